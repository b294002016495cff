"""The table of a simulated day."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pandas as pd
import pytest

from loopgate.results.columns import EVENT_COLUMNS

SCRIPT = Path(__file__).parents[3] / "analysis" / "day.py"


@pytest.fixture(scope="module")
def day() -> ModuleType:
    spec = importlib.util.spec_from_file_location("day", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["day"] = module
    spec.loader.exec_module(module)
    return module


def test_hours_are_told_apart(day: ModuleType) -> None:
    """v1 laps in both hours; v2 in the second only, after a wait of 50 s that began in the first."""
    rows = [
        (100.0, "v1", "lap", "l"),
        (3580.0, "v2", "refuse", "p"),
        (3590.0, "v2", "refuse", "p"),
        (3600.0, "v1", "lap", "l"),
        (3630.0, "v2", "grant", "p"),
        (3640.0, "v2", "grant", "q"),
        (3700.0, "v1", "lap", "l"),
        (3700.0, "v2", "lap", "l"),
    ]
    events = pd.DataFrame([(*row, "", "") for row in rows], columns=list(EVENT_COLUMNS))
    table = day.hours_table(events, 2, [*[90.0] * 5, 100.0, *[104.0] * 6, 999.0])
    assert table.to_dict("list") == {
        "hour": [1, 2],
        "laps": [2, 2],
        "without": [1, 0],
        "wait_s": [0.0, 50.0],
        "memory_mb": [100.0, 104.0],
    }


def test_the_drift_leaves_out_the_first_hour(day: ModuleType) -> None:
    """A straight line through the others, six an hour; with one other there is none."""
    assert day.drift_mb_per_h([*[10.0] * 6, 100.0, 102.0, 104.0]) == pytest.approx(12.0)
    assert pd.isna(day.drift_mb_per_h([*[10.0] * 6, 100.0]))


def test_laps_not_counted_are_lost(day: ModuleType) -> None:
    """250 m on a loop of 100 m are two laps."""
    vehicles = pd.DataFrame({"distance_m": [250.0, 200.0], "loop_length_m": [100.0, 100.0], "laps": [1, 2]})
    assert day.laps_lost(vehicles) == 1
