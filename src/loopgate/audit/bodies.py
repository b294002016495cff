"""Bodies as rectangles on the ground, and which of them overlap."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from loopgate.audit.position_table import Positions

__all__ = ["overlapping"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_STEPS_APART_M = 1e6
"""Steps are laid so far apart that bodies of different steps are never near [m]."""

_ROUNDING_M = 0.02
"""Rectangles are taken this much smaller: recorded positions are rounded [m]."""


def overlapping(positions: Positions, length_m: Floats, width_m: Floats) -> Ints:
    """Return the pairs of rows of one step whose bodies overlap, shape (n, 2).

    Each body is a rectangle behind its recorded front, in its recorded direction. O(n log n) for vehicles
    on roads, of which few are near each other.

    Parameters
    ----------
    positions
        Rows of any number of steps.
    length_m, width_m
        Size of each row's vehicle [m].
    """
    angle = np.deg2rad(positions.angle_deg)
    ahead = np.stack((np.sin(angle), np.cos(angle)), axis=1)
    front = np.stack((positions.x_m, positions.y_m), axis=1)
    centre = front - ahead * (length_m / 2)[:, None]
    half = np.stack((length_m, width_m), axis=1) / 2 - _ROUNDING_M
    _, step = np.unique(positions.time_s, return_inverse=True)
    reach = 2.0 * float(np.hypot(half[:, 0], half[:, 1]).max(initial=0.0))
    tree = cKDTree(np.column_stack((centre, step * _STEPS_APART_M)))
    pairs = tree.query_pairs(reach, output_type="ndarray").astype(np.int64)
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
    hits = pairs[~apart]
    return hits[np.lexsort((hits[:, 1], hits[:, 0]))]
