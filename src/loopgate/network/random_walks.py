"""Finds random closed walks over edges; quick, but not complete."""

import heapq
import random
from collections.abc import Sequence

from loopgate.network.road_graph import RoadGraph

_DETOUR = 1.0
"""Road lengths are stretched by a random share of up to this much, so that loops differ."""

_CROWDED = 3.0
"""Factor on the length of a road that another loop uses, where such roads are avoided."""


class RandomWalks:
    """A search for random closed walks in a strongly connected part of a network.

    Parameters
    ----------
    length_m
        Shortest and longest walk wanted [m].
    shy
        Whether roads that other loops use are avoided.
    via
        Edges of the part that each walk has to lead over, in this order.
    """

    def __init__(
        self, part: RoadGraph, length_m: tuple[float, float], *, shy: bool, via: Sequence[str] = ()
    ) -> None:
        self._low, self._high = length_m
        self._shy = shy
        self._edges, self._roads = part.edges, part.roads
        self._number = {edge: k for k, edge in enumerate(part.edges)}
        self._users = [0] * len(part.edges)
        self._via = [self._number[edge] for edge in via]

    def use(self, edges: tuple[str, ...]) -> None:
        """Record that a loop uses some edges."""
        for edge in edges:
            self._users[self._number[edge]] += 1

    def attempt(self, rng: random.Random, reach: float) -> tuple[str, ...] | None:
        """Return a closed walk that uses no edge twice; None if this attempt found none.

        Its length is about in the allowed range, or in the part of the range that `reach` leaves. O(E log E)
        for the E edges within reach.
        """
        # One draw per edge, reached or not: seeds of studies stand for their loops.
        stretch = [1.0 + _DETOUR * rng.random() for _ in self._edges]
        start = self._via[0] if self._via else rng.randrange(len(self._edges))
        high = self._low + (self._high - self._low) * reach
        goal_m = rng.uniform(self._low, high)
        first, driven_m = self._over_via(start, stretch)
        if not first:
            return None
        goal_m -= driven_m
        out = self._reach(first[-1], stretch, goal_m, banned=frozenset(first[:-1]), target=None)
        # Half of the way out, half of it back; both vary, so any edge about half way will do.
        half = [k for k, (metres, _) in out.items() if 0.3 * goal_m <= metres <= 0.6 * goal_m]
        half = half or self._via[-1:]
        if not half:
            return None
        turn = half[rng.randrange(len(half))]
        there = first[:-1] + _trace(out, turn)
        back = self._reach(turn, stretch, self._high, banned=frozenset(there[1:-1]), target=start)
        if start not in back:
            return None
        walk = there[:-1] + _trace(back, start)[:-1]
        return tuple(self._edges[k] for k in walk)

    def _over_via(self, start: int, stretch: list[float]) -> tuple[list[int], float]:
        """Return a walk from the start over all edges of `via`, and its length [m]; or an empty walk."""
        walk, driven_m = [start], 0.0
        for edge in self._via[1:]:
            if edge in walk:
                continue
            found = self._reach(walk[-1], stretch, self._high, banned=frozenset(walk[:-1]), target=edge)
            if edge not in found:
                return [], 0.0
            driven_m += found[edge][0]
            walk += _trace(found, edge)[1:]
        return walk, driven_m

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
                    crowded = 1.0 + _CROWDED * self._users[following] if self._shy else 1.0
                    weight = (road.length_m + through_m) * (stretch[following] * crowded)
                    heapq.heappush(heap, (cost + weight, following, driven, here))
        return done


def _trace(reached: dict[int, tuple[float, int]], end: int) -> list[int]:
    walk = [end]
    while (before := reached[walk[-1]][1]) >= 0:
        walk.append(before)
    return walk[::-1]
