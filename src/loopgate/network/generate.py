"""Closed loops that a vehicle can drive: random loops, then every other loop of the network."""

import heapq
import random
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from typing import TypedDict, Unpack

from loopgate.errors import RouteError
from loopgate.network.lanes import make_loop
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork
from loopgate.network.road_graph import RoadGraph, parts_with_loops

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


_RELAX = 0.9
_LEAST_REACH = 0.3
"""Where roads of other loops are avoided, each attempt shortens the walks tried by `_RELAX`, down to
`_LEAST_REACH` of the range of lengths: short loops fit in where long ones no longer do."""

_TRIES_PER_LOOP = 60
"""Attempts without a new loop, for each loop asked for, after which the random search gives up."""

_MOST_STEPS = 1_000_000
_STEPS_PER_LOOP = 500
"""Effort that the search for every loop may take: steps of a few microseconds, and how many of them a closer
look at one walk counts for. Some seconds in all; up to several hundred edges that is every loop there is."""


@dataclass(frozen=True, slots=True)
class FoundLoops:
    """The loops that were found, and a warning if they are fewer than asked for."""

    loops: tuple[Loop, ...]
    """The loops found; at most as many as asked for."""
    shortfall: str = ""
    """A line that says how many loops were found of how many, and why; empty if none is missing."""
    way_out: str = ""
    """Advice on how to get more; empty if nothing is missing."""


class LoopSearch:
    """A search that finds distinct closed loops one after another.

    The search begins with random loops: a shortest path over randomly stretched roads leads from a random
    edge to another, and a second path over unused edges leads back. With `admits` it prefers roads that no
    other loop uses, and shorter loops as acceptance gets harder; later it drops this preference. When it
    finds no new loop, it tries all closed walks in a fixed order, within a bounded effort. The same seed
    makes the same loops.

    Parameters
    ----------
    count
        Number of loops to find; the random search tries longer for more loops.
    admits
        Function that accepts or refuses each new loop, in order, so that it may remember accepted loops. The
        other options are those of `LoopOptions`.
    """

    def __init__(
        self,
        network: RoadNetwork,
        count: int,
        *,
        length_m: tuple[float, float] = (400.0, 2000.0),
        seed: int = 1,
        u_turns: bool = False,
        vclass: str = "passenger",
        via: Sequence[str] = (),
        admits: Callable[[Loop], bool] | None = None,
    ) -> None:
        self.network, self.length_m, self.seed, self.vclass = network, length_m, seed, vclass
        self.complete = False
        """Whether every closed walk was looked at; known when no loop is left."""
        self.dropped = 0
        """Number of loops that `admits` did not take."""
        self.longest_below_m = 0.0
        """Length of the longest loop that was too short [m]; 0 if none was."""
        self._via = tuple(via)
        parts = parts_with_loops(network, vclass=vclass, u_turns=u_turns)
        self._parts = tuple(part for part in parts if set(via).issubset(part.edges))
        self._u_turns = u_turns
        self._admits = admits
        self._known: set[tuple[str, ...]] = set()
        self._number = 0
        self._patience = _TRIES_PER_LOOP * count
        searches = [self._random(seed, shy=True)] if admits else []
        self._loops = chain(*searches, self._random(seed, shy=False), self._every())

    def __iter__(self) -> Iterator[Loop]:
        return self._loops

    def result(self, loops: Sequence[Loop], count: int, *, dropped: str, ease: str = "") -> FoundLoops:
        """Return the loops found, with a warning and its reason if they are too few.

        `dropped`: a phrase for the loops that `admits` refused, or empty; `ease`: advice about these.
        Raises `RouteError` if there is not a single one.
        """
        if len(loops) == count:
            return FoundLoops(tuple(loops))
        shortfall, way_out = self._shortfall(len(loops), count, dropped), self._way_out(ease)
        if not loops:
            raise RouteError("; ".join(text for text in (shortfall, way_out) if text))
        return FoundLoops(tuple(loops), shortfall, way_out)

    def _shortfall(self, found: int, count: int, dropped: str) -> str:
        """Return that `found` of `count` were found, and whether there are others."""
        name, low, high = self.network.name, *self.length_m
        if not self._parts:
            what = (
                f"no loop leads over {', '.join(self._via)}"
                if self._via
                else "no edge open to it can be reached from itself"
            )
            return f"{name}: no way round for {self.vclass}: {what}"
        wanted = f"{count} loops of {low:g} to {high:g} m for {self.vclass} (seed {self.seed})"
        if not self.complete:
            others = "; no others were found"
        elif not found and not dropped and self.longest_below_m:
            others = f"; there are none, the longest below that has {self.longest_below_m:.1f} m"
        else:
            others = "; there are no others"
        besides = f", besides {dropped}" if dropped else ""
        return f"{name}: found {found} of {wanted}{others}{besides}"

    def _way_out(self, ease: str) -> str:
        """Return the way to get more loops."""
        turning = parts_with_loops(self.network, vclass=self.vclass, u_turns=True)
        helps = not self._u_turns and sum(p.movements for p in turning) > sum(
            p.movements for p in self._parts
        )
        if not self._parts:
            only = "turning round is the only way: allow --u-turns (u_turns in a scenario)"
            return only if helps else ""
        ways = ["widen --length", *([ease] if self._admits and ease else [])]
        ways += ["allow --u-turns"] if helps else []
        return ", ".join(ways[:-1]) + (", or " if len(ways) > 1 else "") + ways[-1]

    def _random(self, seed: int, *, shy: bool) -> Iterator[Loop]:
        if not self._parts:
            return
        search = RandomWalks(self._parts[0], self.length_m, shy=shy, via=self._via)
        rng = random.Random(seed)
        patience, reach = self._patience, 1.0
        while patience:
            patience -= 1
            reach = max(reach * _RELAX, _LEAST_REACH) if shy else 1.0
            edges = search.attempt(rng, reach)
            loop = self._new(edges) if edges is not None else None
            if loop is not None:
                yield loop
                search.use(loop.edges)
                patience = self._patience

    def _every(self) -> Iterator[Loop]:
        steps = _MOST_STEPS
        # Small parts first: random walks have been all over the largest.
        for edges in chain.from_iterable(every_walk(p, self.length_m[1]) for p in reversed(self._parts)):
            steps -= 1
            if edges is not None and _canonical(edges) not in self._known:
                steps -= _STEPS_PER_LOOP
                loop = self._new(edges)
                if loop is not None:
                    yield loop
            if steps <= 0:
                return
        self.complete = True

    def _new(self, edges: tuple[str, ...]) -> Loop | None:
        """Return the loop over these edges if it is new, as long as wanted, can be driven and is admitted."""
        if _canonical(edges) in self._known or not set(self._via).issubset(edges):
            return None
        self._known.add(_canonical(edges))
        try:
            loop = make_loop(self.network, f"loop{self._number}", edges, vclass=self.vclass)
        except RouteError:
            return None  # connected edges, but no lanes lead round
        low, high = self.length_m
        if loop.length_m < low:
            self.longest_below_m = max(self.longest_below_m, loop.length_m)
        if not low <= loop.length_m <= high:
            return None
        if self._admits is not None and not self._admits(loop):
            self.dropped += 1
            return None
        self._number += 1
        return loop


class LoopOptions(TypedDict, total=False):
    """Options for the loops to find: lengths, seed, U-turns, vehicle class, edges to pass."""

    length_m: tuple[float, float]
    """Shortest and longest loop [m]; default 400 to 2000."""
    seed: int
    """Seed of the search; default 1."""
    u_turns: bool
    """Whether vehicles may turn round at junctions; default no."""
    vclass: str
    """SUMO vehicle class that must be allowed; default ``passenger``."""
    via: Sequence[str]
    """Edges that each loop has to lead over; default none."""
    admits: Callable[[Loop], bool] | None
    """Function that accepts or refuses each new loop; default: every loop is accepted."""


def find_loops(
    network: RoadNetwork,
    count: int,
    *,
    ease: str = "raise --max-shared",
    progress: Callable[[int], None] | None = None,
    **options: Unpack[LoopOptions],
) -> FoundLoops:
    """Find distinct closed loops in the network; no loop uses an edge twice.

    Raises `RouteError` if there is no loop at all; the message gives the reason.

    Parameters
    ----------
    network, count
        The network, and the number of loops; see `LoopSearch` for the method.
    ease
        Advice for the error message on how to loosen `admits`; may be empty.
    progress
        Called with the number of loops found so far.

    Notes
    -----
    Each random attempt costs O(E log E) for the E edges within reach. If there are too few loops, the search
    takes some seconds.

    Examples
    --------
    >>> from loopgate import RoadNetwork, find_loops
    >>> network = RoadNetwork.open("networks/grid5-priority.net.xml")
    >>> found = find_loops(network, 3, length_m=(500, 900), seed=2)
    >>> [500 <= loop.length_m <= 900 for loop in found.loops]
    [True, True, True]
    """
    search = LoopSearch(network, count, **options)
    loops: list[Loop] = []
    for loop in islice(search, count):
        loops.append(loop)
        if progress:
            progress(len(loops))
    dropped = f"{search.dropped} that share{'s' * (search.dropped == 1)} too much" if search.dropped else ""
    return search.result(loops, count, dropped=dropped, ease=ease)


def generate_loops(
    network: RoadNetwork,
    count: int,
    **options: Unpack[LoopOptions],
) -> tuple[Loop, ...]:
    """Return `count` distinct closed loops, found as by `find_loops`.

    Raises `RouteError` if not enough loops were found; the message says how many there are.

    Examples
    --------
    >>> from loopgate import RoadNetwork
    >>> from loopgate.network import generate_loops
    >>> network = RoadNetwork.open("networks/grid5-priority.net.xml")
    >>> [loop.id for loop in generate_loops(network, 2, length_m=(500, 900), seed=2)]
    ['loop0', 'loop1']
    """
    found = find_loops(network, count, **options)
    if found.shortfall:
        msg = f"{found.shortfall}; ask for fewer, {found.way_out}"
        raise RouteError(msg)
    return found.loops


def _canonical(edges: tuple[str, ...]) -> tuple[str, ...]:
    first = edges.index(min(edges))
    return edges[first:] + edges[:first]
