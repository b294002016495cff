"""Parts of lines and of closed curves."""

import numpy as np

from loopgate.arrays import Floats

_ROUNDING_M = 1e-6


def cut_curve(points: Floats, arcs: Floats, lap_m: float, begin_m: float, end_m: float) -> Floats:
    """Return the part of a closed curve between two arc lengths, shape (n, 2) with n at least 2 [m].

    Parameters
    ----------
    points, arcs
        Points of the curve, shape (n, 2), and the arc length of each, ascending from 0 to `lap_m` [m].
    begin_m, end_m
        From where to where; they may lie beyond the curve's ends, at most a lap apart.
    """
    end_m, begin_m = begin_m % lap_m + max(0.0, end_m - begin_m), begin_m % lap_m
    laps = (0.0, lap_m) if end_m > lap_m else (0.0,)
    all_points = np.concatenate([points for _ in laps])
    all_arcs = np.concatenate([arcs + lap for lap in laps])
    return cut_line(all_points, all_arcs, begin_m, end_m)


def cut_line(points: Floats, arcs: Floats, begin_m: float, end_m: float) -> Floats:
    """Return the part of an open line between two arc lengths."""
    inside = (arcs > begin_m) & (arcs < end_m)
    first, last = (
        [float(np.interp(at, arcs, points[:, axis])) for axis in (0, 1)] for at in (begin_m, end_m)
    )
    return np.vstack((first, points[inside], last))


def gap(lap_m: float, from_m: float, to_m: float) -> float:
    """Return the distance from one arc length to another on a loop [m]; 0 if only rounding differs."""
    far = (to_m - from_m) % lap_m
    return 0.0 if far > lap_m - _ROUNDING_M else far
