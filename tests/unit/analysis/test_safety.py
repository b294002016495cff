"""Counts of what must not happen."""

from __future__ import annotations

import pandas as pd
import pytest

from loopgate.analysis import compute_safety
from loopgate.errors import AnalysisError

COLUMNS = [
    "network",
    "gate",
    "status",
    "deadlocks",
    "collisions",
    "teleports",
    "audit",
    "laps_per_h",
    "longest_wait_s",
]
RUNS = pd.DataFrame(
    [
        ("n", "g", "ok", 0, 0, 0, "clean", 10.0, 5.0),
        ("n", "g", "ok", 2, 3, 0, "140 s: v1: SUMO reports a collision", 30.0, 7.0),
        ("n", "g", "failed", None, None, None, None, None, None),
        ("n", "open", "ok", 1, 0, 4, "not gated", 50.0, 0.0),
    ],
    columns=COLUMNS,
)


def test_by_hand() -> None:
    """A run with two deadlocks is one deadlocked run; a refused one counts apart; open has no audit."""
    gated, free = compute_safety(runs=RUNS).to_dict("records")
    assert gated == {
        "network": "n",
        "gate": "g",
        "failed": 1,
        "runs": 2,
        "deadlocked": 1,
        "collisions": 3,
        "teleports": 0,
        "audit_clean": 1,
        "laps_per_h": 20.0,
        "longest_wait_s": 7.0,
    }
    assert (free["deadlocked"], free["teleports"]) == (1, 4)
    assert pd.isna(free["audit_clean"])


def test_a_missing_column_is_named() -> None:
    """Rather than a KeyError."""
    with pytest.raises(AnalysisError, match="the column audit is missing"):
        compute_safety(runs=RUNS.drop(columns="audit"))
