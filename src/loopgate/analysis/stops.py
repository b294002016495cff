"""Stops on loops: how often vehicles came, at which headways, and how late by the timetable."""

from __future__ import annotations

from math import nan

import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns, table
from loopgate.results.columns import (
    CAME,
    DUE,
    DWELL,
    HEADWAY,
    HEADWAY_CV,
    LATENESS,
    LONGEST_HEADWAY,
    LOOP,
    ON_TIME_60,
    ON_TIME_120,
    PERSONS,
    PERSONS_MOST,
    STOP,
    STOP_COLUMNS,
    TIMED,
    VISIT_COLUMNS,
    VISITS,
    WAITING_COLUMNS,
    WENT_ON,
    WORST_LATENESS,
)

_MINUTE_S = 60.0


def compute_stops(*, visits: pd.DataFrame, waiting: pd.DataFrame | None = None) -> pd.DataFrame:
    """Return a row for each stop and loop: visits, headways, and lateness by the timetable.

    Columns: `STOP_COLUMNS`, by loop and stop. A headway is the time from one arrival to the next. A vehicle
    is late by the time from `DUE` to `WENT_ON`, as in SUMO's ``stop-output``; never early, since it waits.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    visits
        `VISIT_COLUMNS`: a row for each stop that a vehicle completed.
    waiting
        `WAITING_COLUMNS`: how many persons waited at a stop at a time, at equal intervals; None if not known.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_stops
    >>> told = [("b1", "market", "line", 100, 120, 110), ("b2", "market", "line", 400, 430, 410)]
    >>> columns = ["vehicle", "stop", "loop", "came_s", "went_on_s", "due_s"]
    >>> made = compute_stops(visits=pd.DataFrame(told, columns=columns))
    >>> made[["stop", "visits", "headway_s", "late_s", "within_60_s"]].values.tolist()
    [['market', 2, 300.0, 15.0, 1.0]]
    """
    check_columns(visits, VISIT_COLUMNS, "visits")
    persons = pd.DataFrame(columns=list(WAITING_COLUMNS)) if waiting is None else waiting
    check_columns(persons, WAITING_COLUMNS, "waiting")
    at_stops = persons.groupby(STOP)[PERSONS].agg(["mean", "max"])
    rows = []
    for (loop, stop), some in visits.groupby([LOOP, STOP], sort=True):
        apart = np.diff(np.sort(some[CAME].to_numpy(np.float64)))
        late = (some[WENT_ON] - some[DUE]).dropna().to_numpy(np.float64)
        rows.append(
            {
                STOP: stop,
                LOOP: loop,
                VISITS: len(some),
                DWELL: float((some[WENT_ON] - some[CAME]).mean()),
                HEADWAY: float(apart.mean()) if len(apart) else nan,
                HEADWAY_CV: float(apart.std(ddof=1) / apart.mean())
                if len(apart) > 1 and apart.mean()
                else nan,
                LONGEST_HEADWAY: float(apart.max()) if len(apart) else nan,
                TIMED: len(late),
                LATENESS: float(np.median(late)) if len(late) else nan,
                WORST_LATENESS: float(late.max()) if len(late) else nan,
                ON_TIME_60: float((late <= _MINUTE_S).mean()) if len(late) else nan,
                ON_TIME_120: float((late <= 2 * _MINUTE_S).mean()) if len(late) else nan,
                PERSONS: float(at_stops["mean"].get(stop, nan)),
                PERSONS_MOST: float(at_stops["max"].get(stop, nan)),
            }
        )
    return table(rows, STOP_COLUMNS)
