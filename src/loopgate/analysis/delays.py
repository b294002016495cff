"""Trips of the runs of a group: who arrived, and what they lost."""

from collections.abc import Sequence

import pandas as pd

from loopgate.analysis import columns as a
from loopgate.analysis.frames import check_columns, groups, succeeded, table
from loopgate.results import row_columns as c

_MEANS = (
    *(c.ARRIVED, c.UNFINISHED, c.MEAN_TRIP, c.MEAN_WAITING),
    *(c.MEAN_TIME_LOSS, c.MEAN_DEPART_DELAY, c.MEAN_DELAY),
)


def compute_trips(*, runs: pd.DataFrame, by: Sequence[str] = (c.GATE, c.VEHICLES)) -> pd.DataFrame:
    """Return how many trips of a run arrived, how long they took, and what they lost.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run; failed runs, and runs in which nobody drives once, are left out.

    Returns
    -------
    DataFrame
        One row per group: `by`; `RUNS`; means over runs of `ARRIVED`, `UNFINISHED`, `MEAN_TRIP`,
        `MEAN_WAITING`, `MEAN_TIME_LOSS`, `MEAN_DEPART_DELAY` and `MEAN_DELAY` [s]; greatest `WORST_DELAY`
        [s].

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
        rows.append({**names, a.RUNS: len(group), **means, c.WORST_DELAY: group[c.WORST_DELAY].max()})
    return table(rows, (*by, a.RUNS, *_MEANS, c.WORST_DELAY))
