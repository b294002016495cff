"""Visits, revisit intervals and idleness against cases worked out by hand."""

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from loopgate.analysis import compute_edge_holds, compute_edges, compute_revisit_intervals, compute_revisits
from loopgate.errors import AnalysisError
from loopgate.results.columns import EDGE_COLUMNS, EVENT_COLUMNS


def events(*rows: tuple[float, str, str, str]) -> pd.DataFrame:
    return pd.DataFrame([(*row, "") for row in rows], columns=list(EVENT_COLUMNS[:5]))


THREE_VISITS = events((6.0, "v2", "edge", "a"), (2.0, "v1", "edge", "a"), (7.0, "v1", "edge", "a"))


def test_revisit_intervals_are_between_any_two_visits() -> None:
    """Visits of a at 2, 6 and 7 s, by two vehicles and out of order: intervals 4 and 1."""
    table = compute_revisit_intervals(events=THREE_VISITS, end_s=10)
    assert table["revisit_s"].tolist() == [4.0, 1.0]
    assert table["begin_s"].tolist() == [2.0, 6.0]


def test_revisits_by_hand() -> None:
    """Gaps 0-2, 2-6, 6-7, 7-10: idleness is (4 + 16 + 1 + 9) / 2 / 10 = 1.5 s."""
    row = compute_revisits(events=THREE_VISITS, end_s=10).iloc[0]
    assert row.to_dict() == {
        "edge": "a",
        "visits": 3,
        "mean_revisit_s": 2.5,
        "max_revisit_s": 4.0,
        "weighted_revisit_s": (16 + 1) / (4 + 1),
        "idleness_s": 1.5,
        "worst_idleness_s": 4.0,
    }


@given(
    visits=st.lists(st.tuples(st.integers(0, 60), st.sampled_from("abc"))),
    begin=st.integers(0, 40),
    lasts=st.integers(1, 20),
)
def test_idleness_against_counting_by_the_quarter_second(
    visits: list[tuple[int, str]], begin: int, lasts: int
) -> None:
    """Brute force: how long ago the last visit was, at every quarter of a second of the measured time.

    Between visits the time since the last one grows evenly, so the mean of its values in the middles of
    the quarters is its mean, and its greatest value is that at the end of some quarter.
    """
    table = compute_revisits(
        events=events(*((float(t), "v", "edge", edge) for t, edge in visits)),
        begin_s=begin,
        end_s=begin + lasts,
        edges=list("abcd"),
    ).set_index("edge")
    for edge in "abcd":
        times = [t for t, visited in visits if visited == edge]

        def since(moment: float, times: list[int] = times) -> float:
            return moment - max((t for t in times if t < moment), default=0)

        quarters = [begin + k / 4 for k in range(4 * lasts)]
        mean = sum(since(q + 0.125) for q in quarters) / len(quarters)
        assert table.loc[edge, "idleness_s"] == pytest.approx(mean)
        assert table.loc[edge, "worst_idleness_s"] == max(since(q + 0.25) for q in quarters)
        assert table.loc[edge, "visits"] == sum(begin < t <= begin + lasts for t in times)


def test_the_worst_idleness_is_that_of_the_measured_time() -> None:
    """Visits at 2, 6 and 7 s. The gap 2-6 counts whole if it ends in the period, not if it ended before.

    In (4, 8] it is 4 s; in (6, 8] 1 s, the end of the period included; in (7, 30] 23 s, though open.
    """
    for begin, end, worst in ((4, 8, 4.0), (6, 8, 1.0), (7, 30, 23.0)):
        row = compute_revisits(events=THREE_VISITS, begin_s=begin, end_s=end).iloc[0]
        assert row["worst_idleness_s"] == worst


def test_visits_in_the_same_step_are_no_time_apart() -> None:
    """Two vehicles enter at once: one interval, of 0 s; weighted by its length it is still 0 s."""
    both = events((2.0, "v", "edge", "a"), (2.0, "w", "edge", "a"))
    assert compute_revisits(events=both, end_s=4).iloc[0]["weighted_revisit_s"] == 0.0


def test_the_period_clips_idleness_but_remembers_the_last_visit() -> None:
    """From 4 s: the gap 2-6 counts from 4 on, where idleness is 2 already.

    Areas: 2-6 clipped to 4-6 is (16 - 4) / 2 = 6; 6-7 is 0.5; 7-10 is 4.5; sum 11 over 6 s.
    """
    row = compute_revisits(events=THREE_VISITS, begin_s=4, end_s=10).iloc[0]
    assert row["visits"] == 2
    assert row["mean_revisit_s"] == 2.5
    assert row["idleness_s"] == pytest.approx(11 / 6)


def test_idleness_before_the_first_visit_counts_from_time_zero() -> None:
    """From 1 s: gap 0-2 counts from 1 on, where idleness is 1: (4 - 1) / 2; then 8 + 0.5 + 4.5; over 9 s."""
    row = compute_revisits(events=THREE_VISITS, begin_s=1, end_s=10).iloc[0]
    assert row["idleness_s"] == pytest.approx((1.5 + 8 + 0.5 + 4.5) / 9)


def test_events_after_the_end_do_not_count() -> None:
    """Up to 6.5 s there are two visits and one interval."""
    row = compute_revisits(events=THREE_VISITS, end_s=6.5).iloc[0]
    assert row["visits"] == 2
    assert row["max_revisit_s"] == 4.0


def test_an_edge_never_visited_is_idle_since_time_zero() -> None:
    """Idleness of an edge never visited grows from 0 to 10 s: mean 5; from 4 s on: (100 - 16) / 2 / 6 = 7."""
    never = compute_revisits(events=THREE_VISITS, end_s=10, edges=["b", "a"])
    assert never["edge"].tolist() == ["b", "a"]
    assert never.iloc[0]["visits"] == 0
    assert pd.isna(never.iloc[0]["mean_revisit_s"])
    assert never.iloc[0]["idleness_s"] == 5.0
    late = compute_revisits(events=THREE_VISITS, begin_s=4, end_s=10, edges=["b"])
    assert late.iloc[0]["idleness_s"] == 7.0


def test_hold_time_goes_to_the_edge_the_vehicle_stands_on() -> None:
    """v1 stands on a from 3 to 5 and on b from 8 to the end; v2's hold has no known edge."""
    log = events(
        (0.0, "v1", "edge", "a"),
        (3.0, "v1", "hold", "p1"),
        (5.0, "v1", "go", "p1"),
        (6.0, "v1", "edge", "b"),
        (8.0, "v1", "hold", "p2"),
        (1.0, "v2", "hold", "p1"),
        (2.0, "v2", "go", "p1"),
    )
    assert compute_edge_holds(events=log, end_s=10).to_dict("list") == {
        "edge": ["a", "b"],
        "hold_s": [2.0, 2.0],
    }
    assert compute_edge_holds(events=log, begin_s=4, end_s=10)["hold_s"].tolist() == [1.0, 2.0]


def test_the_edge_table_has_the_columns_of_the_run_folder() -> None:
    """Edges keep their order; one without events has no visits and no hold."""
    edges = pd.DataFrame({"edge": ["z", "a"], "length_m": [5.0, 7.0], "shape": ["0,0 5,0", "5,0 5,7"]})
    table = compute_edges(events=THREE_VISITS, edges=edges, end_s=10)
    assert tuple(table.columns) == EDGE_COLUMNS
    assert table["edge"].tolist() == ["z", "a"]
    assert table["visits"].tolist() == [0, 3]
    assert table["hold_s"].tolist() == [0.0, 0.0]


def test_no_events_at_all() -> None:
    """A run in which nothing happened has idle edges and no error."""
    edges = pd.DataFrame({"edge": ["a"], "length_m": [7.0], "shape": ["5,0 5,7"]})
    table = compute_edges(events=events(), edges=edges, end_s=10)
    assert table["idleness_s"].tolist() == [5.0]
    assert compute_revisit_intervals(events=events(), end_s=10).empty


@pytest.mark.parametrize("period", [(0.0, 0.0), (5.0, 4.0), (-1.0, 4.0), (0.0, float("inf"))])
def test_a_period_that_is_none_is_refused(period: tuple[float, float]) -> None:
    """The error names both ends."""
    with pytest.raises(AnalysisError, match=r"the period from .* s to .* s is none"):
        compute_revisits(events=THREE_VISITS, begin_s=period[0], end_s=period[1])


def test_a_missing_column_is_named() -> None:
    """The error names the table, the column and what there is."""
    with pytest.raises(AnalysisError, match="events: the column place is missing; the table has time_s"):
        compute_revisits(events=THREE_VISITS.drop(columns="place"), end_s=10)
