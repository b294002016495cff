"""The trips of the vehicles of one run: laps, holds, waits and throughput, from the run's events."""

import pandas as pd

from loopgate.analysis.frames import check_columns, check_period
from loopgate.results.columns import (
    BEGIN,
    END,
    EVENT,
    EVENT_COLUMNS,
    HOLD,
    LAP_NUMBER,
    LAP_TIME,
    LAPS,
    LONGEST_WAIT,
    OPEN,
    PLACE,
    SINCE,
    TIME,
    VEHICLE,
    WAIT,
    Event,
)

_SECONDS_PER_HOUR = 3600.0


def compute_laps(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return every lap that a vehicle completed in the period.

    One row per lap, by vehicle and time: `VEHICLE`, `LAP_NUMBER`, `BEGIN` [s], `END` [s], `LAP_TIME` [s].

    A lap begins when the vehicle's previous lap ends. The first lap begins at the vehicle's first event
    ``start`` or ``edge``; without such an event it is left out.

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in any order.
    begin_s, end_s
        Period of observation (begin, end] [s]; a lap counts if it was completed in it.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_laps
    >>> rows = [(0, "v1", "start", "a"), (80, "v1", "lap", "a"), (170, "v1", "lap", "a")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_laps(events=events, end_s=200)["lap_s"].tolist()
    [80.0, 90.0]
    """
    chosen = _of(events, (Event.START, Event.EDGE, Event.LAP), end_s, begin_s)
    first = ~chosen.duplicated(VEHICLE)
    chosen = chosen[(chosen[EVENT] == Event.LAP) | first]
    by_vehicle = chosen.groupby(VEHICLE, sort=False)
    laps = pd.DataFrame(
        {
            VEHICLE: chosen[VEHICLE],
            LAP_NUMBER: (chosen[EVENT] == Event.LAP).astype("int64").groupby(chosen[VEHICLE]).cumsum(),
            BEGIN: by_vehicle[TIME].shift(),
            END: chosen[TIME],
        }
    )
    laps[LAP_TIME] = laps[END] - laps[BEGIN]
    complete = (chosen[EVENT] == Event.LAP) & laps[BEGIN].notna() & (laps[END] > begin_s)
    return laps[complete].reset_index(drop=True)


def compute_holds(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return every stand of a vehicle at a gate (from event ``hold`` to ``go``) within the period.

    One row per hold, by vehicle and time: `VEHICLE`, `PLACE` (the state that it waits for), `SINCE` [s] (when
    it stopped), `BEGIN`, `END` [s] (clipped to the period), `HOLD` [s] (END - BEGIN), `OPEN` (whether it
    still stood at the end).

    Raises `AnalysisError` on a missing column or an empty period.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_holds
    >>> rows = [(10, "v1", "hold", "b"), (25, "v1", "go", "b"), (90, "v1", "hold", "c")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_holds(events=events, end_s=100)[["place", "hold_s", "open"]].values.tolist()
    [['b', 15.0, False], ['c', 10.0, True]]
    """
    return _spells(events, (Event.HOLD,), (Event.GO,), begin_s, end_s).rename(columns={"length_s": HOLD})


def compute_waits(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return every wait of a vehicle for a grant (first ``refuse`` to ``grant``) within the period.

    One row per wait, by vehicle and time: `VEHICLE`, `PLACE` (the state that it waits for), `SINCE` [s] (when
    it was first refused), `BEGIN`, `END` [s] (clipped to the period), `WAIT` [s] (END - BEGIN), `OPEN`
    (whether it still waited at the end).

    A vehicle may wait without standing: it is refused, slows down, and gets its grant before it stops.

    Raises `AnalysisError` on a missing column or an empty period.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_waits
    >>> rows = [(10, "v1", "refuse", "b"), (12, "v1", "refuse", "b"), (25, "v1", "grant", "b")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_waits(events=events, end_s=100)[["place", "wait_s"]].values.tolist()
    [['b', 15.0]]
    """
    return _spells(events, (Event.REFUSE,), (Event.GRANT,), begin_s, end_s).rename(columns={"length_s": WAIT})


def compute_vehicle_holds(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return laps, hold time and longest wait of each vehicle.

    One row per vehicle, sorted by name: `VEHICLE`, `LAPS` (completed in the period), `HOLD` [s] (total),
    `LONGEST_WAIT` [s] (0 if it was never refused).

    Raises `AnalysisError` on a missing column or an empty period.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_vehicle_holds
    >>> rows = [(10, "v1", "hold", "b"), (25, "v1", "go", "b"), (60, "v1", "lap", "a")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_vehicle_holds(events=events, end_s=100)[["vehicle", "laps", "hold_s"]].values.tolist()
    [['v1', 1, 15.0]]
    """
    check_columns(events, EVENT_COLUMNS[:4], "events")
    index = pd.Index(sorted(events[VEHICLE].unique()), name=VEHICLE, dtype=object)
    period = {"begin_s": begin_s, "end_s": end_s}
    completed = events[(events[EVENT] == Event.LAP) & (events[TIME] > begin_s) & (events[TIME] <= end_s)]
    columns = {
        LAPS: completed.groupby(VEHICLE, observed=True).size().reindex(index, fill_value=0).astype("int64"),
        HOLD: compute_holds(events=events, **period).groupby(VEHICLE)[HOLD].sum(),
        LONGEST_WAIT: compute_waits(events=events, **period).groupby(VEHICLE)[WAIT].max(),
    }
    table = pd.DataFrame({name: column.reindex(index) for name, column in columns.items()}, index=index)
    return table.fillna({HOLD: 0.0, LONGEST_WAIT: 0.0}).reset_index()


def compute_throughput(
    *, events: pd.DataFrame, end_s: float, begin_s: float = 0.0, distance_m: float | None = None
) -> pd.DataFrame:
    """Return the throughput of all vehicles together in the period.

    One row: ``laps``, ``laps_per_h`` [1/h], ``km_per_h`` [vehicle-km/h] (NaN without a distance).

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`.
    begin_s, end_s
        Period of observation (begin, end] [s].
    distance_m
        Distance driven by all vehicles in the period [m], if known.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_throughput
    >>> rows = [(60, "v1", "lap", "a"), (90, "v2", "lap", "a")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> compute_throughput(events=events, end_s=120, distance_m=1200).T[0].to_dict()
    {'laps': 2.0, 'laps_per_h': 60.0, 'km_per_h': 36.0}
    """
    check_columns(events, EVENT_COLUMNS[:4], "events")
    check_period(begin_s, end_s)
    done = (events[EVENT] == Event.LAP) & (events[TIME] > begin_s) & (events[TIME] <= end_s)
    hours = (end_s - begin_s) / _SECONDS_PER_HOUR
    laps = int(done.sum())
    km = float("nan") if distance_m is None else distance_m / 1000.0
    return pd.DataFrame({"laps": [laps], "laps_per_h": [laps / hours], "km_per_h": [km / hours]})


def _of(events: pd.DataFrame, kinds: tuple[Event, ...], end_s: float, begin_s: float) -> pd.DataFrame:
    """Return the events of these kinds up to the end, by vehicle and time."""
    check_columns(events, EVENT_COLUMNS[:4], "events")
    check_period(begin_s, end_s)
    chosen = events.loc[events[EVENT].isin(kinds) & (events[TIME] <= end_s), list(EVENT_COLUMNS[:4])]
    # Run folders keep names as categories, which group by all that exist rather than by those that occur.
    kinds_of = {TIME: float, VEHICLE: str, EVENT: str, PLACE: str}
    return chosen.astype(kinds_of).sort_values([VEHICLE, TIME], kind="stable")


def _spells(
    events: pd.DataFrame, opening: tuple[Event, ...], closing: tuple[Event, ...], begin_s: float, end_s: float
) -> pd.DataFrame:
    """Return each vehicle's spells from an opening event to its next closing one.

    Opening events inside a spell belong to it (a refusal whose reason changes); closing events outside
    one belong to nothing.
    """
    chosen = _of(events, opening + closing, end_s, begin_s)
    opens = chosen[EVENT].isin(opening)
    vehicle = chosen[VEHICLE]
    opened_before = opens.groupby(vehicle, sort=False).shift(fill_value=False).astype(bool)
    first = opens & ~opened_before
    # A closing event is the last of its stretch; the number of those before a row numbers the stretch.
    closes = (~opens).astype("int64")
    stretch = closes.groupby(vehicle, sort=False).cumsum() - closes
    until = chosen[TIME].where(~opens).groupby([vehicle, stretch], sort=False).transform("min").astype(float)
    spells = pd.DataFrame(
        {
            VEHICLE: vehicle,
            PLACE: chosen[PLACE],
            SINCE: chosen[TIME],
            BEGIN: chosen[TIME].clip(lower=begin_s),
            END: until.fillna(end_s),
        }
    )
    spells["length_s"] = spells[END] - spells[BEGIN]
    spells[OPEN] = until.isna()
    return spells[first & (spells[END] > begin_s)].reset_index(drop=True)
