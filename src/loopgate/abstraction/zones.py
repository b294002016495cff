"""Zones from collision segments: stretches of loops that admit one vehicle at a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from loopgate.abstraction.collision_segments import CollisionSegments
from loopgate.errors import RouteError
from loopgate.network.contacts import merge_intervals
from loopgate.network.loop import Loop

if TYPE_CHECKING:
    from networkx.utils import UnionFind

_TOUCH_M = 1e-6


@dataclass(frozen=True, slots=True)
class ZoneVisit:
    """The passage of a path through a zone, in arc length [m]; ``end_m`` may exceed the loop's length."""

    begin_m: float
    end_m: float
    zone: int

    @property
    def length_m(self) -> float:
        """Length on the path [m]."""
        return self.end_m - self.begin_m


@dataclass(frozen=True, slots=True)
class Zones:
    """The collision states of all paths."""

    visits: tuple[tuple[ZoneVisit, ...], ...]
    """For each loop its visits in driving order. Visits do not overlap, but may touch. Zones are numbered
    from 0 in the order in which the loops meet them."""
    merged: tuple[tuple[str, ...], ...]
    """Pairs of zones that followed each other on two paths and became one (Proposition 1), as the ids of the
    loops concerned."""


def make_zones(loops: Sequence[Loop], segments: CollisionSegments, need_m: float) -> Zones:
    """Merge collision segments into zones, and extend the zones so that vehicles can stop before them.

    Segments of a collision pair are one zone, and so are segments that overlap on one path (Zhou et al. 2020,
    Section 3.2, Step 1; union-find over all paths). Then, until nothing changes, each path's visits grow by
    the rules of `cover`, visits that overlap become one, and two zones that follow each other on two paths
    become one (Proposition 1). Zones only grow, so earlier results stay valid.

    `need_m`: length that a standing vehicle takes. Every visit, and every private stretch between visits, has
    at least this length. Raises `RouteError` if a loop is shorter than `need_m` or has no lane on which a
    vehicle can be held.
    """
    for loop in loops:
        if loop.length_m < need_m:
            msg = (
                f"loop {loop.id}: {loop.length_m:.1f} m are too short for a vehicle that needs {need_m:.1f} m"
            )
            raise RouteError(msg)
    union, paths = _overlaps(loops, segments)
    merged: list[tuple[str, ...]] = []
    while True:
        before = paths
        paths = [cover(loop, path, need_m, union) for loop, path in zip(loops, paths, strict=True)]
        merged += _proposition_1(loops, paths, union)
        names = [tuple(replace(v, zone=union[v.zone]) for v in path) for path in paths]
        if all(_same(one, other) for one, other in zip(names, before, strict=True)):
            return _numbered(names, merged)
        paths = names


def cover(
    loop: Loop, visits: Iterable[ZoneVisit], need_m: float, union: UnionFind[int]
) -> tuple[ZoneVisit, ...]:
    """Extend the zone visits on a path so that a vehicle can stop before each.

    A vehicle waits with its front at the end of a state, so states end where SUMO can hold a vehicle. A visit
    begins at or before its true beginning and ends at or after its true end, at such a point. Private road
    shorter than `need_m` goes to the visit after it. A visit shorter than `need_m` grows upstream into
    private road, then downstream; otherwise it joins the shorter of the visits that it touches. Visits that
    overlap become one.

    Parameters
    ----------
    visits
        In any order.
    need_m
        Length that a standing vehicle takes [m].
    union
        Knows which zones are one; gets the zones that become one.
    """
    path = sorted(visits, key=_where)
    while True:
        grown = _join(loop, path, union)
        for step in (_round_out, _close_gaps, _lengthen):
            grown = _join(loop, step(loop, grown, need_m, union), union)
        if _same(grown, path):
            return tuple(grown)
        path = grown


def _where(visit: ZoneVisit) -> tuple[float, float]:
    return visit.begin_m, visit.end_m


def _same(one: Sequence[ZoneVisit], other: Sequence[ZoneVisit]) -> bool:
    return len(one) == len(other) and all(
        a.zone == b.zone and abs(a.begin_m - b.begin_m) < _TOUCH_M and abs(a.end_m - b.end_m) < _TOUCH_M
        for a, b in zip(one, other, strict=True)
    )


def _overlaps(
    loops: Sequence[Loop], segments: CollisionSegments
) -> tuple[UnionFind[int], list[tuple[ZoneVisit, ...]]]:
    """Unite segments that overlap on one path, and the segments of each pair."""
    from networkx.utils import UnionFind  # noqa: PLC0415  most runs do without it

    # A negative distance: segments that merely touch, being related to different robots, stay two.
    row, begin, end, path = merge_intervals(
        segments.path, segments.begin_m, segments.end_m, join=-2.0 * _TOUCH_M
    )
    union = UnionFind(range(len(begin)))
    links = np.unique(row[segments.pairs], axis=0) if len(segments.pairs) else segments.pairs
    for one, other in links.tolist():
        union.union(one, other)
    paths: list[list[ZoneVisit]] = [[] for _ in loops]
    for k, (b, e, i) in enumerate(zip(begin.tolist(), end.tolist(), path.tolist(), strict=True)):
        paths[i].append(ZoneVisit(b, e, k))
    return union, [tuple(found) for found in paths]


def _join(loop: Loop, path: Iterable[ZoneVisit], union: UnionFind[int]) -> list[ZoneVisit]:
    """Merge visits that overlap, and visits of one zone that touch; sort by beginning."""
    lap = loop.length_m
    found: list[ZoneVisit] = []
    for visit in sorted((_first_lap(v, lap) for v in path), key=_where):
        if found and _belong(found[-1], visit, union):
            found[-1] = _united(found[-1], visit, union)
        else:
            found.append(visit)
    while len(found) > 1:  # the last may reach over the loop's beginning into the first ones
        first = replace(found[0], begin_m=found[0].begin_m + lap, end_m=found[0].end_m + lap)
        if not _belong(found[-1], first, union):
            break
        found[-1] = _united(found[-1], first, union)
        del found[0]
    if len(found) == 1 and found[0].length_m > lap - _TOUCH_M:
        end = loop.hold_before(lap)
        return [ZoneVisit(end - lap, end, union[found[0].zone])]
    return [replace(v, zone=union[v.zone]) for v in found]


def _first_lap(visit: ZoneVisit, lap_m: float) -> ZoneVisit:
    if visit.length_m > lap_m - _TOUCH_M or 0.0 <= visit.begin_m < lap_m:
        return visit
    shift = visit.begin_m % lap_m - visit.begin_m
    return replace(visit, begin_m=visit.begin_m + shift, end_m=visit.end_m + shift)


def _belong(one: ZoneVisit, following: ZoneVisit, union: UnionFind[int]) -> bool:
    if following.begin_m < one.end_m - _TOUCH_M:
        return True
    return following.begin_m <= one.end_m + _TOUCH_M and union[one.zone] == union[following.zone]


def _united(one: ZoneVisit, following: ZoneVisit, union: UnionFind[int]) -> ZoneVisit:
    union.union(one.zone, following.zone)
    return replace(one, end_m=max(one.end_m, following.end_m))


def _round_out(loop: Loop, path: list[ZoneVisit], need_m: float, union: UnionFind[int]) -> list[ZoneVisit]:
    del need_m, union
    return [replace(v, begin_m=loop.hold_before(v.begin_m), end_m=loop.hold_after(v.end_m)) for v in path]


def _close_gaps(loop: Loop, path: list[ZoneVisit], need_m: float, union: UnionFind[int]) -> list[ZoneVisit]:
    del union
    found = []
    for number, visit in enumerate(path):
        free = _free_before(loop, path, number)
        begin = visit.begin_m - free if _TOUCH_M < free < need_m else visit.begin_m
        found.append(replace(visit, begin_m=begin))
    return found


def _lengthen(loop: Loop, path: list[ZoneVisit], need_m: float, union: UnionFind[int]) -> list[ZoneVisit]:
    """Extend the first visit that is too short; the caller repeats this until none is."""
    for number, visit in enumerate(path):
        missing = need_m - visit.length_m
        if missing <= _TOUCH_M:
            continue
        free = _free_before(loop, path, number)
        if free > _TOUCH_M:
            begin = loop.hold_before(visit.begin_m - missing)
            if begin - (visit.begin_m - free) < need_m:  # what is left would be too short for a state
                begin = visit.begin_m - free
            return [*path[:number], replace(visit, begin_m=begin), *path[number + 1 :]]
        after = (number + 1) % len(path)
        free = _free_before(loop, path, after)
        if free > _TOUCH_M:
            end = loop.hold_after(visit.end_m + missing)
            if visit.end_m + free - end < need_m:
                end = visit.end_m + free
            return [*path[:number], replace(visit, end_m=end), *path[number + 1 :]]
        neighbour = min(path[number - 1], path[after], key=lambda v: v.length_m)
        union.union(visit.zone, neighbour.zone)
        return path
    return path


def _free_before(loop: Loop, path: list[ZoneVisit], number: int) -> float:
    """Return the length of private road between a visit and the visit before it [m]."""
    before = path[number - 1].end_m - (loop.length_m if number == 0 else 0.0)
    return path[number].begin_m - before


def _proposition_1(
    loops: Sequence[Loop], paths: Sequence[Sequence[ZoneVisit]], union: UnionFind[int]
) -> list[tuple[str, ...]]:
    """Unite zones that follow each other on two paths; return the loops concerned."""
    colours: dict[tuple[int, int], list[int]] = {}
    for i, (loop, path) in enumerate(zip(loops, paths, strict=True)):
        for number, visit in enumerate(path):
            one, other = sorted((union[path[number - 1].zone], union[visit.zone]))
            if one != other and _free_before(loop, list(path), number) <= _TOUCH_M:
                users = colours.setdefault((one, other), [])
                if i not in users:
                    users.append(i)
    merged = []
    for (one, other), users in colours.items():
        if len(users) > 1:
            union.union(one, other)
            merged.append(tuple(loops[i].id for i in users))
    return merged


def _numbered(paths: Sequence[Sequence[ZoneVisit]], merged: Sequence[tuple[str, ...]]) -> Zones:
    number: dict[int, int] = {}
    visits = tuple(
        tuple(replace(v, zone=number.setdefault(v.zone, len(number))) for v in path) for path in paths
    )
    return Zones(visits, tuple(merged))
