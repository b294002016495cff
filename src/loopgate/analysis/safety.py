"""Safety of the runs of a group: deadlocks, collisions, teleports, audits."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from loopgate.analysis.columns import CLEAN, DEADLOCKED, FAILED, RUNS
from loopgate.analysis.frames import check_columns, groups, succeeded, table
from loopgate.results.row_columns import (
    AUDIT,
    COLLISIONS,
    DEADLOCKS,
    GATE,
    LAPS_PER_H,
    LONGEST_WAIT,
    NETWORK,
    NOT_GATED,
    TELEPORTS,
)

__all__ = ["compute_safety"]

_NEEDED = (AUDIT, COLLISIONS, DEADLOCKS, LAPS_PER_H, LONGEST_WAIT, TELEPORTS)
_FIGURES = (FAILED, RUNS, DEADLOCKED, COLLISIONS, TELEPORTS, CLEAN, LAPS_PER_H, LONGEST_WAIT)


def compute_safety(*, runs: pd.DataFrame, by: Sequence[str] = (NETWORK, GATE)) -> pd.DataFrame:
    """Return how many runs of each group were deadlocked, collided, teleported, or failed their audit.

    Parameters
    ----------
    runs
        One row per run.
    by
        Columns that make a group.

    Returns
    -------
    DataFrame
        One row per group: `by`; `FAILED` (runs that could not be made) and `RUNS` (the others, on which
        the rest stands); `DEADLOCKED` of them; sums of `COLLISIONS` and `TELEPORTS`; `CLEAN`, runs under a
        gate whose audit found nothing (missing where there is none); mean of `LAPS_PER_H` [1/h]; greatest
        `LONGEST_WAIT` [s].

    Raises
    ------
    AnalysisError
        On a missing column.

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
        gated = done[done[AUDIT] != NOT_GATED]
        figures = {
            FAILED: len(group) - len(done),
            RUNS: len(done),
            DEADLOCKED: int((done[DEADLOCKS] > 0).sum()),
            COLLISIONS: int(done[COLLISIONS].sum()),
            TELEPORTS: int(done[TELEPORTS].sum()),
            CLEAN: int((gated[AUDIT] == "clean").sum()) if len(gated) else None,
            LAPS_PER_H: done[LAPS_PER_H].mean(),
            LONGEST_WAIT: done[LONGEST_WAIT].max(),
        }
        rows.append({**names, **figures})
    return table(rows, (*by, *_FIGURES)).astype({CLEAN: "Int64"})
