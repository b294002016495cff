"""Streets: edges with the opposite direction of the same road."""

from collections.abc import Collection, Sequence

from loopgate.network.records import Edge
from loopgate.network.road import RoadNetwork

_SAME_STREET = 0.2
"""Two directions of a street differ in length by at most this share."""


def both_ways(network: RoadNetwork, edges: Sequence[str], apart: Collection[str] = ()) -> list[list[str]]:
    """Return the edges by street: both directions together, or alone.

    An edge stands alone if its opposite is not among the edges, or if either of the two is in `apart`.
    """
    alone = set(apart)
    waiting: dict[tuple[str, str], list[str]] = {}
    streets: list[list[str]] = []
    for edge in edges:
        ends = network.edges[edge].from_junction, network.edges[edge].to_junction
        other = _opposite(network.edges[edge], waiting.get((ends[1], ends[0]), ()), network)
        if other is not None and alone & {edge, other}:
            streets.append([edge])
            waiting[ends[1], ends[0]].remove(other)
        elif other is None:
            streets.append([edge])
            waiting.setdefault(ends, []).append(edge)
        else:
            waiting[ends[1], ends[0]].remove(other)
            next(street for street in streets if street == [other]).append(edge)
    return streets


def _opposite(edge: Edge, others: Sequence[str], network: RoadNetwork) -> str | None:
    """Return the opposite edge between the same junctions, of about the same length."""
    for other in others:
        if abs(network.edges[other].length_m - edge.length_m) <= _SAME_STREET * edge.length_m:
            return other
    return None
