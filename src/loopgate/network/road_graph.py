"""The graph of edges for one vehicle class; all loops lie in its strongly connected parts."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from loopgate.network.road import RoadNetwork

N = TypeVar("N", bound=Hashable)


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
    onward: dict[str, list[str]] = {}
    through: dict[tuple[str, str], float] = {}
    for c in network.connections:
        if not network.allows(c, vclass) or (c.direction == "t" and not u_turns):
            continue
        onward.setdefault(c.from_edge, []).append(c.to_edge)
        onward.setdefault(c.to_edge, [])
        metres = network.over_m(c)
        pair = (c.from_edge, c.to_edge)
        through[pair] = min(metres, through.get(pair, metres))
    closed = [
        part
        for part in strong_parts(onward)
        if len(part) > 1 or any((edge, edge) in through for edge in part)
    ]
    closed.sort(key=lambda part: (len(part), min(part)), reverse=True)
    return tuple(_part(network, part, through) for part in closed)


def strong_parts(onward: Mapping[N, Sequence[N]]) -> list[set[N]]:
    """Return the strongly connected parts of a graph, given the next nodes of each node; O(nodes + edges).

    Tarjan's algorithm (1972) without recursion. Most runs would load networkx for nothing else: a tenth of
    the time to their first step.

    Examples
    --------
    >>> [sorted(part) for part in strong_parts({"a": "b", "b": "ac", "c": ""})]
    [['c'], ['a', 'b']]
    """
    found: dict[N, int] = {}
    least: dict[N, int] = {}
    """The first found node of the stack that is known to be reached from each node of the stack."""
    stack: list[N] = []
    parts: list[set[N]] = []
    for root in onward:
        todo = [] if root in found else [(root, iter(onward[root]))]
        while todo:
            node, rest = todo[-1]
            if node not in found:
                found[node] = least[node] = len(found)
                stack.append(node)
            for other in rest:
                if other not in found:
                    todo.append((other, iter(onward[other])))
                    break
                if other in least:
                    least[node] = min(least[node], least[other])
            else:
                todo.pop()
                if least[node] == found[node]:
                    at = stack.index(node)
                    parts.append(set(stack[at:]))
                    for one in stack[at:]:
                        del least[one]
                    del stack[at:]
                elif todo:
                    before = todo[-1][0]
                    least[before] = min(least[before], least[node])
    return parts


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
