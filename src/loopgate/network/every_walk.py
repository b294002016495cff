"""Lists all closed walks over edges in a fixed order; complete, but slow if there are many."""

import heapq
from collections import deque
from collections.abc import Iterator
from itertools import islice

from loopgate.network.road_graph import RoadGraph

_TURN = 40
"""Steps that the search from one edge takes before the next edge has its turn."""


def every_walk(part: RoadGraph, longest_m: float) -> Iterator[tuple[str, ...] | None]:
    """Yield each closed walk that uses no edge twice and is not too long, once; None for other steps.

    The searches from all edges take turns, each beginning with the shortest way back, so that the first walks
    are spread over the network. A caller that has enough walks stops iterating; a step takes a few
    microseconds. There can be exponentially many walks.
    """
    before: list[list[tuple[int, float]]] = [[] for _ in part.edges]
    for here, road in enumerate(part.roads):
        for following, through_m in road.onward:
            before[following].append((here, road.length_m + through_m))
    waiting = deque(_from(part, start, before, longest_m) for start in range(len(part.edges)))
    while waiting:
        search = waiting.popleft()
        steps = list(islice(search, _TURN))
        for walk in steps:
            yield None if walk is None else tuple(part.edges[k] for k in walk)
        if len(steps) == _TURN:
            waiting.append(search)


def _from(
    part: RoadGraph, start: int, before: list[list[tuple[int, float]]], longest_m: float
) -> Iterator[tuple[int, ...] | None]:
    """Yield the walks whose lowest edge number is `start`, so that each walk comes once."""
    home_m: dict[int, float] = {}
    heap = [(0.0, start)]
    while heap:
        metres, here = heapq.heappop(heap)
        if here in home_m:
            continue
        home_m[here] = metres
        yield None
        for earlier, length_m in before[here]:
            if earlier > start and earlier not in home_m and metres + length_m <= longest_m:
                heapq.heappush(heap, (metres + length_m, earlier))

    def onward(here: int, driven_m: float) -> Iterator[tuple[int, float]]:
        """Return the next edges from which there may still be a way back, the nearest first."""
        reached_m = driven_m + part.roads[here].length_m
        ways = [(k, reached_m + m) for k, m in part.roads[here].onward if k in home_m]
        ways.sort(key=lambda way: (way[1] + home_m[way[0]], way[0]))
        return iter([way for way in ways if way[1] + home_m[way[0]] <= longest_m])

    walk = [start]
    on_walk = {start}
    choices = [onward(start, 0.0)]
    while choices:
        step = next(choices[-1], None)
        if step is None:
            choices.pop()
            on_walk.remove(walk.pop())
        elif step[0] == start:
            yield tuple(walk)
        elif step[0] not in on_walk:
            walk.append(step[0])
            on_walk.add(step[0])
            choices.append(onward(*step))
            yield None
