"""Draw the bodies of vehicles on each lane, as rectangles, from the map alone."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import shapely

from loopgate.arrays import Flags, Floats
from loopgate.audit.layout import Layout, LoopSpan, LoopWay

_EVERY_M = 0.5
"""The distance between the fronts of neighbouring drawn bodies [m]."""

NEAR_M = 4.0
"""A body that is less than this behind another on one way follows it [m]."""

_LOOK_BACK_M = 30.0
"""How far behind and ahead of a body two ways are compared, beyond the longest vehicle [m]."""

_ROUNDING_M = 1e-6


@dataclass(slots=True)
class LaneOnWay:
    """A lane as part of a way.

    `window`: where the lanes behind and ahead begin, from the beginning of this lane [m]. `lengths`: the
    lengths of all lanes of the way [m]. `points`, `arcs`: the drawn line of the way up to the end of this
    lane, and the position of each of its points [m]. Vehicles' fronts are from `first_m` to `last_m` of the
    lane: vehicles may come from the lane beside it, or change to that lane.
    """

    lane: int
    window: dict[int, float]
    lengths: dict[int, float]
    points: Floats
    arcs: Floats
    length_m: float
    first_m: float
    last_m: float
    """The last position of a front on this lane [m]."""
    rear_m: float
    """The least position of a rear [m]: the first place of a route that is driven once begins there."""
    loops: dict[str, float] = field(default_factory=dict)
    sizes: dict[tuple[float, bool], float] = field(default_factory=dict)
    """The greatest width of the vehicles [m], by their length [m] and by whether they are jointed."""

    @property
    def behind(self) -> list[tuple[float, int]]:
        """The lane itself and the lanes behind it, each with its beginning [m], the farthest first."""
        return sorted((metres, lane) for lane, metres in self.window.items() if metres <= 0.0)


class DrawnBody(NamedTuple):
    """A body on a way: position of its front [m], length [m], lane of its rear, whether it is in a place."""

    way: int
    at_m: float
    length_m: float
    rear_lane: int
    waits: bool


def find_ways(layout: Layout, numbers: dict[str, int]) -> list[LaneOnWay]:
    """Return each lane once for each different way over it."""
    sizes: dict[str, dict[tuple[float, bool], float]] = {name: {} for name in layout.loops}
    for body in layout.vehicles.values():
        widths, size = sizes[body.loop], (body.length_m, body.jointed)
        widths[size] = max(body.width_m, widths.get(size, 0.0))
    longest = max((body.length_m for body in layout.vehicles.values()), default=0.0)
    found: dict[tuple[tuple[int, float], ...], LaneOnWay] = {}
    for name, loop in layout.loops.items():
        departs_m = loop.legs[0].begin_m if _once(loop) else -np.inf
        lanes = [
            (lane, span.begin_m, span.end_m - span.begin_m) for span in loop.spans for lane in span.driven
        ]
        used = [part for k, span in enumerate(loop.spans) for part in driven(loop, span, loop.spans[k - 1])]
        lengths = {numbers.setdefault(lane, len(numbers)): length_m for lane, _, length_m in lanes}
        for k, (lane, begin_m, length_m) in enumerate(lanes):
            if lane not in layout.shapes:
                continue
            window = {numbers[lane]: 0.0}
            for other, ahead_m in _window(loop, lanes, k, longest + _LOOK_BACK_M, numbers):
                window.setdefault(
                    other, ahead_m
                )  # a lane may lie behind and ahead, where vehicles turn round
            rear_m = 0.0 if used[k][0] > 0.0 else -np.inf
            if departs_m > begin_m - longest:
                rear_m = max(rear_m, departs_m - begin_m)
            on_it = ((numbers[lane], metres) for metres in (*used[k], rear_m))
            key = (*on_it, *sorted(window.items()))
            way = found.get(key)
            if way is None:
                points, arcs = _path(layout, lanes, k, longest)
                way = found[key] = LaneOnWay(
                    numbers[lane], window, lengths, points, arcs, length_m, *used[k], rear_m
                )
            way.loops.setdefault(name, begin_m)
            for size, width in sizes[name].items():
                way.sizes[size] = max(width, way.sizes.get(size, 0.0))
    return list(found.values())


def drawn_alike(layout: Layout, ways: Sequence[LaneOnWay]) -> list[list[int]]:
    """Return the numbers of the ways in groups: on all ways of a group the bodies look the same."""
    found: dict[object, list[int]] = {}
    for number, way in enumerate(ways):
        reach_m = max((length_m for length_m, _ in way.sizes), default=0.0)
        behind = tuple((at, lane) for at, lane in way.behind if at + way.lengths[lane] >= -reach_m)
        used = way.first_m, way.last_m, way.rear_m, way.length_m
        drawn = way.points.tobytes(), way.arcs.tobytes(), tuple(sorted(way.sizes.items()))
        places = tuple((round(begin, 3), round(end, 3)) for begin, end in _places(layout, way, reach_m))
        found.setdefault((way.lane, behind, used, drawn, places), []).append(number)
    return list(found.values())


def driven(loop: LoopWay, span: LoopSpan, before: LoopSpan) -> list[tuple[float, float]]:
    """Return the part of each lane of a span on which vehicles drive [m].

    On a span with two lanes, vehicles change lanes between the first and the last place on that span. In a
    network without lanes inside junctions, vehicles jump from one lane to the next: bodies are drawn once
    they are on the second lane.
    """
    length_m = span.end_m - span.begin_m
    if _once(loop):  # its last state is off the road
        length_m = min(length_m, max(_ROUNDING_M, loop.legs[-1].begin_m - span.begin_m))
    begin_m = _ROUNDING_M if jumps(before, span) else 0.0
    if not span.entered:
        return [(begin_m, length_m)]
    places = [((leg.begin_m - span.begin_m) % loop.length_m, leg.end_m - leg.begin_m) for leg in loop.legs]
    inside = sorted(place for place in places if place[0] < length_m)
    # With one place alone, it is before the change if it begins where the span does.
    several = len(inside) > 1
    first = [at + size for at, size in inside[:1] if several or at < NEAR_M]
    last = [at for at, _ in inside[-1:] if several or at >= NEAR_M]
    return [(begin_m, min(last, default=length_m)), (max(first, default=_ROUNDING_M), length_m)]


def _once(loop: LoopWay) -> bool:
    """Return whether a loop is a route that is driven once: its last state lies beyond its last lane."""
    return loop.length_m > loop.spans[-1].end_m + NEAR_M


def jumps(before: LoopSpan, span: LoopSpan) -> bool:
    """Return whether vehicles get from one span to the next without a lane inside a junction."""
    return not before.internal and not span.internal


_Lanes = Sequence[tuple[str, float, float]]


def _window(
    loop: LoopWay, lanes: _Lanes, k: int, reach_m: float, numbers: Mapping[str, int]
) -> Iterator[tuple[int, float]]:
    """Yield the lanes near the `k`-th lane, and how far ahead of its beginning each begins [m]."""
    begin_m, length_m = lanes[k][1], lanes[k][2]
    for step in (-1, 1):
        on_road = False  # the lanes behind are yielded up to the lane from which a junction was entered
        for far in range(1, len(lanes)):
            lane, at, length = lanes[(k + step * far) % len(lanes)]
            ahead = (at - begin_m) % loop.length_m
            ahead = ahead - loop.length_m if step < 0 else ahead
            if (step < 0 and ahead + length < -reach_m and on_road) or ahead > length_m + reach_m:
                break
            on_road |= not lane.startswith(":")
            yield numbers[lane], round(ahead, 3)


def _path(layout: Layout, lanes: _Lanes, k: int, reach_m: float) -> tuple[Floats, Floats]:
    """Return the points of the drawn way up to the end of the `k`-th lane, and the position of each [m]."""
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


def draw_bodies(layout: Layout, ways: Sequence[LaneOnWay]) -> tuple[list[DrawnBody], Any]:
    """Return the bodies and their rectangles; of a jointed vehicle, one body and rectangle for each part."""
    bodies: list[DrawnBody] = []
    corners: list[Floats] = []
    for number, way in enumerate(ways):
        for (length_m, jointed), width_m in way.sizes.items():
            at = np.linspace(0.0, way.length_m, max(2, int(np.ceil(way.length_m / _EVERY_M)) + 1))
            at = at[(at >= min(way.first_m, way.length_m)) & (at <= way.last_m)]
            at = at[at >= way.rear_m + length_m]
            described = _described(layout, number, way, at, length_m)
            joints = [metres for metres, _ in reversed(way.behind)] if jointed else [-np.inf]
            ahead_m = at
            for joint_m in joints:
                rear_m = np.maximum(at - length_m, joint_m)
                known, shapes = _rectangles(way, ahead_m, rear_m, length_m, width_m, jointed=jointed)
                corners.append(shapes)
                bodies += [described[k] for k in np.flatnonzero(known)]
                ahead_m = rear_m
    if not bodies:
        return [], ()
    return bodies, shapely.polygons(np.concatenate(corners))


def _rectangles(
    way: LaneOnWay, front_m: Floats, rear_m: Floats, length_m: float, width_m: float, *, jointed: bool
) -> tuple[Flags, Floats]:
    """Return which bodies have a rectangle from front to rear, and its corners, of shape (n, 4, 2) [m].

    A body without a direction has none. Where the way behind is not known, it is taken to be straight; the
    part of a jointed vehicle ends there.
    """
    front = np.column_stack([np.interp(front_m, way.arcs, way.points[:, c]) for c in (0, 1)])
    back_m = np.maximum(rear_m, way.arcs[0])
    rear = np.column_stack([np.interp(back_m, way.arcs, way.points[:, c]) for c in (0, 1)])
    ahead = front - rear
    norm = np.hypot(ahead[:, 0], ahead[:, 1])
    known = (norm > _ROUNDING_M) & (front_m > rear_m)  # else there is no direction
    ahead = ahead[known] / norm[known][:, None]
    side = np.column_stack((-ahead[:, 1], ahead[:, 0])) * (width_m / 2)
    tail = rear[known] if jointed else front[known] - ahead * length_m
    return known, np.stack((front[known] + side, front[known] - side, tail - side, tail + side), axis=1)


def _described(layout: Layout, number: int, way: LaneOnWay, at_m: Floats, length_m: float) -> list[DrawnBody]:
    rear_m = at_m - length_m + _ROUNDING_M
    waits = np.zeros(len(at_m), dtype=bool)
    for begin, end in _places(layout, way, length_m):
        waits |= (begin <= rear_m) & (at_m <= end)
    behind = way.behind
    last = np.searchsorted([metres for metres, _ in behind], rear_m, side="right") - 1
    lanes = [
        way.lane if rear >= 0.0 else behind[k][1] if k >= 0 else -1
        for rear, k in zip(rear_m.tolist(), last.tolist(), strict=True)
    ]
    columns = zip(at_m.tolist(), lanes, waits.tolist(), strict=True)
    return [DrawnBody(number, front, length_m, lane, wait) for front, lane, wait in columns]


def _places(layout: Layout, way: LaneOnWay, length_m: float) -> list[tuple[float, float]]:
    """Return from where to where the places near a way reach, for bodies of some length [m]."""
    loop, begin_m = next(iter(way.loops.items()))
    lap_m = layout.loops[loop].length_m
    places = [(leg.begin_m - begin_m, leg.end_m - begin_m) for leg in layout.loops[loop].legs]
    reach_m = way.length_m + length_m
    return [
        (begin + k * lap_m, end + k * lap_m + _ROUNDING_M)
        for begin, end in places
        for k in (-1, 0, 1)
        if begin + k * lap_m <= way.length_m and end + k * lap_m >= -reach_m
    ]
