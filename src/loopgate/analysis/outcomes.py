"""Deadlocks over many runs: their rate, and the time until they come."""

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import scipy

from loopgate.analysis import columns as a
from loopgate.analysis.frames import check_columns, groups, succeeded, table
from loopgate.analysis.statistics import wilson_interval
from loopgate.errors import AnalysisError
from loopgate.results import row_columns as c


def compute_deadlock_rate(
    *, runs: pd.DataFrame, by: Sequence[str] = (c.GATE, c.VEHICLES), level: float = 0.95
) -> pd.DataFrame:
    """Return the share of runs with a deadlock, with Wilson intervals.

    Raises `AnalysisError` on a missing column or a level that is none.

    Parameters
    ----------
    runs
        One row per run, with `DEADLOCKS` and the columns of `by`; failed runs are left out.

    Returns
    -------
    DataFrame
        One row per group: `by`, `RUNS`, `DEADLOCKED`, `RATE`, `LOW`, `HIGH` (shares, 0 to 1).

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
            {**names, a.RUNS: len(group), a.DEADLOCKED: deadlocked, a.RATE: rate, a.LOW: low, a.HIGH: high}
        )
    return table(rows, [*by, a.RUNS, a.DEADLOCKED, a.RATE, a.LOW, a.HIGH])


def compute_survival(
    *, runs: pd.DataFrame, by: Sequence[str] = (c.GATE,), level: float = 0.95
) -> pd.DataFrame:
    """Return Kaplan-Meier curves of the time to the first deadlock.

    A run without deadlock is censored at the end of its observation: it says that the time is longer, not
    that it is infinite. Intervals are Greenwood's on the log-log scale (Kalbfleisch and Prentice 1980).

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run, with `FIRST_DEADLOCK` [s] (missing: none) and `OBSERVED` [s]; failed runs are left
        out.
    by
        Columns that make a curve.
    level
        Confidence level of the pointwise interval.

    Returns
    -------
    DataFrame
        One row per curve and time at which a run locked up or was censored, from time 0 on: `by`, `AT` [s],
        `AT_RISK`, `DEADLOCKED`, `CENSORED`, `SURVIVAL`, `LOW`, `HIGH` (shares, 0 to 1; the interval is
        missing where nothing varies: before the first deadlock, and where all are deadlocked).

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_survival
    >>> runs = pd.DataFrame({"gate": "open", "first_deadlock_s": [900, None], "observed_s": [900, 3600]})
    >>> compute_survival(runs=runs)[["time_s", "survival"]].values.tolist()
    [[0.0, 1.0], [900.0, 0.5], [3600.0, 0.5]]
    """
    check_columns(runs, [c.FIRST_DEADLOCK, c.OBSERVED], "runs")
    curves = [
        _curve(group, level).assign(**names)[[*by, *_CURVE]]
        for names, group in groups(succeeded(runs), by, "runs")
        if len(group)
    ]
    return pd.concat(curves, ignore_index=True) if curves else table([], [*by, *_CURVE])


_CURVE = (a.AT, a.AT_RISK, a.DEADLOCKED, a.CENSORED, a.SURVIVAL, a.LOW, a.HIGH)


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
        pd.DataFrame({a.AT: times, "locked": locked})
        .groupby(a.AT)["locked"]
        .agg(["size", "sum"])
        .loc[pd.Index(at)]
    )
    size, deaths = counts["size"].to_numpy(), counts["sum"].to_numpy(dtype=int)
    curve = pd.DataFrame(
        {
            a.AT: at,
            a.AT_RISK: len(times) - np.concatenate(([0], np.cumsum(size)[:-1])),
            a.DEADLOCKED: deaths,
            a.CENSORED: size - deaths,
            a.SURVIVAL: function.probabilities,
            a.LOW: interval.low.probabilities,
            a.HIGH: interval.high.probabilities,
        }
    )
    if at[0] > 0:
        start = pd.DataFrame([(0.0, len(times), 0, 0, 1.0, np.nan, np.nan)], columns=list(_CURVE))
        curve = pd.concat([start, curve], ignore_index=True)
    return curve


def compute_time_to_deadlock(
    *, runs: pd.DataFrame, by: Sequence[str] = (c.GATE, c.VEHICLES), horizon_s: float | None = None
) -> pd.DataFrame:
    """Return median and restricted mean of the time to the first deadlock, from the Kaplan-Meier curve.

    Raises `AnalysisError` on a missing column or a horizon that is not positive.

    Parameters
    ----------
    runs
        As for `compute_survival`.
    horizon_s
        The restricted mean is the area under the curve up to here [s]; default: as far as every curve is
        known, so that groups can be compared (a curve that has reached 0 is known for ever).

    Returns
    -------
    DataFrame
        One row per group: `by`, `RUNS`, `DEADLOCKED`, `MEDIAN_TIME` [s] (missing if fewer than half were
        seen to lock up), `RESTRICTED_MEAN` [s], `HORIZON` [s].

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_time_to_deadlock
    >>> runs = pd.DataFrame({"gate": "open", "first_deadlock_s": [900, None], "observed_s": [900, 3600]})
    >>> compute_time_to_deadlock(runs=runs, by=["gate"])[["median_s", "restricted_mean_s"]].values.tolist()
    [[900.0, 2250.0]]
    """
    if horizon_s is not None and horizon_s <= 0:
        msg = f"horizon {horizon_s:g} s is none; expected a time above 0 s"
        raise AnalysisError(msg)
    survival = compute_survival(runs=runs, by=by)
    curves = list(groups(survival, by, "runs")) if len(survival) else []
    if horizon_s is None:
        known = [np.inf if curve[a.SURVIVAL].iloc[-1] <= 0 else curve[a.AT].iloc[-1] for _, curve in curves]
        horizon_s = min(known, default=np.nan)
        horizon_s = float(survival[a.AT].max()) if np.isinf(horizon_s) else horizon_s
    rows = []
    for names, curve in curves:
        time, share = curve[a.AT].to_numpy(dtype=float), curve[a.SURVIVAL].to_numpy(dtype=float)
        below = time[share <= 0.5 + 1e-12]
        steps = np.clip(np.append(time, np.inf), 0.0, horizon_s)
        rows.append(
            {
                **names,
                a.RUNS: int(curve[a.AT_RISK].iloc[0]),
                a.DEADLOCKED: int(curve[a.DEADLOCKED].sum()),
                a.MEDIAN_TIME: float(below[0]) if below.size else np.nan,
                a.RESTRICTED_MEAN: float(np.sum(np.diff(steps) * share)),
                a.HORIZON: horizon_s,
            }
        )
    return table(rows, [*by, a.RUNS, a.DEADLOCKED, a.MEDIAN_TIME, a.RESTRICTED_MEAN, a.HORIZON])
