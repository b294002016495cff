"""The shortest circulation that covers streets, and a closed walk of about the same length.

Covering given arcs of a directed graph by one closed walk is the directed rural postman problem. If the walk
need not be connected, it is a minimum-cost circulation, a linear programme. Where its solution has several
parts, each part must be left at least once. With such cuts, added until there is one part, the solution is a
closed walk (Christofides, Campos, Corberan, Mota, "An algorithm for the rural postman problem on a directed
graph", Math. Programming Study 26, 1986).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
import scipy
from scipy.sparse import csr_array, vstack
from scipy.sparse.csgraph import connected_components

from loopgate.arrays import Floats, Ints
from loopgate.network.cover.lane_graph import LaneGraph

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
