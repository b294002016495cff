"""The graph of edges for one vehicle class; all loops lie in its strongly connected parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from loopgate.network.road import RoadNetwork

if TYPE_CHECKING:
    import networkx as nx


@dataclass(frozen=True, slots=True)
class GraphRoad:
    """An edge in the graph: its next edges, and the metres through the junction to each.

    `length_m` and these metres are the least of all lanes.
    """

    length_m: float
    onward: tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class RoadGraph:
    """A strongly connected part of the graph of edges, with numbered edges.

    `edges`: by number, in the network file's order.
    """

    edges: tuple[str, ...]
    roads: tuple[GraphRoad, ...]

    @property
    def movements(self) -> int:
        """The number of movements from edge to edge."""
        return sum(len(road.onward) for road in self.roads)


def parts_with_loops(network: RoadNetwork, *, vclass: str, u_turns: bool) -> tuple[RoadGraph, ...]:
    """Return the parts of the network that contain closed walks, the largest first.

    O(connections), and the order depends on the network alone.
    """
    import networkx as nx  # noqa: PLC0415  a fault of input is told before this is loaded

    graph: nx.DiGraph[str] = nx.DiGraph()
    through: dict[tuple[str, str], float] = {}
    for c in network.connections:
        if not network.allows(c, vclass) or (c.direction == "t" and not u_turns):
            continue
        graph.add_edge(c.from_edge, c.to_edge)
        metres = network.over_m(c)
        pair = (c.from_edge, c.to_edge)
        through[pair] = min(metres, through.get(pair, metres))
    parts = nx.strongly_connected_components(graph) if graph else ()
    closed = [part for part in parts if len(part) > 1 or any((edge, edge) in through for edge in part)]
    closed.sort(key=lambda part: (len(part), min(part)), reverse=True)
    return tuple(_part(network, part, through) for part in closed)


def _part(network: RoadNetwork, inside: set[str], through: dict[tuple[str, str], float]) -> RoadGraph:
    # The file's order, not the hash's, so that the same seed finds the same loops.
    edges = tuple(edge for edge in network.edges if edge in inside)
    number = {edge: k for k, edge in enumerate(edges)}
    roads = tuple(
        GraphRoad(
            network.edges[edge].length_m,
            tuple(
                (number[following], through[edge, following])
                for following in dict.fromkeys(c.to_edge for c in network.outgoing(edge))
                if following in inside and (edge, following) in through
            ),
        )
        for edge in edges
    )
    return RoadGraph(edges, roads)
