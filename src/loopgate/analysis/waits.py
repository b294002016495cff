"""Waits of vehicles at their gates, by cause."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from loopgate.analysis.frames import check_columns, check_period, groups, succeeded, table
from loopgate.analysis.standing import edge_of
from loopgate.gates import Reason
from loopgate.results.columns import (
    BEGIN,
    CAUSE,
    END,
    EVENT,
    EVENT_COLUMNS,
    GATE,
    LONGEST_FOR,
    MEAN,
    MOST,
    NETWORK,
    PLACE,
    REASON,
    RUNS,
    SINCE,
    TIME,
    VEHICLE,
    VEHICLES,
    WAIT,
    Event,
)

_GRANTS = "grants"


def compute_wait_causes(*, events: pd.DataFrame, end_s: float, begin_s: float = 0.0) -> pd.DataFrame:
    """Return for each wait of a vehicle for a grant the seconds due to each reason of refusal.

    One row per wait and reason, by vehicle and time: `VEHICLE`, `PLACE` (the state that it waits for),
    `SINCE` [s] (when it was first refused), `CAUSE` (the reason, see `loopgate.gates.Reason`), `WAIT` [s].

    Waits are those of `compute_waits`. The time after each refusal, until the next refusal with a new reason
    or until the grant, counts for the reason of that refusal.

    Raises `AnalysisError` on a missing column or an empty period.

    Parameters
    ----------
    events
        `EVENT_COLUMNS` up to the reason; refusals and grants suffice.
    begin_s, end_s
        Period of observation [s].

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_wait_causes
    >>> told = [(10, "refuse", "occupied"), (12, "refuse", "crossing"), (25, "grant", "free")]
    >>> events = pd.DataFrame(told, columns=["time_s", "event", "reason"]).assign(vehicle="v1", place="b")
    >>> compute_wait_causes(events=events, end_s=100)[["cause", "wait_s"]].values.tolist()
    [['occupied', 2.0], ['crossing', 13.0]]
    """
    check_columns(events, EVENT_COLUMNS[:5], "events")
    check_period(begin_s, end_s)
    told = events[EVENT].isin((Event.REFUSE, Event.GRANT)) & (events[TIME] <= end_s)
    chosen = events.loc[told, list(EVENT_COLUMNS[:5])].astype(dict.fromkeys((VEHICLE, PLACE, REASON), str))
    chosen = chosen.sort_values([VEHICLE, TIME], kind="stable")
    granted = chosen[EVENT] == Event.GRANT
    vehicle = chosen[VEHICLE]
    spells = pd.DataFrame(
        {
            VEHICLE: vehicle,
            PLACE: chosen[PLACE],
            SINCE: chosen[TIME],
            CAUSE: chosen[REASON],
            BEGIN: chosen[TIME].clip(lower=begin_s),
            END: chosen.groupby(vehicle, sort=False)[TIME].shift(-1).fillna(end_s),
            _GRANTS: granted.groupby(vehicle, sort=False).cumsum(),
        }
    )[~granted]
    spells[WAIT] = spells[END] - spells[BEGIN]
    wait = [VEHICLE, _GRANTS]
    spells[SINCE] = spells.groupby(wait, sort=False)[SINCE].transform("min")
    seen = spells[spells[END] > begin_s]
    parts = seen.groupby([*wait, CAUSE], sort=False).agg({PLACE: "first", SINCE: "first", WAIT: "sum"})
    return parts.reset_index()[[VEHICLE, PLACE, SINCE, CAUSE, WAIT]]


def compute_longest_waits(
    *, runs: pd.DataFrame, by: Sequence[str] = (NETWORK, GATE, VEHICLES)
) -> pd.DataFrame:
    """Return the reasons of refusal during the longest waits of each group of runs.

    One row per group and reason: `by`, `CAUSE` (the reason), `RUNS`, and of each run's longest time with that
    reason in one wait the `MEAN` and the maximum `MOST` [s]. Runs without a gate are left out, and reasons
    for which no vehicle waited.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_longest_waits
    >>> runs = pd.DataFrame({"gate": "certified", "longest_crossing_s": [20.0, 30.0]})
    >>> compute_longest_waits(runs=runs, by=["gate"]).values.tolist()
    [['certified', 'crossing', 2, 25.0, 30.0]]
    """
    known = {cause: column for cause, column in LONGEST_FOR.items() if column in runs}
    rows = []
    for names, group in groups(runs, by, "runs"):
        done = succeeded(group)
        for cause, column in known.items():
            waited = done[column].dropna()
            if waited.gt(0).any():
                figures = {RUNS: len(waited), MEAN: waited.mean(), MOST: waited.max()}
                rows.append({**names, CAUSE: cause, **figures})
    return table(rows, (*by, CAUSE, RUNS, MEAN, MOST))


def wait_figures(causes: pd.DataFrame | None, streets: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the figures of the longest waits for ``summary.json``.

    Keys: ``longest_wait``: the vehicle, the state it waited for and its street, since when [s], and how long
    [s] for which cause, longest first; None if nobody waited. Times at stops do not count for which is the
    longest.
    ``longest_waits_s``: by cause, the longest time that one wait was for it [s].

    `causes`: what `compute_wait_causes` returns; None if nothing was measured. `streets`: the name of its
    street by edge.
    """
    if causes is None or causes.empty:
        return {"longest_wait": None, "longest_waits_s": {}}
    # Who stands at a stop of its own waits for nobody, so the times of stops do not decide which is longest.
    waited = causes[WAIT].where(causes[CAUSE] != Reason.STOP.value, 0.0)
    totals = waited.groupby([causes[VEHICLE], causes[SINCE]], sort=False).sum()
    vehicle, since_s = totals.index[int(totals.to_numpy().argmax())]
    mine = causes[(causes[VEHICLE] == vehicle) & (causes[SINCE] == since_s)]
    by_cause = mine.groupby(CAUSE)[WAIT].sum().sort_values(ascending=False, kind="stable")
    return {
        "longest_wait": {
            "vehicle": str(vehicle),
            "place": str(mine[PLACE].iloc[0]),
            "street": (streets or {}).get(edge_of(str(mine[PLACE].iloc[0])), ""),
            "since_s": float(since_s),
            "by_cause_s": _rounded(by_cause.to_dict()),
        },
        "longest_waits_s": _rounded(causes.groupby(CAUSE)[WAIT].max().sort_index().to_dict()),
    }


def _rounded(seconds: Mapping[Any, float]) -> dict[str, float]:
    return {str(cause): round(float(time_s), 3) for cause, time_s in seconds.items()}
