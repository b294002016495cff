"""Overlaps of rectangles in groups, of which some were compared before."""

import numpy as np
import pytest

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


@pytest.mark.parametrize("seed", range(20))
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


def test_only_what_is_near_a_new_group_is_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = [rows + np.array([1000.0 * k, 0, 0, 0, 0, 0, 0]) for k, rows in enumerate(groups(4, 1))]
    lane, edge = np.arange(4), np.arange(4)
    known = find_overlaps("abc", drawn[:3], lane[:3], edge[:3])
    compared: list[int] = []
    original = rectangles.overlapping

    def counted(rows: Floats, *others: Ints) -> tuple[Ints, Ints]:
        compared.append(len(rows))
        return original(rows, *others)

    monkeypatch.setattr(rectangles, "overlapping", counted)
    find_overlaps("abcd", drawn, lane, edge, known)
    assert compared == [len(drawn[3])]


@pytest.mark.parametrize("seed", range(20))
def test_no_pair_is_missed_and_far_pairs_are_not_looked_at(
    monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """It finds what a look at each two finds; sides are compared only where circles around meet."""
    drawn = groups(10, seed)
    rows = np.concatenate(drawn)
    one, other = np.triu_indices(len(rows), 1)
    together = rectangles._overlap(rows[one], rows[other])
    expected = set(zip(one[together].tolist(), other[together].tolist(), strict=True))
    looked_at: list[Floats] = []
    original = rectangles._overlap

    def noted(a: Floats, b: Floats) -> object:
        apart_m = np.hypot(*(a[:, :2] - b[:, :2]).T)
        looked_at.append(apart_m - np.hypot(a[:, 4], a[:, 5]) - np.hypot(b[:, 4], b[:, 5]))
        return original(a, b)

    monkeypatch.setattr(rectangles, "_overlap", noted)
    every_lane = np.arange(len(rows))
    found = rectangles.overlapping(rows, every_lane, every_lane)
    assert set(zip(*map(np.ndarray.tolist, found), strict=True)) == expected
    assert (np.concatenate(looked_at) <= 1e-9).all()
