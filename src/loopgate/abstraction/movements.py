"""Which movements over junctions conflict, and where they touch: request matrix and geometry together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from loopgate.network.contacts import lane_contacts
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork

__all__ = ["REACH_M", "Conflicts", "find_conflicts", "reach_m"]

REACH_M = 2.2
"""Centre lines nearer than this conflict [m]: cars are 1.8 m wide in SUMO, oncoming lanes lie 3.2 m apart."""

_SIDE_M = 0.4
"""What two vehicles keep between their sides at least [m]."""


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
        Missing where only the request matrix knows of the conflict.
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
    network: RoadNetwork, movements: Iterable[Connection], *, reach_m: float = REACH_M
) -> Conflicts:
    """Find the conflicts among movements.

    Movements from one lane follow each other and do not conflict. All others of one junction conflict if
    the junction's request matrix says so or if their internal lanes come within `reach_m` of each other.
    Where two end on one lane they touch until the end: the second must find the first ahead, not beside.

    O(n log n + k) for n pieces of internal lanes with k near pairs.
    """
    by_id = {movement.id: movement for movement in movements}
    lengths = {m.id: sum(network.lanes[lane].length_m for lane in m.via) for m in by_id.values()}
    owner: dict[str, tuple[str, float]] = {}
    for movement in by_id.values():
        driven = 0.0
        for lane in movement.via:
            owner[lane] = (movement.id, driven)
            driven += network.lanes[lane].length_m
    foes: dict[str, set[str]] = {name: set() for name in by_id}
    overlaps: dict[str, dict[str, Overlap]] = {name: {} for name in by_id}
    for one, other in _listed(network, by_id.values()):
        foes[one].add(other)
        foes[other].add(one)
    unlisted: set[tuple[str, str]] = set()
    for x, y, mine, theirs in _touching(network, owner, reach_m):
        (one, one_at), (other, other_at) = owner[x], owner[y]
        if not _may_meet(by_id[one], by_id[other]):
            continue
        if other not in foes[one]:
            unlisted.add((one, other))
            foes[one].add(other)
            foes[other].add(one)
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


def _listed(network: RoadNetwork, movements: Iterable[Connection]) -> Iterable[tuple[str, str]]:
    at: dict[str, list[Connection]] = {}
    for movement in movements:
        at.setdefault(movement.junction, []).append(movement)
    for together in at.values():
        for k, one in enumerate(together):
            for other in together[k + 1 :]:
                if not _may_meet(one, other):
                    continue
                listed = network.are_foes(one, other) or network.are_foes(other, one)
                # Networks without internal lanes have no geometry and often no matrix: be safe.
                if listed or _same_end(one, other) or not one.via or not other.via:
                    yield one.id, other.id


def _may_meet(one: Connection, other: Connection) -> bool:
    same_origin = one.from_edge == other.from_edge and one.from_lane == other.from_lane
    return one.junction == other.junction and not same_origin


def _same_end(one: Connection, other: Connection) -> bool:
    return one.to_edge == other.to_edge and one.to_lane == other.to_lane


def _widen(touching: dict[str, Overlap], foe: str, begin: float, end: float) -> None:
    known = touching.get(foe)
    touching[foe] = (begin, end) if known is None else (min(begin, known[0]), max(end, known[1]))
