"""Closed tours through required streets: made from assignments, joined, and cut in two or more."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

__all__ = ["assigned", "cut_in_two", "joined", "split"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_WITHIN = 0.002
_CUT_AT = 4


def assigned(cost: Floats) -> Ints:
    """Return one tour through everything: the cheapest assignment of followers, patched.

    Karp ("A patching algorithm for the nonsymmetric traveling-salesman problem", SIAM J. Comput. 8, 1979).
    The diagonal of `cost` is that of a tour through one alone.
    """
    _, following = linear_sum_assignment(cost)
    return _patched(cost, following)


def joined(cost: Floats, tours: Sequence[Ints]) -> Ints:
    """Return one tour made of several, by exchanging followers, the smallest first, where it costs least."""
    following = np.empty(sum(map(len, tours)), dtype=np.int64)
    for tour in tours:
        following[tour] = np.roll(tour, -1)
    return _patched(cost, following)


def _patched(cost: Floats, following: Ints) -> Ints:
    following = following.copy()
    label = _cycles(following)
    sizes = np.bincount(label)
    ids = np.arange(len(following))
    own = cost[ids, following]
    for _ in range(len(sizes) - 1):
        alive = np.flatnonzero(sizes)
        smallest = alive[sizes[alive].argmin()]
        inside = label == smallest
        a, b = ids[inside], ids[~inside]
        extra = cost[np.ix_(a, following[b])] + cost[np.ix_(b, following[a])].T - own[a][:, None] - own[b]
        i, j = divmod(int(extra.argmin()), len(b))
        x, y = a[i], b[j]
        following[x], following[y] = following[y], following[x]
        own[x], own[y] = cost[x, following[x]], cost[y, following[y]]
        sizes[label[y]] += sizes[smallest]
        sizes[smallest] = 0
        label[inside] = label[y]
    order = np.empty(len(following), dtype=np.int64)
    at = 0
    for k in range(len(order)):
        order[k] = at
        at = following[at]
    return order


def _cycles(following: Ints) -> Ints:
    label = np.full(len(following), -1)
    count = 0
    steps = following.tolist()
    for begin in range(len(steps)):
        at = begin
        if label[at] < 0:
            while label[at] < 0:
                label[at] = count
                at = steps[at]
            count += 1
    return label


def cut_in_two(cost: Floats, tour: Ints, power: float, scale: float) -> tuple[Ints, Ints]:
    """Return the two tours into which exchanging two followers cuts a tour of two or more best.

    Best is the least sum of lengths over `scale`, raised to `power`: both short, the longer above all.
    """
    size = len(tour)
    between = cost[np.ix_(tour, tour)]
    places = np.arange(size)
    onward = between[places, (places + 1) % size]
    along = np.concatenate(([0.0], np.cumsum(onward)))
    begin, end = places[:, None], places[None, :]
    piece = along[end] - along[begin] + between.T  # from begin to end, and back
    around = between[(places - 1) % size][:, (places + 1) % size]
    rest = (
        along[size]
        - onward[(places - 1) % size][:, None]
        - (along[end] - along[begin])
        - onward[None, :]
        + around
    )
    fits = (end >= begin) & (end - begin < size - 1)
    worth = np.where(fits, _raised(piece / scale, power) + _raised(rest / scale, power), np.inf)
    i, j = divmod(int(worth.argmin()), size)
    return tour[i : j + 1], np.concatenate((tour[j + 1 :], tour[:i]))


def _raised(values: Floats, power: float) -> Floats:
    return np.maximum(values, 0.0) ** power


def split(cost: Floats, tour: Ints, count: int, least: float) -> list[Ints]:
    """Cut a tour into up to `count` stretches, each closed by the shortest way, the longest short.

    Frederickson, Hecht, Kim ("Approximation algorithms for some routing problems", SIAM J. Comput. 7, 1978),
    with the fewest stretches for a longest length by dynamic programming, and that length by bisection.

    Parameters
    ----------
    cost, tour, count
        Between all, the order, and how many stretches at most.
    least
        No longest stretch is shorter.
    """
    size = len(tour)
    best: list[Ints] = []
    high = float(cost[tour, np.roll(tour, -1)].sum()) * (1 + _WITHIN)
    for begin in np.linspace(0, size, _CUT_AT, endpoint=False).astype(int):
        order = np.roll(tour, -begin)
        along = np.concatenate(([0.0], np.cumsum(cost[order[:-1], order[1:]])))
        low, top = least, high
        if best and _fewest(cost, order, along, high * (1 - _WITHIN), count) is None:
            continue
        while top - low > _WITHIN * low:
            middle = (low + top) / 2
            if _fewest(cost, order, along, middle, count) is None:
                low = middle
            else:
                top = middle
        ends = _fewest(cost, order, along, top, count)
        if ends is not None:
            high, best = top, [order[i:j] for i, j in pairwise(ends)]
    return best


def _fewest(cost: Floats, order: Ints, along: Floats, most: float, count: int) -> list[int] | None:
    """Return where to cut so that no stretch is longer than `most`; None if more than `count` are needed."""
    size = len(order)
    pieces = np.full(size + 1, count + 1)
    pieces[0] = 0
    cut = np.zeros(size + 1, dtype=np.int64)
    for begin in range(size):
        if pieces[begin] >= count:
            continue
        closed = along[begin:] - along[begin] + cost[order[begin:], order[begin]]
        ends = np.flatnonzero(closed <= most) + begin + 1
        better = ends[pieces[ends] > pieces[begin] + 1]
        pieces[better], cut[better] = pieces[begin] + 1, begin
    if pieces[size] > count:
        return None
    found = [size]
    while found[-1]:
        found.append(int(cut[found[-1]]))
    return found[::-1]
