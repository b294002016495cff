"""Costs of gates and views of loops: lap times, decision time, messages, hold time per edge."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns, groups, succeeded, table
from loopgate.analysis.statistics import weighted_quantiles
from loopgate.errors import AnalysisError
from loopgate.results import columns as c

_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def compute_lap_distribution(
    *,
    runs: pd.DataFrame,
    by: Sequence[str] = (c.GATE, c.VEHICLES),
    quantiles: Sequence[float] = _QUANTILES,
) -> pd.DataFrame:
    """Return quantiles of the lap times over all runs of each group.

    One row per group and quantile: `by`, `LAPS` (of all runs), `QUANTILE`, `LAP_TIME` [s].

    Each run's row has 21 quantiles of its lap times, 5 % apart. The middle between two of them stands for
    all laps between them. A run counts in proportion to its laps.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run with `LAPS` and `LAP_QUANTILES` [s]; failed runs, and runs without a lap, are left
        out.
    quantiles
        Between 0 and 1.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_lap_distribution
    >>> quantiles = [60.0 + number for number in range(21)]
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": 40, "laps": 120, "lap_quantiles_s": [quantiles]})
    >>> compute_lap_distribution(runs=runs, quantiles=[0.5])["lap_s"].tolist()
    [69.5]
    """
    check_columns(runs, [c.LAPS, c.LAP_QUANTILES], "runs")
    wrong = [q for q in quantiles if not 0.0 <= q <= 1.0]
    if wrong:
        msg = f"quantile {wrong[0]:g} is none; expected numbers from 0 to 1, such as 0.5 for the median"
        raise AnalysisError(msg)
    rows = []
    for names, group in groups(succeeded(runs), by, "runs"):
        lapped = group[(group[c.LAPS] > 0) & group[c.LAP_QUANTILES].notna()]
        if lapped.empty:
            continue
        # 21 quantiles bound 20 equal slices; the middle of each slice stands for its laps.
        grid = np.array(lapped[c.LAP_QUANTILES].tolist(), dtype=float)
        middles = (grid[:, 1:] + grid[:, :-1]) / 2
        weight = np.repeat(lapped[c.LAPS].to_numpy(dtype=float) / middles.shape[1], middles.shape[1])
        times = weighted_quantiles(middles.ravel(), weight, list(quantiles))
        laps = int(lapped[c.LAPS].sum())
        rows += [
            {**names, c.LAPS: laps, c.QUANTILE: q, c.LAP_TIME: t}
            for q, t in zip(quantiles, times, strict=True)
        ]
    return table(rows, [*by, c.LAPS, c.QUANTILE, c.LAP_TIME])


def compute_decision_time(*, runs: pd.DataFrame, by: Sequence[str] = (c.GATE, c.VEHICLES)) -> pd.DataFrame:
    """Return the time that gates take for a decision, their refusals and their messages.

    One row per group: `by`, `RUNS`, `DECISIONS` (sum), `DECISION_MEDIAN` [us] (median over runs of the run's
    median), `DECISION_P99` [us] (median over runs of the run's 99th percentile), `DECISION_MAX` [us]
    (greatest of all), `REFUSED_SHARE` (refusals per decision), `MESSAGES_PER_DECISION` (missing where no
    messages are counted).

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run with `DECISIONS`, `REFUSALS`, `MESSAGES` and the decision times [us]; failed runs
        are left out.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_decision_time
    >>> runs = pd.DataFrame({"gate": ["banker"], "vehicles": [40], "decisions": [1000], "refusals": [250]})
    >>> runs = runs.assign(messages=None, decision_median_us=5.0, decision_p99_us=30.0, decision_max_us=90.0)
    >>> compute_decision_time(runs=runs)[["decision_median_us", "refused_share"]].values.tolist()
    [[5.0, 0.25]]
    """
    times = (c.DECISION_MEDIAN, c.DECISION_P99, c.DECISION_MAX)
    check_columns(runs, [c.DECISIONS, c.REFUSALS, c.MESSAGES, *times], "runs")
    rows = []
    for names, group in groups(succeeded(runs), by, "runs"):
        decisions = float(group[c.DECISIONS].sum())
        counted = group[group[c.MESSAGES].notna()]
        asked = float(counted[c.DECISIONS].sum())
        rows.append(
            {
                **names,
                c.RUNS: len(group),
                c.DECISIONS: int(decisions),
                c.DECISION_MEDIAN: float(group[c.DECISION_MEDIAN].median()),
                c.DECISION_P99: float(group[c.DECISION_P99].median()),
                c.DECISION_MAX: float(group[c.DECISION_MAX].max()),
                c.REFUSED_SHARE: float(group[c.REFUSALS].sum()) / decisions if decisions else np.nan,
                c.MESSAGES_PER_DECISION: float(counted[c.MESSAGES].sum()) / asked if asked else np.nan,
            }
        )
    return table(rows, [*by, c.RUNS, c.DECISIONS, *times, c.REFUSED_SHARE, c.MESSAGES_PER_DECISION])


def compute_edge_means(
    *, runs: pd.DataFrame, edge_sets: Mapping[str, pd.DataFrame], by: Sequence[str] = (c.GATE,)
) -> pd.DataFrame:
    """Return visits, hold time and revisit intervals of each edge, averaged over runs.

    One row per group and edge: `by`, `EDGE`, `RUNS` (number of runs with the edge on a loop), `VISITS`,
    `HOLD` [s] and, if known, `STOOD` [s] (means per run), `MEAN_REVISIT` [s] (mean over the runs that revisit
    the edge), `IDLENESS` [s] (mean per run), `MAX_REVISIT` [s] (greatest of all runs), `SHAPE`, `JUNCTION`
    (at the end of the edge) and `STREET` (name of the street); the last two are empty if not known.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run with `EDGE_SET` and the lists per edge; failed runs are left out.
    edge_sets
        For each `EDGE_SET` the table of its edges (`EDGE`, `EDGE_LENGTH` [m], `SHAPE`).

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_edge_means
    >>> edge_sets = {"x": pd.DataFrame({"edge": ["e1"], "length_m": [80.0], "shape": ["0,0 80,0"]})}
    >>> runs = pd.DataFrame({"gate": "open", "edge_set": ["x", "x"], "edge_visits": [[3.0], [5.0]]})
    >>> nothing = pd.Series([[0.0], [0.0]])
    >>> lists = ("edge_hold_s", "edge_mean_revisit_s", "edge_max_revisit_s", "edge_idleness_s")
    >>> runs = runs.assign(**dict.fromkeys(lists, nothing))
    >>> compute_edge_means(runs=runs, edge_sets=edge_sets)[["edge", "runs", "visits"]].values.tolist()
    [['e1', 2, 4.0]]
    """
    lists = {name: column for name, column in c.EDGE_LISTS.items() if name != c.MAX_REVISIT}
    if c.EDGE_STOOD not in runs:
        del lists[c.STOOD]
    check_columns(runs, [c.EDGE_SET, c.EDGE_MAX_REVISIT, *lists.values()], "runs")
    parts = []
    for names, group in groups(succeeded(runs).dropna(subset=[c.EDGE_SET]), [*by, c.EDGE_SET], "runs"):
        edges = edge_sets.get(str(names.pop(c.EDGE_SET)))
        if edges is None:
            continue
        named = {name: edges.get(name, "") for name in (c.JUNCTION, c.STREET)}
        part = edges[[c.EDGE, c.SHAPE]].assign(**{c.RUNS: len(group)}, **named)
        for name, column in lists.items():
            values = _stack(group[column], len(edges))
            known = np.isfinite(values)
            part[f"{name} sum"] = np.where(known, values, 0.0).sum(axis=0)
            part[f"{name} count"] = known.sum(axis=0)
        longest = _stack(group[c.EDGE_MAX_REVISIT], len(edges))
        part[c.MAX_REVISIT] = np.where(np.isfinite(longest), longest, -np.inf).max(axis=0, initial=-np.inf)
        parts.append(part.assign(**names))
    columns = [*by, c.EDGE, c.RUNS, *lists, c.MAX_REVISIT, c.SHAPE, c.JUNCTION, c.STREET]
    if not parts:
        return table([], columns)
    how: dict[str, str] = {c.RUNS: "sum", c.MAX_REVISIT: "max", c.SHAPE: "first"}
    how |= {c.JUNCTION: "first", c.STREET: "first"}
    how |= {f"{name} {what}": "sum" for name in lists for what in ("sum", "count")}
    merged = pd.concat(parts).groupby([*by, c.EDGE], sort=True, dropna=False).agg(how).reset_index()
    for name in lists:
        merged[name] = merged[f"{name} sum"] / merged[f"{name} count"].replace(0, np.nan)
    merged[c.MAX_REVISIT] = merged[c.MAX_REVISIT].replace(-np.inf, np.nan)
    return merged[columns]


def compute_ranked(
    *,
    runs: pd.DataFrame,
    edge_sets: Mapping[str, pd.DataFrame],
    by: Sequence[str] = (c.GATE,),
    what: str = c.JUNCTION,
    first: int = 15,
) -> pd.DataFrame:
    """Return the junctions or edges with the longest standing of vehicles before them.

    Columns: `by`, the junction or edge, `STOOD` [s] (all vehicles together) and `VISITS`, means per run. The
    longest standing comes first in each group. Junctions and edges before which no vehicle stood are left
    out.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs, edge_sets, by
        As for `compute_edge_means`.
    what
        `JUNCTION` or `EDGE`.
    first
        Number of rows for each group.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_ranked
    >>> edges = {"edge": ["e1", "e2"], "length_m": 80.0, "shape": "0,0 80,0", "junction": ["J", "K"]}
    >>> runs = pd.DataFrame({"gate": "open", "edge_set": ["x"], "edge_visits": [[3.0, 5.0]]})
    >>> for name in ("hold", "stood", "mean_revisit", "max_revisit", "idleness"):
    ...     runs[f"edge_{name}_s"] = [[2.0, 9.0]]
    >>> ranked = compute_ranked(runs=runs, edge_sets={"x": pd.DataFrame(edges)})
    >>> ranked[["junction", "stood_s"]].values.tolist()
    [['K', 9.0], ['J', 2.0]]
    """
    check_columns(runs, [c.EDGE_STOOD], "runs")
    edges = compute_edge_means(runs=runs, edge_sets=edge_sets, by=by)
    sums = edges.groupby([*by, what], dropna=False)[[c.STOOD, c.VISITS]].sum().reset_index()
    order = sums[sums[c.STOOD] > 0].sort_values(
        [*by, c.STOOD, what], ascending=[*[True] * len(by), False, True], kind="stable"
    )
    return (order.groupby(list(by)) if by else order).head(first).reset_index(drop=True)


def _stack(lists: pd.Series, width: int) -> np.ndarray:
    """Return one row per run; a run whose list has another length says nothing."""
    fitting = [np.asarray(values, dtype=np.float32) for values in lists if values is not None]
    fitting = [values for values in fitting if values.shape == (width,)]
    return np.array(fitting, dtype=np.float32).reshape(len(fitting), width)
