"""Monitoring of the road by the loops: visits, revisit intervals and idleness of every edge.

A *visit* is an `Event.EDGE` row: a vehicle enters the edge. The *revisit interval* is the time between
two visits in a row, whoever makes them. The *idleness* of an edge at time t is the time since its last
visit, counted from time 0 before the first one. Over all edges and all moments of the measured time its
mean is the run's mean idleness and its maximum the run's worst idleness (Machado, Ramalho, Zucker, Drogoul,
"Multi-agent patrolling: an empirical analysis of alternative architectures", MABS 2002: instantaneous graph
idleness, averaged over time, and worst idleness). What lies before the measured time counts in one way only:
it says when an edge was visited last.
"""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns, check_period
from loopgate.analysis.trips import compute_holds
from loopgate.results import columns as c
from loopgate.results.columns import Event


def compute_revisit_intervals(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return every time between two visits of an edge that ended in the period.

    One row per interval, by edge and time: `EDGE`, `BEGIN` [s], `END` [s], `INTERVAL` [s].

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in any order.
    begin_s, end_s
        Period of observation (begin, end] [s]. An interval counts if its second visit lies in it.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_revisit_intervals
    >>> rows = [(10, "v1", "edge", "e1"), (40, "v2", "edge", "e1"), (100, "v1", "edge", "e1")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_revisit_intervals(events=events, end_s=120)["revisit_s"].tolist()
    [30.0, 60.0]
    """
    return _intervals(_visits(events, begin_s, end_s), begin_s)


def _intervals(visits: pd.DataFrame, begin_s: float) -> pd.DataFrame:
    """Return the rows of `compute_revisit_intervals`, of visits by edge and time."""
    edges, times = visits[c.PLACE].to_numpy(), visits[c.TIME].to_numpy()
    again = edges[1:] == edges[:-1] if len(edges) else np.zeros(0, dtype=bool)
    within = again & (times[1:] > begin_s)
    begins, ends = times[:-1][within], times[1:][within]
    return pd.DataFrame({c.EDGE: edges[1:][within], c.BEGIN: begins, c.END: ends, c.INTERVAL: ends - begins})


def compute_revisits(
    *,
    events: pd.DataFrame,
    end_s: float,
    begin_s: float = 0.0,
    edges: Iterable[str] | None = None,
    since_s: float = 0.0,
) -> pd.DataFrame:
    """Return visits, revisit intervals and idleness of every edge.

    One row per edge: `EDGE`, `VISITS` (in the period), `MEAN_REVISIT` and `MAX_REVISIT` [s] (mean and longest
    time between two visits), `WEIGHTED_REVISIT` [s] (mean weighted by length: the expected interval around a
    random moment), `IDLENESS` and `WORST_IDLENESS` [s] (mean and greatest time since the last visit). Without
    two visits the revisit intervals are NaN.

    The time from the last visit to the end is no revisit interval, but counts in the idleness. So look at the
    idleness in runs that lock up. Time O(n log n) in the events.

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in any order.
    begin_s, end_s
        Period of observation (begin, end] [s]; earlier events give the last visit before it.
    edges
        The edges to report, visited or not; default: all visited edges, sorted.
    since_s
        Begin of the simulation [s]; from then an edge is idle until its first visit.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_revisits
    >>> rows = [(10, "v1", "edge", "e1"), (40, "v2", "edge", "e1"), (100, "v1", "edge", "e1")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_revisits(events=events, end_s=120, edges=["e1", "e2"])[["edge", "visits", "mean_revisit_s"]]
      edge  visits  mean_revisit_s
    0   e1       3            45.0
    1   e2       0             NaN
    """
    visits = _visits(events, begin_s, end_s)
    wanted = sorted(visits[c.PLACE].unique()) if edges is None else list(dict.fromkeys(edges))
    index = pd.Index(wanted, name=c.EDGE, dtype=object)
    between = _intervals(visits, begin_s)
    intervals = between.groupby(c.EDGE)[c.INTERVAL]
    result = pd.DataFrame(index=index)
    inside = visits[visits[c.TIME] > begin_s]
    result[c.VISITS] = inside.groupby(c.PLACE).size().reindex(index, fill_value=0).astype("int64")
    result[c.MEAN_REVISIT] = intervals.mean().reindex(index).astype(float)
    result[c.MAX_REVISIT] = intervals.max().reindex(index).astype(float)
    result[c.WEIGHTED_REVISIT] = _weighted(between).reindex(index).astype(float)

    # Idleness rises from 0 along each gap between visits; its integral over the part of the gap inside the
    # period is a difference of squares. The gaps tile [since, end]: to the first visit, between, to the end.
    previous = visits.groupby(c.PLACE, sort=False)[c.TIME].shift().fillna(since_s)
    area = (
        pd.Series(_gap_area(previous, visits[c.TIME], begin_s), index=visits[c.PLACE]).groupby(level=0).sum()
    )
    last = visits.groupby(c.PLACE)[c.TIME].max().reindex(index).fillna(since_s)
    total = area.reindex(index).fillna(0.0) + _gap_area(last, np.full(len(last), float(end_s)), begin_s)
    result[c.IDLENESS] = (total / (end_s - begin_s)).astype(float)

    # It is greatest just before a visit, or at the end; gaps that were over by the beginning do not count.
    gaps = pd.Series((visits[c.TIME] - previous).to_numpy(), index=visits[c.PLACE])[
        (visits[c.TIME] > begin_s).to_numpy()
    ]
    worst = gaps.groupby(level=0).max().reindex(index).fillna(0.0)
    result[c.WORST_IDLENESS] = np.maximum(worst, float(end_s) - last).astype(float)
    return result.reset_index()


def compute_edge_holds(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return the time that vehicles stood at gates, for each edge.

    One row per edge with a hold, sorted: `EDGE`, `EDGE_HOLD` [s] within the period.

    The edge of a hold is the last edge that the vehicle entered before. Holds before a vehicle's first event
    ``edge`` are left out.

    Raises `AnalysisError` on a missing column or an empty period.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_edge_holds
    >>> rows = [(5, "v1", "edge", "e1"), (10, "v1", "hold", "b"), (25, "v1", "go", "b")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_edge_holds(events=events, end_s=100).values.tolist()
    [['e1', 15.0]]
    """
    holds = compute_holds(events=events, begin_s=begin_s, end_s=end_s)
    entered = events.loc[events[c.EVENT] == Event.EDGE, [c.TIME, c.VEHICLE, c.PLACE]].sort_values(
        c.TIME, kind="stable"
    )
    entered = entered.rename(columns={c.PLACE: c.EDGE})
    # A hold that began before the period is clipped to it, so match on the time the vehicle came to rest.
    at = pd.merge_asof(
        holds.sort_values(c.SINCE, kind="stable"),
        entered.astype({c.TIME: float, c.VEHICLE: str, c.EDGE: str}),
        left_on=c.SINCE,
        right_on=c.TIME,
        by=c.VEHICLE,
    )
    total = at.groupby(c.EDGE)[c.HOLD].sum()
    return total.rename(c.EDGE_HOLD).rename_axis(c.EDGE).reset_index().astype({c.EDGE_HOLD: float})


def compute_edges(
    *, events: pd.DataFrame, edges: pd.DataFrame, end_s: float, begin_s: float = 0.0, since_s: float = 0.0
) -> pd.DataFrame:
    """Return visits, hold times and revisit intervals of each edge, as in ``edges.parquet``.

    Columns: `EDGE_COLUMNS`, in the order of `edges`.

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`.
    edges
        The edges on some loop: `EDGE` (unique), `EDGE_LENGTH` [m], `SHAPE`.
    begin_s, end_s
        Period of observation (begin, end] [s].
    since_s
        Begin of the simulation [s]; an edge is idle from then until its first visit.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_edges
    >>> rows = [(5, "v1", "edge", "e1"), (10, "v1", "hold", "b"), (25, "v1", "go", "b")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> edges = pd.DataFrame({"edge": ["e1"], "length_m": [80.0], "shape": ["0,0 80,0"]})
    >>> compute_edges(events=events, edges=edges, end_s=100)[["edge", "visits", "hold_s"]].values.tolist()
    [['e1', 1, 15.0]]
    """
    check_columns(edges, (c.EDGE, c.EDGE_LENGTH, c.SHAPE), "edges")
    revisits = compute_revisits(
        events=events, begin_s=begin_s, end_s=end_s, edges=edges[c.EDGE], since_s=since_s
    )
    holds = compute_edge_holds(events=events, begin_s=begin_s, end_s=end_s)
    table = (
        edges[[c.EDGE, c.EDGE_LENGTH, c.SHAPE]]
        .merge(revisits, on=c.EDGE, how="left")
        .merge(holds, on=c.EDGE, how="left")
    )
    table[c.EDGE_HOLD] = table[c.EDGE_HOLD].fillna(0.0)
    return table[list(c.EDGE_COLUMNS)]


def _visits(events: pd.DataFrame, begin_s: float, end_s: float) -> pd.DataFrame:
    check_columns(events, c.EVENT_COLUMNS[:4], "events")
    check_period(begin_s, end_s)
    chosen = events.loc[(events[c.EVENT] == Event.EDGE) & (events[c.TIME] <= end_s), [c.TIME, c.PLACE]]
    return chosen.astype({c.TIME: float, c.PLACE: str}).sort_values([c.PLACE, c.TIME], kind="stable")


def _weighted(intervals: pd.DataFrame) -> pd.Series:
    """Return the mean interval per edge, each weighted by its own length [s]."""
    sums = intervals.assign(square=intervals[c.INTERVAL] ** 2).groupby(c.EDGE)[["square", c.INTERVAL]].sum()
    # Two visits in one step are 0 s apart; where all are, so is their mean.
    return (sums["square"] / sums[c.INTERVAL].where(sums[c.INTERVAL] > 0.0)).fillna(0.0)


def _gap_area(start: pd.Series, stop: pd.Series | np.ndarray, begin_s: float) -> np.ndarray:
    """Return the integral of the time since `start` over [max(start, begin), stop], per gap [s^2]."""
    begin, end = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    low = np.clip(begin_s - begin, 0.0, end - begin)
    area: np.ndarray = ((end - begin) ** 2 - low**2) / 2
    return area
