"""Which of many rectangles overlap: by squares of the ground, compiled."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from loopgate.kernel_cache import kernel

__all__ = ["overlapping"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_X, _Y, _AHEAD_X, _AHEAD_Y, _HALF_M, _WIDE_M, _Z = range(7)

_ABOVE_M = 2.5
"""What lies so far above another does not touch it [m]."""


def overlapping(rectangles: Floats, lane: Ints, edge: Ints) -> tuple[Ints, Ints]:
    """Return all pairs of rectangles that overlap, but for those on one lane or on lanes of one edge.

    Parameters
    ----------
    rectangles
        Seven columns: x and y of the middle, the direction ahead, half of length and width, height [m].
    lane, edge
        Numbers of the lane and the edge that each is on; an edge below 0 is none.

    Notes
    -----
    O(n log n + k) for k pairs of near ones.
    """
    if not len(rectangles):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    reach_m = 2.0 * float(np.hypot(rectangles[:, _HALF_M], rectangles[:, _WIDE_M]).max())
    column, row = np.floor((rectangles[:, :2] - rectangles[:, :2].min(axis=0)) / reach_m).astype(np.int64).T
    width = int(column.max()) + 3
    square = row * width + column
    order = np.argsort(square, kind="stable")
    square, placed = square[order], np.ascontiguousarray(rectangles[order])
    # Those behind a rectangle in this order: on its square and the next, and on three of the row above.
    ranges = np.stack(
        (
            np.arange(1, len(square) + 1),
            np.searchsorted(square, square + 1, side="right"),
            np.searchsorted(square, square + width - 1, side="left"),
            np.searchsorted(square, square + width + 1, side="right"),
        )
    )
    one, other = order[_find(placed, lane[order], edge[order], ranges)]
    return np.minimum(one, other), np.maximum(one, other)


@kernel
def _find(rectangles: Floats, lane: Ints, edge: Ints, ranges: Ints) -> Ints:
    """Return the pairs, as two rows of numbers in this order."""
    pairs = np.empty((2, 4 * len(rectangles)), dtype=np.int64)
    count = 0
    for i in range(len(rectangles)):
        for k in (0, 2):
            for j in range(ranges[k, i], ranges[k + 1, i]):
                if lane[i] == lane[j] or (edge[i] >= 0 and edge[i] == edge[j]):
                    continue
                if _overlap(rectangles[i], rectangles[j]):
                    if count == pairs.shape[1]:
                        pairs = np.concatenate((pairs, np.empty_like(pairs)), axis=1)
                    pairs[0, count], pairs[1, count] = i, j
                    count += 1
    return pairs[:, :count]


@kernel
def _overlap(a: Floats, b: Floats) -> bool:
    """Return whether two rectangles overlap: no line along a side of either keeps them apart."""
    if abs(a[_Z] - b[_Z]) >= _ABOVE_M:
        return False
    x, y = b[_X] - a[_X], b[_Y] - a[_Y]
    cos = abs(a[_AHEAD_X] * b[_AHEAD_X] + a[_AHEAD_Y] * b[_AHEAD_Y])
    sin = abs(a[_AHEAD_X] * b[_AHEAD_Y] - a[_AHEAD_Y] * b[_AHEAD_X])
    for one, other in ((a, b), (b, a)):
        u, v = one[_AHEAD_X], one[_AHEAD_Y]
        half, wide = other[_HALF_M], other[_WIDE_M]
        if abs(x * u + y * v) >= one[_HALF_M] + half * cos + wide * sin:
            return False
        if abs(x * v - y * u) >= one[_WIDE_M] + half * sin + wide * cos:
            return False
    return True
