"""The graph of edges for one vehicle class; all loops lie in its strongly connected parts."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from loopgate.network.road import RoadNetwork


@dataclass(frozen=True, slots=True)
class Road:
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
    roads: tuple[Road, ...]

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
        metres = network.over_m(c)
        pair = (c.from_edge, c.to_edge)
        through[pair] = min(metres, through.get(pair, metres))
    closed = [
        part
        for part in strongly_connected(onward)
        if len(part) > 1 or any((edge, edge) in through for edge in part)
    ]
    closed.sort(key=lambda part: (len(part), min(part)), reverse=True)
    return tuple(_part(network, part, through) for part in closed)


def strongly_connected(onward: Mapping[str, Collection[str]]) -> list[set[str]]:
    """Return the strongly connected sets of nodes; O(nodes + arcs), by Kosaraju's two searches.

    Every start of a run on random loops asks this; networkx takes longer to load than the whole of it.

    Parameters
    ----------
    onward
        The nodes to which arcs lead from each node; a node without arcs may be missing.
    """
    back: dict[str, list[str]] = {}
    for tail, heads in onward.items():
        for head in heads:
            back.setdefault(head, []).append(tail)
    done: set[str] = set()
    order = [node for start in onward for node in _search(start, onward, done)]
    done.clear()
    return [part for node in reversed(order) if (part := set(_search(node, back, done)))]


def _search(start: str, onward: Mapping[str, Collection[str]], done: set[str]) -> list[str]:
    """Return the nodes that a search in depth reaches, each after the nodes beyond it; add them to `done`.

    It stops at nodes that are done.
    """
    order: list[str] = []
    trail = [] if start in done else [(start, iter(onward.get(start, ())))]
    done.add(start)
    while trail:
        node, ahead = trail[-1]
        following = next((other for other in ahead if other not in done), None)
        if following is None:
            order.append(node)
            trail.pop()
        else:
            done.add(following)
            trail.append((following, iter(onward.get(following, ()))))
    return order


def _part(network: RoadNetwork, inside: set[str], through: dict[tuple[str, str], float]) -> RoadGraph:
    # The file's order, not the hash's, so that the same seed finds the same loops.
    edges = tuple(edge for edge in network.edges if edge in inside)
    number = {edge: k for k, edge in enumerate(edges)}
    roads = tuple(
        Road(
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
