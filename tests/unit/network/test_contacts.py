"""Stretches of lanes near each other, against hand-made geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest

from loopgate.network.contacts import lane_contacts, merge_intervals

Shape = tuple[tuple[float, float], ...]
EAST: Shape = ((0.0, 0.0), (100.0, 0.0))


def contacts(one: Shape, other: Shape, reach: float = 2.5) -> list[tuple[float, ...]]:
    """Return the rows of two different lanes of 100 m, in metres."""
    found = lane_contacts({"one": one, "other": other}, reach)
    return [
        tuple(100.0 * x for x in row[2:])
        for row in zip(
            found.one,
            found.other,
            found.one_begin,
            found.one_end,
            found.other_begin,
            found.other_end,
            strict=True,
        )
        if row[0] != row[1]
    ]


def test_a_lane_is_near_itself_all_along() -> None:
    """Vehicles on the same lane always conflict."""
    found = lane_contacts({"one": EAST}, 2.5)
    assert (found.one.tolist(), found.one_begin.tolist(), found.one_end.tolist()) == ([0], [0.0], [1.0])


def test_oncoming_lanes_do_not_conflict() -> None:
    """3.2 m apart is more than 2.5 m; at 2.4 m apart they conflict all along."""
    assert contacts(EAST, ((100.0, 3.2), (0.0, 3.2))) == []
    assert contacts(EAST, ((100.0, 2.4), (0.0, 2.4))) == [pytest.approx((0, 100, 0, 100))]


def test_a_crossing_at_right_angles() -> None:
    """A point of one is near the other iff it is at most 2.5 m from the crossing."""
    assert contacts(EAST, ((40.0, -50.0), (40.0, 50.0))) == [pytest.approx((37.5, 42.5, 47.5, 52.5))]


def test_a_crossing_at_an_angle() -> None:
    """At 30 degrees the distance to the other line is half the way to the crossing: 5 m to each side."""
    half = 50.0 * math.cos(math.radians(30.0)), 50.0 * math.sin(math.radians(30.0))
    other = ((50.0 - half[0], -half[1]), (50.0 + half[0], half[1]))
    assert contacts(EAST, other) == [pytest.approx((45, 55, 45, 55))]


def test_an_end_that_comes_near() -> None:
    """A lane that ends 2 m from another: within 2.5 m of its end are 1.5 m to each side (3-4-5)."""
    assert contacts(EAST, ((50.0, 102.0), (50.0, 2.0))) == [pytest.approx((48.5, 51.5, 99.5, 100))]


def test_ends_that_face_each_other() -> None:
    """Two lanes in line, 1 m between their ends: the last and the first 1.5 m are near."""
    assert contacts(EAST, ((101.0, 0.0), (201.0, 0.0))) == [pytest.approx((98.5, 100, 0, 1.5))]


def test_two_crossings_are_two_contacts() -> None:
    """A lane that crosses twice: two separate stretches on both, paired one to one."""
    zigzag = ((20.0, -10.0), (20.0, 15.0), (70.0, 15.0), (70.0, -10.0))  # 25 + 50 + 25 m
    assert sorted(contacts(EAST, zigzag)) == [
        pytest.approx((17.5, 22.5, 7.5, 12.5)),
        pytest.approx((67.5, 72.5, 87.5, 92.5)),
    ]


def test_stretches_over_several_pieces_are_one() -> None:
    """A lane cut into many pieces, one of them empty, beside a straight one: still one stretch."""
    pieces = tuple((float(x), 2.0) for x in (0, 10, 10, 30, 31, 77, 100))
    assert contacts(EAST, pieces) == [pytest.approx((0, 100, 0, 100))]


def test_a_lane_drawn_as_a_point() -> None:
    """A lane without drawn length is near as a whole."""
    assert contacts(EAST, ((50.0, 1.5), (50.0, 1.5))) == [pytest.approx((48, 52, 0, 100))]


def test_merging_is_by_group() -> None:
    """Overlaps are united within a group; touching intervals too, unless more overlap is asked for."""
    group = np.array([1, 0, 1, 1, 0])
    begin = np.array([5.0, 0.0, 0.0, 6.0, 2.0])
    end = np.array([6.0, 1.0, 5.0, 9.0, 3.0])
    row, low, high, of = merge_intervals(group, begin, end)
    assert (row.tolist(), low.tolist(), high.tolist(), of.tolist()) == (
        [2, 0, 2, 2, 1],
        [0.0, 2.0, 0.0],
        [1.0, 3.0, 9.0],
        [0, 0, 1],
    )
    assert len(merge_intervals(group, begin, end, join=-1e-6)[1]) == 5
