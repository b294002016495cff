"""Small roads with crossings that vehicles drive on by the ledger alone, without a simulator."""

from __future__ import annotations

import random
from collections.abc import Collection, Mapping, Sequence
from itertools import combinations, pairwise

from by_hand import ByHand
from small_roads import one_way_grid, road_system

from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control.ledger import GRANTED
from loopgate.control.places import Vehicle
from loopgate.gates import make_gate
from loopgate.model import System
from loopgate.negotiation.base import Negotiation, Request, View
from loopgate.negotiation.pressure import Pressure


class Unfair(Pressure):
    """Pressure that never lets some vehicles go, whatever they say and however long they wait."""

    def __init__(self, never: Collection[int] = ()) -> None:
        super().__init__(random.Random(0))
        self.never = never

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Leave them out."""
        return [one for one in super().order(requests, view, now_s) if one.robot not in self.never]


class CrossedRoads:
    """A system driven by the ledger, one step a second.

    Between two places lies a crossing, which excludes some others, drawn by lot. A vehicle that was granted
    clears crossing and place after one to four seconds, but not before there is a slot that others have left,
    and asks for the next as long after that, once it is the first in its place.

    Parameters
    ----------
    system
        Places that are left in order.
    seed
        Draws what is drawn.
    serve_after_s
        The age from which on requests are served [s].
    negotiation
        Who goes first.
    rests
        Vehicles that never clear what they drive over, once they are granted something.
    gate
        The gate's name.
    """

    def __init__(
        self,
        system: System,
        seed: int,
        *,
        serve_after_s: float,
        negotiation: Negotiation | None = None,
        rests: Collection[int] = (),
        gate: str = "certified",
    ) -> None:
        self._rng = random.Random(seed)
        self.system = system
        self.foes = self._conflicts()
        legs = [self._legs(path) for path in system.paths]
        orders = negotiation or Unfair()
        self.hand = ByHand(system, legs, make_gate(gate, system), orders, serve_after_s=serve_after_s)
        self._rests = rests
        self.now_s = 0.0
        self.vehicles: list[Vehicle] = [self.hand[robot.id] for robot in system.robots]
        self._asks_at = [self._rng.uniform(0, 5) for _ in system.robots]
        self._clears_at: list[tuple[float, int, str]] = []
        self.longest_s = [0.0] * len(system.robots)
        """By robot, the longest wait for a grant so far [s], one under way included."""
        self.moves = [0] * len(system.robots)

    def _name(self, here: int, there: int) -> str:
        return f"{self.system.states[here]}>{self.system.states[there]}"

    def _conflicts(self) -> Mapping[str, frozenset[str]]:
        ways = {pair for path in self.system.paths for pair in pairwise((*path, path[0]))}
        foes: dict[str, set[str]] = {self._name(*way): set() for way in sorted(ways)}
        for one, other in combinations(sorted(ways), 2):
            if one[0] != other[0] and (one[1] == other[1] or self._rng.random() < 0.3):
                foes[self._name(*one)].add(self._name(*other))
                foes[self._name(*other)].add(self._name(*one))
        return {name: frozenset(others) for name, others in foes.items()}

    def _legs(self, path: Sequence[int]) -> list[DrawnLeg]:
        return [
            DrawnLeg(
                self.system.states[here],
                10.0 * k,
                10.0 * k + 9.0,
                (Crossing(self._name(here, there), self.foes[self._name(here, there)]),),
            )
            for k, (here, there) in enumerate(pairwise((*path, path[0])))
        ]

    @property
    def under_way(self) -> list[str]:
        """The crossings that vehicles are on."""
        return [crossing for *_, crossing in self._clears_at]

    def let_ask(self) -> None:
        """Let time pass: vehicles clear what they have driven over, and ask for more."""
        self.now_s += 1.0
        for entry in [entry for entry in self._clears_at if entry[0] <= self.now_s]:
            one = self.vehicles[entry[1]]
            if one.bodies[-1] in one.leg.place.bodies[one.leg.place.slots :]:
                continue
            self._clears_at.remove(entry)
            name = one.name
            self.hand.cleared(name)
            self.hand.waits(name)
        for robot, at_s in enumerate(self._asks_at):
            one = self.vehicles[robot]
            ready = at_s <= self.now_s and len(one.bodies) == 1
            if ready and not one.asks and one.leg.place.line[0] is one:
                self.hand.asks(one.name, self.now_s)

    def decide(self) -> list[int]:
        """Answer the vehicles that ask; return the ones that may go."""
        self.hand.decide(self.now_s)
        went = [one.number for what, one, _, _, _ in self.hand.ledger.log if what == GRANTED]
        for robot in went:
            one = self.vehicles[robot]
            path, after = self.system.paths[robot], one.leg.number
            crossing = self._name(path[after - 1], path[after])
            assert self.foes[crossing].isdisjoint(self.under_way), "two in each other's way"
            clear_s = 1e9 if robot in self._rests else self._rng.randint(1, 4)
            self._clears_at.append((self.now_s + clear_s, robot, crossing))
            self._asks_at[robot] = self.now_s + clear_s + self._rng.randint(1, 4)
            self.moves[robot] += 1
        for robot, one in enumerate(self.vehicles):
            if one.asks or robot in went:
                self.longest_s[robot] = max(self.longest_s[robot], self.now_s - one.since_s)
        self._look()
        return went

    def _look(self) -> None:
        for place in {one.leg.place for one in self.vehicles}:
            there = [body for body in place.bodies if not body.vehicle.trips]
            assert max(len(place.line), len(there)) <= min(len(place.bodies), place.slots)

    def drive(self, seconds: int) -> None:
        """Drive for so long."""
        for _ in range(seconds):
            self.let_ask()
            self.decide()

    def oldest(self, after_s: float) -> int | None:
        """Return whose request is the oldest, if it is as old as that [s]."""
        for one in self.hand.ledger.waiting:
            return one.number if self.now_s - one.since_s >= after_s else None
        return None


def small_grid(serve_after_s: float, **options: object) -> CrossedRoads:
    """Return a grid with hardly a slot free, and two vehicles that the negotiation never lets go."""
    given: dict[str, object] = {"negotiation": Unfair({3, 8}), **options}
    return CrossedRoads(
        road_system(one_way_grid(), 13, 2, seed=5),
        1,
        serve_after_s=serve_after_s,
        **given,  # type: ignore[arg-type]  # as above
    )
