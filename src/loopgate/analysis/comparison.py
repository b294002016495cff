"""Gates against each other: means, paired differences, capacity, and the fundamental diagram."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns, groups, succeeded, table
from loopgate.analysis.statistics import FEWEST, check_level, mean_interval, paired_interval
from loopgate.errors import AnalysisError
from loopgate.results import columns as c

_KMH_PER_MPS = 3.6


def compute_mean(
    *,
    runs: pd.DataFrame,
    value: str = c.KM_PER_H,
    by: Sequence[str] = (c.GATE, c.VEHICLES),
    level: float = 0.95,
) -> pd.DataFrame:
    """Return the mean of a column over the runs of each group, with Student's t interval.

    One row per group: `by`, `RUNS`, `MEAN`, `STD`, `LOW`, `HIGH` (in the unit of `value`; the last three are
    missing for a single run). If no run has a negative value, `LOW` is at least 0.

    Raises `AnalysisError` on a missing column or an invalid level.

    Parameters
    ----------
    runs
        One row per run; failed runs, and runs without the value, are left out.
    value
        Column of `runs`, such as `KM_PER_H` [vehicle-km/h], `LAPS_PER_H` [1/h] or `HOLD` [s].

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_mean
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": 40, "km_per_h": [90.0, 110.0, 100.0]})
    >>> compute_mean(runs=runs).round(1)[["mean", "low", "high"]].values.tolist()
    [[100.0, 75.2, 124.8]]
    """
    check_columns(runs, [value], "runs")
    rows = []
    for names, group in groups(succeeded(runs), by, "runs"):
        sample = group[value].dropna().to_numpy(dtype=float)
        mean, low, high = mean_interval(sample, level=level)
        if sample.size and sample.min() >= 0.0:
            low = max(low, 0.0)
        spread = float(sample.std(ddof=1)) if sample.size > 1 else np.nan
        rows.append(
            {**names, c.RUNS: int(sample.size), c.MEAN: mean, c.STD: spread, c.LOW: low, c.HIGH: high}
        )
    made = table(rows, [*by, c.RUNS, c.MEAN, c.STD, c.LOW, c.HIGH])
    made.attrs[c.OF] = value
    return made


def compute_paired(
    *,
    runs: pd.DataFrame,
    baseline: str,
    value: str = c.KM_PER_H,
    of: str = c.GATE,
    by: Sequence[str] = (c.VEHICLES,),
    match: Sequence[str] = (c.SEED,),
    level: float = 0.95,
    seed: int = 0,
) -> pd.DataFrame:
    """Return the difference of each gate to a baseline gate, run by run on the same seeds.

    One row per gate and group: `of`, `by`, `BASELINE`, `PAIRS` (number of pairs), `DIFFERENCE` (mean, in the
    unit of `value`), `LOW`, `HIGH` (its interval), `KIND` (method of the interval: none below three pairs,
    paired t below eight, BCa bootstrap from eight), `RATIO` (missing if the baseline is 0), `BETTER` (share
    of pairs in which the gate is better).

    Runs with equal `by` and `match` are a pair; a run without partner is left out. Both runs of a pair have
    the same loops and starts, so a few seeds show more than two separate means do.

    Raises `AnalysisError` on a missing column, an unknown baseline, or a run with several possible partners.

    Parameters
    ----------
    runs
        One row per run with `of`, `value`, and the columns of `by` and `match`; failed runs are left out.
    baseline
        The value of column `of` to compare with, such as a gate's name.
    value
        Column of `runs`; greater is better.
    of
        Column with the names of the compared rules.
    by, match
        Columns by which runs are grouped, and columns by which two runs of a group are paired.
    level, seed
        Confidence level; seed of the bootstrap's random numbers.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_paired
    >>> runs = pd.DataFrame({"gate": ["open", "open", "certified", "certified"], "seed": [1, 2, 1, 2]})
    >>> runs = runs.assign(vehicles=40, km_per_h=[90.0, 110.0, 100.0, 120.0])
    >>> compute_paired(runs=runs, baseline="open")[["gate", "pairs", "difference", "ratio"]].values.tolist()
    [['certified', 2, 10.0, 1.1]]
    """
    keys = [*by, *match]
    check_columns(runs, [of, value, *keys], "runs")
    good = succeeded(runs).dropna(subset=[value])
    known = sorted(good[of].dropna().unique())
    if baseline not in known:
        there = ", ".join(map(str, known)) or "no runs"
        msg = f"baseline {baseline}: no run used that {of}; there are {there}"
        raise AnalysisError(msg)
    twins = good[good.duplicated([of, *keys], keep=False)]
    if len(twins):
        row = twins.iloc[0]
        which = ", ".join(f"{name} {row[name]}" for name in [of, *keys])
        msg = f"runs: several runs have {which}, so pairs are not unique; add what tells them apart to by"
        raise AnalysisError(msg)
    base = good[good[of] == baseline].set_index(keys)[value]
    rows = []
    for names, group in groups(good[good[of] != baseline], [of, *by], "runs"):
        pairs = group.set_index(keys)[[value]].join(base.rename("base"), how="inner")
        if pairs.empty:
            continue
        difference = (pairs[value] - pairs["base"]).to_numpy(dtype=float)
        (mean, low, high), kind = paired_interval(difference, level=level, seed=seed)
        total = float(pairs["base"].sum())
        rows.append(
            {
                **names,
                c.BASELINE: baseline,
                c.PAIRS: len(pairs),
                c.DIFFERENCE: mean,
                c.LOW: low,
                c.HIGH: high,
                c.KIND: kind,
                c.RATIO: float(pairs[value].sum()) / total if total else np.nan,
                c.BETTER: float((difference > 0).mean()),
            }
        )
    made = table(rows, [of, *by, c.BASELINE, c.PAIRS, c.DIFFERENCE, c.LOW, c.HIGH, c.KIND, c.RATIO, c.BETTER])
    made.attrs[c.OF] = value
    return made


def compute_fundamental(*, runs: pd.DataFrame, by: Sequence[str] = ()) -> pd.DataFrame:
    """Return density, flow and speed of each run (the macroscopic fundamental diagram).

    Columns: those of `runs`, or of `by`, and `DENSITY` [vehicles/km], `FLOW` [vehicles/h], `SPEED` [km/h]
    (means over the runs of a group).

    All edges on loops count: density is vehicles per km of edge, flow is vehicle-km per hour and km of edge.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run with `VEHICLES`, `EDGE_KM` [km], `KM_PER_H` [vehicle-km/h] and `MEAN_SPEED` [m/s];
        failed runs, and runs without a length, are left out.
    by
        Columns by which runs are grouped, such as gate and vehicles; without them each run is a row.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_fundamental
    >>> runs = pd.DataFrame({"vehicles": [40], "edge_km": 8.0, "km_per_h": 800.0, "mean_speed_mps": 5.0})
    >>> compute_fundamental(runs=runs)[["density_veh_per_km", "flow_veh_per_h"]].values.tolist()
    [[5.0, 100.0]]
    """
    check_columns(runs, [c.VEHICLES, c.EDGE_KM, c.KM_PER_H, c.MEAN_SPEED], "runs")
    good = succeeded(runs)
    good = good[good[c.EDGE_KM] > 0]
    points = good.assign(
        **{
            c.DENSITY: good[c.VEHICLES] / good[c.EDGE_KM],
            c.FLOW: good[c.KM_PER_H] / good[c.EDGE_KM],
            c.SPEED: good[c.MEAN_SPEED] * _KMH_PER_MPS,
        }
    )
    if not by:
        return points
    check_columns(points, by, "runs")
    return points.groupby(list(by), dropna=False)[[c.DENSITY, c.FLOW, c.SPEED]].mean().reset_index()


def compute_capacity(
    *,
    runs: pd.DataFrame,
    value: str = c.KM_PER_H,
    by: Sequence[str] = (c.GATE,),
    level: float = 0.95,
    resamples: int = 1000,
    seed: int = 0,
) -> pd.DataFrame:
    """Return the number of vehicles with the greatest mean of a column, such as throughput.

    One row per group: `by`, `CAPACITY` [vehicles], `LOW`, `HIGH` [vehicles], `PEAK` (unit of `value`),
    `AT_BORDER`.

    The interval is a bootstrap over the runs of each number of vehicles; it is missing if some number has
    fewer than three runs. If the peak is at the largest number of vehicles (`AT_BORDER`), the capacity is at
    least that large, and `HIGH` is missing.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run with `VEHICLES`, `value` and the columns of `by`; failed runs are left out.
    value
        Column of `runs`; the peak is its greatest mean, the smallest count on a tie.
    level, resamples, seed
        Confidence level; number and seed of the bootstrap's resamples.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_capacity
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40, 60], "km_per_h": [90.0, 150.0, 80.0]})
    >>> compute_capacity(runs=runs)[["gate", "capacity_vehicles", "peak", "at_border"]].values.tolist()
    [['open', 40, 150.0, False]]
    """
    check_columns(runs, [c.VEHICLES, value], "runs")
    check_level(level)
    rows = []
    for names, group in groups(succeeded(runs).dropna(subset=[value, c.VEHICLES]), by, "runs"):
        samples = {
            int(float(str(n))): part[value].to_numpy(dtype=float) for n, part in group.groupby(c.VEHICLES)
        }
        if not samples:
            continue
        counts = np.array(list(samples))
        means = np.array([sample.mean() for sample in samples.values()])
        random = np.random.default_rng(seed)
        drawn = np.array(
            [random.choice(sample, (resamples, sample.size)).mean(axis=1) for sample in samples.values()]
        )
        peaks = counts[drawn.argmax(axis=0)]
        tail = (1 - level) / 2
        low, high = np.quantile(peaks, [tail, 1 - tail], method="inverted_cdf")
        best, known = int(means.argmax()), min(sample.size for sample in samples.values()) >= FEWEST
        at_border = best == len(counts) - 1
        rows.append(
            {
                **names,
                c.CAPACITY: int(counts[best]),
                c.LOW: float(low) if known else np.nan,
                c.HIGH: float(high) if known and not at_border else np.nan,
                c.PEAK: float(means[best]),
                c.AT_BORDER: at_border,
            }
        )
    return table(rows, [*by, c.CAPACITY, c.LOW, c.HIGH, c.PEAK, c.AT_BORDER])
