"""A ledger whose vehicles a test moves by hand: requests and answers, without a simulator."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from itertools import pairwise

from builders import system
from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control import blocking
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import GRANTED, REFUSED
from loopgate.control.places import Place, Vehicle
from loopgate.control.refusal import Refusal
from loopgate.gates import Gate, make_gate
from loopgate.model import Configuration, System
from loopgate.negotiation.base import Negotiation
from loopgate.negotiation.pressure import Pressure
from loopgate.simulation.asked_gate import Deciding

AFTER_S = 20.0
"""The age from which on requests are served in `by_hand` [s]."""

Told = tuple[str, str]
"""A vehicle, and why it was refused; "granted" if it was let go."""


class ByHand:
    """A ledger for a system.

    Each vehicle waits half a metre before the end of its leg, for as long as the test does not move it.

    Parameters
    ----------
    system
        The vehicles as robots; they stand as it says.
    legs
        The legs of their paths; the first follows the last.
    gate, negotiation
        What decides.
    serve_after_s
        The age from which on requests are served [s].
    """

    def __init__(
        self,
        system: System,
        legs: Sequence[Sequence[DrawnLeg]],
        gate: Gate,
        negotiation: Negotiation,
        *,
        serve_after_s: float,
    ) -> None:
        self.system = system
        self._held: dict[str, str] = {}
        deciding = Deciding(system, gate, negotiation, serve_after_s)
        self.ledger = deciding.ledger([self._outside], step_s=1.0)
        everyone = len(system.robots)
        rooms = zip(system.states, system.room, system.private, strict=True)
        self._layout = PlaceLayout({name: everyone if alone else room for name, room, alone in rooms}, legs)
        deciding.know(self._layout.places)
        for robot, drawn in zip(system.robots, legs, strict=True):
            path = self._layout.path(drawn)
            one = self.ledger.take_in(robot.id, path, robot.start, lap_m=10.0 * len(drawn))
            one.front_m = one.line_m - 0.5
        first = {robot: n for queue in system.initial.queues for n, robot in enumerate(queue)}
        for place in self._layout.places.values():
            place.line.sort(key=lambda one: first.get(one.number, 0))

    def _outside(self, vehicle: Vehicle, _now_s: float) -> Refusal | None:
        reason = self._held.get(vehicle.name)
        return None if reason is None else Refusal(reason)

    def __getitem__(self, name: str) -> Vehicle:
        """Return a vehicle."""
        return self.ledger.vehicles[name]

    def place(self, name: str) -> Place:
        """Return a place."""
        return self._layout.places[name]

    def configuration(self) -> Configuration:
        """Return how the vehicles stand, as the gate sees it."""
        vehicles = self.ledger.vehicles.values()
        at = tuple(one.leg.number for one in sorted(vehicles, key=lambda one: one.number))
        states = [self.system.states[s] for s in self.system.fifo_states]
        return Configuration(at, tuple(tuple(one.number for one in self.place(s).line) for s in states))

    def asks(self, name: str, now_s: float) -> None:
        """Let a vehicle ask for its next place."""
        self.ledger.now_s = now_s
        self.ledger.ask(self[name])

    def withhold(self, reason: str = "", *names: str) -> None:
        """Let something outside keep these from going on, and nobody else."""
        self._held = dict.fromkeys(names, reason)

    def breaks_down(self, name: str, reason: str = "stop") -> None:
        """Grant a vehicle nothing, since something stands in its way."""
        self[name].withheld = reason

    def left(self, name: str) -> None:
        """Let the rear of a vehicle leave the place where it was; it is still on the crossing behind."""
        self._drives_to(name, self[name].bodies[0].out_m)

    def cleared(self, name: str) -> None:
        """Let the rear of a vehicle pass the first crossing granted to it, and leave the place before."""
        held, body = self[name], self[name].bodies
        self._drives_to(name, held.trips[0].clear_m if held.trips else body[1].begin_m)

    def _drives_to(self, name: str, front_m: float) -> None:
        self[name].front_m = front_m
        self.ledger.passed(self[name])

    def waits(self, name: str) -> None:
        """Let a vehicle come to the end of its leg."""
        self._drives_to(name, self[name].line_m - 0.5)

    def decide(self, now_s: float) -> list[Told]:
        """Answer the requests; return what vehicles were told that was new."""
        self.ledger.log.clear()
        self.ledger.answer(now_s)
        said = [(one.name, what, reason) for what, one, _, reason, _ in self.ledger.log]
        return [(name, reason or "granted") for name, what, reason in said if what in (GRANTED, REFUSED)]

    def blockers(self, name: str) -> list[list[str]]:
        """Return whom a vehicle waits for: of every list, some vehicle has to move on."""
        everybody = self.ledger.vehicles.values()
        return [
            [one.name for one in some]
            for some in blocking.blockers(self[name], list(everybody), self.ledger.gate)
        ]


def by_hand(
    paths: Mapping[str, str],
    capacity: Mapping[str, int],
    crossings: Mapping[tuple[str, str], Crossing] | None = None,
    negotiation: Negotiation | None = None,
    gate: str = "certified",
    serve_after_s: float = AFTER_S,
) -> ByHand:
    """Return a ledger under the chain rule for vehicles that start in the first of their places.

    `crossings`: by the places before and behind. Unless said otherwise nothing is kept in reserve.
    """
    robots = system(paths, capacity=capacity, fifo=tuple(capacity))
    over = crossings or {}
    legs = [
        [
            DrawnLeg(here, 10.0 * k, 10.0 * k + 9.0, (over[here, there],) if (here, there) in over else ())
            for k, (here, there) in enumerate(pairwise((*robot.path, robot.path[0])))
        ]
        for robot in robots.robots
    ]
    orders = negotiation or Pressure(random.Random(0), crowded=1.0)
    return ByHand(robots, legs, make_gate(gate, robots), orders, serve_after_s=serve_after_s)
