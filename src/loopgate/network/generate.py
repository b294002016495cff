"""Random closed loops that a vehicle can drive."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable
from dataclasses import dataclass

import networkx as nx

from loopgate.errors import RouteError
from loopgate.network.lanes import make_loop
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork

__all__ = ["generate_loops"]

_RELAX = 0.9
_LEAST_REACH = 0.3
"""Where sharing is bounded, each attempt shortens the walks tried by `_RELAX`, down to `_LEAST_REACH` of the
range of lengths: short loops fit in where long ones no longer do."""

_TRIES_PER_LOOP = 60
"""Attempts without a new loop, for each loop asked for, after which the search gives up."""

_DETOUR = 1.0
"""Road lengths are stretched by a random share of up to this much, so that loops differ."""

_CROWDED = 3.0
"""By how much a road that another loop uses counts as longer where sharing is bounded."""


def generate_loops(  # noqa: PLR0913  one per choice
    network: RoadNetwork,
    count: int,
    *,
    length_m: tuple[float, float] = (400.0, 2000.0),
    seed: int = 1,
    u_turns: bool = False,
    vclass: str = "passenger",
    admits: Callable[[Loop], bool] | None = None,
    ease: str = "raise --max-shared",
    progress: Callable[[int], None] | None = None,
) -> tuple[Loop, ...]:
    """Make distinct closed loops, none of which uses an edge twice. The same seed makes the same loops.

    A loop leads from a random edge to another by a shortest path over randomly stretched roads, and back the
    same way over edges not used yet.

    Parameters
    ----------
    network
        The roads.
    count
        How many.
    length_m
        Shortest and longest loop [m].
    seed
        Seed of the search.
    u_turns
        Whether vehicles may turn round at junctions.
    vclass
        SUMO vehicle class that must be allowed.
    admits
        Asked of every new loop; where it returns False the loop is dropped. It is asked in order of the
        result, so it may remember the loops it has admitted. Where it is given, the search prefers roads
        that no other loop uses, and turns to shorter loops as it gets harder.
    ease
        What the user may do about `admits`, for the message; may be empty.
    progress
        Called with the number of loops found so far.

    Raises
    ------
    RouteError
        If not enough loops were found; the text says how many there are.

    Notes
    -----
    Each attempt costs O(E log E) for the E edges within reach.
    """
    search = _Search(network, length_m, u_turns=u_turns, vclass=vclass, shy=admits is not None)
    rng = random.Random(seed)
    loops: list[Loop] = []
    known: set[tuple[str, ...]] = set()
    patience, reach = _TRIES_PER_LOOP * count, 1.0
    while len(loops) < count and patience and search.edges:
        patience -= 1
        reach = max(reach * _RELAX, _LEAST_REACH) if admits else 1.0
        edges = search.attempt(rng, reach)
        if edges is None or _canonical(edges) in known:
            continue
        known.add(_canonical(edges))
        try:
            loop = make_loop(network, f"loop{len(loops)}", edges, vclass=vclass)
        except RouteError:
            continue  # connected edges, but no lanes lead round
        low, high = length_m
        if not low <= loop.length_m <= high or (admits is not None and not admits(loop)):
            continue
        loops.append(loop)
        if progress:
            progress(len(loops))
        search.use(edges)
        patience = _TRIES_PER_LOOP * count
    if len(loops) < count:
        low, high = length_m
        if not search.edges:
            msg = f"{network.name}: no way round for {vclass}: no edge open to it can be reached from itself"
            raise RouteError(msg)
        way_out = "ask for fewer, widen --length" + (f", {ease}" if admits and ease else "")
        way_out += "" if u_turns else ", or allow --u-turns"
        msg = (
            f"{network.name}: found {len(loops)} of {count} loops of {low:g} to {high:g} m for {vclass} "
            f"(seed {seed}); {way_out}"
        )
        raise RouteError(msg)
    return tuple(loops)


def _canonical(edges: tuple[str, ...]) -> tuple[str, ...]:
    first = edges.index(min(edges))
    return edges[first:] + edges[:first]


@dataclass(frozen=True, slots=True)
class _Road:
    """An edge with the way to its followers: number of the follower, metres through the junction."""

    length_m: float
    onward: tuple[tuple[int, float], ...]


class _Search:
    """Random closed walks over the edges of the largest part in which every edge leads to every other."""

    def __init__(
        self,
        network: RoadNetwork,
        length_m: tuple[float, float],
        *,
        u_turns: bool,
        vclass: str,
        shy: bool,
    ) -> None:
        self._low, self._high = length_m
        self._shy = shy
        graph: nx.DiGraph[str] = nx.DiGraph()
        through: dict[tuple[str, str], float] = {}
        for c in network.connections:
            if not network.allows(c, vclass) or (c.direction == "t" and not u_turns):
                continue
            graph.add_edge(c.from_edge, c.to_edge)
            metres = sum(network.lanes[lane].length_m for lane in c.via)
            pair = (c.from_edge, c.to_edge)
            through[pair] = min(metres, through.get(pair, metres))
        parts = nx.strongly_connected_components(graph) if graph else ()
        # The file's order, not the hash's, so that the same seed finds the same loops.
        inside = max(parts, key=lambda part: (len(part), min(part)), default=set())
        self.edges = [edge for edge in network.edges if edge in inside]
        self._number = {edge: k for k, edge in enumerate(self.edges)}
        self._roads = [
            _Road(
                network.edges[edge].length_m,
                tuple(
                    (self._number[following], through[edge, following])
                    for following in dict.fromkeys(c.to_edge for c in network.outgoing(edge))
                    if following in inside and (edge, following) in through
                ),
            )
            for edge in self.edges
        ]
        self._users = [0] * len(self.edges)

    def use(self, edges: tuple[str, ...]) -> None:
        """Remember that a loop uses these edges."""
        for edge in edges:
            self._users[self._number[edge]] += 1

    def attempt(self, rng: random.Random, reach: float) -> tuple[str, ...] | None:
        """Return a closed edge-simple walk, or None if this attempt found none.

        Walks are about as long as the range of lengths allows, or as the part of it that `reach` leaves.
        """
        stretch = [1.0 + _DETOUR * rng.random() for _ in self.edges]
        if self._shy:
            stretch = [s * (1.0 + _CROWDED * users) for s, users in zip(stretch, self._users, strict=True)]
        start = rng.randrange(len(self.edges))
        high = self._low + (self._high - self._low) * reach
        goal_m = rng.uniform(self._low, high)
        out = self._reach(start, stretch, goal_m, banned=frozenset(), target=None)
        # Half of the way out, half of it back; both vary, so any edge about half way will do.
        half = [k for k, (metres, _) in out.items() if 0.3 * goal_m <= metres <= 0.6 * goal_m]
        if not half:
            return None
        turn = half[rng.randrange(len(half))]
        there = _trace(out, turn)
        back = self._reach(turn, stretch, self._high, banned=frozenset(there[1:-1]), target=start)
        if start not in back:
            return None
        walk = there[:-1] + _trace(back, start)[:-1]
        return tuple(self.edges[k] for k in walk)

    def _reach(
        self,
        start: int,
        stretch: list[float],
        limit_m: float,
        *,
        banned: frozenset[int],
        target: int | None,
    ) -> dict[int, tuple[float, int]]:
        """Return (metres driven, edge before) of every edge reached: Dijkstra over stretched lengths.

        The start is reached again only as `target`; until then it stands for the beginning.
        """
        done: dict[int, tuple[float, int]] = {}
        heap: list[tuple[float, int, float, int]] = [(0.0, start, 0.0, -1)]
        while heap:
            cost, here, metres, before = heapq.heappop(heap)
            if here in done:
                continue
            done[here] = (metres, before)
            if here == target:
                break
            road = self._roads[here]
            for following, through_m in road.onward:
                driven = metres + road.length_m + through_m
                if following not in done and following not in banned and driven <= limit_m:
                    weight = (road.length_m + through_m) * stretch[following]
                    heapq.heappush(heap, (cost + weight, following, driven, here))
        return done


def _trace(reached: dict[int, tuple[float, int]], end: int) -> list[int]:
    walk = [end]
    while (before := reached[walk[-1]][1]) >= 0:
        walk.append(before)
    return walk[::-1]
