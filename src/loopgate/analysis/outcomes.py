"""Outcomes of many runs: deadlocks, time to deadlock, safety, trips."""

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import scipy

from loopgate.analysis.frames import check_columns, groups, succeeded, table
from loopgate.analysis.statistics import check_level, wilson_interval
from loopgate.errors import AnalysisError
from loopgate.results import columns as c

_MEANS = (
    *(c.ARRIVED, c.UNFINISHED, c.MEAN_TRIP, c.MEAN_WAITING),
    *(c.MEAN_TIME_LOSS, c.MEAN_DEPART_DELAY, c.MEAN_DELAY),
)
_OF_SAFETY = (c.AUDIT, c.COLLISIONS, c.DEADLOCKS, c.LAPS_PER_H, c.LONGEST_WAIT, c.TELEPORTS)
_SAFETY = (c.FAILED, c.RUNS, c.DEADLOCKED, c.COLLISIONS, c.TELEPORTS, c.CLEAN, c.LAPS_PER_H, c.LONGEST_WAIT)


def compute_deadlock_rate(
    *, runs: pd.DataFrame, by: Sequence[str] = (c.GATE, c.VEHICLES), level: float = 0.95
) -> pd.DataFrame:
    """Return the share of runs with a deadlock in each group, with Wilson's interval.

    One row per group: `by`, `RUNS`, `DEADLOCKED`, `RATE`, `LOW`, `HIGH` (shares, 0 to 1).

    Raises `AnalysisError` on a missing column or an invalid level.

    Parameters
    ----------
    runs
        One row per run, with `DEADLOCKS` and the columns of `by`; failed runs are left out.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_deadlock_rate
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": 40, "deadlocks": [1, 0, 0, 2]})
    >>> compute_deadlock_rate(runs=runs)[["runs", "deadlocked", "rate"]].values.tolist()
    [[4.0, 2.0, 0.5]]
    """
    check_columns(runs, [c.DEADLOCKS], "runs")
    rows = []
    for names, group in groups(succeeded(runs), by, "runs"):
        deadlocked = int((group[c.DEADLOCKS] > 0).sum())
        rate, low, high = wilson_interval(deadlocked, len(group), level=level)
        rows.append(
            {**names, c.RUNS: len(group), c.DEADLOCKED: deadlocked, c.RATE: rate, c.LOW: low, c.HIGH: high}
        )
    return table(rows, [*by, c.RUNS, c.DEADLOCKED, c.RATE, c.LOW, c.HIGH])


def compute_survival(
    *, runs: pd.DataFrame, by: Sequence[str] = (c.GATE,), level: float = 0.95
) -> pd.DataFrame:
    """Return Kaplan-Meier curves: the share of runs without a deadlock up to each time.

    One row per curve and time at which a run locked up or was censored, from time 0: `by`, `AT` [s],
    `AT_RISK`, `DEADLOCKED`, `CENSORED` (numbers of runs), `SURVIVAL`, `LOW`, `HIGH` (shares, 0 to 1). The
    interval is missing before the first deadlock, and when all runs are deadlocked.

    A run without deadlock is censored at its end: its time to deadlock is longer than the run. Intervals are
    Greenwood's on the log-log scale (Kalbfleisch and Prentice 1980).

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run, with `FIRST_DEADLOCK` [s] (missing: none) and `OBSERVED` [s]; failed runs are left
        out.
    by
        Columns by which runs are grouped; each group has a curve.
    level
        Confidence level of the pointwise interval.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_survival
    >>> runs = pd.DataFrame({"gate": "open", "first_deadlock_s": [900, None], "observed_s": [900, 3600]})
    >>> compute_survival(runs=runs)[["time_s", "survival"]].values.tolist()
    [[0.0, 1.0], [900.0, 0.5], [3600.0, 0.5]]
    """
    check_columns(runs, [c.FIRST_DEADLOCK, c.OBSERVED], "runs")
    check_level(level)
    curves = [
        _curve(group, level).assign(**names)[[*by, *_CURVE]]
        for names, group in groups(succeeded(runs), by, "runs")
        if len(group)
    ]
    return pd.concat(curves, ignore_index=True) if curves else table([], [*by, *_CURVE])


_CURVE = (c.AT, c.AT_RISK, c.DEADLOCKED, c.CENSORED, c.SURVIVAL, c.LOW, c.HIGH)


def _curve(group: pd.DataFrame, level: float) -> pd.DataFrame:
    locked = group[c.FIRST_DEADLOCK].notna().to_numpy()
    times = group[c.FIRST_DEADLOCK].where(locked, group[c.OBSERVED]).to_numpy(dtype=float)
    function = scipy.stats.ecdf(scipy.stats.CensoredData.right_censored(times, ~locked)).sf
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        # Nothing varies before the first deadlock and after the last: no interval there, and no news.
        warnings.simplefilter("ignore", RuntimeWarning)
        interval: Any = function.confidence_interval(confidence_level=level, method="log-log")
    at = function.quantiles
    counts = (
        pd.DataFrame({c.AT: times, "locked": locked})
        .groupby(c.AT)["locked"]
        .agg(["size", "sum"])
        .loc[pd.Index(at)]
    )
    size, deaths = counts["size"].to_numpy(), counts["sum"].to_numpy(dtype=int)
    curve = pd.DataFrame(
        {
            c.AT: at,
            c.AT_RISK: len(times) - np.concatenate(([0], np.cumsum(size)[:-1])),
            c.DEADLOCKED: deaths,
            c.CENSORED: size - deaths,
            c.SURVIVAL: function.probabilities,
            c.LOW: interval.low.probabilities,
            c.HIGH: interval.high.probabilities,
        }
    )
    if at[0] > 0:
        start = pd.DataFrame([(0.0, len(times), 0, 0, 1.0, np.nan, np.nan)], columns=list(_CURVE))
        curve = pd.concat([start, curve], ignore_index=True)
    return curve


def compute_time_to_deadlock(
    *, runs: pd.DataFrame, by: Sequence[str] = (c.GATE, c.VEHICLES), horizon_s: float | None = None
) -> pd.DataFrame:
    """Return median and restricted mean of the time to the first deadlock (Kaplan-Meier).

    One row per group: `by`, `RUNS`, `DEADLOCKED`, `MEDIAN_TIME` [s] (missing if fewer than half of the runs
    lock up), `RESTRICTED_MEAN` [s] (mean of the time to deadlock, cut off at the horizon; missing if no run
    of the group was observed that long and some did not lock up), `HORIZON` [s].

    Raises `AnalysisError` on a missing column or a horizon that is not positive.

    Parameters
    ----------
    runs
        One row per run, with `FIRST_DEADLOCK` [s] (missing: none) and `OBSERVED` [s]; failed runs are left
        out.
    horizon_s
        Time at which the restricted mean is cut off [s]; default: the longest time up to which all curves are
        known, so that groups can be compared.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_time_to_deadlock
    >>> runs = pd.DataFrame({"gate": "open", "first_deadlock_s": [900, None], "observed_s": [900, 3600]})
    >>> compute_time_to_deadlock(runs=runs, by=["gate"])[["median_s", "restricted_mean_s"]].values.tolist()
    [[900.0, 2250.0]]
    """
    if horizon_s is not None and not horizon_s > 0:
        msg = f"horizon {horizon_s:g} s is none; expected a time above 0 s"
        raise AnalysisError(msg)
    survival = compute_survival(runs=runs, by=by)
    curves = list(groups(survival, by, "runs")) if len(survival) else []
    if horizon_s is None:
        ends = [np.inf if curve[c.SURVIVAL].iloc[-1] <= 0 else curve[c.AT].iloc[-1] for _, curve in curves]
        horizon_s = min(ends, default=np.nan)
        horizon_s = float(survival[c.AT].max()) if np.isinf(horizon_s) else horizon_s
    rows = []
    for names, curve in curves:
        time, share = curve[c.AT].to_numpy(dtype=float), curve[c.SURVIVAL].to_numpy(dtype=float)
        below = time[share <= 0.5 + 1e-12]
        steps = np.clip(np.append(time, np.inf), 0.0, horizon_s)
        known = share[-1] <= 0.0 or time[-1] >= horizon_s
        rows.append(
            {
                **names,
                c.RUNS: int(curve[c.AT_RISK].iloc[0]),
                c.DEADLOCKED: int(curve[c.DEADLOCKED].sum()),
                c.MEDIAN_TIME: float(below[0]) if below.size else np.nan,
                c.RESTRICTED_MEAN: float(np.sum(np.diff(steps) * share)) if known else np.nan,
                c.HORIZON: horizon_s,
            }
        )
    return table(rows, [*by, c.RUNS, c.DEADLOCKED, c.MEDIAN_TIME, c.RESTRICTED_MEAN, c.HORIZON])


def compute_safety(*, runs: pd.DataFrame, by: Sequence[str] = (c.NETWORK, c.GATE)) -> pd.DataFrame:
    """Return failures, deadlocks, collisions, teleports, clean audits and longest waits, by group.

    One row per group: `by`; `FAILED` (number of runs that ended in an error; all other columns leave them
    out) and `RUNS`; `DEADLOCKED` (runs with a deadlock); sums of `COLLISIONS` and `TELEPORTS`; `CLEAN` (runs
    whose audit found nothing; missing without a gate); mean of `LAPS_PER_H` [1/h]; greatest `LONGEST_WAIT`
    [s].

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_safety
    >>> runs = pd.DataFrame({"gate": ["open", "certified"], "audit": ["not gated", "clean"]})
    >>> runs = runs.assign(deadlocks=[1, 0], collisions=0, teleports=0, laps_per_h=80, longest_wait_s=40)
    >>> compute_safety(runs=runs, by=["gate"])[["gate", "deadlocked", "collisions"]].values.tolist()
    [['certified', 0, 0], ['open', 1, 0]]
    """
    check_columns(runs, _OF_SAFETY, "runs")
    rows = []
    for names, group in groups(runs, by, "runs"):
        done = succeeded(group)
        gated = done[done[c.AUDIT] != c.NOT_GATED]
        figures = {
            c.FAILED: len(group) - len(done),
            c.RUNS: len(done),
            c.DEADLOCKED: int((done[c.DEADLOCKS] > 0).sum()),
            **{name: done[name].sum(min_count=min(1, len(done))) for name in (c.COLLISIONS, c.TELEPORTS)},
            c.CLEAN: int((gated[c.AUDIT] == "clean").sum()) if len(gated) else None,
            c.LAPS_PER_H: done[c.LAPS_PER_H].mean(),
            c.LONGEST_WAIT: done[c.LONGEST_WAIT].max(),
        }
        rows.append({**names, **figures})
    return table(rows, (*by, *_SAFETY)).astype(dict.fromkeys((c.CLEAN, c.COLLISIONS, c.TELEPORTS), "Int64"))


def compute_trips(*, runs: pd.DataFrame, by: Sequence[str] = (c.GATE, c.VEHICLES)) -> pd.DataFrame:
    """Return the number of trips, how many arrived, and their durations and delays.

    One row per group: `by`; `RUNS`; means over runs of `ARRIVED`, `UNFINISHED`, `MEAN_TRIP`, `MEAN_WAITING`,
    `MEAN_TIME_LOSS`, `MEAN_DEPART_DELAY` and `MEAN_DELAY` [s]; greatest `WORST_DELAY` [s].

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run; failed runs, and runs without trips, are left out.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_trips
    >>> runs = pd.DataFrame({"gate": "open", "arrived": [50, 52], "unfinished": [2, 0], "mean_trip_s": 60.0})
    >>> runs = runs.assign(mean_waiting_s=4.0, mean_time_loss_s=[10.0, 9.0], mean_depart_delay_s=1.0)
    >>> runs = runs.assign(mean_delay_s=[11.0, 10.0], worst_delay_s=[40.0, 30.0])
    >>> compute_trips(runs=runs, by=["gate"])[["arrived", "mean_delay_s", "worst_delay_s"]].values.tolist()
    [[51.0, 10.5, 40.0]]
    """
    check_columns(runs, [*_MEANS, c.WORST_DELAY], "runs")
    done = succeeded(runs)
    rows = []
    for names, group in groups(done[done[c.ARRIVED].notna()], by, "runs"):
        means = {name: group[name].mean() for name in _MEANS}
        rows.append({**names, c.RUNS: len(group), **means, c.WORST_DELAY: group[c.WORST_DELAY].max()})
    return table(rows, (*by, c.RUNS, *_MEANS, c.WORST_DELAY))
