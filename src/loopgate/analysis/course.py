"""The course of one run or a few: over time, causes of waits, along a loop, stuck vehicles."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns, table
from loopgate.analysis.waits import compute_wait_causes
from loopgate.errors import AnalysisError
from loopgate.results import columns as c
from loopgate.results.columns import Event

_HOUR_S = 3600.0


def compute_flow(*, flow: pd.DataFrame, every_s: float = 60.0, by: Sequence[str] = ()) -> pd.DataFrame:
    """Return distance, laps and standing vehicles in each time interval, and their running totals.

    One row per group and interval: `by`, `TIME` (end of the interval [s]), `ON_ROAD` and `STILL` (mean
    numbers of vehicles on the road and standing), `SPEED` [km/h], `KM_PER_H`, `LAPS_PER_H`, and the running
    totals `DISTANCE_KM`, `LAPS`, `STOOD_H`.

    Raises `AnalysisError` on a missing column, or intervals shorter than the rows.

    Parameters
    ----------
    flow
        `FLOW_COLUMNS`: ``flow.parquet`` of a run; of several runs with a column `KEY`, the key of the run.
    every_s
        Length of an interval [s]; an incomplete last interval is left out.
    by
        Columns by which runs are grouped; the runs of a group are averaged.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_flow
    >>> flow = pd.DataFrame({"time_s": [10.0, 20.0], "vehicles": 4, "standing": [0, 2], "laps": [0, 1]})
    >>> flow["distance_m"] = [400.0, 100.0]
    >>> compute_flow(flow=flow, every_s=20)[["standing", "km_per_h", "laps"]].values.tolist()
    [[1.0, 90.0, 1.0]]
    """
    check_columns(flow, [*c.FLOW_COLUMNS, *by], "flow")
    if not every_s >= c.FLOW_EVERY_S:
        msg = f"intervals of {every_s:g} s are too short; expected at least {c.FLOW_EVERY_S:g} s"
        raise AnalysisError(msg)
    rows = flow.assign(**{c.KEY: flow.get(c.KEY, "")})
    begin = rows.groupby(c.KEY)[c.TIME].transform("min") - c.FLOW_EVERY_S
    bins = np.ceil((rows[c.TIME] - begin) / every_s - 1e-9) * every_s
    groups = rows.assign(**{c.TIME: bins + begin.min()}).groupby([*by, c.TIME], sort=True, observed=True)
    sums = groups.agg(
        {c.ON_ROAD: "mean", c.STILL: "mean", c.DISTANCE: "sum", c.LAPS: "sum", c.KEY: "nunique"}
    )
    full = groups.size() / sums[c.KEY] * c.FLOW_EVERY_S > every_s - c.FLOW_EVERY_S
    sums = sums[full]
    hours = every_s / _HOUR_S
    km, laps = sums[c.DISTANCE] / 1000.0 / sums[c.KEY], sums[c.LAPS] / sums[c.KEY]
    result = sums[[c.ON_ROAD, c.STILL]].assign(
        **{
            c.SPEED: km / (sums[c.ON_ROAD] * hours),
            c.KM_PER_H: km / hours,
            c.LAPS_PER_H: laps / hours,
            c.DISTANCE_KM: km,
            c.LAPS: laps,
            c.STOOD_H: sums[c.STILL] * hours,
        }
    )
    total = [c.DISTANCE_KM, c.LAPS, c.STOOD_H]
    result[total] = result.groupby(level=list(by))[total].cumsum() if by else result[total].cumsum()
    return result.reset_index()


def compute_causes(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return the total time that vehicles waited for a gate, for each reason of refusal.

    One row per reason, the most costly first: `REASON`, `WAITS` (number of waits with the reason), `WAIT` [s]
    (total), `LONGEST` [s] (longest time in one wait).

    `compute_wait_causes` has each wait; see `loopgate.gates.Reason` for the words.

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in any order.
    begin_s, end_s
        Period of observation [s]; waits are clipped to it.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_causes
    >>> rows = [(10, "v1", "refuse", "b", "occupied"), (12, "v1", "refuse", "b", "crossing")]
    >>> rows += [(25, "v1", "grant", "b", "free")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place", "reason"])
    >>> compute_causes(events=events, end_s=100)[["reason", "wait_s"]].values.tolist()
    [['crossing', 13.0], ['occupied', 2.0]]
    """
    spells = compute_wait_causes(events=events, end_s=end_s, begin_s=begin_s)
    result = spells.groupby(c.CAUSE)[c.WAIT].agg(["size", "sum", "max"]).reset_index()
    result.columns = pd.Index([c.REASON, c.WAITS, c.WAIT, c.LONGEST])
    return result.sort_values([c.WAIT, c.REASON], ascending=[False, True], kind="stable").reset_index(
        drop=True
    )


def compute_time_space(
    *, events: pd.DataFrame, vehicles: pd.DataFrame, loops: pd.DataFrame, loop: str
) -> pd.DataFrame:
    """Return the times at which the vehicles of a loop entered each edge (a time-space diagram).

    By vehicle and time: `VEHICLE`, `LAP_NUMBER` (from 0: rounds of the loop's first edge), `TIME` [s],
    `POSITION` [m], `EDGE`. A round ends with a point at the loop's length. Edges on no round of the loop,
    which a vehicle enters when it is led round a closed street, are left out.

    Raises `AnalysisError` on a missing column, or a loop that is not there.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`; `Event.EDGE` suffices.
    vehicles
        `VEHICLE_COLUMNS`: the loop of each vehicle.
    loops
        `LOOP_COLUMNS`: the edges of the loop, and where each begins.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_time_space
    >>> rows = [(0, "v1", "edge", "b"), (9, "v1", "edge", "a"), (20, "v1", "edge", "b")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> loops = pd.DataFrame({"loop": "x", "edge": ["a", "b"], "begin_m": [0.0, 70.0]})
    >>> vehicles = pd.DataFrame({"vehicle": ["v1"], "loop": "x", "loop_length_m": 120.0})
    >>> points = compute_time_space(events=events, vehicles=vehicles, loops=loops, loop="x")
    >>> points[["lap", "time_s", "position_m"]].values.tolist()
    [[0.0, 0.0, 70.0], [0.0, 9.0, 120.0], [1.0, 9.0, 0.0], [1.0, 20.0, 70.0]]
    """
    check_columns(events, [c.TIME, c.VEHICLE, c.EVENT, c.PLACE], "events")
    check_columns(vehicles, [c.VEHICLE, c.LOOP, c.LOOP_LENGTH], "vehicles")
    check_columns(loops, c.LOOP_COLUMNS, "loops")
    way = loops[loops[c.LOOP] == loop]
    if way.empty:
        msg = f"loop {loop}: not there; there are {', '.join(loops[c.LOOP].unique()[:5]) or 'none'}"
        raise AnalysisError(msg)
    edges, begins = way[c.EDGE].tolist(), way[c.EDGE_BEGIN].tolist()
    own = vehicles[vehicles[c.LOOP] == loop].set_index(c.VEHICLE)[c.LOOP_LENGTH]
    entered = events[(events[c.EVENT] == Event.EDGE) & events[c.VEHICLE].isin(own.index)]
    rows = []
    for vehicle, part in entered.astype({c.VEHICLE: str}).groupby(c.VEHICLE, sort=True):
        at, lap = -1, 0
        for time_s, edge in zip(part[c.TIME], part[c.PLACE], strict=True):
            # An edge may come several times on a loop: it is the next of them.
            following = next((n for n in range(1, len(edges) + 1) if edges[(at + n) % len(edges)] == edge), 0)
            if not following:  # the vehicle is led round: it is at no place of the loop
                continue
            before, at = at, (at + following) % len(edges)
            if before >= 0 and at <= before:
                rows.append((vehicle, lap, time_s, own[vehicle], edge))
                lap += 1
            rows.append((vehicle, lap, time_s, begins[at], edge))
    return pd.DataFrame(rows, columns=[c.VEHICLE, c.LAP_NUMBER, c.TIME, c.POSITION, c.EDGE])


def compute_stuck(
    *, vehicles: pd.DataFrame, events: pd.DataFrame, end_s: float, after_s: float = 300.0
) -> pd.DataFrame:
    """Return the vehicles that stood for long at the end of the run, and the circles of the deadlocks.

    One row per vehicle, the longest standing first: `VEHICLE`, `LOOP`, `SINCE` [s], `STANDING` [s],
    `WAITS_FOR` (the next vehicle in its deadlock; empty for vehicles in no deadlock), `X`, `Y` [m].

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    vehicles
        `VEHICLE_COLUMNS`.
    events
        `EVENT_COLUMNS`; `Event.DEADLOCK` suffices.
    end_s
        End of the run [s].
    after_s
        Time of standing from which a vehicle is listed [s]; vehicles in a deadlock are always listed.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_stuck
    >>> vehicles = pd.DataFrame({"vehicle": ["v1", "v2"], "loop": "x", "standing_s": [400.0, 0.0]})
    >>> vehicles = vehicles.assign(x_m=0.0, y_m=0.0)
    >>> rows = [(200, "v1", "deadlock", "b", "v9")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place", "reason"])
    >>> compute_stuck(vehicles=vehicles, events=events, end_s=600)[["since_s", "waits_for"]].values.tolist()
    [[200.0, 'v9']]
    """
    check_columns(vehicles, [c.VEHICLE, c.LOOP, c.STANDING, c.X, c.Y], "vehicles")
    check_columns(events, [c.VEHICLE, c.EVENT, c.REASON], "events")
    circle = events[events[c.EVENT] == Event.DEADLOCK].drop_duplicates(c.VEHICLE, keep="last")
    waits_for = dict(zip(circle[c.VEHICLE].astype(str), circle[c.REASON].astype(str), strict=True))
    stuck = vehicles[(vehicles[c.STANDING] >= after_s) | vehicles[c.VEHICLE].isin(waits_for)]
    stuck = stuck.assign(
        **{
            c.SINCE: end_s - stuck[c.STANDING],
            c.WAITS_FOR: stuck[c.VEHICLE].map(waits_for).fillna("").astype(object),
        }
    )
    columns = [c.VEHICLE, c.LOOP, c.SINCE, c.STANDING, c.WAITS_FOR, c.X, c.Y]
    if stuck.empty:
        return table([], columns)
    return stuck[columns].sort_values([c.SINCE, c.VEHICLE], kind="stable").reset_index(drop=True)
