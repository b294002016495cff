"""Designs covering loops: K closed walks over given streets, with the longest as short as possible.

Covering given arcs of a directed graph by one closed walk is the directed rural postman problem. If the walk
need not be connected, it is a minimum-cost circulation, a linear programme. Where its solution has several
parts, each part must be left at least once. With such cuts, added until there is one part, the solution is a
closed walk (Christofides, Campos, Corberan, Mota, "An algorithm for the rural postman problem on a directed
graph", Math. Programming Study 26, 1986).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import networkx as nx
import numpy as np
import numpy.typing as npt
import scipy
from scipy.sparse import csr_array, vstack
from scipy.sparse.csgraph import connected_components, dijkstra

from loopgate.arrays import Floats, Ints
from loopgate.errors import RouteError
from loopgate.network.cover.lane_graph import LaneGraph, lane_graph
from loopgate.network.cover.reasons import CoverReason, why_not_covered
from loopgate.network.cover.search import TourPlan, search
from loopgate.network.cover.tours import joined
from loopgate.network.road import RoadNetwork, both_ways
from loopgate.network.route_lanes import LEAST_CHANGE_M


@dataclass(frozen=True, slots=True)
class Ways:
    """The shortest paths between the streets to cover, by number of the street."""

    nodes: Ints
    cost: Floats
    """Shape (n, n): cost from the end of one street to the end of another; on the diagonal, the cost of the
    street's shortest closed walk."""
    before: npt.NDArray[np.int32]
    """Shape (n, nodes of the graph): the node before each node on the shortest path from a required node."""
    closing: Ints
    """The node before each required node on its shortest closed walk."""

    def length(self, tour: Sequence[int]) -> float:
        """Return the cost of a closed walk through required nodes in this order."""
        return float(self.cost[tour, np.roll(tour, -1)].sum())

    def walk(self, tour: Sequence[int]) -> tuple[int, ...]:
        """Return all nodes of a closed walk through required nodes in this order, from the first on."""
        found: list[int] = []
        for one, other in zip(tour, (*tour[1:], tour[0]), strict=True):
            end = int(self.nodes[other])
            leg = [end]
            at = int(self.closing[other]) if one == other else int(self.before[one, end])
            while at != self.nodes[one]:
                leg.append(at)
                at = int(self.before[one, at])
            found += reversed(leg)
        return (found[-1], *found[:-1])


def shortest_ways(graph: LaneGraph, cost: Floats, nodes: Sequence[int]) -> Ways:
    """Find the shortest paths between nodes of a strongly connected graph; n searches of Dijkstra.

    `graph`, `cost`: the lanes, and the cost of each arc; above 0.
    """
    size = len(graph.edges)
    links = csr_array((cost, (graph.tail, graph.head)), shape=(size, size))
    required = np.asarray(nodes, dtype=np.int64)
    reach, before = dijkstra(links, indices=required, return_predecessors=True)
    closed = np.full(len(required), np.inf)
    closing = np.full(len(required), -1)
    arcs: dict[int, list[int]] = {}
    for arc, head in enumerate(graph.head.tolist()):
        arcs.setdefault(head, []).append(arc)
    for rank, node in enumerate(required.tolist()):
        into = arcs[node]
        totals = reach[rank, graph.tail[into]] + cost[into]
        best = int(totals.argmin())
        closed[rank], closing[rank] = totals[best], graph.tail[into[best]]
    between = np.ascontiguousarray(reach[:, required])  # else of one node all would be compiled anew
    np.fill_diagonal(between, closed)
    return Ways(required, between, before, closing)


_ROUNDS = 1
_MOST_PARTS = 150
_GAP = 0.005
_MOST_BRANCHES = 40
"""Limits of the cuts: how often they are added, and the gap or the number of branches to which each programme
is solved. Detours join the few parts that are left. A circulation in more parts gets no cuts, which would
take minutes; detours join it as it is."""


@dataclass(frozen=True, slots=True)
class Circulation:
    """The streets that a circulation drives."""

    nodes: tuple[int, ...]
    """One visited node for each choice of nodes."""
    walks: tuple[tuple[int, ...], ...]
    """Closed walks, as nodes in driving order, that visit all of them; one if it hangs together."""


def circulate(graph: LaneGraph, cost: Floats, choices: Sequence[Sequence[int]]) -> Circulation:
    """Find the cheapest circulation over one node of each choice.

    Parameters
    ----------
    graph
        Strongly connected.
    cost
        The cost of each arc.
    choices
        For each street its nodes, of which one must be visited.
    """
    balance, visits = _demands(graph, choices)
    times = np.rint(_solved(cost, balance, visits, ()).x).astype(np.int64)
    cuts: list[Ints] = []
    for _ in range(_ROUNDS):
        parts = _parts(graph, times)
        if not 1 < len(parts) <= _MOST_PARTS:
            break
        cuts += [(np.isin(graph.tail, part) & ~np.isin(graph.head, part)).astype(np.int64) for part in parts]
        cut = _solved(cost, balance, visits, cuts)
        if cut.x is None:
            break  # not within so many branches
        times = np.rint(cut.x).astype(np.int64)
    seen = np.bincount(graph.head[times > 0], minlength=len(graph.edges)) > 0
    return Circulation(
        tuple(next(node for node in choice if seen[node]) for choice in choices),
        tuple(_walk(graph, times, part) for part in _parts(graph, times)),
    )


def least_circulation(graph: LaneGraph, cost: Floats, choices: Sequence[Sequence[int]]) -> float:
    """Return only the cost of the cheapest circulation; parameters as in `circulate`."""
    return float(_solved(cost, *_demands(graph, choices), (), whole=False).fun)


def _demands(
    graph: LaneGraph, choices: Sequence[Sequence[int]]
) -> tuple[csr_array[np.float64], csr_array[np.float64]]:
    """Return the balance of each node by arc, and the choices that each arc visits."""
    nodes, arcs = len(graph.edges), len(graph.tail)
    every = np.arange(arcs)
    balance = csr_array(
        (
            np.concatenate((np.ones(arcs), -np.ones(arcs))),
            (np.append(graph.head, graph.tail), np.tile(every, 2)),
        ),
        shape=(nodes, arcs),
    )
    into = csr_array((np.ones(arcs), (graph.head, every)), shape=(nodes, arcs))
    member = np.concatenate([np.full(len(choice), k) for k, choice in enumerate(choices)])
    chosen = csr_array((np.ones(len(member)), (member, np.concatenate(choices))), shape=(len(choices), nodes))
    return balance, chosen @ into


def _solved(
    cost: Floats,
    balance: csr_array[np.float64],
    visits: csr_array[np.float64],
    cuts: Sequence[Ints],
    *,
    whole: bool = True,
) -> scipy.optimize.OptimizeResult:
    """Return how often to drive each arc; with `whole`, in whole numbers."""
    rows = vstack([balance, visits, *([csr_array(np.array(cuts, dtype=np.float64))] if cuts else [])])
    ways = balance.shape[0]
    demands = rows.shape[0] - ways
    low = np.concatenate((np.zeros(ways), np.ones(demands)))
    high = np.concatenate((np.zeros(ways), np.full(demands, np.inf)))
    return scipy.optimize.milp(
        cost,
        constraints=scipy.optimize.LinearConstraint(rows.tocsr(), low, high),
        integrality=np.full(len(cost), int(whole)),
        bounds=scipy.optimize.Bounds(0.0, np.inf),
        options={"mip_rel_gap": _GAP, "node_limit": _MOST_BRANCHES} if cuts else {},
    )


def _parts(graph: LaneGraph, times: Ints) -> list[Ints]:
    """Return the nodes of each connected part of the driven arcs."""
    used = times > 0
    nodes = len(graph.edges)
    links = csr_array((np.ones(used.sum()), (graph.tail[used], graph.head[used])), shape=(nodes, nodes))
    _, label = connected_components(links, directed=False)
    return [np.flatnonzero(label == part) for part in np.unique(label[graph.head[used]])]


def _walk(graph: LaneGraph, times: Ints, part: Ints) -> tuple[int, ...]:
    """Return a closed walk over the arcs of a part, each as often as it is driven."""
    euler: nx.MultiDiGraph[int] = nx.MultiDiGraph()
    inside = np.isin(graph.tail, part)
    for arc in np.flatnonzero(inside & (times > 0)).tolist():
        ends = int(graph.tail[arc]), int(graph.head[arc])
        euler.add_edges_from([ends] * int(times[arc]))
    return tuple(head for _, head in nx.eulerian_circuit(euler, source=int(part.min())))


_STARTS, _COUNTED = 20, 100
"""Bounds on the longest walk are computed from this many streets, for at most this many loops."""


@dataclass(frozen=True, slots=True)
class CoverTask:
    """The streets to cover, and the limits of the loops."""

    edges: tuple[str, ...] | None = None
    """The streets; every edge open to the class if None."""
    vclass: str = "passenger"
    u_turns: bool = False
    """`vclass` and `u_turns`: the vehicle class, and whether vehicles may turn round at junctions."""
    either_way: bool = False
    """Whether one direction of a street is enough."""
    both_sides: tuple[str, ...] = ()
    """With `either_way`, edges of streets of which both directions must be covered."""
    longest: float = math.inf
    """Greatest length of a loop [m]; greatest time [s] with `by_time`."""
    by_time: bool = False
    """Whether loops shall be short in time at the speed limits [s], not in length [m]."""
    depots: tuple[str, ...] = ()
    """Depot edges; every loop passes the nearest one. Empty for none."""
    around: frozenset[str] | None = None
    """Edges that loops may use; all edges if None."""
    change_m: float = LEAST_CHANGE_M
    """Length of the shortest edge on which a vehicle can change lanes [m]."""
    place_m: float = 0.0
    """Length of the shortest edge on which vehicles can wait [m]. A loop returns to such an edge over shorter
    edges only if streets could not be covered otherwise. 0 if that does not matter."""


@dataclass(frozen=True, slots=True)
class Design:
    """Streets that can be covered, with shortest paths and bounds, before loops are made."""

    task: CoverTask
    graph: LaneGraph
    """Lanes and turns; each can be reached from each other."""
    ways: Ways
    """Shortest paths between the required streets."""
    circulation: float
    """Cost of the cheapest circulation over them [m, or s by time], a lower bound on all loops together."""
    apart: Floats
    """Lower bounds on the longest loop. The first is the cost of the longest of the streets' shortest closed
    walks. The others are, for each number of loops: among one street more than loops, no two streets have
    a shorter closed walk."""
    tour: Ints
    """One tour through all required streets."""
    required: tuple[str, ...]
    """The edges to cover."""
    left_out: dict[str, CoverReason]
    """The edges that cannot be covered, and why."""

    def bound(self, count: int) -> float:
        """Return a lower bound on the longest of `count` loops."""
        return max(self.circulation / count, float(self.apart[0]), *map(float, self.apart[count : count + 1]))

    def dearer(self, more: Mapping[str, float]) -> Design:
        """Return the design with an extra cost for some streets."""
        cost = self.ways.cost.copy()
        for rank, node in enumerate(self.ways.nodes):
            cost[:, rank] += more.get(self.graph.edges[node], 0.0)
        return replace(self, ways=replace(self.ways, cost=cost))

    def settled(self) -> Design:
        """Return the design without its shortest paths, which take much memory; bounds and reasons stay."""
        nodes, cost = np.zeros(0, dtype=np.int64), np.zeros((0, 0))
        return replace(self, ways=Ways(nodes, cost, cost.astype(np.int32), nodes))

    def plans(self, count: int, *, seed: int, begun: TourPlan | None = None) -> Iterator[TourPlan]:
        """Yield better and better plans for `count` loops, or for more loops if the longest is bounded.

        With `begun`, a plan found before, the search continues from that plan.
        """
        most = self.task.longest
        if math.isinf(most):
            tours = begun.tours if begun else (self.tour,)
            yield from search(self.ways.cost, tours, count, self.bound(count), seed=seed)
            return
        count = max(count, math.ceil(self.circulation / most))
        while count <= len(self.ways.nodes):
            for plan in search(self.ways.cost, (self.tour,), count, most, seed=seed):
                if plan.longest <= most:
                    yield plan
            if plan.longest <= most:
                return
            count += max(1, count // 20)


def walks_of(design: Design, plan: TourPlan) -> list[tuple[int, ...]]:
    """Return the closed walks of a plan, as nodes of the graph, each past its nearest depot.

    A tour that the way to its depot makes too long is cut in half.
    """
    tours = [tuple(int(rank) for rank in tour) for tour in plan.tours]
    if not design.task.depots:
        return [design.ways.walk(tour) for tour in tours]
    hubs = _hubs(design.graph, design.task)
    arcs = zip(design.graph.tail.tolist(), design.graph.head.tolist(), strict=True)
    price = dict(zip(arcs, _cost(design.graph, design.task).tolist(), strict=True))
    walks = []
    while tours:
        tour = tours.pop(0)
        walk = _over_depot(design, tour, hubs)
        cost = sum(price[step] for step in pairwise((*walk, walk[0])))
        if cost > design.task.longest and len(tour) > 1:
            half = len(tour) // 2
            tours[:0] = tour[:half], tour[half:]
        else:
            walks.append(walk)
    return walks


def _hubs(graph: LaneGraph, task: CoverTask) -> list[int]:
    return [node for node, edge in enumerate(graph.edges) if edge in task.depots]


def _over_depot(design: Design, tour: tuple[int, ...], hubs: Sequence[int]) -> tuple[int, ...]:
    """Return the closed walk of a tour, with the shortest detour over a hub."""
    walk = design.ways.walk(tour)
    if set(hubs) & set(walk):
        return walk
    if len(tour) == 1:  # to the depot and back; its own closed walk is no part of the way
        walk = (int(design.ways.nodes[tour[0]]),)
    cost = _cost(design.graph, design.task)
    there = shortest_ways(design.graph, cost, sorted({*walk, *hubs}))
    rank = {int(node): k for k, node in enumerate(there.nodes)}
    _, at, hub = min(
        (there.cost[rank[node], rank[hub]] + there.cost[rank[hub], rank[node]], k, hub)
        for k, node in enumerate(walk)
        for hub in hubs
    )
    detour = there.walk((rank[walk[at]], rank[hub]))
    if len(walk) == 1:
        return detour
    return (*walk[:at], *detour, *walk[at:])


def make_design(
    network: RoadNetwork, task: CoverTask, *, without: dict[str, CoverReason] | None = None
) -> Design:
    """Find the streets that can be covered, and lower bounds on the loops.

    Raises `NetworkError` if an edge of the task is not in the network; `RouteError` if no street can be
    covered.

    Parameters
    ----------
    network, task
        The roads, and the streets to cover.
    without
        Edges to avoid, and why.
    """
    kept_off = without or {}
    wanted = wanted_edges(network, task)
    plain = _part(network, task, wanted, kept_off)
    graph = plain.without_rings([network.edges[edge].length_m >= task.place_m for edge in plain.edges])
    nodes = _by_edge(graph)
    left_out = why_not_covered(network, nodes, wanted, vclass=task.vclass, u_turns=task.u_turns)
    left_out |= {edge: reason for edge, reason in kept_off.items() if edge in left_out}
    required = [edge for edge in wanted if edge in nodes]
    cost = _cost(graph, task)
    if math.isfinite(task.longest):
        too_long = _too_long(graph, cost, nodes, required, task)
        left_out |= dict.fromkeys(too_long, CoverReason.TOO_LONG)
        required = [edge for edge in required if edge not in too_long]
    if not required:
        raise _nothing(network, task, left_out)
    streets = both_ways(network, required, task.both_sides) if task.either_way else [[e] for e in required]
    choices = _choices(streets, nodes)
    found = circulate(graph, cost, choices)
    ways = shortest_ways(graph, cost, found.nodes)
    sure = [k for k, choice in enumerate(choices) if len(choice) == 1]  # of others another may be as good
    return Design(
        task,
        graph,
        ways,
        least_circulation(plain, _cost(plain, task), _choices(streets, _by_edge(plain))),
        _apart(ways.cost[np.ix_(sure, sure)]),
        _one_tour(ways, found),
        tuple(required),
        left_out,
    )


def coverable(network: RoadNetwork, task: CoverTask) -> list[str]:
    """Return the edges that closed walks can reach; vehicles may still be unable to queue there.

    Raises the errors of `make_design`, except for an empty answer.
    """
    wanted = wanted_edges(network, task)
    try:
        reached = set(_part(network, task, wanted, {}).edges)
    except RouteError:
        return []
    return [edge for edge in wanted if edge in reached]


def wanted_edges(network: RoadNetwork, task: CoverTask) -> list[str]:
    """Return the edges to cover: the given edges, or every edge open to the vehicle class."""
    if task.edges is None:
        return [edge.id for edge in network.edges.values() if edge.allows(task.vclass)]
    return [network.edge(edge).id for edge in dict.fromkeys(task.edges)]


def _by_edge(graph: LaneGraph) -> dict[str, list[int]]:
    nodes: dict[str, list[int]] = {}
    for node, edge in enumerate(graph.edges):
        nodes.setdefault(edge, []).append(node)
    return nodes


def _choices(streets: Sequence[Sequence[str]], nodes: Mapping[str, Sequence[int]]) -> list[list[int]]:
    return [[node for edge in street for node in nodes[edge]] for street in streets]


def _cost(graph: LaneGraph, task: CoverTask) -> Floats:
    return graph.seconds if task.by_time else graph.length_m


def _part(
    network: RoadNetwork, task: CoverTask, wanted: Sequence[str], without: dict[str, CoverReason]
) -> LaneGraph:
    """Return the part of the network in which most of the wanted edges can be reached from each other."""
    far = () if task.around is None else network.edges.keys() - task.around
    graph = lane_graph(
        network, vclass=task.vclass, u_turns=task.u_turns, change_m=task.change_m, without={*without, *far}
    )
    parts = graph.components()
    for at in (network.edge(depot).id for depot in task.depots):
        parts = [part for part in parts if any(graph.edges[node] == at for node in part)]
        if not parts:
            other = " and the other depots" if len(task.depots) > 1 else ""
            msg = f"{network.name}: no loop leads over the start {at}{other}; choose another edge"
            raise RouteError(msg)
    if not parts:
        raise _nothing(network, task, {})
    of_task = set(wanted)
    return graph.within(max(parts, key=lambda part: len({graph.edges[node] for node in part} & of_task)))


def _nothing(network: RoadNetwork, task: CoverTask, left_out: dict[str, CoverReason]) -> RouteError:
    if not any(edge.allows(task.vclass) for edge in network.edges.values()):
        return RouteError(f"{network.name}: no edge is open to {task.vclass}; name a class of SUMO's")
    counted = {reason: list(left_out.values()).count(reason) for reason in dict.fromkeys(left_out.values())}
    why = "; ".join(f"{number}: {reason}" for reason, number in counted.items())
    way_out = "" if task.u_turns else "; turning round (--u-turns) may help"
    return RouteError(
        f"{network.name}: no street can be covered by closed loops for {task.vclass}"
        + (f" ({why})" if why else ": no edge can be reached from itself")
        + way_out
    )


def _apart(cost: Floats) -> Floats:
    """Return lower bounds on the longest closed walk, for each number of walks from none.

    Farthest-first traversal (Gonzalez, "Clustering to minimize the maximum intercluster distance", Theor.
    Comput. Sci. 38, 1985), from each of the farthest streets; O(starts n counts).
    """
    alone = cost.diagonal()
    apart = np.zeros(max(min(len(cost), _COUNTED), 1))
    apart[0] = alone.max(initial=0.0)
    for first in np.argsort(-alone, kind="stable")[:_STARTS].tolist():
        latest, nearest, least = first, np.full(len(cost), np.inf), np.inf
        for count in range(1, len(apart)):
            nearest = np.minimum(nearest, cost[latest] + cost[:, latest])
            nearest[latest] = -np.inf
            latest = int(nearest.argmax())
            least = min(least, float(nearest[latest]))
            apart[count] = max(apart[count], least)
    return apart


def _too_long(
    graph: LaneGraph,
    cost: Floats,
    nodes: dict[str, list[int]],
    required: Sequence[str],
    task: CoverTask,
) -> set[str]:
    """Return the edges whose shortest closed walk, over a depot if there are some, is too long."""
    every = [node for edge in required for node in nodes[edge]]
    hubs = _hubs(graph, task)
    there = shortest_ways(graph, cost, sorted({*every, *hubs}))
    rank = {int(node): k for k, node in enumerate(there.nodes)}
    closed = {}
    for node in every:
        at = rank[node]
        over = [
            there.cost[at, h] + (there.cost[h, at] if h != at else 0.0) for h in (rank[hub] for hub in hubs)
        ]
        closed[node] = min(over, default=there.cost[at, at])
    return {edge for edge in required if min(closed[node] for node in nodes[edge]) > task.longest}


def _one_tour(ways: Ways, found: Circulation) -> Ints:
    rank = {int(node): k for k, node in enumerate(ways.nodes)}
    tours, seen = [], set[int]()
    for walk in found.walks:
        tour = [rank[node] for node in dict.fromkeys(walk) if node in rank and rank[node] not in seen]
        seen.update(tour)
        if tour:
            tours.append(np.array(tour))
    return joined(ways.cost, tours)
