"""A gatekeeper whose vehicles stand still: requests and answers without traffic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, cast

from loopgate.abstraction.itinerary import Leg
from loopgate.abstraction.track import Round, Track
from loopgate.drive import occupancy, requests
from loopgate.drive.codes import NOTHING, REASONS, number_of
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.ground import Ground
from loopgate.drive.tables import Tables
from loopgate.gates import Gate, Reason
from loopgate.kernel_cache import kernel
from loopgate.model import Configuration, System
from loopgate.negotiation.base import Negotiation


# Ways in, from Python, to what only compiled code calls.
@kernel
def _asks(robot: int, t: Tables) -> None:
    requests.asks(robot, t)


@kernel
def _left(robot: int, state: int, t: Tables) -> None:
    occupancy.left(robot, state, t)


@kernel
def _cleared(robot: int, leg: int, t: Tables) -> None:
    occupancy.cleared(robot, leg, t)


@kernel
def _leaves(robot: int, t: Tables) -> None:
    occupancy.leaves(robot, t)


@kernel
def _decide(t: Tables) -> None:
    requests.decide(t)


@kernel
def _stay(t: Tables) -> None:
    requests.stay(t)


ROUNDS = (Round("e", "round", "first"), Round("", "onward", "second"))


def track(
    vehicle: str, legs: Sequence[Leg], *, lap_m: float, start_m: float = 0.0, position: int = 0
) -> Track:
    """Return the track of a vehicle on a loop of one edge."""
    return Track(
        vehicle=vehicle,
        loop=vehicle,
        lap_m=lap_m,
        start_m=start_m,
        top_speed_mps=10.0,
        rounds=ROUNDS,
        edges=((0.0, "e"),),
        legs=tuple(legs),
        start_position=position,
    )


class Books(Gatekeeper):
    """A gatekeeper with tables, told by a test what vehicles do."""

    def __init__(
        self,
        system: System,
        legs: Sequence[Sequence[Leg]],
        gate: Gate,
        negotiation: Negotiation,
        *,
        serve_after_s: float = math.inf,
    ) -> None:
        super().__init__(negotiation, serve_after_s=serve_after_s)
        self.change(system, gate)
        tracks = [
            track(robot.id, its, lap_m=100.0, start_m=its[robot.start].begin_m, position=robot.start)
            for robot, its in zip(system.robots, legs, strict=True)
        ]
        words: list[str] = [""]

        def code(word: str) -> int:
            if word not in words:
                words.append(word)
            return words.index(word)

        ground = Ground.of(tracks, system, code, step_s=1.0)
        self.tables = ground.tables
        self.do = self.take_over(ground)
        self.columns: Any = cast("Any", self.tables.vehicles)
        self.run: Any = cast("Any", self.tables.run)
        self.run["now_s"] = -1.0

    def configuration(self) -> Configuration:
        """Return the configuration, written out."""
        at = tuple((self.columns["granted"] % self.columns["legs"]).tolist())
        return Configuration(at, tuple(tuple(self.line(state)) for state in self.system.fifo_states))

    def asks(self, robot: int, now_s: float) -> None:
        """Let a vehicle ask."""
        before = float(self.run["now_s"][0])
        self.run["now_s"] = now_s
        _asks(robot, self.tables)
        self.run["now_s"] = before

    def withhold(self, reason: Reason | None = None, *robots: int) -> None:
        """Withhold grants from these for a reason, and from nobody else."""
        withheld = self.columns["withheld"]
        withheld[:] = NOTHING
        if reason is not None:
            withheld[list(robots)] = number_of(reason)

    def left(self, robot: int, state: int) -> None:
        """Let the rear of a vehicle leave a state."""
        _left(robot, state, self.tables)

    def cleared(self, robot: int, leg: int) -> None:
        """Let the rear of a vehicle pass what lies behind a leg."""
        _cleared(robot, leg, self.tables)

    def leaves(self, robot: int) -> None:
        """Let a vehicle go, with all that it holds."""
        _leaves(robot, self.tables)

    def decide(self, now_s: float) -> list[tuple[int, bool, str]]:
        """Answer the requests; return who was told what."""
        self.run["now_s"] = now_s
        if self.compiled:
            _decide(self.tables)
        else:
            self._decide()
        _stay(self.tables)
        told = cast("Any", self.tables.entries)["answered"][: self.run["answers"][0]].tolist()
        said = []
        for robot in told:
            reason = REASONS[self.columns["reason"][robot]]
            said.append((robot, bool(self.columns["going"][robot]), reason.value if reason else ""))
            self.columns["going"][robot] = False
        self.run["answers"] = 0
        return said
