"""Where bodies on different ways touch, found from the drawn lanes alone: by other means than the gate's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from loopgate.audit.layout import Layout, LoopWay, Span

__all__ = [
    "Drawn",
    "DrawnConflict",
    "Meeting",
    "Side",
    "conflicts_by_loop",
    "find_meetings",
    "jumps",
    "lies_above",
]

_EVERY_M = 0.5
"""How far apart the fronts are at which bodies are drawn [m]."""

_NEAR_M = 4.0
"""One that is nearer than this behind another on one way follows it [m]."""

_LOOK_BACK_M = 30.0
"""How far behind and ahead of a body ways are compared [m]."""

_ROUNDING_M = 1e-6

_LEAST_M = 0.1
"""Shorter stretches are corners that touch [m]."""

_JUST_LEFT_M = 12.0
"""So far behind the end of a lane SUMO keeps those apart that leave it one after the other [m]."""

_APART_M = 2.0
"""Fronts farther apart than this belong to different stretches [m]."""

_ABOVE_M = 2.5
"""Lanes this far above each other do not meet [m]."""


@dataclass(frozen=True, slots=True)
class DrawnConflict:
    """A stretch of a loop on which bodies can touch those on another lane.

    The front can touch from `begin_m` on, the rear up to `end_m`: arc lengths [m]. Named are the lanes of the
    two fronts.
    """

    movement: str
    foe: str
    begin_m: float
    end_m: float


class Side(NamedTuple):
    """One of two bodies that touch: a loop, the lane of the front, where front and rear touch as above [m].

    `fronts_m` is how far apart the first and the last of these fronts are [m]. `waits` says whether some of
    these bodies lie in a place, between its beginning and its stop line, `shortest` whether none are shorter.
    """

    loop: str
    lane: str
    begin_m: float
    end_m: float
    fronts_m: float
    waits: bool
    shortest: bool


class Meeting(NamedTuple):
    """All touches between two ways; `loops` are those of each that have it, with how far off they are [m]."""

    one: Side
    other: Side
    loops: tuple[Mapping[str, float], Mapping[str, float]]


Drawn = Sequence[Meeting]


@dataclass(slots=True)
class _Way:
    """A lane as part of a way: where it and the lanes behind and ahead begin [m], and their lengths."""

    lane: int
    window: dict[int, float]
    lengths: dict[int, float]
    points: npt.NDArray[np.float64]
    arcs: npt.NDArray[np.float64]
    length_m: float
    first_m: float
    last_m: float
    """Where on it vehicles are, that change to the lane beside it or come from there."""
    loops: dict[str, float] = field(default_factory=dict)
    sizes: dict[float, float] = field(default_factory=dict)
    """Widths by length of the vehicles."""


class _Body(NamedTuple):
    way: int
    at_m: float
    length_m: float
    rear_lane: int
    waits: bool


def find_meetings(layout: Layout) -> list[Meeting]:
    """Find where bodies can touch, none of which follows the other.

    A body is a rectangle from its front towards where its rear is on its way. Bodies on one lane are left to
    SUMO, those on lanes beside each other on one edge too.
    """
    numbers: dict[str, int] = {}
    ways = _ways(layout, numbers)
    names = list(numbers)
    edges = [name.rpartition("_")[0] for name in names]
    bodies, shapes = _bodies(layout, ways)
    if not len(shapes):
        return []
    tree = shapely.STRtree(shapes)
    one, other = tree.query(shapes, predicate="intersects")
    keep = one < other
    pairs: dict[tuple[int, float, int, float], list[tuple[_Body, _Body]]] = {}
    for a, b in zip(one[keep].tolist(), other[keep].tolist(), strict=True):
        x, y = bodies[a], bodies[b]
        i, j = ways[x.way].lane, ways[y.way].lane
        beside = edges[i] == edges[j] and not edges[i].startswith(":")
        if i == j or beside or lies_above(layout, names[i], names[j]) or _follows(ways, x, y):
            continue
        pairs.setdefault((x.way, x.length_m, y.way, y.length_m), []).append((x, y))
    found = []
    for (v, _, w, _), touching in pairs.items():
        for zone in _zones(touching):
            mine, theirs = _side(ways[v], names, zone, 0), _side(ways[w], names, zone, 1)
            if min(mine.fronts_m, theirs.fronts_m) >= _LEAST_M:
                found.append(Meeting(mine, theirs, (ways[v].loops, ways[w].loops)))
    return found


def _zones(touching: Sequence[tuple[_Body, _Body]]) -> Iterator[list[tuple[_Body, _Body]]]:
    """Yield the pairs in groups that hang together: two lanes can meet at both of their ends."""
    for part in _runs(touching, 0):
        yield from _runs(part, 1)


def _runs(pairs: Sequence[tuple[_Body, _Body]], side: int) -> Iterator[list[tuple[_Body, _Body]]]:
    run: list[tuple[_Body, _Body]] = []
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
    for meeting in drawn:
        if not (meeting.one.shortest and meeting.other.shortest):
            continue
        sides = (meeting.one, meeting.other), (meeting.other, meeting.one)
        for (mine, foe), loops in zip(sides, meeting.loops, strict=True):
            for loop, off_m in loops.items():
                begin, end = mine.begin_m + off_m, mine.end_m + off_m
                found[loop].add(DrawnConflict(mine.lane, foe.lane, begin, end))
    return {name: sorted(some, key=lambda c: (c.begin_m, c.end_m, c.foe)) for name, some in found.items()}


def _side(way: _Way, names: Sequence[str], zone: Sequence[tuple[_Body, _Body]], which: int) -> Side:
    bodies = [pair[which] for pair in zone]
    fronts = [body.at_m for body in bodies]
    return Side(
        loop=next(iter(way.loops)),
        lane=names[way.lane],
        begin_m=min(fronts),
        end_m=max(body.at_m - body.length_m for body in bodies),
        fronts_m=max(fronts) - min(fronts),
        waits=any(body.waits for body in bodies),
        shortest=bodies[0].length_m == min(way.sizes),
    )


def _ways(layout: Layout, numbers: dict[str, int]) -> list[_Way]:
    """Return each lane once for each different way over it."""
    sizes: dict[str, dict[float, float]] = {name: {} for name in layout.loops}
    for body in layout.vehicles.values():
        widths = sizes[body.loop]
        widths[body.length_m] = max(body.width_m, widths.get(body.length_m, 0.0))
    longest = max((body.length_m for body in layout.vehicles.values()), default=0.0)
    found: dict[tuple[tuple[int, float], ...], _Way] = {}
    for name, loop in layout.loops.items():
        lanes = [
            (lane, span.begin_m, span.end_m - span.begin_m) for span in loop.spans for lane in span.driven
        ]
        driven = [
            part for k, span in enumerate(loop.spans) for part in _driven(loop, span, loop.spans[k - 1])
        ]
        lengths = {numbers.setdefault(lane, len(numbers)): length_m for lane, _, length_m in lanes}
        for k, (lane, begin_m, length_m) in enumerate(lanes):
            if lane not in layout.shapes:
                continue
            window = {numbers[lane]: 0.0}
            for other, ahead_m in _window(loop, lanes, k, longest + _LOOK_BACK_M, numbers):
                window.setdefault(
                    other, ahead_m
                )  # a lane may lie behind and ahead, where vehicles turn round
            key = ((numbers[lane], driven[k][0]), (numbers[lane], driven[k][1]), *sorted(window.items()))
            way = found.get(key)
            if way is None:
                points, arcs = _path(layout, lanes, k, longest)
                way = found[key] = _Way(numbers[lane], window, lengths, points, arcs, length_m, *driven[k])
            way.loops.setdefault(name, begin_m)
            for size, width in sizes[name].items():
                way.sizes[size] = max(width, way.sizes.get(size, 0.0))
    return list(found.values())


def _driven(loop: LoopWay, span: Span, before: Span) -> list[tuple[float, float]]:
    """Return where vehicles are on each lane of a span that they drive on [m]: all along, unless they change.

    They change between the place before and the one behind, if these lie on the span. Without lanes inside
    junctions they jump from lane to lane: nothing can be drawn until they are on the second.
    """
    length_m = span.end_m - span.begin_m
    begin_m = _ROUNDING_M if jumps(before, span) else 0.0
    if not span.entered:
        return [(begin_m, length_m)]
    places = [((leg.begin_m - span.begin_m) % loop.length_m, leg.end_m - leg.begin_m) for leg in loop.legs]
    inside = sorted(place for place in places if place[0] < length_m)
    first = [at + size for at, size in inside if at < _NEAR_M]
    last = [at for at, _ in inside if at >= _NEAR_M]
    return [(begin_m, min(last, default=length_m)), (max(first, default=_ROUNDING_M), length_m)]


def jumps(before: Span, span: Span) -> bool:
    """Return whether vehicles get from one lane to another with no lane inside a junction between."""
    return not before.internal and not span.internal


_Lanes = Sequence[tuple[str, float, float]]


def _window(
    loop: LoopWay, lanes: _Lanes, k: int, reach_m: float, numbers: Mapping[str, int]
) -> Iterator[tuple[int, float]]:
    """Yield the lanes within reach of the `k`-th with how far ahead of its beginning each begins [m]."""
    begin_m, length_m = lanes[k][1], lanes[k][2]
    for step in (-1, 1):
        on_road = False  # what lies behind is told up to the lane from which a junction was entered
        for far in range(1, len(lanes)):
            lane, at, length = lanes[(k + step * far) % len(lanes)]
            ahead = (at - begin_m) % loop.length_m
            ahead = ahead - loop.length_m if step < 0 else ahead
            if (step < 0 and ahead + length < -reach_m and on_road) or ahead > length_m + reach_m:
                break
            on_road |= not lane.startswith(":")
            yield numbers[lane], round(ahead, 3)


def _path(
    layout: Layout, lanes: _Lanes, k: int, reach_m: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the drawn way up to the end of the `k`-th lane, with metres from its beginning."""
    parts, at_m = [], lanes[k][2]
    for far in range(len(lanes)):
        lane, _, length = lanes[k - far]
        shape = layout.shapes.get(lane)
        if shape is None:
            break
        points = np.asarray(shape, dtype=np.float64)
        steps = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
        drawn = steps[-1] if steps[-1] > 0 else 1.0
        parts.append((points, at_m - length + steps * (length / drawn)))
        at_m -= length
        if at_m < -reach_m:
            break
    return np.concatenate([p for p, _ in reversed(parts)]), np.concatenate([a for _, a in reversed(parts)])


def _bodies(layout: Layout, ways: Sequence[_Way]) -> tuple[list[_Body], Any]:
    bodies: list[_Body] = []
    corners: list[npt.NDArray[np.float64]] = []
    for number, way in enumerate(ways):
        behind = sorted((metres, lane) for lane, metres in way.window.items() if metres <= 0.0)
        loop, begin_m = next(iter(way.loops.items()))
        places = [(leg.begin_m - begin_m, leg.end_m - begin_m) for leg in layout.loops[loop].legs]
        lap_m = layout.loops[loop].length_m
        for length, width in way.sizes.items():
            at = np.linspace(0.0, way.length_m, max(2, int(np.ceil(way.length_m / _EVERY_M)) + 1))
            at = at[(at >= min(way.first_m, way.length_m)) & (at <= way.last_m)]
            at = at[at >= length] if way.first_m > 0.0 else at
            front = np.column_stack([np.interp(at, way.arcs, way.points[:, c]) for c in (0, 1)])
            # Where the way behind is not known it is taken to be straight.
            back_m = np.maximum(at - length, way.arcs[0])
            rear = np.column_stack([np.interp(back_m, way.arcs, way.points[:, c]) for c in (0, 1)])
            ahead = front - rear
            norm = np.hypot(ahead[:, 0], ahead[:, 1])
            known = norm > 1e-6  # noqa: PLR2004  else there is no direction
            ahead = ahead[known] / norm[known][:, None]
            side = np.column_stack((-ahead[:, 1], ahead[:, 0])) * (width / 2)
            tail = front[known] - ahead * length
            corners.append(
                np.stack((front[known] + side, front[known] - side, tail - side, tail + side), axis=1)
            )
            for metres in at[known].tolist():
                rear_m = metres - length + _ROUNDING_M
                lane = next((n for m, n in reversed(behind) if m <= rear_m), -1)
                lane = way.lane if rear_m >= 0.0 else lane
                waits = any(
                    b + k * lap_m <= metres - length + 1e-6 and metres <= e + k * lap_m + 1e-6
                    for b, e in places
                    for k in (-1, 0, 1)
                )
                bodies.append(_Body(number, metres, length, lane, waits))
    if not corners:
        return [], ()
    return bodies, shapely.polygons(np.concatenate(corners))


def lies_above(layout: Layout, one: str, other: str) -> bool:
    """Return whether a lane is known to lie above another, or below it."""
    heights = layout.heights
    return one in heights and other in heights and abs(heights[one] - heights[other]) > _ABOVE_M


def _follows(ways: Sequence[_Way], one: _Body, other: _Body) -> bool:
    """Return whether one of two bodies comes behind the other on a way that both take, and close to it.

    Either on one way, with all of the first ahead of the second; or where both have just left one lane.
    """
    mine, theirs = ways[one.way], ways[other.way]
    here, there = mine.window, theirs.window
    if mine.lane in there or theirs.lane in here:
        off_m = here[theirs.lane] if theirs.lane in here else -there[mine.lane]
        gain = other.at_m + off_m - one.at_m
        first, last = (other, one) if gain >= 0 else (one, other)
        if abs(gain) - first.length_m < _NEAR_M and first.rear_lane in ways[last.way].window:
            return True
    for lane, at_m in here.items():
        if at_m > 0.0 or there.get(lane, 1.0) > 0.0:
            continue
        s, t = one.at_m - at_m, other.at_m - there[lane]
        length_m = one.length_m if s >= t else other.length_m
        just_left = max(s, t) - length_m <= mine.lengths[lane] + _JUST_LEFT_M
        if just_left and abs(s - t) - length_m < _NEAR_M:
            return True
    return False
