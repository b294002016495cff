"""What vehicles waited for, by cause."""

from __future__ import annotations

from math import nan

import pandas as pd
import pytest

from loopgate.analysis import compute_longest_waits, compute_wait_causes, compute_waits
from loopgate.analysis.rows import run_row
from loopgate.analysis.waits import wait_figures
from loopgate.errors import AnalysisError
from loopgate.results.columns import EDGE_COLUMNS
from loopgate.results.figures import summary_rows

ROWS = [
    (5.0, "v2", "refuse", "c", "reserve"),
    (10.0, "v1", "refuse", "b", "occupied"),
    (12.0, "v1", "refuse", "b", "crossing"),
    (13.0, "v2", "grant", "c", "free"),
    (20.0, "v1", "refuse", "b", "occupied"),
    (25.0, "v1", "hold", "b", ""),
    (26.0, "v1", "grant", "b", "free"),
    (40.0, "v1", "refuse", "c", "red"),
    (50.0, "v2", "grant", "d", "free"),
]
"""V1 waits from 10 to 26, for a crossing between two spells for a full place, and from 40 on."""


def test_longest_waits_of_many_runs() -> None:
    """Mean and most over the runs that had a gate; causes for which nobody waited have no row."""
    runs = pd.DataFrame({"gate": ["open", "certified", "certified"], "vehicles": 40})
    runs = runs.assign(longest_crossing_s=[nan, 20.0, 30.0], longest_red_s=[nan, 0.0, 0.0])
    table = compute_longest_waits(runs=runs, by=["gate"])
    assert table.columns.tolist() == ["gate", "cause", "runs", "mean", "most"]
    assert table.to_numpy().tolist() == [["certified", "crossing", 2, 25.0, 30.0]]


def events() -> pd.DataFrame:
    """Return them as a trace, in no order by vehicle."""
    return pd.DataFrame(ROWS, columns=["time_s", "vehicle", "event", "place", "reason"])


def test_each_second_of_a_wait_is_for_the_last_reason_told() -> None:
    """Spells for one cause add up within a wait; a wait under way lasts to the end."""
    table = compute_wait_causes(events=events(), end_s=100.0)
    assert table.to_numpy().tolist() == [
        ["v1", "b", 10.0, "occupied", 8.0],
        ["v1", "b", 10.0, "crossing", 8.0],
        ["v1", "c", 40.0, "red", 60.0],
        ["v2", "c", 5.0, "reserve", 8.0],
    ]


def test_causes_add_up_to_the_waits() -> None:
    """Also where the period of observation cuts them."""
    for begin_s, end_s in ((0.0, 100.0), (11.0, 24.0), (13.0, 41.0)):
        causes = compute_wait_causes(events=events(), begin_s=begin_s, end_s=end_s)
        waits = compute_waits(events=events(), begin_s=begin_s, end_s=end_s)
        keys = ["vehicle", "since_s"]
        assert causes.groupby(keys)["wait_s"].sum().to_dict() == waits.groupby(keys)["wait_s"].sum().to_dict()


def test_the_longest_wait_and_the_longest_for_each_cause() -> None:
    """The longest wait is told with what it was for, longest first."""
    causes = compute_wait_causes(events=events(), end_s=45.0)
    assert wait_figures(causes) == {
        "longest_wait": {
            "vehicle": "v1",
            "place": "b",
            "street": "",
            "since_s": 10.0,
            "by_cause_s": {"crossing": 8.0, "occupied": 8.0},
        },
        "longest_waits_s": {"crossing": 8.0, "occupied": 8.0, "red": 5.0, "reserve": 8.0},
    }


def test_where_nobody_waits_there_is_no_longest_wait() -> None:
    """Nor where nothing was measured."""
    nothing: dict[str, object] = {"longest_wait": None, "longest_waits_s": {}}
    assert wait_figures(compute_wait_causes(events=events()[:0], end_s=45.0)) == nothing
    assert wait_figures(None) == nothing


def test_events_without_reasons_are_refused() -> None:
    """By the name of the column."""
    with pytest.raises(AnalysisError, match="the column reason is missing"):
        compute_wait_causes(events=events().drop(columns="reason"), end_s=45.0)


@pytest.mark.parametrize(("known", "crossing_s", "red_s"), [(True, 8.0, 0.0), (False, None, None)])
def test_a_row_keeps_the_longest_for_each_cause(
    known: bool,  # noqa: FBT001  a case
    crossing_s: float | None,
    red_s: float | None,
) -> None:
    """None of a run of which it is not known, such as one without a gate."""
    summary = {"vehicles": 3, "loops": 1, "duration_s": 3600.0, "laps": 3, "distance_km": 1.0}
    if known:
        summary["longest_waits_s"] = {"crossing": 8.0}  # type: ignore[assignment]  # of many kinds
    no_laps = pd.DataFrame(columns=["time_s", "vehicle", "event", "place"])
    no_edges = pd.DataFrame(columns=list(EDGE_COLUMNS))
    row = run_row(scenario={}, summary=summary, events=no_laps, edges=no_edges).row
    assert (row.get("longest_crossing_s"), row.get("longest_red_s")) == (crossing_s, red_s)


def test_the_table_of_a_run_says_what_the_longest_wait_was_for() -> None:
    """Who, for which place, and how long for which cause."""
    some = dict.fromkeys(
        (
            "vehicles",
            "loops",
            "duration_s",
            "laps",
            "distance_km",
            "mean_speed_mps",
            "laps_per_h",
            "km_per_h",
        ),
        1,
    )
    more = dict.fromkeys(("hold_s", "longest_wait_s", "collisions", "teleports", "decisions"), 1)
    clock = {"decision_us": {"median": 1, "p99": 1, "max": 1}, "wall_s": {"sumo": 1, "gate": 1, "total": 1}}
    rest: dict[str, object] = {"deadlocks": [], "refusals": {}, "audit": "clean", "idleness_s": None}
    reach = {"coverage_edges": None, "coverage_lane_km": None}
    longest = wait_figures(compute_wait_causes(events=events(), end_s=45.0))
    rows = dict(summary_rows({**some, **more, **clock, **rest, **reach, **longest}))
    assert rows["longest wait"] == "v1 for b: crossing 8 s, occupied 8 s"
    assert "longest wait" not in dict(summary_rows({**some, **more, **clock, **rest, **reach}))
