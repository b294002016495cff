"""Vehicles' bodies as rectangles on the ground, and the pairs of bodies that overlap."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
import scipy
import shapely

from loopgate.arrays import Floats, Ints
from loopgate.audit.layout import Layout, LoopWay
from loopgate.audit.position_table import Positions

_STEPS_APART_M = 1e6
"""Steps are laid so far apart that bodies of different steps are never near [m]."""

_ROUNDING_M = 0.02
"""Rectangles are taken this much smaller: recorded positions are rounded [m]."""


def overlapping(positions: Positions, length_m: Floats, width_m: Floats, bent: Mapping[int, Floats]) -> Ints:
    """Return the pairs of rows, shape (n, 2), of one step whose bodies overlap.

    Each body is a rectangle behind its recorded front, in its recorded direction. O(n log n) for vehicles
    on roads, of which few are near each other.

    Parameters
    ----------
    positions
        Rows of any number of steps.
    length_m, width_m
        Size of each row's vehicle [m].
    bent
        By row, for bodies that are not one rectangle: the points at which its parts meet, see `bends`.
    """
    angle = np.deg2rad(positions.angle_deg)
    ahead = np.stack((np.sin(angle), np.cos(angle)), axis=1)
    front = np.stack((positions.x_m, positions.y_m), axis=1)
    row = np.arange(len(front))
    if bent:
        first = np.concatenate([points[:-1] for points in bent.values()])
        rear = np.concatenate([points[1:] for points in bent.values()])
        whole = np.setdiff1d(row, list(bent))
        size = np.hypot(*(first - rear).T)
        row = np.concatenate((whole, np.repeat(list(bent), [len(points) - 1 for points in bent.values()])))
        front = np.concatenate((front[whole], first))
        ahead = np.concatenate((ahead[whole], (first - rear) / size[:, None]))
        length_m, width_m = np.concatenate((length_m[whole], size)), width_m[row]
    centre = front - ahead * (length_m / 2)[:, None]
    half = np.stack((length_m, width_m), axis=1) / 2 - _ROUNDING_M
    _, step = np.unique(positions.time_s, return_inverse=True)
    reach = 2.0 * float(np.hypot(half[:, 0], half[:, 1]).max(initial=0.0))
    tree = scipy.spatial.cKDTree(np.column_stack((centre, step[row] * _STEPS_APART_M)))
    pairs = tree.query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = pairs[row[pairs[:, 0]] != row[pairs[:, 1]]]
    if not len(pairs):
        return np.zeros((0, 2), dtype=np.int64)
    a, b = pairs[:, 0], pairs[:, 1]
    between = centre[b] - centre[a]
    apart = np.zeros(len(pairs), dtype=bool)
    for one, other in ((a, b), (b, a)):  # a line along a side of either keeps two rectangles apart, or none
        along = ahead[one]
        across = np.stack((along[:, 1], -along[:, 0]), axis=1)
        cos = np.abs((ahead[other] * along).sum(axis=1))
        sin = np.abs((ahead[other] * across).sum(axis=1))
        apart |= (
            np.abs((between * along).sum(axis=1))
            >= half[one, 0] + half[other, 0] * cos + half[other, 1] * sin
        )
        apart |= (
            np.abs((between * across).sum(axis=1))
            >= half[one, 1] + half[other, 0] * sin + half[other, 1] * cos
        )
    return np.unique(np.sort(row[pairs[~apart]], axis=1), axis=0)


def bends(layout: Layout, names: Sequence[str], positions: Positions, arcs_m: Floats) -> dict[int, Floats]:
    """Return the points at which jointed bodies bend, by row, from front to rear, shape (n, 2) [m].

    They bend where lanes end, as SUMO draws them; the angle that SUMO records is that of the first part.

    Parameters
    ----------
    layout, names
        The run's; the vehicles by number.
    arcs_m
        Where the front is on its loop [m]; NaN off it: then the recorded angle has to do.
    """
    jointed = np.array([layout.vehicles[name].jointed for name in names], dtype=bool)
    found = {}
    for row in np.flatnonzero(jointed[positions.vehicle] & ~np.isnan(arcs_m)).tolist():
        body = layout.vehicles[names[int(positions.vehicle[row])]]
        front = np.array([positions.x_m[row], positions.y_m[row]])
        at_m, lane = float(positions.pos_m[row]), str(positions.lane_name[row])
        loop = layout.loops[body.loop]
        points = [front, *_behind(layout, loop, lane, at_m, float(arcs_m[row]), body.length_m)]
        apart = [np.hypot(*(one - two)) > _ROUNDING_M for one, two in pairwise(points)]
        if any(apart):
            found[row] = np.array([front, *(p for p, far in zip(points[1:], apart, strict=True) if far)])
    return found


def _behind(
    layout: Layout, loop: LoopWay, lane: str, pos_m: float, arc_m: float, length_m: float
) -> Iterator[Floats]:
    """Yield the ends of the lanes behind the front's on which the body lies, and its rear."""
    begin_m, half_m = arc_m - pos_m, loop.length_m / 2
    off = [abs((span.begin_m - begin_m + half_m) % loop.length_m - half_m) for span in loop.spans]
    k = int(np.argmin(off))
    at_m, size_m, rear_m = 0.0, loop.spans[k].end_m - loop.spans[k].begin_m, pos_m - length_m
    for _ in loop.spans:
        if rear_m >= at_m:
            break
        k -= 1
        lane, size_m = loop.spans[k].lanes[0], loop.spans[k].end_m - loop.spans[k].begin_m
        at_m -= size_m
        yield np.asarray(layout.shapes[lane][-1])
    share = min(max((rear_m - at_m) / max(size_m, _ROUNDING_M), 0.0), 1.0)
    rear = shapely.LineString(layout.shapes[lane]).interpolate(share, normalized=True)
    yield np.array([rear.x, rear.y])
