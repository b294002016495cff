"""Which movements over junctions conflict, and where they touch: by geometry, and by the request matrix."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

from loopgate.network.contacts import lane_contacts
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork

__all__ = ["REACH_M", "Conflicts", "cut_corners", "find_conflicts", "reach_m"]

REACH_M = 2.2
"""Centre lines nearer than this conflict [m]: cars are 1.8 m wide in SUMO, oncoming lanes lie 3.2 m apart."""

_SIDE_M = 0.4
"""What two vehicles keep between their sides at least [m]."""


_LONG_M = 6.0
"""Longer vehicles cut corners. Bodies of this length on movements that are listed but do not come near each
other were half a metre apart or more, wherever they were, on thousands of pairs in two cities and nine
generated networks."""


def cut_corners(lengths_m: Iterable[float]) -> bool:
    """Return whether vehicles of these lengths swing out so far that centre lines do not tell who meets."""
    return max(lengths_m, default=0.0) > _LONG_M


def reach_m(widths_m: Iterable[float]) -> float:
    """Return how near centre lines conflict [m] where vehicles of these widths drive; for cars, `REACH_M`."""
    return max(REACH_M, max(widths_m, default=0.0) + _SIDE_M)


Overlap = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Conflicts:
    """The conflicts among movements.

    Attributes
    ----------
    foes
        By movement id: the movements in conflict with it. Symmetric.
    overlaps
        By movement id, then foe: between which metres after the movement's beginning the two can touch.
        Missing where geometry does not show the conflict.
    lengths_m, speeds_mps
        Length, and lowest speed limit until the rear is past it, the next lane's included, by movement id.
    unlisted
        Conflicts that the geometry shows and the request matrix does not list.
    """

    foes: Mapping[str, frozenset[str]]
    overlaps: Mapping[str, Mapping[str, Overlap]]
    lengths_m: Mapping[str, float]
    speeds_mps: Mapping[str, float]
    unlisted: tuple[tuple[str, str], ...]


def find_conflicts(
    network: RoadNetwork,
    movements: Iterable[Connection],
    *,
    reach_m: float = REACH_M,
    all_listed: bool = False,
) -> Conflicts:
    """Find the conflicts among movements.

    Movements from one lane follow each other and do not conflict. All others of one junction conflict if
    their internal lanes come within `reach_m` of each other, or if they end on one lane. Then they touch
    until the end: the second must find the first ahead, not beside.

    The junction's request matrix lists more, mostly movements to neighbouring lanes of one edge, which never
    come near each other. Vehicles under a gate do not change lanes there, and SUMO's drivers stop only for
    whom they could meet. These conflict if `all_listed`, for vehicles that `cut_corners`, and where the
    network has no internal lanes to look at.

    O(n log n + k) for n pieces of internal lanes with k near pairs.
    """
    by_id = {movement.id: movement for movement in movements}
    lengths = {m.id: sum(network.lanes[lane].length_m for lane in m.via) for m in by_id.values()}
    owner = _owners(network, by_id.values())
    foes: dict[str, set[str]] = {name: set() for name in by_id}
    overlaps: dict[str, dict[str, Overlap]] = {name: {} for name in by_id}
    pairs = list(_pairs(network, by_id.values()))
    known = {frozenset(pair.ids) for pair in pairs if pair.listed or pair.certain}
    for pair in pairs:
        if pair.certain or (pair.listed and all_listed):
            _add(foes, *pair.ids)
    unlisted: set[tuple[str, str]] = set()
    for x, y, mine, theirs in _touching(network, owner, reach_m):
        (one, one_at), (other, other_at) = owner[x], owner[y]
        if not _may_meet(by_id[one], by_id[other]):
            continue
        _add(foes, one, other)
        if frozenset((one, other)) not in known:
            unlisted.add((one, other))
        x_m, y_m = network.lanes[x].length_m, network.lanes[y].length_m
        _widen(overlaps[one], other, one_at + mine[0] * x_m, one_at + mine[1] * x_m)
        _widen(overlaps[other], one, other_at + theirs[0] * y_m, other_at + theirs[1] * y_m)
    for one, touching in overlaps.items():
        for other, (begin, end) in touching.items():
            if _same_end(by_id[one], by_id[other]):
                touching[other] = (begin, max(end, lengths[one]))
    return Conflicts(
        foes={name: frozenset(found) for name, found in foes.items()},
        overlaps=overlaps,
        lengths_m=lengths,
        speeds_mps={
            m.id: min(network.lanes[lane].speed_mps for lane in (*m.via, f"{m.to_edge}_{m.to_lane}"))
            for m in by_id.values()
        },
        unlisted=tuple(sorted(unlisted)),
    )


def _owners(network: RoadNetwork, movements: Iterable[Connection]) -> dict[str, tuple[str, float]]:
    """Return the movement of each internal lane, and how far from its beginning that lane begins [m]."""
    owner: dict[str, tuple[str, float]] = {}
    for movement in movements:
        driven = 0.0
        for lane in movement.via:
            owner[lane] = (movement.id, driven)
            driven += network.lanes[lane].length_m
    return owner


def _touching(
    network: RoadNetwork, lanes: Iterable[str], reach_m: float
) -> Iterator[tuple[str, str, Overlap, Overlap]]:
    """Yield pairs of lanes, and the stretches of each, as fractions, that are near the other."""
    shapes = {lane: network.lanes[lane].shape for lane in lanes}
    if not shapes:
        return
    found = lane_contacts(shapes, reach_m)
    for k in range(len(found.one)):
        x, y = found.lanes[found.one[k]], found.lanes[found.other[k]]
        mine = float(found.one_begin[k]), float(found.one_end[k])
        yield x, y, mine, (float(found.other_begin[k]), float(found.other_end[k]))


class _Pair(NamedTuple):
    """Two movements that may meet on a junction: if its matrix lists them, and if they conflict for sure."""

    ids: tuple[str, str]
    listed: bool
    certain: bool


def _pairs(network: RoadNetwork, movements: Iterable[Connection]) -> Iterator[_Pair]:
    at: dict[str, list[Connection]] = {}
    for movement in movements:
        at.setdefault(movement.junction, []).append(movement)
    for together in at.values():
        for one, other in combinations(together, 2):
            if _may_meet(one, other):
                listed = network.are_foes(one, other) or network.are_foes(other, one)
                # Networks without internal lanes have no geometry and often no matrix: be safe.
                certain = _same_end(one, other) or not one.via or not other.via
                yield _Pair((one.id, other.id), listed, certain)


def _add(foes: Mapping[str, set[str]], one: str, other: str) -> None:
    foes[one].add(other)
    foes[other].add(one)


def _may_meet(one: Connection, other: Connection) -> bool:
    same_origin = one.from_edge == other.from_edge and one.from_lane == other.from_lane
    return one.junction == other.junction and not same_origin


def _same_end(one: Connection, other: Connection) -> bool:
    return one.to_edge == other.to_edge and one.to_lane == other.to_lane


def _widen(touching: dict[str, Overlap], foe: str, begin: float, end: float) -> None:
    known = touching.get(foe)
    touching[foe] = (begin, end) if known is None else (min(begin, known[0]), max(end, known[1]))
