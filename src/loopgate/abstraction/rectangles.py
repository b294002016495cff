"""Finds overlapping rectangles among many, with a grid of squares."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from loopgate.arrays import Flags, Floats, Ints

_X, _Y, _AHEAD_X, _AHEAD_Y, _HALF_M, _WIDE_M, _Z = range(7)

_ABOVE_M = 2.5
"""Bodies on lanes with this difference in height do not touch [m]."""

_AT_ONCE = 500_000
"""Number of pairs that are checked at once, to save memory."""


@dataclass(frozen=True, slots=True)
class Overlaps:
    """All pairs of overlapping rectangles.

    Attributes
    ----------
    numbers
        Number of each group, by name.
    begins
        The first row of each group, and the number of all rows.
    one, other
        The two rows of each pair; `one` ascends.
    """

    numbers: Mapping[Hashable, int]
    begins: Ints
    one: Ints
    other: Ints


def find_overlaps(
    names: Sequence[Hashable],
    groups: Sequence[Floats],
    lane: Ints,
    edge: Ints,
    known: Overlaps | None = None,
) -> Overlaps:
    """Return all pairs of overlapping rectangles, except pairs on lanes of one edge.

    If overlaps are known, only the groups that they lack are compared with all others.

    Parameters
    ----------
    names, groups
        Name of each group, and its rectangles as in `overlapping`.
    lane, edge
        Numbers of the lane and the edge of each group; an edge below 0 is none.
    known
        Overlaps of other groups; a group of the same name has the same rectangles, lane and edge.
    """
    numbers = {name: number for number, name in enumerate(names)}
    counts = [len(rows) for rows in groups]
    begins = np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))
    group = np.repeat(np.arange(len(counts)), counts)
    rectangles = np.concatenate(groups) if groups else np.zeros((0, 7))
    pairs = np.zeros((2, 0), dtype=np.int64)
    fresh = np.ones(len(rectangles), dtype=bool)
    if known is not None:
        now = np.array([numbers.get(name, -1) for name in known.numbers], dtype=np.int64)
        fresh = np.isin(group, now, invert=True)
        rows = np.stack((known.one, known.other))
        of = np.searchsorted(known.begins, rows, side="right") - 1
        pairs = (begins[now[of]] + rows - known.begins[of])[:, (now[of] >= 0).all(axis=0)]
    some = _near_to(rectangles, fresh)
    one, other = (some[rows] for rows in overlapping(rectangles[some], lane[group[some]], edge[group[some]]))
    new = fresh[one] | fresh[other]
    pairs = np.sort(np.concatenate((pairs, (one[new], other[new])), axis=1), axis=0)
    return Overlaps(numbers, begins, *pairs[:, np.lexsort(pairs[::-1])])


def _near_to(rectangles: Floats, these: Flags) -> Ints:
    """Return the rows of some rectangles, and of all rectangles that may overlap with one of them."""
    if these.all() or not these.any():
        return np.flatnonzero(these)
    square, width = _squares(rectangles)
    around = np.array([row * width + column for row in (-1, 0, 1) for column in (-1, 0, 1)])
    return np.flatnonzero(np.isin(square, np.add.outer(np.unique(square[these]), around)))


def _squares(rectangles: Floats) -> tuple[Ints, int]:
    """Return the number of each middle's square, and the difference to the row above.

    Overlapping rectangles are on one square or on neighbouring squares.
    """
    reach_m = 2.0 * float(np.hypot(rectangles[:, _HALF_M], rectangles[:, _WIDE_M]).max())
    column, row = np.floor((rectangles[:, :2] - rectangles[:, :2].min(axis=0)) / reach_m).astype(np.int64).T
    width = int(column.max()) + 3
    return row * width + column, width


def overlapping(rectangles: Floats, lane: Ints, edge: Ints) -> tuple[Ints, Ints]:
    """Return all pairs of overlapping rectangles, except pairs on one edge.

    O(n log n + k) for k pairs of near rectangles.

    Parameters
    ----------
    rectangles
        Seven columns: x and y of the middle, the direction ahead, half of length and width, height [m].
    lane, edge
        Numbers of the lane and the edge of each rectangle; an edge below 0 is none.
    """
    if not len(rectangles):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    square, width = _squares(rectangles)
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
    lane, edge = lane[order], edge[order]
    x, y, reach_m = (
        placed[:, _X].copy(),
        placed[:, _Y].copy(),
        np.hypot(placed[:, _HALF_M], placed[:, _WIDE_M]),
    )
    found = []
    for one, other in _near(ranges):
        near = (x[other] - x[one]) ** 2 + (y[other] - y[one]) ** 2 < (reach_m[one] + reach_m[other]) ** 2
        pairs = np.stack((one[near], other[near]))  # circles around the rest do not meet
        apart = (lane[pairs[0]] != lane[pairs[1]]) & (
            (edge[pairs[0]] < 0) | (edge[pairs[0]] != edge[pairs[1]])
        )
        pairs = pairs[:, apart]
        found.append(pairs[:, _overlap(*placed[pairs])])
    one, other = order[np.concatenate(found, axis=1)]
    return np.minimum(one, other), np.maximum(one, other)


def _near(ranges: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yield pairs of each rectangle and the rectangles in its ranges, in batches."""
    for begin, end in (ranges[:2], ranges[2:]):
        counts = np.maximum(end - begin, 0)
        before = np.concatenate(([0], np.cumsum(counts)))
        cuts = np.searchsorted(before, np.arange(_AT_ONCE, before[-1] + _AT_ONCE, _AT_ONCE))
        for first, last in pairwise((0, *np.minimum(cuts, len(counts)).tolist())):
            some = counts[first:last]
            one = np.repeat(np.arange(first, last), some)
            behind = np.arange(len(one)) - np.repeat(before[first:last] - before[first], some)
            yield one, np.repeat(begin[first:last], some) + behind


def _overlap(a: Floats, b: Floats) -> Flags:
    """Return which rectangles overlap, row by row: no line along a side of either separates them."""
    x, y = b[:, _X] - a[:, _X], b[:, _Y] - a[:, _Y]
    cos = np.abs(a[:, _AHEAD_X] * b[:, _AHEAD_X] + a[:, _AHEAD_Y] * b[:, _AHEAD_Y])
    sin = np.abs(a[:, _AHEAD_X] * b[:, _AHEAD_Y] - a[:, _AHEAD_Y] * b[:, _AHEAD_X])
    together = np.abs(a[:, _Z] - b[:, _Z]) < _ABOVE_M
    for one, other in ((a, b), (b, a)):
        u, v = one[:, _AHEAD_X], one[:, _AHEAD_Y]
        half, wide = other[:, _HALF_M], other[:, _WIDE_M]
        together &= np.abs(x * u + y * v) < one[:, _HALF_M] + half * cos + wide * sin
        together &= np.abs(x * v - y * u) < one[:, _WIDE_M] + half * sin + wide * cos
    return together
