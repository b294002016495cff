"""Where bodies on different ways touch, found from the drawn lanes alone: by other means than the gate's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from loopgate.audit.layout import Layout, LoopWay

__all__ = ["Drawn", "DrawnConflict", "Meeting", "Side", "conflicts_by_loop", "find_meetings", "lies_above"]

_EVERY_M = 0.5
"""How far apart the fronts are at which bodies are drawn [m]."""

_NEAR_M = 4.0
"""One that is nearer than this behind another on one way follows it [m]."""

_LOOK_BACK_M = 30.0
"""How far behind and ahead of a body ways are compared [m]."""

_LEAST_M = 0.1
"""Shorter stretches are corners that touch [m]."""

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
    these bodies lie in a place, between its beginning and its stop line.
    """

    loop: str
    lane: str
    begin_m: float
    end_m: float
    fronts_m: float
    waits: bool


class Meeting(NamedTuple):
    """All touches between two ways; `loops` are those of each that have it, with how far off they are [m]."""

    one: Side
    other: Side
    loops: tuple[Mapping[str, float], Mapping[str, float]]


Drawn = Sequence[Meeting]


@dataclass(slots=True)
class _Way:
    """A lane as part of a way: what lies behind and ahead of it, as metres from its own beginning."""

    lane: int
    window: dict[int, float]
    points: npt.NDArray[np.float64]
    arcs: npt.NDArray[np.float64]
    length_m: float
    changed: bool
    """Whether vehicles come onto it from the lane beside it."""
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
    hulls: dict[tuple[int, float, int, float], list[list[float]]] = {}
    for a, b in zip(one[keep].tolist(), other[keep].tolist(), strict=True):
        x, y = bodies[a], bodies[b]
        i, j = ways[x.way].lane, ways[y.way].lane
        beside = edges[i] == edges[j] and not edges[i].startswith(":")
        if i == j or beside or lies_above(layout, names[i], names[j]) or _follows(ways, x, y):
            continue
        key = (x.way, x.length_m, y.way, y.length_m)
        rows = hulls.setdefault(key, [[np.inf, -np.inf, 0.0], [np.inf, -np.inf, 0.0]])
        for row, body in zip(rows, (x, y), strict=True):
            row[0] = min(row[0], body.at_m)
            row[1] = max(row[1], body.at_m - body.length_m)
            row[2] = max(row[2], body.waits)
    return [
        Meeting(
            _side(ways[v], names, mine, length),
            _side(ways[w], names, theirs, other_length),
            (ways[v].loops, ways[w].loops),
        )
        for (v, length, w, other_length), (mine, theirs) in hulls.items()
        if min(mine[1] + length - mine[0], theirs[1] + other_length - theirs[0]) >= _LEAST_M
    ]


def conflicts_by_loop(layout: Layout, drawn: Drawn) -> dict[str, list[DrawnConflict]]:
    """Return the stretches of each loop on which bodies can touch those on other lanes."""
    found: dict[str, set[DrawnConflict]] = {name: set() for name in layout.loops}
    for meeting in drawn:
        sides = (meeting.one, meeting.other), (meeting.other, meeting.one)
        for (mine, foe), loops in zip(sides, meeting.loops, strict=True):
            for loop, off_m in loops.items():
                begin, end = mine.begin_m + off_m, mine.end_m + off_m
                found[loop].add(DrawnConflict(mine.lane, foe.lane, begin, end))
    return {name: sorted(some, key=lambda c: (c.begin_m, c.end_m, c.foe)) for name, some in found.items()}


def _side(way: _Way, names: Sequence[str], row: Sequence[float], length_m: float) -> Side:
    first, last, waits = row
    # Fronts between those that were drawn touch too.
    begin, end = first - _EVERY_M / 2, last + _EVERY_M / 2
    return Side(next(iter(way.loops)), names[way.lane], begin, end, last + length_m - first, bool(waits))


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
        came = [lane != span.driven[0] for span in loop.spans for lane in span.driven]
        for lane, _, _ in lanes:
            numbers.setdefault(lane, len(numbers))
        for k, (lane, begin_m, length_m) in enumerate(lanes):
            if lane not in layout.shapes:
                continue
            window = dict(_window(loop, lanes, k, longest + _LOOK_BACK_M, numbers))
            key = ((numbers[lane], float(came[k])), *sorted(window.items()))
            way = found.get(key)
            if way is None:
                points, arcs = _path(layout, lanes, k, longest)
                way = found[key] = _Way(numbers[lane], window, points, arcs, length_m, came[k])
            way.loops.setdefault(name, begin_m)
            for size, width in sizes[name].items():
                way.sizes[size] = max(width, way.sizes.get(size, 0.0))
    return list(found.values())


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
            at = at[at >= length] if way.changed else at
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
                lane = next((n for m, n in reversed(behind) if m <= metres - length), -1)
                lane = way.lane if metres - length >= 0.0 else lane
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
    """Return whether one of two bodies comes behind the other on a way that both take, and close to it."""
    mine, theirs = ways[one.way], ways[other.way]
    ahead_m = _ahead_m(mine, theirs)
    if ahead_m is None:
        return False
    gain = other.at_m + ahead_m[0] - one.at_m
    first, last = (other, one) if gain >= 0 else (one, other)
    after = ways[last.way]
    on_way = first.rear_lane == after.lane or first.rear_lane in after.window
    return (on_way or ahead_m[1]) and abs(gain) - first.length_m < _NEAR_M


def _ahead_m(mine: _Way, theirs: _Way) -> tuple[float, bool] | None:
    """Return how far ahead of mine their lane begins [m], and whether both come from one lane, if known."""
    here = {mine.lane: 0.0, **mine.window}
    there = {theirs.lane: 0.0, **theirs.window}
    common = [lane for lane in here if lane in there]
    if not common:
        return None
    behind = [lane for lane in common if here[lane] <= 0.0 and there[lane] <= 0.0]
    lane = max(behind, key=lambda one: here[one]) if behind else min(common, key=lambda one: here[one])
    return here[lane] - there[lane], bool(behind)
