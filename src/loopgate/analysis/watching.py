"""What of a district was seen, and how evenly: all streets, those on no loop included.

Idleness is that of `loopgate.analysis.monitoring`; a street that is never entered is idle from time 0 on. The
coefficient of variation of the intervals between visits is 0 where vehicles come evenly and 1 where they come
at random; with a mean interval m it makes the mean idleness m (1 + cv^2) / 2. An interval counts as *bunched*
below a quarter of its street's mean.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from loopgate.analysis.columns import INTERVAL
from loopgate.analysis.monitoring import compute_revisit_intervals, compute_revisits
from loopgate.results.columns import (
    BUNCHED,
    EDGE,
    EVENT,
    HEADWAY_CV,
    IDLENESS,
    PLACE,
    STREET_COLUMNS,
    TIME,
    VISITS,
    WEIGHTED_REVISIT,
    WITHIN,
    WORST_IDLENESS,
    Event,
)

__all__ = ["compute_watch", "watch_figures"]

_BUNCHED = 0.25
_RANKED = 10


def compute_watch(
    *, events: pd.DataFrame, streets: Iterable[str], end_s: float, bound_s: float, begin_s: float = 0.0
) -> pd.DataFrame:
    """Return how often and how evenly every street was seen, the one that was idle longest first.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in any order.
    streets
        All edges to be seen, those that nobody visits included.
    begin_s, end_s
        Period of observation (begin, end] [s].
    bound_s
        Time that no street should go unseen for longer than [s]; infinity for none.

    Returns
    -------
    DataFrame
        `STREET_COLUMNS`: those of `compute_revisits`, `HEADWAY_CV` (standard deviation over mean of the
        intervals; NaN for fewer than two), `BUNCHED` (share of them, NaN without one) and `WITHIN` (share of
        the period in which the idleness is at most the bound).

    Raises
    ------
    AnalysisError
        On a missing column or an empty period.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_watch
    >>> rows = [(10, "v1", "edge", "e1"), (40, "v2", "edge", "e1"), (70, "v1", "edge", "e1")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> seen = compute_watch(events=events, streets=["e1", "e2"], end_s=100, bound_s=60)
    >>> seen[["edge", "visits", "worst_idleness_s"]].values.tolist()
    [['e2', 0, 100.0], ['e1', 3, 30.0]]
    """
    table = compute_revisits(events=events, begin_s=begin_s, end_s=end_s, edges=streets).set_index(EDGE)
    between = compute_revisit_intervals(events=events, begin_s=begin_s, end_s=end_s)
    intervals = between.groupby(EDGE)[INTERVAL]
    table[HEADWAY_CV] = intervals.std() / intervals.mean().where(lambda mean: mean > 0.0)
    short = between[INTERVAL] < _BUNCHED * intervals.transform("mean")
    table[BUNCHED] = short.groupby(between[EDGE]).mean()
    visits = events.loc[(events[EVENT] == Event.EDGE) & (events[TIME] <= end_s), [PLACE, TIME]]
    times = {str(edge): np.sort(part.to_numpy()) for edge, part in visits.groupby(PLACE)[TIME]}
    nothing = np.empty(0)
    over = [_over_s(times.get(str(edge), nothing), begin_s, end_s, bound_s) for edge in table.index]
    table[WITHIN] = 1.0 - np.array(over) / (end_s - begin_s)
    worst = table.reset_index().sort_values([WORST_IDLENESS, EDGE], ascending=[False, True], kind="stable")
    return worst[list(STREET_COLUMNS)].reset_index(drop=True)


def _over_s(times: np.ndarray, begin_s: float, end_s: float, bound_s: float) -> float:
    """Return for how long of the period the last of the visits was longer ago than the bound [s]."""
    since, until = np.append(0.0, times), np.append(times, end_s)
    return float(np.clip(until - np.maximum(since + bound_s, begin_s), 0.0, None).sum())


def watch_figures(table: pd.DataFrame, *, bound_s: float) -> dict[str, Any]:
    """Return what a summary says of the streets in a table of `compute_watch`; all streets count alike."""
    seen = table[table[VISITS] > 0]
    figures: dict[str, Any] = {
        "streets": len(table),
        "never_seen": len(table) - len(seen),
        "idleness_s": _rounded(table[IDLENESS].mean()),
        "idleness_of_seen_s": _rounded(seen[IDLENESS].mean()),
        "worst_idleness_of_seen_s": _rounded(seen[WORST_IDLENESS].max()),
        "weighted_revisit_s": _rounded(seen[WEIGHTED_REVISIT].mean()),
        "headway_cv": _rounded(seen[HEADWAY_CV].mean()),
        "bunched": _rounded(seen[BUNCHED].mean()),
        "rarest": [
            {
                "edge": edge,
                "visits": int(visits),
                "idleness_s": _rounded(mean),
                "worst_idleness_s": _rounded(most),
            }
            for edge, visits, mean, most in seen[[EDGE, VISITS, IDLENESS, WORST_IDLENESS]]
            .head(_RANKED)
            .itertuples(index=False)
        ],
    }
    if np.isfinite(bound_s):
        broken = seen[seen[WITHIN] < 1.0]
        figures |= {
            "bound_s": bound_s,
            "within": _rounded(table[WITHIN].mean()),
            "within_of_seen": _rounded(seen[WITHIN].mean()),
            "streets_over": len(broken),
        }
    return figures


def _rounded(value: float) -> float | None:
    return None if np.isnan(value) else round(float(value), 4)
