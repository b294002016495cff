"""Which vehicles starve, and behind whom: a slow queue is no sink."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from loopgate.drive.codes import NOTHING
from loopgate.simulation.watching.starving import StarvationWatch

AFTER_S = 600.0


class Road:
    """Three vehicles in line in one place; `line` is their order, and `metres` how far each has driven."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.line = [0, 1, 2]
        self.metres = np.array([30.0, 20.0, 10.0])
        columns = [("granted", int), ("pending", bool), ("reason", int), ("stop_m", float)]
        self.vehicles = np.zeros(3, dtype=columns)
        self.vehicles["reason"] = NOTHING
        self.noted: list[str] = []

    def watch(self) -> StarvationWatch:
        """Return a watch over this road."""
        driver = SimpleNamespace(granted=0, leg=lambda _: SimpleNamespace(state=0))
        engine: Any = SimpleNamespace(
            vehicles=self.vehicles,
            odometers=lambda: (["a", "b", "c"], self.metres),
            driver_of=dict.fromkeys("abc", driver),
        )
        keeper: Any = SimpleNamespace(
            here=lambda _: 0, line=lambda _: self.line, blockers=lambda _: [], wanted=lambda _: 0
        )
        traffic: Any = SimpleNamespace(
            lane=lambda _: ("street_0", 0.0), at_own_stop=lambda _: False, pauses=lambda _: False
        )
        traffic_time = type("Traffic", (SimpleNamespace,), {"now_s": property(lambda _: self.now_s)})
        recorder: Any = SimpleNamespace(note=lambda *told: self.noted.append(told[1]))
        return StarvationWatch(engine, keeper, traffic_time(**vars(traffic)), recorder, after_s=AFTER_S)


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
        road.line = [1, 0, 2] if road.now_s % 30 else [0, 1, 2]
        watch.check()
    assert watch.sinks == {}
