"""Covering loops on which vehicles can queue: checks and repairs designed loops."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import networkx as nx

from loopgate.abstraction.movements import least_change_m, least_place_m
from loopgate.abstraction.queue_survey import refused_queues
from loopgate.errors import RouteError
from loopgate.network import Loop, RoadNetwork, make_loop
from loopgate.network.cover.design import CoverTask, Design, make_design, walks_of
from loopgate.network.cover.lane_graph import LaneGraph
from loopgate.network.cover.reasons import CoverReason
from loopgate.network.cover.search import ROUNDS, TourPlan
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

_MENDS, _SHARED = 20, 2

Walk = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Cover:
    """Loops that cover streets; vehicles can queue on each loop."""

    design: Design
    """The streets to cover, and lower bounds of the length."""
    loops: tuple[Loop, ...]
    left_out: dict[str, CoverReason]
    """The streets that are not covered, and why."""
    finished: bool = True
    """Whether the search was completed."""
    costs: tuple[float, ...] = ()
    """Cost of each loop [m, or s by time]."""

    @property
    def covered(self) -> tuple[str, ...]:
        """The required streets that lie on some loop."""
        on = {edge for loop in self.loops for edge in loop.edges}
        return tuple(edge for edge in self.design.required if edge in on)


def cover_streets(
    network: RoadNetwork,
    task: CoverTask,
    count: int,
    *,
    kind: VehicleType = DEFAULT_TYPE,
    seed: int = 1,
    name: str = "loop",
    progress: Callable[[int, int | None], None] | None = None,
) -> Cover:
    """Make closed loops that cover streets, can be cut into queues, and whose longest loop is short.

    An interruption from the keyboard ends the search; the best loops so far are used.

    Raises `RouteError` if no street can be covered, or no loop can be as short as required.

    Parameters
    ----------
    network, task
        The roads, and the streets to cover.
    count
        Number of loops; fewer if there are fewer streets, more if the length of a loop is limited.
    kind
        The type of the vehicles; of the task's class.
    seed
        Seed of the search; the same seed gives the same loops.
    name
        Beginning of the loops' names.
    progress
        Called with rounds done and rounds in all.
    """
    kept_off: dict[str, CoverReason] = {}
    task = replace(task, change_m=least_change_m(kind.needed_m), place_m=least_place_m(kind.needed_m))
    while True:
        design = make_design(network, task, without=kept_off)
        plan, finished = _best(design, count, seed, progress)
        if plan is None:
            unit = "s" if task.by_time else "m"
            msg = f"{network.name}: no loops found of at most {task.longest:g} {unit}; allow longer loops"
            raise RouteError(msg)
        mender = _Mender(network, design, kind, name)
        loops, bad = mender.mended(walks_of(design, plan))
        detours: dict[str, float] = {}
        for _ in range(_SHARED):
            if bad or not finished or not mender.detours or mender.longest <= plan.longest:
                break
            # The costs of detours are known now: search again with them, and keep the better loops.
            detours |= mender.detours
            other = _Mender(network, design, kind, name)
            more, finished = _best(design.dearer(detours), count, seed, progress, plan)
            plan = more or plan
            again, refused = other.mended(walks_of(design, plan))
            detours |= other.detours
            if not refused and len(other.lost) <= len(mender.lost) and other.longest < mender.longest:
                loops, mender = again, other
        if not bad and not loops:
            why = CoverReason.QUEUES
            msg = f"{network.name}: no covering loop works as queues: {why}; cover more streets"
            raise RouteError(msg)
        if not bad:
            return Cover(design.settled(), loops, design.left_out | mender.lost, finished, mender.costs)
        kept_off |= dict.fromkeys(bad, CoverReason.QUEUES)


def _best(
    design: Design,
    count: int,
    seed: int,
    progress: Callable[[int, int | None], None] | None,
    begun: TourPlan | None = None,
) -> tuple[TourPlan | None, bool]:
    plan = begun
    try:
        better_and_better = design.plans(count, seed=seed, begun=begun)
        for number, better in enumerate(better_and_better, ROUNDS // 2 if begun else 0):
            plan = better
            if progress:
                progress(number, ROUNDS)
    except KeyboardInterrupt:
        if plan is None:
            raise
        return plan, False
    return plan, True


class _Mender:
    """Repairs walks that cannot be cut into queues.

    A walk that returns to a lane without a place between loses that ring; other detours then cover its
    streets. A walk with fewer than two places is joined to another walk.
    """

    def __init__(self, network: RoadNetwork, design: Design, kind: VehicleType, name: str) -> None:
        self.lost: dict[str, CoverReason] = {}
        """Streets that no mended walk covers."""
        self.detours: dict[str, float] = {}
        """Streets that needed a detour, and its cost."""
        self.longest = 0.0
        """Cost of the longest repaired walk."""
        self.costs: tuple[float, ...] = ()
        """Cost of each repaired walk."""
        self._network = network
        self._design = design
        self._name = name
        self._kind = kind
        graph = design.graph
        self._is_place = [network.edges[edge].length_m >= design.task.place_m for edge in graph.edges]
        self._roads = _digraph(graph, design)

    def mended(self, walks: Sequence[Walk]) -> tuple[tuple[Loop, ...], set[str]]:
        """Return loops that can be cut into queues; otherwise the edges that walks must avoid."""
        now = list(walks)
        for _ in range(_MENDS):
            loops = [
                make_loop(
                    self._network,
                    f"{self._name}{number}",
                    [self._design.graph.edges[node] for node in walk],
                    vclass=self._kind.vclass,
                )
                for number, walk in enumerate(now)
            ]
            refused = refused_queues(self._network, [(loop, self._kind) for loop in loops])
            if not refused:
                self.costs = tuple(map(self._cost, now))
                self.longest = max(self.costs, default=0.0)
                return tuple(loops), set()
            bad: set[str] = set()
            for refusal in sorted(refused, key=lambda r: loops.index(r.loop), reverse=True):
                number = loops.index(refusal.loop)
                if refusal.edge is None:
                    self._join(now, number)
                    break  # it may now be part of another refused walk
                if not self._without_ring(now, number, refusal.edge):
                    bad.add(refusal.edge)
            if bad:
                return (), bad
        return (), {refusal.edge or refusal.loop.edges[0] for refusal in refused}

    def _join(self, walks: list[Walk], number: int) -> None:
        """Join a walk to the cheapest walk that shares a node with it; without one, leave it out."""
        walk = walks.pop(number)
        sharing = [k for k, other in enumerate(walks) if set(walk) & set(other)]
        if not sharing:
            on = {node for other in walks for node in other}
            self._lose([self._design.graph.edges[node] for node in walk if node not in on])
            return
        k = min(sharing, key=lambda k: self._cost(walks[k]))
        at = next(place for place, node in enumerate(walks[k]) if node in walk)
        begin = walk.index(walks[k][at])
        walks[k] = (*walks[k][:at], *walk[begin:], *walk[:begin], *walks[k][at:])

    def _lose(self, edges: Sequence[str]) -> None:
        required = set(self._design.required)
        self.lost |= {edge: CoverReason.QUEUES for edge in edges if edge in required}

    def _without_ring(self, walks: list[Walk], number: int, edge: str) -> bool:
        """Remove the shortest ring from an edge back to the edge; return whether there is one."""
        graph, walk = self._design.graph, walks[number]
        visits = [k for k, node in enumerate(walk) if graph.edges[node] == edge]
        rings = [(one, other) for one, other in pairwise((*visits, *(k + len(walk) for k in visits[:1])))]
        if len(visits) == 1:
            return False
        around = [self._is_place[node] for node in walk] * 2
        # A long lane may be no place, if other vehicles swing out over it.
        begin, end = min(rings, key=lambda ring: (sum(around[ring[0] + 1 : ring[1]]), ring[1] - ring[0]))
        turned = (*walk[begin:], *walk[:begin])
        ring, rest = turned[1 : end - begin], turned[end - begin :]
        walks[number] = rest
        for taken in dict.fromkeys(graph.edges[node] for node in ring):
            if not any(graph.edges[node] == taken for walk in walks for node in walk):
                self._lead_over(walks, taken)
        return True

    def _lead_over(self, walks: list[Walk], edge: str) -> None:
        """Add the cheapest detour over an edge to a walk, or lose the edge."""
        nodes = [node for node, name in enumerate(self._design.graph.edges) if name == edge]
        options = [option for node in nodes for option in self._detours(walks, node)]
        if not options:
            self._lose([edge])
            return
        costs = [self._cost(walk) for walk in walks]
        # The detour that lengthens the longest loop least; ties go to the cheapest detour.
        _, self.detours[edge], number, begin, detour = min(
            (max(costs[k] + price, *costs), price, k, begin, detour)
            for price, begin, detour in options
            for k, walk in enumerate(walks)
            if begin in walk
        )
        at = walks[number].index(begin)
        walks[number] = (*walks[number][:at], *detour, *walks[number][at:])

    def _detours(self, walks: Sequence[Walk], node: int) -> Iterator[tuple[float, int, Walk]]:
        """Yield detours from a place over a node to another place and back, with their cost."""
        place, roads, name = self._is_place, self._roads, self._design.graph.edges
        onto = nx.subgraph_view(roads, filter_edge=lambda _, head: head == node or not place[head])
        off = nx.subgraph_view(roads, filter_edge=lambda tail, _: tail == node or not place[tail])
        before, ways_in = _shortest(onto.reverse(copy=False), node)
        after, ways_out = _shortest(off, node)
        for begin in (p for p in before if p != node and place[p] and any(p in walk for walk in walks)):
            home, ways_home = _shortest(roads.reverse(copy=False), begin)
            for end in (q for q in after if q != node and place[q] and name[q] != name[begin]):
                parts = ways_in[begin][::-1], ways_out[end], ways_home[end][::-1]
                detour = tuple(step for part in parts for step in part[:-1])
                yield before[begin] + after[end] + home[end], begin, detour

    def _cost(self, walk: Walk) -> float:
        return sum(float(self._roads.edges[step]["weight"]) for step in pairwise((*walk, walk[0])))


def _shortest(roads: nx.DiGraph[int], source: int) -> tuple[dict[int, float], dict[int, list[int]]]:
    """Return the shortest ways from a node and their costs."""
    costs = nx.single_source_dijkstra_path_length(roads, source)
    return costs, nx.single_source_dijkstra_path(roads, source)


def _digraph(graph: LaneGraph, design: Design) -> nx.DiGraph[int]:
    cost = graph.seconds if design.task.by_time else graph.length_m
    roads: nx.DiGraph[int] = nx.DiGraph()
    roads.add_weighted_edges_from(zip(graph.tail.tolist(), graph.head.tolist(), cost.tolist(), strict=True))
    return roads
