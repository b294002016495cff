"""Junctions: for each movement the vehicles, their delay and queue, and why they waited."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns, check_period, table
from loopgate.analysis.standing import edge_of
from loopgate.analysis.waits import compute_wait_causes
from loopgate.arrays import Floats
from loopgate.results.columns import (
    CAUSE,
    CROSSED,
    CROSSED_PER_H,
    DELAY,
    DELAY_95,
    EDGE,
    EVENT,
    EVENT_COLUMNS,
    GREEN_USED,
    JUNCTION,
    JUNCTION_COLUMNS,
    LOST,
    MOVEMENT,
    PLACE,
    QUEUE,
    QUEUE_95,
    QUEUE_MOST,
    SERVICE_LEVEL,
    SINCE,
    TIME,
    TO_EDGE,
    VEHICLE,
    WAIT,
    WAITED_FOR,
    Event,
)

FREE = "free_s"
"""Column of movements: the time over edge and junction at the speed limits [s]."""
LIT = "lit"
"""Column of movements: whether vehicles obey a traffic light there."""

GREEN = "green_s"
"""Column of movements: how long each of their lanes had green, all lanes together [lane s]."""

_SATURATED_S = 2.0
"""Time that a vehicle of a dense queue takes to cross [s]: 1800 vehicles an hour and lane."""

_LEVELS = "ABCDEF"
_LEVELS_S = {False: (10.0, 15.0, 25.0, 35.0, 50.0, inf), True: (10.0, 20.0, 35.0, 55.0, 80.0, inf)}
"""Delay up to which a level holds [s], without and with a light: Transportation Research Board, "Highway
Capacity Manual", 6th edition, 2016, exhibits 19-8 and 20-2."""

_COLUMNS = JUNCTION, EDGE, TO_EDGE, MOVEMENT, FREE, LIT, GREEN, QUEUE, QUEUE_95, QUEUE_MOST


def queue_figures(steps: Mapping[int, int], all_steps: int) -> tuple[float, int, int]:
    """Return the mean, the 95 % quantile and the maximum of a queue [vehicles].

    `steps`: in how many of `all_steps` steps so many vehicles stood; in all others nobody stood.

    Examples
    --------
    >>> queue_figures({1: 10, 3: 10}, 100)
    (0.4, 3, 3)
    """
    stood = sum(steps.values())
    lengths = sorted({0: max(0, all_steps - stood), **steps}.items())
    needed, so_far, quantile = 0.95 * max(all_steps, stood), 0, 0
    for length, number in lengths:
        so_far += number
        quantile = length
        if so_far > needed:
            break
    mean = sum(length * number for length, number in lengths) / max(1, all_steps)
    return mean, quantile, max(steps, default=0)


def level_of_service(delay_s: float, *, lit: bool) -> str:
    """Return the level of service for a mean delay [s], A to F; empty if there is none.

    `lit`: whether a traffic light is obeyed, which the levels allow more for.

    Examples
    --------
    >>> level_of_service(18.0, lit=False), level_of_service(18.0, lit=True)
    ('C', 'B')
    """
    if np.isnan(delay_s):
        return ""
    return next(level for level, most_s in zip(_LEVELS, _LEVELS_S[lit], strict=True) if delay_s <= most_s)


def compute_junctions(
    *,
    events: pd.DataFrame,
    movements: pd.DataFrame,
    begin_s: float,
    end_s: float,
) -> pd.DataFrame:
    """Return a row for each junction and movement: vehicles, delay, level of service, queue, waits by cause.

    Columns: `JUNCTION_COLUMNS`, by junction and edge. A vehicle counts when its front comes onto the next
    edge. Its delay is the time since it came onto the edge before, less the time at the speed limits and the
    time at stops of its own; a vehicle that started on that edge has none. Waits count from the first refusal
    to the grant.

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS` up to the reason: edges, stops, refusals and grants.
    movements
        For each movement `JUNCTION`, `EDGE`, `TO_EDGE`, `MOVEMENT`, `FREE` [s], `LIT`, `GREEN` [lane s], and
        the queue: `QUEUE`, `QUEUE_95`, `QUEUE_MOST`.
    begin_s, end_s
        Period of observation [s].

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_junctions
    >>> told = [(0, "a"), (20, "b"), (50, "a"), (80, "b")]
    >>> events = pd.DataFrame(told, columns=["time_s", "place"]).assign(vehicle="v1", event="edge", reason="")
    >>> row = {"junction": "j", "edge": "a", "to_edge": "b", "movement": "a → b", "free_s": 18, "lit": False}
    >>> queue = {"green_s": 0.0, "queue_mean": 0.2, "queue_95": 1, "queue_longest": 1}
    >>> made = compute_junctions(events=events, movements=pd.DataFrame([row | queue]), begin_s=0, end_s=100)
    >>> made[["edge", "to_edge", "vehicles", "delay_s", "level_of_service"]].values.tolist()
    [['a', 'b', 2, 12.0, 'B']]
    """
    check_columns(events, EVENT_COLUMNS[:5], "events")
    check_columns(movements, _COLUMNS, "movements")
    check_period(begin_s, end_s)
    passages = _passages(events, end_s)
    made = passages[(passages[TIME] > begin_s) & (passages[TIME] <= end_s)]
    made = made.merge(movements[[EDGE, TO_EDGE, FREE]], on=[EDGE, TO_EDGE])
    made[DELAY] = made[TIME] - made[SINCE] - made["own_s"] - made[FREE]
    crossed = {key: some[DELAY].to_numpy(np.float64) for key, some in made.groupby([EDGE, TO_EDGE])}
    waited = _waited(events, passages, begin_s, end_s)
    rows = []
    for one in movements[list(_COLUMNS)].to_dict("records"):
        key = one[EDGE], one[TO_EDGE]
        every = crossed.get(key, np.zeros(0))
        delays = every[~np.isnan(every)]
        mean_s, most_s = _delay(delays)
        row = {name: one[name] for name in _COLUMNS if name in JUNCTION_COLUMNS}
        row |= {CROSSED: len(every), CROSSED_PER_H: len(every) * 3600.0 / (end_s - begin_s)}
        row[GREEN_USED] = len(every) * _SATURATED_S / one[GREEN] if one[LIT] and one[GREEN] else np.nan
        row |= {DELAY: mean_s, DELAY_95: most_s, SERVICE_LEVEL: level_of_service(mean_s, lit=bool(one[LIT]))}
        rows.append(row | {name: waited.get((*key, cause), 0.0) for cause, name in WAITED_FOR.items()})
    found = table(rows, JUNCTION_COLUMNS)
    return found.sort_values([JUNCTION, EDGE, TO_EDGE], kind="stable", ignore_index=True)


def _delay(delays: Floats) -> tuple[float, float]:
    """Return mean and 95 % quantile [s]; NaN if nobody came."""
    if not len(delays):
        return np.nan, np.nan
    return float(delays.mean()), float(np.quantile(delays, 0.95))


def _passages(events: pd.DataFrame, end_s: float) -> pd.DataFrame:
    """Return each time that a vehicle was on an edge: since when and until when [s], and the next edge.

    The last edge of a vehicle has no next edge, and lasts until `end_s`. ``own_s``: the time at stops of its
    own [s]; NaN on the edge on which it started, so that its delay there is unknown.
    """
    known = events[(events[EVENT] == Event.EDGE) & (events[TIME] <= end_s)].astype({VEHICLE: str, PLACE: str})
    known = known.sort_values([VEHICLE, TIME], kind="stable", ignore_index=True)
    following = known.groupby(VEHICLE, sort=False)
    passages = pd.DataFrame(
        {
            VEHICLE: known[VEHICLE],
            SINCE: known[TIME].astype(float),
            EDGE: known[PLACE],
            TIME: following[TIME].shift(-1).fillna(end_s).astype(float),
            TO_EDGE: following[PLACE].shift(-1).fillna(""),
        }
    )
    own_s = _overlaps(passages, _at_stops(events, end_s))
    passages["own_s"] = np.where(passages.duplicated(VEHICLE), own_s, np.nan)
    return passages


def _at_stops(events: pd.DataFrame, end_s: float) -> pd.DataFrame:
    """Return each stop of a vehicle at a stop of its own: since when [s] and how long [s]."""
    told = events[events[EVENT].isin((Event.STOP, Event.SERVED)) & (events[TIME] <= end_s)]
    told = told.astype({VEHICLE: str}).sort_values([VEHICLE, TIME], kind="stable")
    until = told.groupby(VEHICLE, sort=False)[TIME].shift(-1).fillna(end_s)
    stops = pd.DataFrame(
        {VEHICLE: told[VEHICLE], SINCE: told[TIME].astype(float), "own_s": until - told[TIME]}
    )
    return stops[(told[EVENT] == Event.STOP).to_numpy()]


def _within(times: pd.DataFrame, passages: pd.DataFrame) -> pd.DataFrame:
    """Return times of vehicles (`SINCE`), each with the passage in which it lies."""
    columns = [VEHICLE, SINCE, EDGE, TO_EDGE]
    ways = passages[columns].assign(passage=passages.index, at=passages[SINCE]).drop(columns=SINCE)
    return pd.merge_asof(
        times.sort_values(SINCE, kind="stable"),
        ways.sort_values("at", kind="stable"),
        left_on=SINCE,
        right_on="at",
        by=VEHICLE,
    ).dropna(subset="passage")


def _overlaps(passages: pd.DataFrame, stops: pd.DataFrame) -> Floats:
    """Return the time at stops in each passage [s]; a stop lies in one passage."""
    if stops.empty:
        return np.zeros(len(passages))
    total = _within(stops.astype({SINCE: float}), passages).groupby("passage")["own_s"].sum()
    return np.asarray(total.reindex(passages.index).fillna(0.0).to_numpy(np.float64))


def _waited(
    events: pd.DataFrame, passages: pd.DataFrame, begin_s: float, end_s: float
) -> Mapping[tuple[str, str, str], float]:
    """Return the vehicle-seconds of refusals by edge, next edge and cause."""
    causes = compute_wait_causes(events=events, begin_s=begin_s, end_s=end_s)
    if causes.empty or passages.empty:
        return {}
    on = _within(causes.astype({VEHICLE: str, SINCE: float}), passages)
    # Who still waits at the end has no next edge yet: the place that it waits for is there.
    on[TO_EDGE] = on[TO_EDGE].where(on[TO_EDGE] != "", on[PLACE].astype(str).map(edge_of))
    return dict(on.groupby([EDGE, TO_EDGE, CAUSE])[WAIT].sum())


def compute_worst_movements(*, junctions: pd.DataFrame, first: int = 10) -> pd.DataFrame:
    """Return the movements that cost most time, the worst first.

    One row per movement with delay: `JUNCTION`, `MOVEMENT`, `CROSSED`, `LOST` (vehicle-hours), `DELAY` and
    `DELAY_95` [s], `SERVICE_LEVEL`, `QUEUE`, `QUEUE_95`, `QUEUE_MOST`, `GREEN_USED` where there are lights,
    and `CAUSE`, for which the gate let vehicles wait longest; empty if it did not.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    junctions
        From `compute_junctions`.
    first
        How many rows at most.

    Examples
    --------
    >>> from loopgate import Scenario, run
    >>> from loopgate.analysis import compute_worst_movements
    >>> made = run(Scenario(network="networks/grid5-priority.net.xml", vehicles=60, duration_s=120))
    >>> len(compute_worst_movements(junctions=made.junctions, first=3))
    3
    """
    check_columns(junctions, JUNCTION_COLUMNS, "junctions")
    waited = junctions[[*WAITED_FOR.values()]].rename(columns={name: why for why, name in WAITED_FOR.items()})
    cause = waited.idxmax(axis=1).where(waited.max(axis=1) > 0.0, "").astype(str)
    lost = junctions[DELAY] * junctions[CROSSED] / 3600.0
    every = junctions.assign(**{LOST: lost, CAUSE: cause}).query(f"{LOST} > 0")
    worst = every.sort_values(LOST, ascending=False, kind="stable").head(first)
    columns = [JUNCTION, MOVEMENT, CROSSED, LOST, DELAY, DELAY_95, SERVICE_LEVEL]
    columns += [QUEUE, QUEUE_95, QUEUE_MOST, GREEN_USED, CAUSE]
    lit = worst[GREEN_USED].notna().any()
    return worst[columns if lit else [name for name in columns if name != GREEN_USED]].reset_index(drop=True)


def movement_table(rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    """Return movements as the table that `compute_junctions` takes."""
    return table(rows, _COLUMNS)
