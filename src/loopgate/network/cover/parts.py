"""Divides a network with too many streets for one search into parts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median

from loopgate.network.cover.design import CoverTask, coverable, wanted_edges
from loopgate.network.road import RoadNetwork

__all__ = ["MOST_BYTES", "MOST_STREETS", "CoverPart", "parts", "search_bytes"]

MOST_STREETS = 3_200
"""More streets than that are covered in parts: time and memory of a search grow with their square."""

MOST_BYTES = 3_000_000_000
"""A search that needs more memory is refused before it begins [bytes]."""

_BYTES_OF_TWO = 34
"""What a search keeps for each two streets: their distance four times, once for the search in reverse order,
and the street before [bytes]; measured 33 to 34 at the most."""

_MARGIN = 0.25
"""Loops of a part may leave its rectangle by this share of the longer side."""

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class CoverPart:
    """A rectangle of a large network: the streets to cover in it, and the streets its loops may use."""

    edges: tuple[str, ...]
    around: frozenset[str] | None
    """Edges that the loops may use; all edges if None."""


def parts(network: RoadNetwork, task: CoverTask, count: int, most: int = MOST_STREETS) -> list[CoverPart]:
    """Divide the streets to cover into rectangles with at most `most` streets each; O(n log n).

    A rectangle with too many streets is cut at the median of its longer side, repeatedly. The two directions
    of a street stay together. The loops of a part stay near it, unless some streets could then not be
    reached.

    Parameters
    ----------
    network, task
        The roads, and the streets to cover.
    count
        Number of loops, and so the largest number of parts, unless the task bounds the length of loops.
    most
        Largest number of streets in a part.

    Examples
    --------
    >>> from loopgate.network import RoadNetwork
    >>> drt = RoadNetwork.open("sumo:DRT")
    >>> [len(part.edges) for part in parts(drt, CoverTask(), 4, most=500)]
    [370, 370]
    """
    wanted = tuple(wanted_edges(network, task))
    few = count if math.isinf(task.longest) else len(wanted)
    if len(wanted) <= most or few == 1:
        return [CoverPart(wanted, None)]
    at = {edge: _middle(network, edge) for edge in network.edges}
    pieces: list[Sequence[str]] = [wanted]
    while len(pieces[0]) > most and len(pieces) < few:
        halves = _halves(pieces[0], at)
        if not all(halves):
            break
        pieces = sorted((*pieces[1:], *halves), key=len, reverse=True)
    whole = set(coverable(network, task))
    return [CoverPart(tuple(piece), _around(network, task, piece, at, whole)) for piece in pieces]


def search_bytes(streets: int) -> int:
    """Return how much memory a search takes at the most, for so many streets in one part [bytes].

    Examples
    --------
    >>> f"{search_bytes(3_200) / 1e9:.1f} GB, {search_bytes(25_000) / 1e9:.0f} GB"
    '0.3 GB, 21 GB'
    """
    return _BYTES_OF_TWO * streets * streets


def _middle(network: RoadNetwork, edge: str) -> tuple[float, float]:
    ends = network.edges[edge].from_junction, network.edges[edge].to_junction
    one, other = (network.junctions[end] for end in ends)
    return (one.x + other.x) / 2, (one.y + other.y) / 2


def _box(edges: Sequence[str], at: dict[str, tuple[float, float]]) -> Box:
    x, y = zip(*(at[edge] for edge in edges), strict=True)
    return min(x), min(y), max(x), max(y)


def _halves(edges: Sequence[str], at: dict[str, tuple[float, float]]) -> tuple[list[str], list[str]]:
    west, south, east, north = _box(edges, at)
    axis = 0 if east - west >= north - south else 1
    middle = median(at[edge][axis] for edge in edges)
    near = [edge for edge in edges if at[edge][axis] < middle]
    return near, [edge for edge in edges if at[edge][axis] >= middle]


def _around(
    network: RoadNetwork,
    task: CoverTask,
    edges: Sequence[str],
    at: dict[str, tuple[float, float]],
    whole: set[str],
) -> frozenset[str] | None:
    """Return the edges near a part, or None if loops over these do not cover all that can be covered."""
    west, south, east, north = _box(edges, at)
    more = _MARGIN * max(east - west, north - south)
    near = frozenset(
        edge
        for edge, (x, y) in at.items()
        if west - more <= x <= east + more and south - more <= y <= north + more
    )
    reached = coverable(network, replace(task, edges=tuple(edges), around=near))
    return near if whole.intersection(edges) <= set(reached) else None
