"""The graph on which covering loops are designed: lanes between which a vehicle can choose, and turns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.network.lanes import movements_made
from loopgate.network.road import Connection, Edge, RoadNetwork
from loopgate.network.route_lanes import LEAST_CHANGE_M

_SPARE_M = 1e-3
"""Extra length of each lane, so that of equally long ways the one over fewer edges is chosen [m]."""


@dataclass(frozen=True, slots=True)
class LaneGraph:
    """The graph of lanes and turns for one vehicle class, with numbered nodes and arcs.

    A node is a way to enter an edge: one lane, or all neighbouring lanes together if the edge is long enough
    to change lanes on it.
    """

    edges: tuple[str, ...]
    """The edge of each node, in the network file's order."""
    tail: Ints
    head: Ints
    """`tail` and `head`: nodes that each arc leads from and to."""
    length_m: Floats
    """Length of each arc: over the junction and the edge to which it leads [m]."""
    seconds: Floats
    """Time of each arc at the speed limits [s]."""

    def components(self) -> list[list[int]]:
        """Return the strongly connected sets of nodes, the largest first."""
        graph = self.digraph()
        found = [
            sorted(part)
            for part in nx.strongly_connected_components(graph)
            if len(part) > 1 or any(graph.has_edge(node, node) for node in part)
        ]
        return sorted(found, key=lambda part: (-len(part), part))

    def within(self, nodes: Iterable[int]) -> LaneGraph:
        """Return the subgraph of some nodes, numbered in the same order."""
        kept = sorted(nodes)
        number = np.full(len(self.edges), -1)
        number[kept] = np.arange(len(kept))
        arcs = (number[self.tail] >= 0) & (number[self.head] >= 0)
        return LaneGraph(
            tuple(self.edges[node] for node in kept),
            number[self.tail[arcs]],
            number[self.head[arcs]],
            self.length_m[arcs],
            self.seconds[arcs],
        )

    def without_rings(self, waits: Sequence[bool]) -> LaneGraph:
        """Return the graph without closed ways on which no vehicle can wait.

        The nodes of such a ring get a copy for vehicles that come from its beginning; the copy does not lead
        back. Where this would cut streets off, the ring stays.

        `waits`: whether vehicles can wait on each node.
        """
        rings = _rings(self, waits)
        kept = set(self.edges)
        while rings:
            opened = self._opened(rings)
            (most, *_) = opened.components() or [[]]
            cut_off = kept - {opened.edges[node] for node in most}
            if not cut_off:
                return opened.within(most)
            left = {
                begin: ring
                for begin, ring in rings.items()
                if cut_off.isdisjoint(self.edges[node] for node in ring)
            }
            rings = left if len(left) < len(rings) else {}
        return self

    def _opened(self, rings: dict[int, set[int]]) -> LaneGraph:
        """Return the graph with an open copy of each ring for vehicles that come from its beginning."""
        edges = list(self.edges)
        tail, head, arc = self.tail.tolist(), self.head.tolist(), list(range(len(self.tail)))
        for begin, ring in rings.items():
            copy = {node: len(edges) + k for k, node in enumerate(sorted(ring))}
            edges += [self.edges[node] for node in copy]
            for number in range(len(self.tail)):
                one, other = int(self.tail[number]), int(self.head[number])
                if one == begin and other in ring:
                    head[number] = copy[other]
                elif one in ring and other != begin:
                    tail.append(copy[one])
                    head.append(copy.get(other, other))
                    arc.append(number)
        return LaneGraph(tuple(edges), np.array(tail), np.array(head), self.length_m[arc], self.seconds[arc])

    def digraph(self) -> nx.DiGraph[int]:
        """Return the turns as a graph of networkx."""
        graph: nx.DiGraph[int] = nx.DiGraph()
        graph.add_nodes_from(range(len(self.edges)))
        graph.add_edges_from(zip(self.tail.tolist(), self.head.tolist(), strict=True))
        return graph


def lane_graph(
    network: RoadNetwork,
    *,
    vclass: str = "passenger",
    u_turns: bool = False,
    change_m: float = LEAST_CHANGE_M,
    without: Iterable[str] = (),
) -> LaneGraph:
    """Return the lanes and turns of a network that vehicles of a class may use; O(connections).

    Parameters
    ----------
    network, vclass, u_turns
        The roads, the class, and whether it may turn round at junctions.
    change_m
        Length of the shortest edge on which it can change lanes [m].
    without
        Edges to leave out.
    """
    left_out = set(without)
    edges: list[str] = []
    node: dict[tuple[str, int], int] = {}
    for edge in network.edges.values():
        for lanes in () if edge.id in left_out else _groups(edge, vclass, change_m):
            node.update(((edge.id, lane), len(edges)) for lane in lanes)
            edges.append(edge.id)
    shortest: dict[tuple[int, int], Connection] = {}
    through: dict[tuple[int, int], float] = {}
    for c in movements_made(network, vclass):
        arc = node.get((c.from_edge, c.from_lane)), node.get((c.to_edge, c.to_lane))
        if arc[0] is None or arc[1] is None or (c.direction == "t" and not u_turns):
            continue
        metres = network.over_m(c)
        if metres < through.get((arc[0], arc[1]), np.inf):
            through[arc[0], arc[1]], shortest[arc[0], arc[1]] = metres, c
    length, seconds = [], []
    for c in shortest.values():
        lanes_on = [network.lanes[lane] for lane in (*c.via, c.to_id)]
        length.append(sum(lane.length_m for lane in lanes_on) + _SPARE_M)
        seconds.append(sum(lane.length_m / lane.speed_mps for lane in lanes_on) + _SPARE_M)
    ends = np.array(list(shortest), dtype=np.int64).reshape(-1, 2)
    return LaneGraph(tuple(edges), ends[:, 0], ends[:, 1], np.array(length), np.array(seconds))


def _rings(graph: LaneGraph, waits: Sequence[bool]) -> dict[int, set[int]]:
    """Return, for each node where vehicles wait, the nodes on ways back to it on which none can wait."""
    roads = graph.digraph()
    short = roads.subgraph(node for node in roads if not waits[node])
    onward: dict[int, set[int]] = {}
    for node in short:
        onward[node] = {node, *nx.descendants(short, node)}
    rings = {}
    for begin in (node for node in roads if waits[node]):
        behind = {node for first in roads.successors(begin) for node in onward.get(first, ())}
        back = set(roads.predecessors(begin))
        ring = {node for node in behind if not back.isdisjoint(onward[node])}
        if ring:
            rings[begin] = ring
    return rings


def _groups(edge: Edge, vclass: str, change_m: float) -> list[list[int]]:
    """Return the lanes of an edge between which a vehicle can choose, in groups."""
    groups: list[list[int]] = []
    for lane in edge.lanes:
        if vclass not in lane.allowed:
            continue
        if groups and groups[-1][-1] == lane.index - 1 and edge.length_m >= change_m:
            groups[-1].append(lane.index)
        else:
            groups.append([lane.index])
    return groups
