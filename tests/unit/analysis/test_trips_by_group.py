"""Trips of runs, by group."""

from __future__ import annotations

import pandas as pd
import pytest

from loopgate.analysis import compute_trips
from loopgate.errors import AnalysisError

COLUMNS = ["gate", "status", "arrived", "unfinished", "mean_trip_s", "mean_waiting_s", "mean_time_loss_s"]
COLUMNS += ["mean_depart_delay_s", "mean_delay_s", "worst_delay_s"]
RUNS = pd.DataFrame(
    [
        ("certified", "ok", 40, 0, 60.0, 3.0, 8.0, 2.0, 10.0, 30.0),
        ("certified", "ok", 30, 10, 80.0, 5.0, 10.0, 4.0, 14.0, 50.0),
        ("certified", "failed", None, None, None, None, None, None, None, None),
        ("open", "ok", 0, 40, None, 9.0, 20.0, 1.0, 21.0, 90.0),
        ("loops", "ok", None, None, None, None, None, 7.0, None, None),
    ],
    columns=COLUMNS,
)


def test_by_hand() -> None:
    """Means over runs, and the worst of all; runs on loops are none, though theirs may depart later."""
    gated, free = compute_trips(runs=RUNS, by=["gate"]).to_dict("records")
    assert gated == {
        "gate": "certified",
        "runs": 2,
        "arrived": 35.0,
        "unfinished": 5.0,
        "mean_trip_s": 70.0,
        "mean_waiting_s": 4.0,
        "mean_time_loss_s": 9.0,
        "mean_depart_delay_s": 3.0,
        "mean_delay_s": 12.0,
        "worst_delay_s": 50.0,
    }
    assert (free["gate"], free["runs"], free["arrived"]) == ("open", 1, 0.0)
    assert pd.isna(free["mean_trip_s"])


def test_a_missing_column_is_named() -> None:
    """Rather than a KeyError."""
    with pytest.raises(AnalysisError, match="the column mean_waiting_s is missing"):
        compute_trips(runs=RUNS.drop(columns="mean_waiting_s"))
