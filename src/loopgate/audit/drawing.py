"""Find where bodies on different ways touch, from the drawn lanes alone: not with the gate's computation."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
import shapely

from loopgate.arrays import Flags, Floats, Ints
from loopgate.audit.drawn_bodies import NEAR_M, LaneOnWay, draw_bodies, drawn_alike, find_ways
from loopgate.audit.layout import Layout, ground_key
from loopgate.audit.parted import Parted
from loopgate.cache import Cache

_LEAST_M = 0.1
"""Stretches shorter than this are left out: only corners of the bodies touch there [m]."""

_APART_M = 2.0
"""Fronts farther apart than this belong to different stretches [m]."""

_ABOVE_M = 2.5
"""Lanes this far above each other do not meet [m]."""


@dataclass(frozen=True, slots=True)
class DrawnConflict:
    """A stretch of a loop on which bodies can touch bodies on another lane.

    The front of a body can touch from `begin_m` on, its rear up to `end_m`: arc lengths [m]. `movement` and
    `foe` are the lanes of the two fronts. Bodies on these lanes can touch in several zones, for example at
    both ends of the lanes, and a bus touches a car elsewhere than another bus: `zone` is the number of this
    zone.
    """

    movement: str
    foe: str
    begin_m: float
    end_m: float
    zone: int = 0


class Side(NamedTuple):
    """One of two groups of bodies that touch each other: its loop and the lane of its fronts.

    `begin_m`: the first front; `end_m`: the last rear [m]. `fronts_m`: the distance from the first to the
    last front [m]. `waits`: whether any of these bodies lies in a place, between its beginning and its stop
    line. `shortest`: whether the bodies have the least length on this way. `under`: the numbers of the lanes
    on which parts of these bodies can lie. `length_m`: their length [m].
    """

    loop: str
    lane: str
    begin_m: float
    end_m: float
    fronts_m: float
    waits: bool
    shortest: bool
    under: frozenset[int] = frozenset()
    length_m: float = math.inf


class Meeting(NamedTuple):
    """A zone in which bodies on two ways touch, with the loops on each way and their offsets [m]."""

    one: Side
    other: Side
    loops: tuple[Mapping[str, float], Mapping[str, float]]


Drawn = Sequence[Meeting]


def find_meetings(layout: Layout) -> list[Meeting]:
    """Find where bodies can touch, unless one of them follows the other.

    A body is a rectangle from its front towards its rear on its way. Bodies on one lane are not compared, nor
    bodies on lanes beside each other on one edge: SUMO keeps these apart. Ways on which bodies look the same
    are drawn once. Which body follows which depends on the lanes before and behind, so this is computed for
    each two ways.

    The result for the last layout is cached: runs of one demand under several gates, or with several starts,
    have the same layout.
    """
    return _KEPT.get(ground_key(layout), lambda: _find_meetings(layout))


_KEPT: Cache[list[Meeting]] = Cache(1)


def _find_meetings(layout: Layout) -> list[Meeting]:
    numbers: dict[str, int] = {}
    ways = find_ways(layout, numbers)
    names = list(numbers)
    lanes_of_roads = {number for name, number in numbers.items() if not name.startswith(":")}
    unregulated = {numbers[lane] for lane in layout.unregulated}
    roads = _Roads(lanes_of_roads, unregulated, Parted(layout, names, lanes_of_roads))
    alike = drawn_alike(layout, ways)
    bodies, shapes = draw_bodies(layout, [ways[some[0]] for some in alike])
    if not len(shapes):
        return []
    edges = [name.rpartition("_")[0] for name in names]
    lanes = [ways[some[0]].lane for some in alike]
    columns = _Bodies(*(np.array(column) for column in zip(*bodies, strict=True)))
    found: list[Meeting] = []
    on = np.array([names[lanes[body.way]] for body in bodies])
    for touching in _touching(shapes, [lanes[body.way] for body in bodies], edges):
        pairs = touching[:, ~_on_bridges(layout, on, shapes, touching)]
        if not pairs.size:
            continue
        for one, other in _by_kind(columns, pairs):
            v, w = alike[one.way], alike[other.way]
            if not lies_above(layout, names[lanes[one.way]], names[lanes[other.way]]):
                found += _meet_all(ways, roads, names, (v, w), (one, other))
    return found


class _Bodies(NamedTuple):
    """Bodies as columns of the fields of `Body`.

    In a group of bodies with the same way and the same length, `way` and `length_m` are single numbers.
    """

    way: Any
    at_m: Any
    length_m: Any
    rear_lane: Any
    waits: Any


def _by_kind(columns: _Bodies, pairs: Ints) -> Iterator[tuple[_Bodies, _Bodies]]:
    """Yield the pairs of bodies in groups: in each, the ways and the lengths are the same."""
    keys = [column[side] for side in pairs for column in (columns.length_m, columns.way)]
    order = np.lexsort(keys)
    changes = np.any([np.diff(key[order]) != 0 for key in keys], axis=0)
    for some in np.split(order, np.flatnonzero(changes) + 1):
        one, other = (
            _Bodies(int(way[0]), at_m, float(length_m[0]), rear, waits)
            for way, at_m, length_m, rear, waits in (
                [column[side[some]] for column in columns] for side in pairs
            )
        )
        yield one, other


def _meet_all(
    ways: Sequence[LaneOnWay],
    roads: _Roads,
    names: Sequence[str],
    alike: tuple[Sequence[int], Sequence[int]],
    bodies: tuple[_Bodies, _Bodies],
) -> Iterator[Meeting]:
    """Yield the zones where bodies of two groups meet, for each two ways on which bodies look like that."""
    known: dict[bytes, list[tuple[Side, Side]]] = {}
    every = np.ones(len(bodies[0].at_m), dtype=bool)
    for v in alike[0]:
        for w in alike[1]:
            mine, theirs = ways[v], ways[w]
            apart = mine.window.keys().isdisjoint(theirs.window)
            meet = every if apart else ~_follow(mine, theirs, roads, *bodies)
            key = meet.tobytes()
            if key not in known:
                known[key] = list(_zones(mine, theirs, names, bodies, np.flatnonzero(meet)))
            for one, other in known[key]:
                first, second = next(iter(mine.loops)), next(iter(theirs.loops))
                sides = one._replace(loop=first), other._replace(loop=second)
                yield Meeting(*sides, (mine.loops, theirs.loops))


def _touching(shapes: Any, lanes: Sequence[int], edges: Sequence[str]) -> Iterator[Ints]:  # noqa: ANN401
    """Yield the pairs of bodies that touch, on different lanes that do not lie beside each other on one edge.

    Only roads whose bounding boxes overlap are compared, and of each road only the bodies inside the box of
    the other: most bodies touch only bodies of their own road. Each array is of two roads, of shape (2,
    pairs); the first body of a pair has the lower number.
    """
    codes: dict[str | int, int] = {}
    roads = [n if edge.startswith(":") else edge for n, edge in enumerate(edges)]
    road = np.array([codes.setdefault(name, len(codes)) for name in roads])[np.asarray(lanes)]
    order = np.argsort(road, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(road[order])) + 1)
    bounds = shapely.bounds(shapes)
    boxes = np.array([[*bounds[part, :2].min(axis=0), *bounds[part, 2:].max(axis=0)] for part in parts])
    near, other = shapely.STRtree(shapely.box(*boxes.T)).query(shapely.box(*boxes.T))
    for a, b in zip(near[near < other].tolist(), other[near < other].tolist(), strict=True):
        one, two = (parts[x][_overlap(bounds[parts[x]], boxes[y])] for x, y in ((a, b), (b, a)))
        i, j = shapely.STRtree(shapes[one]).query(shapes[two], predicate="intersects")
        if len(i):
            yield np.sort(np.stack((two[i], one[j])), axis=0)


def _overlap(boxes: Floats, box: Floats) -> Flags:
    """Return which of some boxes (left, bottom, right, top) overlap another box."""
    low, high = (boxes[:, :2] <= box[2:]), (boxes[:, 2:] >= box[:2])
    return cast("Flags", (low & high).all(axis=1))


def _zones(
    mine: LaneOnWay, theirs: LaneOnWay, names: Sequence[str], bodies: tuple[_Bodies, _Bodies], pairs: Ints
) -> Iterator[tuple[Side, Side]]:
    """Yield the pairs in groups of neighbouring fronts: two lanes can meet at both of their ends."""
    for part in _runs(bodies[0].at_m, pairs):
        for zone in _runs(bodies[1].at_m, part):
            one, other = _side(mine, names, bodies[0], zone), _side(theirs, names, bodies[1], zone)
            if min(one.fronts_m, other.fronts_m) >= _LEAST_M:
                yield one, other


def _runs(at_m: Floats, pairs: Ints) -> list[Ints]:
    ordered = pairs[np.argsort(at_m[pairs], kind="stable")]
    return np.split(ordered, np.flatnonzero(np.diff(at_m[ordered]) > _APART_M) + 1) if len(pairs) else []


def conflicts_by_loop(layout: Layout, drawn: Drawn) -> dict[str, list[DrawnConflict]]:
    """Return the stretches of each loop on which the shortest bodies can touch bodies on other lanes.

    Longer bodies swing out farther. Where these touch depends on each body, so that the rule *bodies* checks
    them from their rectangles.
    """
    found: dict[str, set[DrawnConflict]] = {name: set() for name in layout.loops}
    zones: dict[tuple[str, str], list[tuple[Side, Side]]] = {}
    for meeting in drawn:
        if not (meeting.one.shortest and meeting.other.shortest):
            continue
        one, other = sorted(meeting[:2], key=lambda side: side.lane)
        known = zones.setdefault((one.lane, other.lane), [])
        zone = next((k for k, (a, b) in enumerate(known) if _meet(a, one) and _meet(b, other)), len(known))
        if zone == len(known):
            known.append((one, other))
        sides = (meeting.one, meeting.other), (meeting.other, meeting.one)
        for (mine, foe), loops in zip(sides, meeting.loops, strict=True):
            for loop, off_m in loops.items():
                begin, end = mine.begin_m + off_m, mine.end_m + off_m
                found[loop].add(DrawnConflict(mine.lane, foe.lane, begin, end, zone))
    return {name: sorted(some, key=lambda c: (c.begin_m, c.end_m, c.foe)) for name, some in found.items()}


def _meet(one: Side, other: Side) -> bool:
    """Return whether two groups of fronts on one lane are near each other, and the bodies lie alike."""
    if (one.under, one.length_m) != (other.under, other.length_m):
        return False
    first, last = (one, other) if one.begin_m <= other.begin_m else (other, one)
    return last.begin_m - (first.begin_m + first.fronts_m) <= _APART_M


def _side(way: LaneOnWay, names: Sequence[str], bodies: _Bodies, some: Ints) -> Side:
    fronts, length_m = bodies.at_m[some], bodies.length_m
    return Side(
        loop=next(iter(way.loops)),
        lane=names[way.lane],
        begin_m=float(fronts.min()),
        end_m=float(fronts.max() - length_m),
        fronts_m=float(fronts.max() - fronts.min()),
        waits=bool(bodies.waits[some].any()),
        shortest=length_m == min(way.sizes)[0],
        under=frozenset(lane for at, lane in way.behind if at + way.lengths[lane] > -length_m),
        length_m=length_m,
    )


def _on_bridges(layout: Layout, on: Any, shapes: Any, pairs: Ints) -> Flags:  # noqa: ANN401
    """Return which pairs of bodies do not touch, since the road of one leads over that of the other there.

    `on`: the lane of each body's front.
    """
    above = np.zeros(pairs.shape[1], dtype=bool)
    if layout.bridges:
        there = shapely.centroid(shapely.intersection(*shapes[pairs]))
        for bridge in layout.bridges:
            above |= bridge.parts(on[pairs[0]], on[pairs[1]], shapely.get_x(there), shapely.get_y(there))
    return above


def lies_above(layout: Layout, one: str, other: str, at_m: tuple[float, float] | None = None) -> bool:
    """Return whether one of two lanes lies above the other: by their heights, or by a bridge at a point."""
    heights = layout.heights
    if at_m is not None:
        here, there, x_m, y_m = np.array([one]), np.array([other]), np.array([at_m[0]]), np.array([at_m[1]])
        if any(bridge.parts(here, there, x_m, y_m)[0] for bridge in layout.bridges):
            return True
    return one in heights and other in heights and abs(heights[one] - heights[other]) > _ABOVE_M


class _Roads(NamedTuple):
    """The lanes outside junctions, by number, and the lanes that lead to a junction without right of way.

    `parted`: how far behind a lane bodies on two ways follow each other.
    """

    lanes: AbstractSet[int]
    unregulated: AbstractSet[int]
    parted: Parted


def _follow(mine: LaneOnWay, theirs: LaneOnWay, roads: _Roads, one: _Bodies, other: _Bodies) -> Flags:
    """Return the pairs in which one body closely follows the other.

    Either both are on one way, and the whole of the first is ahead of the second; or both have just left one
    lane; or the rear of the first is on a lane of the way of the second.
    """
    here, there = mine.window, theirs.window
    follow = _is_behind_tail(mine, theirs, one, other) | _is_behind_tail(theirs, mine, other, one)
    if mine.lane in there or theirs.lane in here:
        off_m = here[theirs.lane] if theirs.lane in here else -there[mine.lane]
        gain = other.at_m + off_m - one.at_m
        for is_first, first, last in ((gain >= 0, other, mine), (gain < 0, one, theirs)):
            close = is_first & (np.abs(gain) - first.length_m < NEAR_M)
            for lane in set(first.rear_lane.tolist()) & last.window.keys():
                follow |= close & (first.rear_lane == lane)
    for lane, at_m in here.items():
        if at_m > 0.0 or there.get(lane, 1.0) > 0.0:
            continue
        s, t = one.at_m - at_m, other.at_m - there[lane]
        length_m = np.where(s >= t, one.length_m, other.length_m)
        # A driver still on that lane sees the vehicles ahead; on the road behind the junction, none behind.
        kept_m = math.inf
        if lane not in (mine.lane, theirs.lane):
            ends_m = [_kept_apart(way, roads, lane) - way.window[lane] for way in (mine, theirs)]
            kept_m = min(*ends_m, mine.lengths[lane] + roads.parted.behind_m(lane, mine, theirs))
        just_left = np.maximum(s, t) - length_m <= kept_m
        follow |= just_left & (np.abs(s - t) - length_m < NEAR_M)
    return follow


def _kept_apart(way: LaneOnWay, roads: _Roads, lane: int) -> float:
    """Return up to where SUMO keeps vehicles apart that left a lane on different ways [m].

    The road behind the junction begins there; infinity if the front has not reached that road. At a junction
    without right of way, it is the end of the lane.
    """
    at_m = way.window[lane]
    if lane in roads.unregulated:
        return at_m + way.lengths[lane]
    return min(
        (at for other, at in way.window.items() if at_m < at <= 0.0 and other in roads.lanes),
        default=math.inf,
    )


def _is_behind_tail(its: LaneOnWay, behind: LaneOnWay, first: _Bodies, last: _Bodies) -> Flags:
    """Return the pairs in which the first body's rear is close ahead of the second body's front, on its way.

    The way of the first may lead elsewhere: a driver in SUMO follows any body that still lies on the lanes
    ahead.
    """
    follow = np.zeros(len(first.at_m), dtype=bool)
    for lane in set(first.rear_lane.tolist()) & its.window.keys() & behind.window.keys():
        gap = first.at_m - first.length_m - its.window[lane] + behind.window[lane] - last.at_m
        follow |= (first.rear_lane == lane) & (gap >= 0.0) & (gap < NEAR_M)
    return follow
