"""Collision segments and collision pairs of closed paths (Zhou et al. 2020, Definition 1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.network.contacts import LaneContacts, lane_contacts, lanes_of, merge_intervals
from loopgate.network.loop import Loop

_JOIN_M = 1e-4
"""Stretches on neighbouring lanes meet at a lane's end up to rounding."""


@dataclass(frozen=True, slots=True)
class CollisionSegments:
    """The maximal continuous stretches of each path within 2 rho of another path, and which meet.

    Segment ``k`` lies on path ``path[k]``, is maximal with respect to path ``other[k]`` alone, and reaches
    from ``begin_m[k]`` to ``end_m[k]`` in arc length. A segment across the beginning of its path has an
    ``end_m`` beyond the path's length.

    `pairs`: collision pairs, shape (p, 2): numbers of segments on two paths that come within 2 rho of each
    other.
    """

    path: Ints
    other: Ints
    begin_m: Floats
    end_m: Floats
    pairs: Ints


def collision_segments(loops: Sequence[Loop], rho_m: float) -> CollisionSegments:
    """Find all collision segments and pairs of `loops` (Definition 1), exactly, by arc length.

    Every lane on which a vehicle may be counts as part of its path. A path that comes near itself does not
    conflict with itself.

    Lanes are compared once, however many loops use them. O(n log n) for n lane contacts times their users.

    Parameters
    ----------
    loops
        The paths; each has one robot (Assumption 3).
    rho_m
        Safe radius [m].
    """
    i, j, mine, theirs = _contacts_of_loops(loops, lane_contacts(lanes_of(loops), 2.0 * rho_m))
    n = len(loops)
    near_i, begin_i, end_i, group_i = merge_intervals(i * n + j, mine[:, 0], mine[:, 1], join=_JOIN_M)
    near_j, begin_j, end_j, group_j = merge_intervals(j * n + i, theirs[:, 0], theirs[:, 1], join=_JOIN_M)
    pairs = np.unique(np.stack((near_i, near_j + len(begin_i)), axis=1), axis=0)
    group = np.concatenate((group_i, group_j))
    begin, end = np.concatenate((begin_i, begin_j)), np.concatenate((end_i, end_j))
    return _round_the_beginning(loops, group // max(n, 1), group % max(n, 1), begin, end, pairs)


def _contacts_of_loops(loops: Sequence[Loop], contacts: LaneContacts) -> tuple[Ints, Ints, Floats, Floats]:
    """Return pairs of loops i < j, and for each the near stretches on i and on j, shape (n, 2) [m]."""
    number = {lane: k for k, lane in enumerate(contacts.lanes)}
    uses = sorted(
        (number[lane_id], i, span.begin_m, span.length_m)
        for i, loop in enumerate(loops)
        for span in loop.spans
        for lane_id in span.lane_ids
    )
    lane = np.array([use[0] for use in uses], dtype=np.int64)
    loop = np.array([use[1] for use in uses], dtype=np.int64)
    begin = np.array([use[2] for use in uses])
    length = np.array([use[3] for use in uses])
    first = np.searchsorted(lane, np.arange(len(contacts.lanes)))
    count = np.searchsorted(lane, np.arange(len(contacts.lanes)), side="right") - first
    # Every user of the one lane with every user of the other, as one flat table.
    rows = count[contacts.one] * count[contacts.other]
    row = np.repeat(np.arange(len(rows)), rows)
    local = np.arange(len(row)) - np.repeat(np.cumsum(rows) - rows, rows)
    width = count[contacts.other][row]
    a = first[contacts.one][row] + local // np.maximum(width, 1)
    b = first[contacts.other][row] + local % np.maximum(width, 1)
    same = contacts.one[row] == contacts.other[row]
    keep = np.where(same, loop[a] < loop[b], loop[a] != loop[b])
    row, a, b = row[keep], a[keep], b[keep]

    def stretch(use: Ints, low: Floats, high: Floats) -> Floats:
        return np.stack((begin[use] + low[row] * length[use], begin[use] + high[row] * length[use]), axis=1)

    on_a = stretch(a, contacts.one_begin, contacts.one_end)
    on_b = stretch(b, contacts.other_begin, contacts.other_end)
    turn = (loop[a] > loop[b])[:, None]
    i, j = np.minimum(loop[a], loop[b]), np.maximum(loop[a], loop[b])
    return i, j, np.where(turn, on_b, on_a), np.where(turn, on_a, on_b)


def _round_the_beginning(
    loops: Sequence[Loop], path: Ints, other: Ints, begin: Floats, end: Floats, pairs: Ints
) -> CollisionSegments:
    """Unite the last and the first segment of a path and its other where they meet at the beginning."""
    lap = np.array([loop.length_m for loop in loops])[path]
    key = path * len(loops) + other
    first = {int(key[k]): int(k) for k in np.flatnonzero(begin <= _JOIN_M)}
    last = {int(key[k]): int(k) for k in np.flatnonzero(end >= lap - _JOIN_M)}
    becomes = np.arange(len(path))
    end = end.copy()
    for pair, k in first.items():
        before = last.get(pair, k)
        if before != k:
            becomes[k] = before
            end[before] = lap[k] + end[k]
    kept = np.flatnonzero(becomes == np.arange(len(path)))
    place = np.full(len(path), -1, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    pairs = np.unique(place[becomes[pairs]], axis=0) if len(pairs) else pairs
    return CollisionSegments(path[kept], other[kept], begin[kept], end[kept], pairs)
