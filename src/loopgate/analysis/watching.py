"""How much of a district was seen, and how evenly: all streets, also streets on no loop.

Idleness is that of `loopgate.analysis.monitoring`; a street that is never entered is idle from time 0 on. The
coefficient of variation of the intervals between visits is 0 where vehicles come evenly and 1 where they come
at random; with a mean interval m it makes the mean idleness m (1 + cv^2) / 2. An interval counts as *bunched*
below a quarter of its street's mean.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns, check_period
from loopgate.analysis.monitoring import compute_revisit_intervals, compute_revisits
from loopgate.arrays import Floats, Ints
from loopgate.errors import AnalysisError
from loopgate.reading import at_least
from loopgate.results import columns as c
from loopgate.results.columns import Event

_BUNCHED = 0.25
_POINTS = 100


def compute_watch(
    *,
    events: pd.DataFrame,
    streets: Iterable[str],
    end_s: float,
    bound_s: float | Mapping[str, float],
    begin_s: float = 0.0,
    since_s: float = 0.0,
) -> pd.DataFrame:
    """Return visits, revisit intervals and idleness of every street; the longest idle street first.

    One row per street with the columns `WATCH_COLUMNS`: all columns of `compute_revisits`; `HEADWAY_CV`
    (standard deviation over mean of the revisit intervals; NaN for fewer than two), `BUNCHED` (share of
    intervals below a quarter of their mean; NaN without one), `BOUND` (the bound [s]) and `WITHIN` (share of
    the period in which the idleness is at most the bound).

    Raises `AnalysisError` on a missing column, an empty period, or a street without a bound from 0 s on.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in any order.
    streets
        All edges to watch, visited or not.
    begin_s, end_s
        Period of observation (begin, end] [s].
    bound_s
        Longest allowed time between visits [s], for all streets or by street; infinity for no limit.
    since_s
        Begin of the simulation [s]; an edge is idle from then until its first visit.

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
    period = {"begin_s": begin_s, "end_s": end_s}
    table = compute_revisits(events=events, edges=streets, since_s=since_s, **period).set_index(c.EDGE)
    between = compute_revisit_intervals(events=events, **period)
    intervals = between.groupby(c.EDGE)[c.INTERVAL]
    table[c.HEADWAY_CV] = intervals.std() / intervals.mean().where(lambda mean: mean > 0.0)
    short = between[c.INTERVAL] < _BUNCHED * intervals.transform("mean")
    table[c.BUNCHED] = short.groupby(between[c.EDGE]).mean()
    table[c.BOUND] = [
        _bound(bound_s.get(edge) if isinstance(bound_s, Mapping) else bound_s, edge) for edge in table.index
    ]
    gaps = _gaps(events, list(table.index), since_s, **period)
    over = np.bincount(gaps.street, gaps.over_s(table[c.BOUND].to_numpy()[gaps.street]), len(table))
    table[c.WITHIN] = 1.0 - over / (end_s - begin_s)
    worst = table.reset_index().sort_values(
        [c.WORST_IDLENESS, c.EDGE], ascending=[False, True], kind="stable"
    )
    return worst[list(c.WATCH_COLUMNS)].reset_index(drop=True)


def _bound(bound_s: float | None, edge: str) -> float:
    return at_least(0.0, bound_s, f"bound_s of {edge}", AnalysisError, "seconds from 0 on")


@dataclass(frozen=True, slots=True)
class _Gaps:
    """For each street the times from the beginning to the first visit, between visits, and to the end."""

    street: Ints
    since: Floats
    until: Floats
    begin_s: float

    def over_s(self, bounds: Floats | float) -> Floats:
        """Return for how long of the period each gap was longer than its bound so far [s]."""
        over: Floats = np.clip(self.until - np.maximum(self.since + bounds, self.begin_s), 0.0, None)
        return over


def _gaps(
    events: pd.DataFrame, streets: Sequence[str], since_s: float, *, begin_s: float, end_s: float
) -> _Gaps:
    number = pd.Series(range(len(streets)), index=list(streets), dtype="int64")
    visits = events[
        (events[c.EVENT] == Event.EDGE) & (events[c.TIME] <= end_s) & events[c.PLACE].isin(number.index)
    ]
    at = np.r_[visits[c.PLACE].map(number).to_numpy(dtype=np.int64), np.arange(len(streets))]
    until = np.r_[visits[c.TIME].to_numpy(dtype=float), np.full(len(streets), float(end_s))]
    order = np.lexsort((until, at))
    at, until = at[order], until[order]
    first = np.r_[True, at[1:] != at[:-1]] if len(at) else np.zeros(0, dtype=bool)
    since = np.where(first, since_s, np.r_[0.0, until[:-1]] if len(at) else until)
    return _Gaps(at, since, until, begin_s)


def compute_seen_within(
    *,
    events: pd.DataFrame,
    streets: Iterable[str],
    end_s: float,
    begin_s: float = 0.0,
    since_s: float = 0.0,
    times_s: Iterable[float] | None = None,
) -> pd.DataFrame:
    """Return the share of streets visited within a time, on average and always.

    Columns: `SEEN_WITHIN` (a time [s]); `NOW`: share of the streets visited within that time, on average over
    the period; `ALWAYS`: share of the streets that were visited within that time throughout the period.

    Raises `AnalysisError` on a missing column, an empty period, or no streets.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in any order.
    streets
        All edges to watch, visited or not.
    begin_s, end_s
        Period of observation (begin, end] [s].
    since_s
        Begin of the simulation [s]; an edge is idle from then until its first visit.
    times_s
        The times of the rows [s]; default: a hundred steps from 0 to the longest idleness of a visited
        street.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_seen_within
    >>> rows = [(25, "v1", "edge", "e1"), (50, "v2", "edge", "e1"), (75, "v1", "edge", "e1")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> seen = compute_seen_within(events=events, streets=["e1", "e2"], end_s=100, times_s=[10, 25])
    >>> seen.values.tolist()
    [[10.0, 0.25, 0.0], [25.0, 0.625, 0.5]]
    """
    check_columns(events, c.EVENT_COLUMNS[:4], "events")
    check_period(begin_s, end_s)
    names = list(dict.fromkeys(streets))
    if not names:
        msg = "streets: none are given; expected the names of edges"
        raise AnalysisError(msg)
    gaps = _gaps(events, names, since_s, begin_s=begin_s, end_s=end_s)
    longest = np.zeros(len(names))
    inside = gaps.until > begin_s
    np.maximum.at(longest, gaps.street[inside], (gaps.until - gaps.since)[inside])
    visited = gaps.street[gaps.since > since_s]
    most = longest[visited].max() if len(visited) else longest.max()
    times = np.linspace(0.0, most, _POINTS + 1) if times_s is None else np.array(list(times_s))
    whole = len(names) * (end_s - begin_s)
    return pd.DataFrame(
        {
            c.SEEN_WITHIN: times.astype(float),
            c.NOW: [1.0 - float(gaps.over_s(float(time)).sum()) / whole for time in times],
            c.ALWAYS: [float(np.mean(longest <= time)) for time in times],
        }
    )


def compute_rarest(*, streets: pd.DataFrame, first: int = 15) -> pd.DataFrame:
    """Return the visited streets with the longest time between two visits.

    One row per street with the columns named below; the street with the longest time comes first.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    streets
        ``streets.parquet``: `EDGE`, `STREET` (its name), `VISITS`, `IDLENESS` and `WORST_IDLENESS` [s].
    first
        Number of streets to return.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_rarest
    >>> rows = [("e1", "High Street", 9, 30.0, 60.0), ("e2", "Mill Lane", 2, 90.0, 300.0)]
    >>> rows += [("e3", "", 0, 450.0, 900.0)]
    >>> columns = ["edge", "street", "visits", "idleness_s", "worst_idleness_s"]
    >>> compute_rarest(streets=pd.DataFrame(rows, columns=columns))["street"].tolist()
    ['Mill Lane', 'High Street']
    """
    told = [c.EDGE, c.STREET, c.VISITS, c.IDLENESS, c.WORST_IDLENESS]
    check_columns(streets, told, "streets")
    seen = streets.loc[streets[c.VISITS] > 0, told]
    return seen.sort_values(c.WORST_IDLENESS, ascending=False, kind="stable")[:first].reset_index(drop=True)


def compute_promises(*, streets: pd.DataFrame) -> pd.DataFrame:
    """Return for each street name whether all its edges were visited often enough.

    One row per street name (an edge without a name counts by itself): `STREET`, `EDGES` (number of edges),
    `SEEN` (edges visited), `LATE` (visited edges that were idle for longer than their bound), `VISITS` (of
    all edges), `WORST_IDLENESS` and `BOUND` [s] (of the edge that is worst against its bound), `WITHIN`
    (mean), and `PROMISE`: *broken* if an edge is late, otherwise *never seen*, *partly seen* or *kept*.
    Broken promises come first, then kept, partly seen and never seen; within each the longest idle street
    first.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    streets
        ``streets.parquet``: `EDGE`, `STREET`, `VISITS`, `WORST_IDLENESS`, `BOUND` and `WITHIN`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_promises
    >>> rows = [("e1", "High Street", 9, 60.0), ("e2", "High Street", 2, 300.0), ("e3", "", 0, 900.0)]
    >>> streets = pd.DataFrame(rows, columns=["edge", "street", "visits", "worst_idleness_s"])
    >>> found = compute_promises(streets=streets.assign(bound_s=200.0, within=1.0))
    >>> found[["street", "promise"]].values.tolist()
    [['High Street', 'broken'], ['e3', 'never seen']]
    """
    told = [c.EDGE, c.STREET, c.VISITS, c.WORST_IDLENESS, c.BOUND, c.WITHIN]
    check_columns(streets, told, "streets")
    names = streets[c.STREET].where(streets[c.STREET].fillna("") != "", streets[c.EDGE])
    rows = []
    for name, part in streets.groupby(names, sort=True):
        seen = part[c.VISITS] > 0
        late = part[c.WORST_IDLENESS] / part[c.BOUND]
        promise = "kept" if seen.all() else "partly seen" if seen.any() else "never seen"
        nearest = part.iloc[int((late.where(seen, 0.0) if seen.any() else late).to_numpy().argmax())]
        rows.append(
            {
                c.STREET: str(name),
                c.EDGES: len(part),
                c.SEEN: int(seen.sum()),
                c.LATE: int((late[seen] > 1.0).sum()),
                c.VISITS: int(part[c.VISITS].sum()),
                c.WORST_IDLENESS: float(nearest[c.WORST_IDLENESS]),
                c.BOUND: float(nearest[c.BOUND]),
                c.WITHIN: float(part[c.WITHIN].mean()),
                c.PROMISE: "broken" if (late[seen] > 1.0).any() else promise,
            }
        )
    columns = [
        c.STREET,
        c.EDGES,
        c.SEEN,
        c.LATE,
        c.VISITS,
        c.WORST_IDLENESS,
        c.BOUND,
        c.WITHIN,
        c.PROMISE,
    ]
    found = pd.DataFrame(rows, columns=columns)
    rank = found[c.PROMISE].map({"broken": 0, "kept": 1, "partly seen": 2, "never seen": 3})
    order = found.assign(rank=rank).sort_values(
        ["rank", c.WORST_IDLENESS, c.STREET], ascending=[True, False, True], kind="stable"
    )
    return order[columns].reset_index(drop=True)


def compute_districts(*, watch: pd.DataFrame, districts: Mapping[str, Iterable[str]]) -> pd.DataFrame:
    """Return visits and idleness of groups of streets (districts); the longest idle group first.

    One row per district: `DISTRICT`, `STREETS` (number of edges), `NEVER_SEEN` (edges without a visit),
    `VISITS` (of all edges), `IDLENESS` and `WORST_IDLENESS` [s] (mean and greatest), `HEADWAY_CV` and
    `BUNCHED` (means over the visited edges), and `WITHIN`.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    watch
        From `compute_watch`.
    districts
        The edges of each group, by its name; an edge may be in several, or in none.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_districts, compute_watch
    >>> rows = [(10, "v1", "edge", "e1"), (40, "v2", "edge", "e1"), (70, "v1", "edge", "e2")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> watch = compute_watch(events=events, streets=["e1", "e2", "e3"], end_s=100, bound_s=60)
    >>> found = compute_districts(watch=watch, districts={"north": ["e1", "e2"], "south": ["e3"]})
    >>> found[["district", "streets", "never_seen", "worst_idleness_s"]].values.tolist()
    [['south', 1, 1, 100.0], ['north', 2, 0, 70.0]]
    """
    check_columns(watch, c.WATCH_COLUMNS, "watch")
    by_edge = watch.set_index(c.EDGE)
    how = {c.VISITS: "sum", c.IDLENESS: "mean", c.WORST_IDLENESS: "max"}
    how |= dict.fromkeys((c.HEADWAY_CV, c.BUNCHED, c.WITHIN), "mean")
    rows = []
    for name, edges in districts.items():
        part = by_edge.loc[by_edge.index.isin([edges] if isinstance(edges, str) else list(edges))]
        if len(part):
            never = int((part[c.VISITS] == 0).sum())
            rows.append({c.DISTRICT: name, c.STREETS: len(part), c.NEVER_SEEN: never, **part.agg(how)})
    table = pd.DataFrame(rows, columns=[c.DISTRICT, c.STREETS, c.NEVER_SEEN, *how])
    table = table.astype({c.VISITS: "int64"})
    order = [c.WORST_IDLENESS, c.DISTRICT]
    return table.sort_values(order, ascending=[False, True], kind="stable").reset_index(drop=True)
