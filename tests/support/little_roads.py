"""Vehicles that drive by the books alone: grants, crossings that clear, places that empty, no simulator."""

from __future__ import annotations

import random
from collections.abc import Collection, Sequence
from itertools import combinations, pairwise
from typing import Any

from books import Books

from loopgate.abstraction.itinerary import Crossing, Leg
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


class LittleRoads:
    """A system driven by the certified gate, one step a second.

    Between two places lies a crossing, which excludes some others, drawn by lot. A vehicle that was granted
    clears crossing and place after one to four seconds, and asks for the next as long after that, once it is
    the first in its place.

    Parameters
    ----------
    system
        Places that hold two, left in order.
    seed
        Draws what is drawn.
    serve_after_s
        See `Gatekeeper`.
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
        self.books = Books(
            system,
            legs,
            make_gate(gate, system),
            negotiation or Unfair(),
            serve_after_s=serve_after_s,
        )
        self._rests = rests
        self.now_s = 0.0
        self._asks_at = [self._rng.uniform(0, 5) for _ in system.robots]
        self._clears_at: list[tuple[float, int, int, str]] = []
        self.longest_s = [0.0] * len(system.robots)
        """By robot, the longest wait for a grant so far [s], one under way included."""
        self.moves = [0] * len(system.robots)

    def _name(self, here: int, there: int) -> str:
        return f"{self.system.states[here]}>{self.system.states[there]}"

    def _conflicts(self) -> dict[str, frozenset[str]]:
        ways = {pair for path in self.system.paths for pair in pairwise((*path, path[0]))}
        foes: dict[str, set[str]] = {self._name(*way): set() for way in sorted(ways)}
        for one, other in combinations(sorted(ways), 2):
            if one[0] != other[0] and (one[1] == other[1] or self._rng.random() < 0.3):
                foes[self._name(*one)].add(self._name(*other))
                foes[self._name(*other)].add(self._name(*one))
        return {name: frozenset(others) for name, others in foes.items()}

    def _legs(self, path: Sequence[int]) -> list[Leg]:
        return [
            Leg(
                self.system.states[here],
                10.0 * k,
                10.0 * k + 9.0,
                (Crossing(self._name(here, there), self.foes[self._name(here, there)]),),
            )
            for k, (here, there) in enumerate(pairwise((*path, path[0])))
        ]

    @property
    def column(self) -> Any:  # noqa: ANN401  a table
        """The table of vehicles."""
        return self.books.columns

    @property
    def under_way(self) -> list[str]:
        """The crossings that vehicles are on."""
        return [crossing for *_, crossing in self._clears_at]

    def let_ask(self) -> None:
        """Let time pass: vehicles clear what they have driven over, and ask for more."""
        self.now_s += 1.0
        for entry in [entry for entry in self._clears_at if entry[0] <= self.now_s]:
            self._clears_at.remove(entry)
            _, robot, leg, _ = entry
            path = self.system.paths[robot]
            self.books.cleared(robot, leg)
            self.books.left(robot, path[leg % len(path)])
        for robot, at_s in enumerate(self._asks_at):
            if at_s <= self.now_s and not self.column["pending"][robot]:
                self.books.asks(robot, self.now_s)

    def decide(self) -> list[int]:
        """Answer who asks; return who may go."""
        went = [robot for robot, going, _ in self.books.decide(self.now_s) if going]
        for robot in went:
            path, leg = self.system.paths[robot], int(self.column["granted"][robot]) - 1
            crossing = self._name(path[leg % len(path)], path[(leg + 1) % len(path)])
            assert self.foes[crossing].isdisjoint(self.under_way), "two in each other's way"
            clear_s = 1e9 if robot in self._rests else self._rng.randint(1, 4)
            self._clears_at.append((self.now_s + clear_s, robot, leg, crossing))
            self._asks_at[robot] = self.now_s + clear_s + self._rng.randint(1, 4)
            self.moves[robot] += 1
        waiting = self.column["pending"]
        for robot in range(len(waiting)):
            since_s = float(self.column["since_s"][robot])
            if waiting[robot] or robot in went:
                self.longest_s[robot] = max(self.longest_s[robot], self.now_s - since_s)
        return went

    def drive(self, seconds: int) -> None:
        """Drive for so long."""
        for _ in range(seconds):
            self.let_ask()
            self.decide()
