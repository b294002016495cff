"""Condition (S) on loops and vehicle counts: without it no gate can promise that every vehicle goes on.

A set of places is *crossed* if some loop has places in it and outside it. A *resident* of the set is a robot
whose whole loop lies in it. (S): every crossed set has at least two slots more than residents.

Suppose that every place has two slots or more and is left in order of arrival. Then a configuration is live
for everyone if and only if no full places wait for one another in a circle and (S) holds (proof:
docs/proofs/roads.md). For suppose that residents hold all slots of a set but one, and another robot enters
the last slot. It is then last in its place, behind residents only, and all of them want full places of the
set, for ever.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from loopgate.errors import UnsafeStartError
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import System
from loopgate.reading import listed

SPARE = 2
"""Slots of a crossed set that must not belong to residents."""


@dataclass(frozen=True, slots=True)
class Crowd:
    """A crossed set of places with more residents than condition (S) allows.

    Attributes
    ----------
    places
        Numbers of the places, ascending.
    residents
        Numbers of the robots whose loops lie in the places, ascending.
    slots
        Number of slots of all these places.
    """

    places: tuple[int, ...]
    residents: tuple[int, ...]
    slots: int

    @property
    def excess(self) -> int:
        """The number of residents beyond the limit of condition (S)."""
        return len(self.residents) - (self.slots - SPARE)


def find_crowd(
    loops: Sequence[Sequence[int]], slots: Sequence[int], passing: Iterable[Sequence[int]] = ()
) -> Crowd | None:
    """Return a set of places that breaks condition (S); None if (S) holds.

    Parameters
    ----------
    loops
        The places of each robot's loop, in driving order; one entry per robot.
    slots
        Number of slots of each place, two or more; all robots must fit on their loops at once.
    passing
        Paths without robots yet. They cross sets of places too, but have no residents.

    Notes
    -----
    If all robots could stand with one slot free in every place, (S) holds: one maximum flow shows that.
    Otherwise only sets within the places that have no space for that can be crowded. A minimum cut for each
    of these places, and for each place that follows it where that is tight, finds such a set or shows that
    there is none.
    """
    numbers = Counter(frozenset(loop) for loop in loops)
    net = _Net(numbers, slots)
    within = net.tight()
    if not within:
        return None
    following: dict[int, set[int]] = {}
    for loop in {tuple(way) for ways in (loops, passing) for way in ways}:
        for here, there in zip(loop, (*loop[1:], loop[0]), strict=True):
            if here in within:
                following.setdefault(here, set()).add(there)
    for inside in sorted(following):
        if net.least_spare(inside)[0] >= SPARE:
            continue
        for outside in sorted(following[inside]):
            spare, places = net.least_spare(inside, outside)
            if spare < SPARE:
                residents = tuple(i for i, loop in enumerate(loops) if places.issuperset(loop))
                return Crowd(tuple(sorted(places)), residents, sum(slots[p] for p in places))
    return None


def too_many(loops: Sequence[Sequence[int]], slots: Sequence[int]) -> list[int]:
    """Return robots that must be removed for condition (S) to hold, ascending; empty if it holds.

    It takes crowd by crowd, and robots on the shortest loops first, since they are residents of most sets.
    Only rarely would fewer robots do.
    """
    left = list(range(len(loops)))
    gone: list[int] = []
    while (crowd := find_crowd([loops[i] for i in left], slots)) is not None:
        robots = sorted((left[k] for k in crowd.residents), key=lambda i: (len(set(loops[i])), -i))
        gone += robots[: crowd.excess]
        left = [i for i in left if i not in gone]
    return sorted(gone)


def is_plain_for_the_chain(system: System) -> bool:
    """Return whether the chain rule plainly keeps everyone going, with no more to look at.

    It does if all paths are closed, each place that several robots visit is left in order of arrival and
    holds two or more, and a slot is free in each at the start: then (S) holds, and there is no circle of full
    places. O(length of all paths).
    """
    if any(following[-1] < 0 for following in system.following):
        return False
    fifo, count = (
        set(system.fifo_states),
        Counter(p[r.start] for p, r in zip(system.paths, system.robots, strict=True)),
    )
    return all(
        own or (state in fifo and max(SPARE, count[state] + 1) <= room)
        for state, (own, room) in enumerate(zip(system.private, system.room, strict=True))
    )


def refuse_crowds(layout: SystemIndex, stand: Occupancy) -> None:
    """Raise an error if condition (S) fails at the start of a system of closed paths.

    (S) plainly holds if the robots stand with one slot free in every place. A private place counts as two
    slots, since its robot never waits for it.

    Raises `UnsafeStartError` if (S) does not hold: no gate could keep every robot going.
    """
    private = layout.system.private
    slots = [max(SPARE, room) if own else room for room, own in zip(layout.room, private, strict=True)]
    if all(count < most for count, most in zip(stand.count, slots, strict=True)):
        return
    crowd = find_crowd(layout.path, slots)
    if crowd is None:
        return
    gone = too_many(layout.path, slots)
    places = listed((layout.system.states[p] for p in crowd.places), 8)
    msg = (
        f"gate certified: not everyone can go on for ever: {len(crowd.residents)} robots "
        f"({layout.names(crowd.residents)}) never leave the places {places}, which hold {crowd.slots}; "
        f"others pass there, so at most {crowd.slots - SPARE} may. {len(gone)} fewer would do: leave out "
        f"{layout.names(gone)}, or ask for promise=somebody"
    )
    raise UnsafeStartError(msg)


class _Net:
    """The network source -> loops -> places -> sink, in which a cut stands for a set of places.

    A loop carries its robots, a place its slots. The places on the source's side are the set. The cut has the
    robots whose loops are not wholly in the set, and the slots of the set: all robots, minus residents, plus
    slots.
    """

    def __init__(self, numbers: Counter[frozenset[int]], slots: Sequence[int]) -> None:
        self._places = sorted(frozenset[int]().union(*numbers))
        self._robots = numbers.total()
        self._slots = [slots[p] for p in self._places]
        node = {p: 1 + len(numbers) + k for k, p in enumerate(self._places)}
        self._node = node
        self._sink = 1 + len(numbers) + len(node)
        self._endless = self._robots + sum(self._slots) + 1
        self._edges = [(0, k, n) for k, n in enumerate(numbers.values(), start=1)]
        self._edges += [
            (k, node[p], self._endless) for k, loop in enumerate(numbers, start=1) for p in sorted(loop)
        ]

    def tight(self) -> set[int]:
        """Return the largest set of places with the least spare slots, if each place must keep one free.

        Every crowded set lies in it: otherwise, by supermodularity, a part of the crowded set would have more
        residents than slots.
        """
        to_sink = [(n, self._sink, s - 1) for n, s in zip(self._node.values(), self._slots, strict=True)]
        flow, left = self._flow(to_sink)
        if flow == self._robots:
            return set()
        reaches_sink = self._reached(left.T.tocsr(), self._sink)
        return {p for p in self._places if self._node[p] not in reaches_sink}

    def least_spare(self, inside: int, outside: int | None = None) -> tuple[int, set[int]]:
        """Return the least surplus of slots over residents of a set with `inside`; and the set.

        The set does not contain `outside`. A place on no loop is in no set.
        """
        edges = [(n, self._sink, s) for n, s in zip(self._node.values(), self._slots, strict=True)]
        edges.append((0, self._node[inside], self._endless))
        if outside in self._node:
            edges.append((self._node[outside], self._sink, self._endless))
        flow, left = self._flow(edges)
        reached = self._reached(left, 0)
        return flow - self._robots, {p for p in self._places if self._node[p] in reached}

    def _flow(self, edges: Sequence[tuple[int, int, int]]) -> "tuple[int, scipy.sparse.csr_array]":
        """Return the greatest flow and the capacity left, back edges included."""
        tails, heads, most = np.array([*self._edges, *edges], np.int32).T
        capacity = scipy.sparse.csr_array((most, (tails, heads)), shape=(self._sink + 1, self._sink + 1))
        found = scipy.sparse.csgraph.maximum_flow(capacity, 0, self._sink)
        return int(found.flow_value), scipy.sparse.csr_array(capacity - found.flow)

    @staticmethod
    def _reached(left: "scipy.sparse.csr_array", begin: int) -> Collection[int]:
        left.eliminate_zeros()
        nodes: NDArray[np.int32] = scipy.sparse.csgraph.breadth_first_order(
            left, begin, return_predecessors=False
        )
        return set(nodes.tolist())
