"""Finds overlapping rectangles among many."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from loopgate.arrays import Flags, Floats, Ints

_X, _Y, _AHEAD_X, _AHEAD_Y, _HALF_M, _WIDE_M, _Z = range(7)

ABOVE_M = 2.5
"""Bodies on lanes with this difference in height do not touch [m]."""

_AT_ONCE = 10_000
_IN_TREE = 300_000
"""Number of rectangles that are compared at once, and whose neighbours are in one tree, to save memory. A
rectangle in a tree takes half a kilobyte, and a city has millions."""


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
    one, other = overlapping(rectangles, lane[group], edge[group], fresh)
    pairs = np.sort(np.concatenate((pairs, (one, other)), axis=1), axis=0)
    return Overlaps(numbers, begins, *pairs[:, np.lexsort(pairs[::-1])])


def overlapping(
    rectangles: Floats, lane: Ints, edge: Ints, fresh: Flags, in_tree: int = _IN_TREE
) -> tuple[Ints, Ints]:
    """Return all pairs of overlapping rectangles with a fresh one, except pairs on one edge.

    Trees of shapely, one for each strip from south to north, find rectangles that are near each other.
    O(n log n + k) for k such pairs.

    Parameters
    ----------
    rectangles
        Seven columns: x and y of the middle, the direction ahead, half of length and width, height [m].
    lane, edge
        Numbers of the lane and the edge of each rectangle; an edge below 0 is none.
    fresh
        Whether a rectangle is compared with all others; the others are not compared with each other.
    in_tree
        Most rectangles of a strip.
    """
    x, y = rectangles[:, _X], rectangles[:, _Y]
    ahead_x, ahead_y, half_m, wide_m = np.abs(rectangles[:, _AHEAD_X:_Z].T)
    east_m, north_m = ahead_x * half_m + ahead_y * wide_m, ahead_y * half_m + ahead_x * wide_m
    eastward, widest_m = np.argsort(x, kind="stable"), float(east_m.max(initial=0.0))
    x_in_order = x[eastward]
    found = [np.zeros((2, 0), dtype=np.int64)]
    for first in range(0, len(eastward), in_tree):
        strip = eastward[first : first + in_tree]
        strip = strip[fresh[strip]]
        if not len(strip):
            continue
        from_m, to_m = (x[strip] - east_m[strip]).min(), (x[strip] + east_m[strip]).max()
        begin = int(np.searchsorted(x_in_order, from_m - widest_m, side="left"))
        end = int(np.searchsorted(x_in_order, to_m + widest_m, side="right"))
        near = np.sort(eastward[begin:end])
        half_x, half_y = east_m[near], north_m[near]
        boxes = shapely.box(x[near] - half_x, y[near] - half_y, x[near] + half_x, y[near] + half_y)
        tree, at = shapely.STRtree(boxes), np.searchsorted(near, np.sort(strip))
        for number in range(0, len(at), _AT_ONCE):
            asked = at[number : number + _AT_ONCE]
            of, to = tree.query(boxes[asked])
            one, other = near[asked[of]], near[to]
            apart = ((one < other) | ~fresh[other]) & (lane[one] != lane[other])
            pairs = np.stack((one, other))[:, apart & ((edge[one] < 0) | (edge[one] != edge[other]))]
            found.append(pairs[:, _overlap(*rectangles[pairs])])
    one, other = np.concatenate(found, axis=1)
    return np.minimum(one, other), np.maximum(one, other)


def _overlap(a: Floats, b: Floats) -> Flags:
    """Return which rectangles overlap, row by row: no line along a side of either separates them."""
    x, y = b[:, _X] - a[:, _X], b[:, _Y] - a[:, _Y]
    cos = np.abs(a[:, _AHEAD_X] * b[:, _AHEAD_X] + a[:, _AHEAD_Y] * b[:, _AHEAD_Y])
    sin = np.abs(a[:, _AHEAD_X] * b[:, _AHEAD_Y] - a[:, _AHEAD_Y] * b[:, _AHEAD_X])
    together = np.abs(a[:, _Z] - b[:, _Z]) < ABOVE_M
    for one, other in ((a, b), (b, a)):
        u, v = one[:, _AHEAD_X], one[:, _AHEAD_Y]
        half, wide = other[:, _HALF_M], other[:, _WIDE_M]
        together &= np.abs(x * u + y * v) < one[:, _HALF_M] + half * cos + wide * sin
        together &= np.abs(x * v - y * u) < one[:, _WIDE_M] + half * sin + wide * cos
    return together
