"""Overlaps of rectangles in groups, of which some were compared before."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from loopgate.abstraction import rectangles
from loopgate.abstraction.rectangles import find_overlaps
from loopgate.arrays import Floats, Ints


def groups(count: int, seed: int) -> list[Floats]:
    """Return groups of one to twenty bodies on a square of 100 m."""
    rng = np.random.default_rng(seed)
    found = []
    for size in rng.integers(1, 21, count):
        turned = rng.uniform(0.0, 2 * np.pi, size)
        columns = (
            *rng.uniform(0.0, 100.0, (2, size)),
            np.cos(turned),
            np.sin(turned),
            rng.uniform(1.0, 6.0, size),
            np.full(size, 1.0),
            np.zeros(size),
        )
        found.append(np.column_stack(columns))
    return found


def every(count: int) -> tuple[Ints, Ints]:
    """Return a lane for each two groups, and an edge for each lane."""
    lane = np.arange(count) // 2
    return lane, lane


@given(st.integers(0, 10**6))
@settings(max_examples=15)
def test_what_is_known_changes_no_overlap(seed: int) -> None:
    names, drawn, (lane, edge) = list("abcdefghij"), groups(10, seed), every(10)
    rng = np.random.default_rng(seed)
    before, now = (rng.permutation(10)[:8] for _ in range(2))
    known = find_overlaps([names[k] for k in before], [drawn[k] for k in before], lane[before], edge[before])
    asked = [names[k] for k in now], [drawn[k] for k in now], lane[now], edge[now]
    again, anew = find_overlaps(*asked, known), find_overlaps(*asked)
    assert len(anew.one)
    for one, other in ((again.one, anew.one), (again.other, anew.other), (again.begins, anew.begins)):
        np.testing.assert_array_equal(one, other)


@given(st.integers(0, 10**6))
@settings(max_examples=15)
def test_no_pair_is_missed(seed: int) -> None:
    """It finds what a look at each two finds, also where only some are compared with all others."""
    rows = np.concatenate(groups(10, seed))
    one, other = np.triu_indices(len(rows), 1)
    together = rectangles._overlap(rows[one], rows[other])
    fresh = np.arange(len(rows)) % 3 == seed % 3
    every_lane = np.arange(len(rows))
    for asked in (fresh, np.ones(len(rows), dtype=bool)):
        expected = together & (asked[one] | asked[other])
        pairs = sorted(zip(one[expected].tolist(), other[expected].tolist(), strict=True))
        for in_tree in (1_000, 7):
            found = rectangles.overlapping(rows, every_lane, every_lane, asked, in_tree)
            assert sorted(zip(*map(np.ndarray.tolist, found), strict=True)) == pairs
