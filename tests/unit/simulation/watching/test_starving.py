"""Which vehicles starve, and behind whom: a slow queue is no sink."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from loopgate.simulation.watching.starving import StarvationWatch

AFTER_S = 600.0


class Road:
    """Three vehicles in line in one place; `line` is their order, and `metres` how far each has driven."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.line = ["a", "b", "c"]
        self.metres = np.array([30.0, 20.0, 10.0])
        self.noted: list[str] = []

    def watch(self) -> StarvationWatch:
        """Return a watch over this road."""
        drive: Any = SimpleNamespace(
            odometers=lambda: (["a", "b", "c"], self.metres),
            granted=lambda: np.zeros(3, dtype=np.int64),
            waits_behind=lambda vehicle: self.line[:1] if vehicle != self.line[0] else [],
            asks=lambda _: False,
            reason=lambda _: "",
            wanted=lambda _: "street",
        )
        traffic: Any = SimpleNamespace(
            lane=lambda _: ("street_0", 0.0), at_own_stop=lambda _: False, faces_red=lambda _: False
        )
        traffic_time = type("Traffic", (SimpleNamespace,), {"now_s": property(lambda _: self.now_s)})
        recorder: Any = SimpleNamespace(note=lambda *told: self.noted.append(told[1]))
        return StarvationWatch(drive, traffic_time(**vars(traffic)), recorder, after_s=AFTER_S)


def test_behind_a_vehicle_that_stands_for_good_others_starve() -> None:
    road = Road()
    watch = road.watch()
    for road.now_s in range(0, 700, 10):
        watch.check()
    assert [(sink.vehicle, sink.victims) for sink in watch.sinks.values()] == [("a", {"a", "b", "c"})]
    assert road.noted == ["a", "b", "c"]


def test_a_queue_that_creeps_is_no_sink() -> None:
    """A vehicle that has crept to the front for long is there at one look, and gone at the next."""
    road = Road()
    watch = road.watch()
    for road.now_s in range(0, 1500, 10):
        road.metres += road.now_s % 200 == 0
        watch.check()
    assert watch.sinks == {}


def test_a_vehicle_that_is_first_in_line_at_one_look_is_no_sink() -> None:
    """It waited for others until then: now it may go."""
    road = Road()
    watch = road.watch()
    for road.now_s in range(0, 640, 10):
        road.line = ["b", "a", "c"] if road.now_s % 30 else ["a", "b", "c"]
        watch.check()
    assert watch.sinks == {}
