"""Safety of the runs of a group: deadlocks, collisions, teleports, audits."""

from collections.abc import Sequence

import pandas as pd

from loopgate.analysis import columns as a
from loopgate.analysis.frames import check_columns, groups, succeeded, table
from loopgate.results import row_columns as c

_NEEDED = (c.AUDIT, c.COLLISIONS, c.DEADLOCKS, c.LAPS_PER_H, c.LONGEST_WAIT, c.TELEPORTS)
_FIGURES = (a.FAILED, a.RUNS, a.DEADLOCKED, c.COLLISIONS, c.TELEPORTS, a.CLEAN, c.LAPS_PER_H, c.LONGEST_WAIT)


def compute_safety(*, runs: pd.DataFrame, by: Sequence[str] = (c.NETWORK, c.GATE)) -> pd.DataFrame:
    """Return how many runs of each group were deadlocked, collided, teleported, or failed their audit.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run.

    Returns
    -------
    DataFrame
        One row per group: `by`; `FAILED` (runs that could not be made) and `RUNS` (the others, on which
        the rest stands); `DEADLOCKED` of them; sums of `COLLISIONS` and `TELEPORTS`; `CLEAN`, runs under a
        gate whose audit found nothing (missing where there is none); mean of `LAPS_PER_H` [1/h]; greatest
        `LONGEST_WAIT` [s].

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_safety
    >>> runs = pd.DataFrame({"gate": ["open", "certified"], "audit": ["not gated", "clean"]})
    >>> runs = runs.assign(deadlocks=[1, 0], collisions=0, teleports=0, laps_per_h=80, longest_wait_s=40)
    >>> compute_safety(runs=runs, by=["gate"])[["gate", "deadlocked", "collisions"]].values.tolist()
    [['certified', 0, 0], ['open', 1, 0]]
    """
    check_columns(runs, _NEEDED, "runs")
    rows = []
    for names, group in groups(runs, by, "runs"):
        done = succeeded(group)
        gated = done[done[c.AUDIT] != c.NOT_GATED]
        figures = {
            a.FAILED: len(group) - len(done),
            a.RUNS: len(done),
            a.DEADLOCKED: int((done[c.DEADLOCKS] > 0).sum()),
            c.COLLISIONS: int(done[c.COLLISIONS].sum()),
            c.TELEPORTS: int(done[c.TELEPORTS].sum()),
            a.CLEAN: int((gated[c.AUDIT] == "clean").sum()) if len(gated) else None,
            c.LAPS_PER_H: done[c.LAPS_PER_H].mean(),
            c.LONGEST_WAIT: done[c.LONGEST_WAIT].max(),
        }
        rows.append({**names, **figures})
    return table(rows, (*by, *_FIGURES)).astype({a.CLEAN: "Int64"})
