"""Contacts: stretches on which lanes come near each other, the geometry under collision segments."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely

from loopgate.arrays import Floats, Ints
from loopgate.network.loop import Loop, arc_lengths
from loopgate.network.road import Points


@dataclass(frozen=True, slots=True)
class LaneContacts:
    """Stretches of lanes that lie within a distance of each other.

    Row ``k`` says: the stretch ``one_begin[k]`` to ``one_end[k]`` of lane ``one[k]`` and the stretch
    ``other_begin[k]`` to ``other_end[k]`` of lane ``other[k]`` are maximal and near each other. Stretches are
    fractions of the lane's length, 0 to 1. Each unordered pair of lanes is listed once, ``one <= other``;
    a lane is near itself all along.

    `lanes`: ids; ``one`` and ``other`` index them.
    """

    lanes: tuple[str, ...]
    one: Ints
    other: Ints
    one_begin: Floats
    one_end: Floats
    other_begin: Floats
    other_end: Floats


def lanes_of(loops: Iterable[Loop]) -> dict[str, Points]:
    """Return the centre lines of all lanes on which vehicles on the loops may be, by lane id."""
    return {
        lane: shape
        for loop in loops
        for span in loop.spans
        for lane, shape in zip(span.lane_ids, span.shapes, strict=True)
    }


def lane_contacts(shapes: dict[str, Points], reach_m: float) -> LaneContacts:
    """Find all stretches of lanes within `reach_m` of each other, exactly.

    Centre lines are polylines; the points of one straight piece within a distance of another form one
    interval, since the distance to a convex set is convex. Heights are ignored: a bridge conflicts with the
    road below, which is safe.

    O(n log n + k) for n straight pieces with k near pairs (a spatial index; no all-pairs loop).

    Parameters
    ----------
    shapes
        Centre lines [m] by lane id.
    reach_m
        The distance: 2 rho.
    """
    names = tuple(shapes)
    starts, ends, lane, low, high = _pieces(shapes)
    # The tree takes a line of length 0 for empty; only its box matters here, so give it a little.
    point = np.all(starts == ends, axis=1)[:, None]
    lines = np.asarray(shapely.linestrings(np.stack((starts, ends + 1e-6 * point), axis=1)), dtype=np.object_)
    tree = shapely.STRtree(lines)
    p, q = tree.query(lines, predicate="dwithin", distance=reach_m)
    keep = lane[p] < lane[q]
    p, q = p[keep], q[keep]
    t0, t1 = _near(starts[p], ends[p], starts[q], ends[q], reach_m)
    s0, s1 = _near(starts[q], ends[q], starts[p], ends[p], reach_m)
    real = (t0 <= t1) & (s0 <= s1)
    p, q = p[real], q[real]
    t0, t1, s0, s1 = t0[real], t1[real], s0[real], s1[real]

    def along(piece: Ints, t: Floats) -> Floats:
        return np.asarray(low[piece] + t * (high[piece] - low[piece]), dtype=np.float64)

    group = lane[p] * len(names) + lane[q]
    seg_p, begin_p, end_p, group_p = merge_intervals(group, along(p, t0), along(p, t1))
    seg_q, begin_q, end_q, _ = merge_intervals(group, along(q, s0), along(q, s1))
    links = np.unique(np.stack((seg_p, seg_q), axis=1), axis=0)
    mine, theirs = links[:, 0], links[:, 1]
    itself = np.arange(len(names), dtype=np.int64)
    zero, unit = np.zeros(len(names)), np.ones(len(names))
    return LaneContacts(
        lanes=names,
        one=np.concatenate((itself, group_p[mine] // len(names))),
        other=np.concatenate((itself, group_p[mine] % len(names))),
        one_begin=np.concatenate((zero, begin_p[mine])),
        one_end=np.concatenate((unit, end_p[mine])),
        other_begin=np.concatenate((zero, begin_q[theirs])),
        other_end=np.concatenate((unit, end_q[theirs])),
    )


def merge_intervals(
    group: Ints, begin: Floats, end: Floats, *, join: float = 1e-9
) -> tuple[Ints, Floats, Floats, Ints]:
    """Unite the intervals of each group that overlap or lie at most `join` apart; below 0: overlap more.

    Returns
    -------
    tuple
        For each input row the number of its union; then begin, end and group of each union, ordered by
        group and begin. O(n log n).
    """
    if not len(group):
        none = np.zeros(0, dtype=np.int64)
        return none, np.zeros(0), np.zeros(0), none
    order = np.lexsort((begin, group))
    g, b, e = group[order], begin[order], end[order]
    # One running maximum over all groups: each group is lifted above the groups before it.
    _, rank = np.unique(g, return_inverse=True)
    lift = (float(e.max()) - float(b.min()) + 1.0 + abs(join)) * rank
    top = np.maximum.accumulate(e + lift)
    fresh = np.ones(len(g), dtype=bool)
    fresh[1:] = (g[1:] != g[:-1]) | (b[1:] + lift[1:] > top[:-1] + join)
    number = np.cumsum(fresh) - 1
    row = np.empty(len(g), dtype=np.int64)
    row[order] = number
    first = np.flatnonzero(fresh)
    return row, b[first], np.maximum.reduceat(e, first), g[first]


def _pieces(shapes: dict[str, Points]) -> tuple[Floats, Floats, Ints, Floats, Floats]:
    """Cut centre lines into straight pieces: start, end, lane number, fraction of the lane at both ends."""
    starts, ends, lane, low, high = [], [], [], [], []
    for number, shape in enumerate(shapes.values()):
        points = np.asarray(shape, dtype=np.float64)
        along = arc_lengths(points, 0.0, 1.0)
        # Repeated points make empty pieces; a lane that is a single point keeps one.
        real = np.flatnonzero(np.diff(along) > 0.0) if len(points) > 1 else np.zeros(0, dtype=np.int64)
        if not len(real):
            points, along, real = np.stack((points[0], points[-1])), np.array((0.0, 1.0)), np.array((0,))
        starts.append(points[real])
        ends.append(points[real + 1])
        lane.append(np.full(len(real), number, dtype=np.int64))
        low.append(along[real])
        high.append(along[real + 1])
    return (
        np.concatenate(starts),
        np.concatenate(ends),
        np.concatenate(lane),
        np.concatenate(low),
        np.concatenate(high),
    )


def _near(a0: Floats, a1: Floats, b0: Floats, b1: Floats, reach: float) -> tuple[Floats, Floats]:
    """Return where on the pieces a0-a1 (as fractions) the distance to b0-b1 is at most `reach`; row by row.

    The points within `reach` of a straight piece form two discs and a rectangle between them; the answer is
    the hull of the three intersections. Rows without a solution have begin > end.
    """
    d, e = a1 - a0, b1 - b0
    low = np.full(len(d), np.inf)
    high = np.full(len(d), -np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for centre in (b0, b1):
            t0, t1 = _in_disc(a0 - centre, d, reach)
            low, high = np.fmin(low, t0), np.fmax(high, t1)
        length = np.hypot(e[:, 0], e[:, 1])
        u = e / length[:, None]
        f = a0 - b0
        t0, t1 = _in_band((f * u).sum(1), (d * u).sum(1), np.zeros(len(d)), length)
        r0, r1 = _in_band(_cross(u, f), _cross(u, d), np.full(len(d), -reach), np.full(len(d), reach))
        t0, t1 = np.maximum(t0, r0), np.minimum(t1, r1)
        inside = t0 <= t1
        low = np.where(inside, np.fmin(low, t0), low)
        high = np.where(inside, np.fmax(high, t1), high)
    # A piece that is a point has length 0 and is near as a whole or not at all.
    point = np.hypot(d[:, 0], d[:, 1]) == 0.0
    low, high = np.where(point, 0.0, low), np.where(point, 1.0, high)
    return np.clip(low, 0.0, None), np.clip(high, None, 1.0)


def _in_disc(f: Floats, d: Floats, reach: float) -> tuple[Floats, Floats]:
    a, b, c = (d * d).sum(1), 2.0 * (f * d).sum(1), (f * f).sum(1) - reach * reach
    root = np.sqrt(b * b - 4.0 * a * c)  # nan where the line misses the disc
    return (-b - root) / (2.0 * a), (-b + root) / (2.0 * a)


def _in_band(at: Floats, slope: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Solve low <= at + t slope <= high for t; begin > end where there is none."""
    x, y = (low - at) / slope, (high - at) / slope
    t0, t1 = np.minimum(x, y), np.maximum(x, y)
    flat = slope == 0.0
    within = (low <= at) & (at <= high)
    t0 = np.where(flat, np.where(within, -np.inf, np.inf), t0)
    t1 = np.where(flat, np.where(within, np.inf, -np.inf), t1)
    return t0, t1


def _cross(u: Floats, v: Floats) -> Floats:
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], dtype=np.float64)
