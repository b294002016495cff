"""Vehicles without SUMO on loops of their own that share one state: an engine, its traffic, what it notes."""

from collections.abc import Callable
from random import Random

import numpy as np
from fake_traffic import FakeTraffic, FakeVehicle
from numpy.typing import NDArray

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.abstraction.track import Round, Track
from loopgate.drive.changing import ChangingEngine
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.gates import make_gate
from loopgate.model import StateId
from loopgate.negotiation.simple import OldestFirst
from loopgate.network.loop import LanePosition
from loopgate.results.columns import Event

PRIVATE_M, SHARED_M = 200.0, 60.0


class Notes:
    """A recorder that keeps the rows."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, str, str, str]] = []
        self._stages: list[tuple[str, str]] = []
        self.words: list[str] = [""]
        self.before: Callable[[], None] = lambda: None

    @property
    def rows(self) -> list[tuple[float, str, str, str]]:
        """The rows so far."""
        self.before()
        return self._rows

    @property
    def stages(self) -> list[tuple[str, str]]:
        """The stages so far, by event."""
        self.before()
        return self._stages

    def note(
        self, time_s: float, vehicle: str, event: Event, place: str, reason: str = "", stage: str = ""
    ) -> None:
        """Keep one row."""
        del reason
        self.before()
        self._keep(time_s, vehicle, event, place, stage)

    def _keep(self, time_s: float, vehicle: str, event: Event, place: str, stage: str) -> None:
        self._rows.append((time_s, vehicle, event.value, place))
        self._stages.append((event.value, stage))

    def code(self, word: str) -> int:
        """Return the number of a word."""
        if word not in self.words:
            self.words.append(word)
        return self.words.index(word)

    def passed(self, times: NDArray[np.float64], rows: NDArray[np.int32]) -> None:
        """Keep rows of numbered words."""
        for time_s, row in zip(times.tolist(), rows.tolist(), strict=True):
            vehicle, event, place, _, stage = (self.words[number] for number in row)
            self._keep(time_s, vehicle, Event(event), place, stage)

    def of(self, *events: str) -> list[tuple[float, str, str, str]]:
        """Return the rows of these kinds."""
        return [row for row in self.rows if row[2] in events]


def world(*starts_m: float, gate: str = "collision") -> tuple[ChangingEngine, FakeTraffic, Notes]:
    """Vehicles on loops of 200 m of their own road and one shared state of 60 m.

    Each loop has an edge for its private state and one for the shared state ``s``.
    """
    names = [f"v{i}" for i in range(len(starts_m))]
    robots = system({name: f"p{name} s" for name in names})
    legs = {
        name: (
            Leg(StateId(f"p{name}"), 0.0, 199.0, line=LanePosition(f"{name}p", 0, 199.0)),
            Leg(StateId("s"), 199.0, 260.0, line=LanePosition(f"{name}s", 0, 59.9)),
        )
        for name in names
    }
    tracks = [
        Track(
            vehicle=name,
            loop=name,
            lap_m=PRIVATE_M + SHARED_M,
            start_m=start,
            top_speed_mps=10.0,
            rounds=(Round(f"{name}p", "round", "first"), Round("", "onward", "second")),
            edges=((0.0, f"{name}p"), (PRIVATE_M, f"{name}s")),
            legs=legs[name],
        )
        for name, start in zip(names, starts_m, strict=True)
    ]
    fleet = {
        name: FakeVehicle([(f"{name}p", PRIVATE_M), (f"{name}s", SHARED_M)], start)
        for name, start in zip(names, starts_m, strict=True)
    }
    traffic = FakeTraffic(fleet)
    notes = Notes()
    keeper = Gatekeeper(OldestFirst(Random(1)))
    keeper.change(robots, make_gate(gate, robots))
    engine = ChangingEngine(traffic, tracks, keeper, notes)  # type: ignore[arg-type]  # the notes stand in for a recorder
    return engine, traffic, notes


def drive(engine: Engine, traffic: FakeTraffic, until_s: float) -> None:
    """Run."""
    engine.begin()
    while traffic.now_s < until_s:
        engine.step()
