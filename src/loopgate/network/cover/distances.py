"""Shortest paths between the streets to cover."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from loopgate.arrays import Floats, Ints
from loopgate.network.cover.lane_graph import LaneGraph


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
