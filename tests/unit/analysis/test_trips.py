"""Laps, holds, waits and throughput against cases worked out by hand."""

import pandas as pd
import pytest

from loopgate.analysis import (
    compute_holds,
    compute_laps,
    compute_throughput,
    compute_vehicle_holds,
    compute_waits,
)
from loopgate.results.columns import EVENT_COLUMNS


def events(*rows: tuple[float, str, str, str]) -> pd.DataFrame:
    return pd.DataFrame([(*row, "") for row in rows], columns=list(EVENT_COLUMNS[:5]))


LAPS = events(
    (0.0, "v1", "start", "p"),
    (30.0, "v1", "lap", "p"),
    (70.0, "v1", "lap", "p"),
    (0.0, "v2", "start", "q"),
    (50.0, "v2", "lap", "q"),
    (0.0, "v2", "edge", "e1"),
    (20.0, "v2", "edge", "e2"),
    (20.0, "late", "lap", "q"),
    (60.0, "late", "lap", "q"),
)
WAITS = events(
    (1.0, "v1", "refuse", "p"),
    (2.0, "v1", "hold", "p"),
    (3.0, "v1", "refuse", "p"),
    (6.0, "v1", "grant", "p"),
    (6.5, "v1", "go", "p"),
    (7.0, "v1", "grant", "q"),
    (8.0, "v1", "refuse", "r"),
    (9.0, "v1", "hold", "r"),
    (4.0, "v2", "grant", "p"),
)


def test_lap_times_from_start_and_from_lap_to_lap() -> None:
    """v1: 30 and 40 s; v2: 50 s; a vehicle without a start row has no first lap time, but its second."""
    laps = compute_laps(events=LAPS, end_s=100)
    assert list(zip(laps["vehicle"], laps["lap"], laps["lap_s"], strict=True)) == [
        ("late", 2, 40.0),
        ("v1", 1, 30.0),
        ("v1", 2, 40.0),
        ("v2", 1, 50.0),
    ]


def test_a_first_lap_without_a_start_lasts_from_the_first_edge() -> None:
    """Ungated runs have no states to start in: from the first edge at 1 s to the lap at 31 s."""
    log = events((1.0, "v", "edge", "e1"), (9.0, "v", "edge", "e2"), (31.0, "v", "lap", "e1"))
    assert compute_laps(events=log, end_s=40)["lap_s"].tolist() == [30.0]


def test_names_kept_as_categories_give_the_same() -> None:
    """Run folders keep vehicles, events and places as categories, some of which do not occur."""
    kinds = {"vehicle": "category", "event": "category", "place": "category"}
    for log in (LAPS, WAITS):
        other = log.astype(kinds).iloc[:5]
        for function in (compute_laps, compute_holds, compute_waits, compute_vehicle_holds):
            expected = function(events=log.iloc[:5], end_s=100)
            pd.testing.assert_frame_equal(function(events=other, end_s=100), expected)


def test_laps_count_where_they_end() -> None:
    """In (30, 60] end v2's first and the latecomer's second lap; v1 completed one at 30 s, before."""
    laps = compute_laps(events=LAPS, begin_s=30, end_s=60)
    assert laps["vehicle"].tolist() == ["late", "v2"]


def test_holds_by_hand() -> None:
    """v1 stands 2 to 6.5 s and from 9 s on; seen up to 10 s, the second is open."""
    holds = compute_holds(events=WAITS, end_s=10)
    assert holds["hold_s"].tolist() == [4.5, 1.0]
    assert holds["open"].tolist() == [False, True]
    assert holds["place"].tolist() == ["p", "r"]


def test_a_hold_is_clipped_to_the_period() -> None:
    """From 5 s on, 1.5 s of the first hold remain, which began at 2 s."""
    first = compute_holds(events=WAITS, begin_s=5, end_s=10).iloc[0]
    assert (first["since_s"], first["begin_s"], first["hold_s"]) == (2.0, 5.0, 1.5)


def test_waits_last_from_the_first_refusal_to_the_grant() -> None:
    """A second refusal for another reason belongs to the same wait: 1 to 6 s; then 8 s to the end."""
    waits = compute_waits(events=WAITS, end_s=10)
    assert waits["wait_s"].tolist() == [5.0, 2.0]
    assert waits["open"].tolist() == [False, True]


def test_per_vehicle() -> None:
    """v1 stood 5.5 s and waited 5 s at most; v2 was never refused."""
    table = compute_vehicle_holds(events=WAITS, end_s=10)
    assert table.to_dict("list") == {
        "vehicle": ["v1", "v2"],
        "laps": [0, 0],
        "hold_s": [5.5, 0.0],
        "longest_wait_s": [5.0, 0.0],
    }


def test_throughput() -> None:
    """5 laps in 100 s are 180 per hour; 4 km in 100 s are 144 km/h; from 40 s on, 3 laps in 60 s."""
    row = compute_throughput(events=LAPS, end_s=100, distance_m=4000).iloc[0]
    assert row.to_dict() == {"laps": 5, "laps_per_h": 180.0, "km_per_h": 144.0}
    later = compute_throughput(events=LAPS, begin_s=40, end_s=100).iloc[0]
    assert later["laps_per_h"] == pytest.approx(180.0)
    assert pd.isna(later["km_per_h"])


def test_no_events() -> None:
    """Tables without rows keep their columns."""
    assert compute_laps(events=events(), end_s=1).empty
    assert compute_holds(events=events(), end_s=1).empty
    assert compute_vehicle_holds(events=events(), end_s=1).empty
    assert compute_throughput(events=events(), end_s=3600)["laps_per_h"].tolist() == [0.0]
