"""Closed tours through required streets: made from assignments, joined, and cut in two or more."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from loopgate.arrays import Floats, Ints

_WITHIN = 0.002
_CUT_AT = 4


def assigned(cost: Floats) -> Ints:
    """Return a tour through all nodes: the cheapest assignment of followers, patched.

    Karp ("A patching algorithm for the nonsymmetric traveling-salesman problem", SIAM J. Comput. 8, 1979).
    The diagonal of `cost` has the tours through a single node.
    """
    _, following = scipy.optimize.linear_sum_assignment(cost)
    return _patched(cost, following)


def joined(cost: Floats, tours: Sequence[Ints]) -> Ints:
    """Join several tours into one by exchanging followers where it costs least; the smallest tour first."""
    following = np.empty(sum(map(len, tours)), dtype=np.int64)
    for tour in tours:
        following[tour] = np.roll(tour, -1)
    return _patched(cost, following)


def _patched(cost: Floats, following: Ints) -> Ints:
    following = np.asarray(following, dtype=np.int64).copy()
    links = csr_array((np.ones(len(following)), (np.arange(len(following)), following)))
    _, label = connected_components(links, directed=False)
    sizes = np.bincount(label)
    for _ in range(len(sizes) - 1):
        alive = np.flatnonzero(sizes)
        smallest = alive[sizes[alive].argmin()]
        inside = label == smallest
        x, y = _cheapest_exchange(cost, following, np.flatnonzero(inside), np.flatnonzero(~inside))
        following[x], following[y] = following[y], following[x]
        sizes[label[y]] += sizes[smallest]
        sizes[smallest] = 0
        label[inside] = label[y]
    order = np.empty(len(following), dtype=np.int64)
    at = 0
    for k in range(len(order)):
        order[k] = at
        at = following[at]
    return order


def _cheapest_exchange(cost: Floats, following: Ints, some: Ints, others: Ints) -> tuple[int, int]:
    """Return a node of one set and a node of another whose exchange of followers costs least."""
    after = following[others]
    saved = cost[others, after]
    least, found = np.inf, (int(some[0]), int(others[0]))
    for x in some.tolist():
        extra = cost[x, after] - cost[x, following[x]] - saved + cost[others, following[x]]
        y = int(extra.argmin())
        if extra[y] < least:
            least, found = float(extra[y]), (x, int(others[y]))
    return found


def cut_in_two(cost: Floats, tour: Ints, power: int, scale: float) -> tuple[Ints, Ints]:
    """Return the two tours into which exchanging two followers cuts a tour of two or more best.

    Best is the least sum of lengths over `scale`, raised to `power`: both short, the longer above all.
    """
    begin, end = _best_cut(cost[np.ix_(tour, tour)], power, scale)
    return tour[begin : end + 1], np.concatenate((tour[end + 1 :], tour[:begin]))


def _best_cut(between: Floats, power: int, scale: float) -> tuple[int, int]:
    """Return first and last index of the piece to cut out of a tour; costs are in the tour's order."""
    size = len(between)
    step = between[np.arange(size), np.roll(np.arange(size), -1)]
    along = np.concatenate(([0.0], np.cumsum(step)))
    least, found = np.inf, (0, 0)
    for begin in range(size):
        before, end = (begin - 1) % size, np.arange(begin, min(size, begin + size - 1))
        inside, behind = along[end] - along[begin], (end + 1) % size
        piece = inside + between[end, begin]
        rest = along[size] - between[before, begin] - inside - step[end] + between[before, behind]
        longer, shorter = np.maximum(piece, rest) / scale, np.maximum(np.minimum(piece, rest), 0.0) / scale
        total = longer**power + shorter**power
        best = int(total.argmin())
        if total[best] < least:
            least, found = float(total[best]), (begin, int(end[best]))
    return found


def split(cost: Floats, tour: Ints, count: int, least: float) -> list[Ints]:
    """Cut a tour into up to `count` stretches, each closed by the shortest path, with the longest short.

    Frederickson, Hecht, Kim ("Approximation algorithms for some routing problems", SIAM J. Comput. 7, 1978),
    with the fewest stretches for a longest length by dynamic programming, and that length by bisection.

    Parameters
    ----------
    cost, tour, count
        Costs between all nodes, their order on the tour, and the largest number of stretches.
    least
        Lower bound on the longest stretch.
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
