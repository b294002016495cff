"""Deadlock rates and Kaplan-Meier curves by hand and against lifelines."""

import numpy as np
import pandas as pd
import pytest
from lifelines import KaplanMeierFitter

from loopgate.analysis import compute_deadlock_rate, compute_survival, compute_time_to_deadlock
from loopgate.errors import AnalysisError


def runs(*rows: tuple[str, float | None, float]) -> pd.DataFrame:
    frame = pd.DataFrame(rows, columns=["gate", "first_deadlock_s", "observed_s"])
    return frame.assign(
        status="ok", vehicles=10, deadlocks=frame["first_deadlock_s"].notna().astype(int)
    ).astype({"first_deadlock_s": float})


HAND = runs(("g", 2, 2), ("g", None, 3), ("g", 4, 4), ("g", 4, 4), ("g", None, 10), ("g", None, 10))


def test_rate_counts_runs_and_leaves_failures_out() -> None:
    """3 of 6 runs; a failed run is no run without deadlock."""
    failed = runs(("g", None, 0)).assign(status="failed")
    row = compute_deadlock_rate(runs=pd.concat([HAND, failed])).iloc[0]
    assert (row["runs"], row["deadlocked"], row["rate"]) == (6, 3, 0.5)
    assert row["low"] == pytest.approx(0.1876, abs=1e-4)


def test_kaplan_meier_by_hand() -> None:
    """At 2 s one of 6: 5/6. At 3 s one is censored. At 4 s two of 4: 5/12. The rest is censored at 10 s."""
    curve = compute_survival(runs=HAND)
    assert curve["time_s"].tolist() == [0, 2, 3, 4, 10]
    assert curve["at_risk"].tolist() == [6, 6, 5, 4, 2]
    assert curve["deadlocked"].tolist() == [0, 1, 0, 2, 0]
    assert curve["censored"].tolist() == [0, 0, 1, 0, 2]
    assert curve["survival"].tolist() == pytest.approx([1, 5 / 6, 5 / 6, 5 / 12, 5 / 12])


@pytest.mark.parametrize("seed", range(5))
def test_kaplan_meier_as_in_lifelines(seed: int) -> None:
    """Survival and its log-log Greenwood interval agree at every time, ties included."""
    random = np.random.default_rng(seed)
    horizon = 40.0
    times = np.ceil(random.exponential(30, 60))
    locked = times < horizon
    frame = runs(*(("g", t if hit else None, min(t, horizon)) for t, hit in zip(times, locked, strict=True)))
    ours = compute_survival(runs=frame).set_index("time_s")
    theirs = KaplanMeierFitter().fit(np.minimum(times, horizon), locked)
    expected = theirs.survival_function_["KM_estimate"].reindex(ours.index)
    assert ours["survival"].to_numpy() == pytest.approx(expected.to_numpy())
    interval = theirs.confidence_interval_.reindex(ours.index)
    known = ours["low"].notna().to_numpy()
    assert known.sum() > 10
    assert ours["low"].to_numpy()[known] == pytest.approx(interval.iloc[:, 0].to_numpy()[known])
    assert ours["high"].to_numpy()[known] == pytest.approx(interval.iloc[:, 1].to_numpy()[known])


def test_a_gate_without_deadlock_survives_to_the_end() -> None:
    """All censored: the curve stays at 1 and has no interval, rather than a time that is infinite."""
    curve = compute_survival(runs=runs(("g", None, 5), ("g", None, 9)))
    assert curve["survival"].tolist() == [1, 1, 1]
    assert curve["censored"].tolist() == [0, 1, 1]
    assert curve["low"].isna().all()


def test_time_to_deadlock_by_hand() -> None:
    """Median 4 s. Area up to 10 s: 2 + 2 * 5/6 + 6 * 5/12 = 6 1/6; the other gate never locks up: 10."""
    table = compute_time_to_deadlock(runs=pd.concat([HAND, runs(("h", None, 12))]))
    hand, other = table.iloc[0], table.iloc[1]
    assert hand["median_s"] == 4
    assert hand["restricted_mean_s"] == pytest.approx(2 + 2 * 5 / 6 + 6 * 5 / 12)
    assert pd.isna(other["median_s"])
    assert other["restricted_mean_s"] == other["horizon_s"] == 10


def test_the_horizon_is_not_cut_short_by_a_gate_that_always_locks_up() -> None:
    """One gate locks up at 2 s for certain; the other is watched for 12 s, and both are known up to there."""
    table = compute_time_to_deadlock(runs=runs(("g", 2, 2), ("h", None, 12)))
    assert table["restricted_mean_s"].tolist() == [2, 12]


def test_no_runs() -> None:
    """Empty tables keep their columns."""
    assert compute_survival(runs=HAND.iloc[:0]).empty
    assert list(compute_deadlock_rate(runs=HAND.iloc[:0]).columns) == [
        "gate",
        "vehicles",
        "runs",
        "deadlocked",
        "rate",
        "low",
        "high",
    ]
    assert compute_time_to_deadlock(runs=HAND.iloc[:0]).empty


def test_a_missing_column_is_named() -> None:
    """An axis that the table does not have is an error of the caller's."""
    with pytest.raises(AnalysisError, match="the column rho is missing"):
        compute_deadlock_rate(runs=HAND, by=["rho"])
