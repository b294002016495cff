"""Where bodies on different ways touch, found from the drawn lanes alone: by other means than the gate's."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt
import shapely

from loopgate.audit.drawn_bodies import NEAR_M, Body, Way, draw_bodies, find_ways
from loopgate.audit.layout import Layout

_LEAST_M = 0.1
"""Shorter stretches are corners that touch [m]."""

_JUST_LEFT_M = 12.0
"""So far behind the end of a lane SUMO keeps those apart that leave it one after the other [m].

Not beyond the junction: on the road behind it a driver looks no longer at who still is inside. And not at
all at a junction without right of way.
"""

_APART_M = 2.0
"""Fronts farther apart than this belong to different stretches [m]."""

_ABOVE_M = 2.5
"""Lanes this far above each other do not meet [m]."""


@dataclass(frozen=True, slots=True)
class DrawnConflict:
    """A stretch of a loop on which bodies can touch those on another lane.

    The front can touch from `begin_m` on, the rear up to `end_m`: arc lengths [m]. Named are the lanes of the
    two fronts, and which of the zones it is in which bodies on these touch: two lanes can meet at both ends.
    """

    movement: str
    foe: str
    begin_m: float
    end_m: float
    zone: int = 0


class Side(NamedTuple):
    """One of two bodies that touch: a loop, the lane of the front, where front and rear touch as above [m].

    `fronts_m` is how far apart the first and the last of these fronts are [m]. `waits` says whether some of
    these bodies lie in a place, between its beginning and its stop line, `shortest` whether none are shorter.
    `under` are the lanes that bodies with their fronts here can lie on, by number.
    """

    loop: str
    lane: str
    begin_m: float
    end_m: float
    fronts_m: float
    waits: bool
    shortest: bool
    under: frozenset[int] = frozenset()


class Meeting(NamedTuple):
    """All touches between two ways; `loops` are those of each that have it, with how far off they are [m]."""

    one: Side
    other: Side
    loops: tuple[Mapping[str, float], Mapping[str, float]]


Drawn = Sequence[Meeting]

_Boxes = npt.NDArray[np.float64]


def find_meetings(layout: Layout) -> list[Meeting]:
    """Find where bodies can touch, none of which follows the other.

    A body is a rectangle from its front towards where its rear is on its way. Bodies on one lane are left to
    SUMO, those on lanes beside each other on one edge too.
    """
    numbers: dict[str, int] = {}
    ways = find_ways(layout, numbers)
    names = list(numbers)
    roads = _Roads(
        {number for name, number in numbers.items() if not name.startswith(":")},
        {numbers[lane] for lane in layout.unregulated},
    )
    edges = [name.rpartition("_")[0] for name in names]
    bodies, shapes = draw_bodies(layout, ways)
    if not len(shapes):
        return []
    pairs: dict[tuple[int, float, int, float], list[tuple[Body, Body]]] = {}
    apart = cache(lambda v, w: ways[v].window.keys().isdisjoint(ways[w].window))
    for a, b in _touching(shapes, [ways[body.way].lane for body in bodies], edges):
        x, y = bodies[a], bodies[b]
        i, j = ways[x.way].lane, ways[y.way].lane
        if lies_above(layout, names[i], names[j]):
            continue
        if apart(x.way, y.way) or not _follows(ways, roads, x, y):
            pairs.setdefault((x.way, x.length_m, y.way, y.length_m), []).append((x, y))
    found = []
    for (v, _, w, _), touching in pairs.items():
        for zone in _zones(touching):
            mine, theirs = _side(ways[v], names, zone, 0), _side(ways[w], names, zone, 1)
            if min(mine.fronts_m, theirs.fronts_m) >= _LEAST_M:
                found.append(Meeting(mine, theirs, (ways[v].loops, ways[w].loops)))
    return found


def _touching(shapes: Any, lanes: Sequence[int], edges: Sequence[str]) -> Iterator[tuple[int, int]]:  # noqa: ANN401
    """Yield the bodies that touch, of different lanes that do not lie beside each other on one edge.

    Roads are compared with those near them, and of each only the bodies that are: most touch others of their
    own road alone.
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
        for i, j in shapely.STRtree(shapes[one]).query(shapes[two], predicate="intersects").T.tolist():
            x, y = int(two[i]), int(one[j])
            yield (x, y) if x < y else (y, x)


def _overlap(boxes: _Boxes, box: _Boxes) -> npt.NDArray[np.bool_]:
    """Return which of some boxes, left, bottom, right, top, have something in common with one."""
    low, high = (boxes[:, :2] <= box[2:]), (boxes[:, 2:] >= box[:2])
    return cast("npt.NDArray[np.bool_]", (low & high).all(axis=1))


def _zones(touching: Sequence[tuple[Body, Body]]) -> Iterator[list[tuple[Body, Body]]]:
    """Yield the pairs in groups that hang together: two lanes can meet at both of their ends."""
    for part in _runs(touching, 0):
        yield from _runs(part, 1)


def _runs(pairs: Sequence[tuple[Body, Body]], side: int) -> Iterator[list[tuple[Body, Body]]]:
    run: list[tuple[Body, Body]] = []
    for pair in sorted(pairs, key=lambda pair: pair[side].at_m):
        if run and pair[side].at_m - run[-1][side].at_m > _APART_M:
            yield run
            run = []
        run.append(pair)
    yield run


def conflicts_by_loop(layout: Layout, drawn: Drawn) -> dict[str, list[DrawnConflict]]:
    """Return the stretches of each loop on which the shortest bodies can touch those on other lanes.

    Longer ones swing out farther, each in its own way: whether they touch, their rectangles tell.
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
    """Return whether fronts on one lane touch on one stretch of it, with the same way behind them."""
    if one.under != other.under:
        return False
    first, last = (one, other) if one.begin_m <= other.begin_m else (other, one)
    return last.begin_m - (first.begin_m + first.fronts_m) <= _APART_M


def _side(way: Way, names: Sequence[str], zone: Sequence[tuple[Body, Body]], which: int) -> Side:
    bodies = [pair[which] for pair in zone]
    fronts = [body.at_m for body in bodies]
    return Side(
        loop=next(iter(way.loops)),
        lane=names[way.lane],
        begin_m=min(fronts),
        end_m=max(body.at_m - body.length_m for body in bodies),
        fronts_m=max(fronts) - min(fronts),
        waits=any(body.waits for body in bodies),
        shortest=bodies[0].length_m == min(way.sizes)[0],
        under=frozenset(lane for at, lane in way.behind if at + way.lengths[lane] > -bodies[0].length_m),
    )


def lies_above(layout: Layout, one: str, other: str) -> bool:
    """Return whether a lane is known to lie above another, or below it."""
    heights = layout.heights
    return one in heights and other in heights and abs(heights[one] - heights[other]) > _ABOVE_M


class _Roads(NamedTuple):
    """The lanes outside junctions, by number; and those that lead to a junction without right of way."""

    lanes: AbstractSet[int]
    unregulated: AbstractSet[int]


def _follows(ways: Sequence[Way], roads: _Roads, one: Body, other: Body) -> bool:
    """Return whether one of two bodies comes behind the other on a way that both take, and close to it.

    Either on one way, with all of the first ahead of the second; or where both have just left one lane.
    """
    mine, theirs = ways[one.way], ways[other.way]
    here, there = mine.window, theirs.window
    if mine.lane in there or theirs.lane in here:
        off_m = here[theirs.lane] if theirs.lane in here else -there[mine.lane]
        gain = other.at_m + off_m - one.at_m
        first, last = (other, one) if gain >= 0 else (one, other)
        if abs(gain) - first.length_m < NEAR_M and first.rear_lane in ways[last.way].window:
            return True
    if _is_behind_tail(ways, one, other) or _is_behind_tail(ways, other, one):
        return True
    for lane, at_m in here.items():
        if at_m > 0.0 or there.get(lane, 1.0) > 0.0:
            continue
        s, t = one.at_m - at_m, other.at_m - there[lane]
        length_m = one.length_m if s >= t else other.length_m
        # Who is on that lane still looks ahead; on the road behind the junction nobody looks back.
        left = lane not in (mine.lane, theirs.lane)
        ends_m = [_kept_apart(way, roads, lane) - way.window[lane] for way in (mine, theirs) if left]
        junction_m = min(ends_m, default=math.inf)
        just_left = max(s, t) - length_m <= min(mine.lengths[lane] + _JUST_LEFT_M, junction_m)
        if just_left and abs(s - t) - length_m < NEAR_M:
            return True
    return False


def _kept_apart(way: Way, roads: _Roads, lane: int) -> float:
    """Return how far behind a lane SUMO looks at who left it another way [m]: as far as the road behind.

    Infinite if the front is not there yet; not at all where the junction is unregulated.
    """
    at_m = way.window[lane]
    if lane in roads.unregulated:
        return at_m + way.lengths[lane]
    return min(
        (at for other, at in way.window.items() if at_m < at <= 0.0 and other in roads.lanes),
        default=math.inf,
    )


def _is_behind_tail(ways: Sequence[Way], first: Body, last: Body) -> bool:
    """Return whether the rear of the first lies on a lane that the last takes too, close ahead of its front.

    Wherever the first goes: SUMO's drivers follow whatever still lies on their lanes.
    """
    its, lane = ways[first.way].window, first.rear_lane
    ahead = ways[last.way].window
    if lane not in its or lane not in ahead:
        return False
    gap = first.at_m - first.length_m - its[lane] + ahead[lane] - last.at_m
    return 0.0 <= gap < NEAR_M
