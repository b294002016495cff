"""An exhaustive oracle of roads with capacity, apart from the package: who can go on for ever.

Vehicles on one loop are interchangeable, and everyone goes on for ever iff a strongly connected part of what
can be reached can be reached in which each place that is not empty gives its first vehicle away. Where first
vehicles stand for good, everyone else goes on iff in such a part all other places give theirs away, and no
vehicle more stands behind those.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from loopgate.model import Configuration, Robot, RobotId, StateId, System

MOST = 3_000
"""Systems with more configurations are not looked at."""

Lines = tuple[tuple[tuple[int, int], ...], ...]
"""Who stands in each place, first in line first: loop and position on it."""


@dataclass(frozen=True)
class Roads:
    """Loops over places, a start, and the places whose first vehicle stands for good."""

    loops: tuple[tuple[int, ...], ...]
    slots: tuple[int, ...]
    start: Lines
    stands: frozenset[int] = frozenset()

    def wanted(self, entry: tuple[int, int]) -> tuple[int, tuple[int, int]]:
        """Return the place that a vehicle wants, and how it stands there."""
        loop, position = entry
        after = (position + 1) % len(self.loops[loop])
        return self.loops[loop][after], (loop, after)

    def moves(self, here: Lines) -> list[tuple[int, Lines]]:
        """Return for each place whose first vehicle can move the configuration after that."""
        found = []
        for place, line in enumerate(here):
            if line and place not in self.stands:
                there, entry = self.wanted(line[0])
                if len(here[there]) < self.slots[there]:
                    lines = list(here)
                    lines[place] = line[1:]
                    lines[there] = (*lines[there], entry)
                    found.append((place, tuple(lines)))
        return found

    def circle(self, here: Lines) -> bool:
        """Return whether full places, none that stands, wait for one another in a circle."""
        full = {p for p, line in enumerate(here) if len(line) == self.slots[p]} - self.stands
        for place in full:
            seen = set[int]()
            while place in full and place not in seen:
                seen.add(place)
                place = self.wanted(here[place][0])[0]  # noqa: PLW2901 - the walk goes on from there
            if place in seen:
                return True
        return False

    def crowded(self) -> bool:
        """Return whether some crossed set of places has more residents than slots less two, set by set."""
        numbers = Counter(self.going())
        loops = {k: frozenset(self.loops[k]) for k in numbers}
        for size in range(1, len(self.slots)):
            for some in map(frozenset, combinations(range(len(self.slots)), size)):
                if any(loop & some and not loop <= some for loop in loops.values()):
                    residents = sum(numbers[k] for k, loop in loops.items() if loop <= some)
                    if residents > sum(self.slots[p] for p in some) - 2:
                        return True
        return False

    def going(self) -> list[int]:
        """Return the loop of each vehicle that does not stand, nor behind one that does."""
        return [loop for p, line in enumerate(self.start) if p not in self.stands for loop, _ in line]

    def leads_there(self) -> bool:
        """Return whether the loop of a vehicle elsewhere leads to a place that stands."""
        return any(not self.stands.isdisjoint(self.loops[loop]) for loop in self.going())

    @cached_property
    def system(self) -> System:
        """The same for the package; robots are numbered place by place, line by line."""
        robots = [
            Robot(RobotId(f"r{n}"), tuple(StateId(f"p{p}") for p in self.loops[loop]), start=position)
            for n, (loop, position) in enumerate(entry for line in self.start for entry in line)
        ]
        visited = {p for line in self.start for loop, _ in line for p in self.loops[loop]}
        return System(
            robots, {StateId(f"p{p}"): self.slots[p] for p in visited}, [StateId(f"p{p}") for p in visited]
        )


class Reach:
    """All configurations that can be reached, and which of them are live for everyone."""

    def __init__(self, roads: Roads, most: int = MOST) -> None:
        self.roads = roads
        self.number = {roads.start: 0}
        self.all = [roads.start]
        edges: list[tuple[int, int, int]] = []
        for here in self.all:
            if len(self.all) > most:
                msg = "too many configurations"
                raise OverflowError(msg)
            for place, there in roads.moves(here):
                k = self.number.setdefault(there, len(self.all))
                if k == len(self.all):
                    self.all.append(there)
                edges.append((self.number[here], k, place))
        self._edges = np.array(edges, np.int64).reshape(-1, 3)
        self.live = self._leads_to(self._goes_round())

    def _goes_round(self) -> np.ndarray:
        """Return the configurations in a strongly connected part in which everyone moves."""
        n, tails, heads, places = len(self.all), *self._edges.T
        part = connected_components(
            csr_array((np.ones(len(tails)), (tails, heads)), (n, n)), connection="strong"
        )[1]
        inside = part[tails] == part[heads]
        leaves: list[set[int]] = [set() for _ in range(part.max() + 1)]
        for k, place in zip(part[tails[inside]].tolist(), places[inside].tolist(), strict=True):
            leaves[k].add(place)
        stands, start = self.roads.stands, self.roads.start
        return np.array(
            [
                all(
                    line == start[p] if p in stands else not line or p in leaves[k]
                    for p, line in enumerate(here)
                )
                for here, k in zip(self.all, part.tolist(), strict=True)
            ]
        )

    def _leads_to(self, goal: np.ndarray) -> np.ndarray:
        """Return the configurations from which one of the goal's can be reached."""
        before: list[list[int]] = [[] for _ in self.all]
        for tail, head, _ in self._edges.tolist():
            before[head].append(tail)
        found, todo = goal.copy(), np.flatnonzero(goal).tolist()
        while todo:
            for tail in before[todo.pop()]:
                if not found[tail]:
                    found[tail] = True
                    todo.append(tail)
        return found

    def roomy(self) -> np.ndarray:
        """Return the configurations from which one with a slot free in every place can be reached."""
        slots = self.roads.slots
        free = [all(len(line) < most for line, most in zip(here, slots, strict=True)) for here in self.all]
        return self._leads_to(np.array(free))

    def lines(self, here: Configuration) -> Lines:
        """Return how the package's configuration reads here."""
        roads, system = self.roads, self.roads.system
        loop_of = [loop for line in roads.start for loop, _ in line]
        by_place: list[tuple[tuple[int, int], ...]] = [()] * len(roads.slots)
        for state, name in enumerate(system.states):
            inside = system.occupants(here, state)
            by_place[int(name[1:])] = tuple((loop_of[i], here.positions[i]) for i in inside)
        return tuple(by_place)

    def is_live(self, here: Configuration) -> bool:
        """Return whether the package's configuration is live for everyone."""
        return bool(self.live[self.number[self.lines(here)]])
