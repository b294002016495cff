"""One vehicle before lights, without SUMO, and what compiled code says of these."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, cast

from fake_traffic import FakeTraffic

from builders import system
from loopgate.abstraction.itinerary import Crossing, Leg
from loopgate.abstraction.track import Round, Track
from loopgate.drive import lights
from loopgate.drive.codes import HEED, HEEDLESS
from loopgate.drive.driver import Driver
from loopgate.drive.gaps import leg_of, passes_lights
from loopgate.drive.ground import Ground
from loopgate.drive.tables import Tables
from loopgate.drive.timetable import Signal, Timetable
from loopgate.kernel_cache import kernel
from loopgate.model import StateId
from loopgate.results.recorder import Recorder
from loopgate.traffic.base import Dynamics, Light, Phase, Program

LINE_M = 100.0

_KEEPS, _LET_GO, _LOOK, _UNREAD, _LETTER, _RED_AT, _MAY_BE_OPEN, _FOR_SURE = range(8)


@kernel
def _ask(what: int, i: int, from_s: float, to_s: float, t: Tables) -> float:
    """Lead into what only compiled code calls."""
    said = 0.0
    if what == _KEEPS:
        said = 1.0 if lights.keeps(i, t) else 0.0
    elif what == _LET_GO:
        lights.let_go(i, t.vehicles[i].leg_at + (t.vehicles[i].granted - 1) % t.vehicles[i].legs, t)
    elif what == _LOOK:
        said = 1.0 if lights.look(t) else 0.0
    elif what == _UNREAD:
        said = 1.0 if lights.unread(t) else 0.0
    elif what == _LETTER:
        said = 1.0 * lights.next_letter(i, t)
    elif what == _RED_AT:
        said = lights.red_at_s(i, t)
    elif what == _MAY_BE_OPEN:
        said = 1.0 if lights.may_be_open(i, from_s, to_s, t) else 0.0
    elif what == _FOR_SURE:
        said = 1.0 if passes_lights(i, leg_of(i, t.vehicles[i].granted, t), t) else 0.0
    return said


class Ahead(NamedTuple):
    """A light with one link, and how far behind the end of a leg it stands [m]."""

    light: str
    ahead_m: float


def signal(light: str, ahead_m: float = 0.1) -> Ahead:
    """Return a light behind a leg."""
    return Ahead(light, ahead_m)


class Scene:
    """A vehicle whose first state ends at 100 m, before crossings with the lights given."""

    def __init__(
        self,
        *ahead: Ahead,
        after: Sequence[Ahead] = (),
        at_m: float = 99.0,
        speed: float = 0.0,
        links: int = 1,
    ) -> None:
        legs = (
            Leg(StateId("a"), 0.0, LINE_M, self._crossings(ahead)),
            Leg(StateId("b"), 150.0, 300.0, self._crossings(after)),
        )
        track = Track(
            vehicle="v",
            loop="loop",
            lap_m=400.0,
            start_m=at_m,
            top_speed_mps=10.0,
            rounds=(Round("e", "round", "first"), Round("", "onward", "second")),
            edges=((0.0, "e"),),
            legs=legs,
        )
        self.traffic = FakeTraffic({})
        shown = [Signal(f"over {one.light}", one.light, 0, 10.0) for one in (*ahead, *after)]
        shown += [Signal(f"link {link}", shown[0].light, link, 10.0) for link in range(1, links)]
        self.timetable = Timetable(self.traffic, shown)
        code, numbers = Recorder(None).code, self.timetable.numbers
        self.tables = Ground.of([track], system({"v": "a b"}), code, step_s=1.0, signals=numbers).tables
        driver = Driver(0, track, self.tables)
        driver.drives_like(Dynamics(5.0, 2.6, 4.5, 1.0))
        self.row: Any = driver.row
        self.row["line_m"], self.row["speed"] = LINE_M, speed
        self.told_to_drive_on = False

    @staticmethod
    def _crossings(ahead: Sequence[Ahead]) -> tuple[Crossing, ...]:
        return tuple(Crossing(f"over {one.light}", frozenset(), ahead_m=one.ahead_m) for one in ahead)

    @property
    def run(self) -> Any:  # noqa: ANN401  a row
        """The row of the run."""
        return cast("Any", self.tables.run)[0]

    def shows(
        self, light: str, state: str, changes_s: float, *, after: str = "r", fixed: bool = True
    ) -> None:
        """Let a light show a letter until a time, then another for 1000 s."""
        self.traffic.lights[light] = Light(state, changes_s, "p", 0)
        self.traffic.programs[light] = Program((Phase(state, 50.0, 1), Phase(after, 1000.0, 0)), fixed=fixed)

    def ask(self, what: int, number: int = 0, from_s: float = 0.0, to_s: float = 0.0) -> float:
        """Ask compiled code, once all lights that it needs have been read."""
        self.run["now_s"] = self.traffic.now_s
        self.tables = self.timetable.put_into(self.tables)
        while _ask(_UNREAD, 0, 0.0, 0.0, self.tables):
            self.timetable.read()
            self.tables = self.timetable.put_into(self.tables)
        said = _ask(what, number, from_s, to_s, self.tables)
        for _, act, _ in self.tables.acts[: self.run["acts"]].tolist():
            assert act in (HEED, HEEDLESS)
            self.told_to_drive_on = bool(act == HEEDLESS)
        self.run["acts"] = 0
        return float(said)

    def drives_on(self) -> bool:
        """Return whether the vehicle has been told to drive on whatever the light shows."""
        return self.told_to_drive_on

    def keeps(self) -> bool:
        """Return whether the vehicle, which asks, is kept by a light."""
        self.row["pending"] = True
        return bool(self.ask(_KEEPS))

    def passes_for_sure(self) -> bool:
        """Return whether the vehicle passes all lights before it for sure, if they let it go."""
        self.row["pending"] = True
        return bool(self.ask(_FOR_SURE))

    def let_go(self, line_m: float = LINE_M) -> None:
        """Let the vehicle have its next leg; it is told of the end of that later."""
        self.row["line_m"], self.row["pending"] = line_m, True
        self.ask(_UNREAD)
        self.row["pending"] = False
        self.row["granted"] += 1
        self.ask(_LET_GO)

    def look(self) -> None:
        """Look at the vehicle in a step of its own."""
        self.run["looked_s"] = -1.0
        self.ask(_LOOK)

    def next(self, number: int = 0) -> tuple[str, float]:
        """Return what a signal shows in the next step, and when it turns red."""
        self.row["pending"] = True
        return chr(int(self.ask(_LETTER, number))), self.ask(_RED_AT, number)

    def may_be_open(self, number: int, from_s: float, to_s: float) -> bool:
        """Return whether a signal is open all the time between two times from now on [s]."""
        self.row["pending"] = True
        return bool(self.ask(_MAY_BE_OPEN, number, from_s, to_s))
