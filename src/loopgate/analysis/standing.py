"""Tables of blocked places and of the vehicles that starved behind them."""

import re
from collections.abc import Mapping
from typing import Any

import pandas as pd

from loopgate.analysis.frames import table
from loopgate.results import columns as c

_BLOCKED = {c.PLACE: "place", c.CAUSE: "why", c.VEHICLE: "vehicle", c.FROM: "from_s", c.UNTIL: "to_s"}

_EDGE_OF_PLACE = re.compile(r"(.+)_\d+(?:\D.*)?$")
"""A place is named after its lane, ``EDGE_NUMBER``, with a suffix where a lane has several places."""

_SINK = {c.WAITS_FOR: "behind", c.LANE: "lane", c.CAUSE: "why", c.FROM: "noticed_s", c.UNTIL: "until_s"}


def compute_blocked(*, summary: Mapping[str, Any]) -> pd.DataFrame:
    """Return the blocked places (closed to vehicles because something stands there), by time.

    One row per place: `PLACE`, `STREET` (its name, if it has one), `CAUSE` (closed, breakdown, stop or
    trapped), `VEHICLE` (that stands there; empty for a closed place), `FROM` and `UNTIL` [s] (the latter
    missing if still blocked at the end), `UNWATCHED` (streets of loops through the place that no vehicle
    entered meanwhile, with the time of the last visit).

    Parameters
    ----------
    summary
        The content of ``summary.json``.

    Examples
    --------
    >>> from loopgate.analysis import compute_blocked
    >>> one = {"place": "A1", "why": "closed", "vehicle": "", "from_s": 60.0, "to_s": None}
    >>> compute_blocked(summary={"standing": {"blocked": [one]}})["place"].tolist()
    ['A1']
    """
    every = summary.get("standing", {}).get("blocked", ())
    rows = (
        {name: one[key] for name, key in _BLOCKED.items()}
        | {c.STREET: one.get("street", "")}
        | {c.UNWATCHED: ", ".join(f"{e} since {s:g} s" for e, s in one.get("unwatched", {}).items())}
        for one in every
    )
    return table(rows, [*_BLOCKED, c.STREET, c.UNWATCHED])


def edge_of(place: str) -> str:
    """Return the edge of a place, which is named after its lane; empty if it is named otherwise."""
    found = _EDGE_OF_PLACE.match(place)
    return found[1] if found else ""


def compute_starving(*, summary: Mapping[str, Any]) -> pd.DataFrame:
    """Return the vehicles that starved, grouped by the vehicle ahead; the largest group first.

    One row per starved vehicle: `VEHICLE`, `WAITS_FOR` (the vehicle that stood ahead; empty if none was
    found), `LANE` and `CAUSE` (lane of the vehicle ahead, and reason why it stood), `FROM` and `UNTIL` [s]
    (when the group was first and last found starving).

    Parameters
    ----------
    summary
        The content of ``summary.json``.

    Examples
    --------
    >>> from loopgate.analysis import compute_starving
    >>> sink = {"behind": "v1", "lane": "a_0", "why": "breakdown", "noticed_s": 600.0, "until_s": 900.0}
    >>> compute_starving(summary={"starving": [sink | {"vehicles": ["v2", "v3"]}]})["vehicle"].tolist()
    ['v2', 'v3']
    """
    sinks = sorted(summary.get("starving", ()), key=lambda sink: -len(sink["vehicles"]))
    rows = (
        {c.VEHICLE: vehicle} | {name: sink[key] for name, key in _SINK.items()}
        for sink in sinks
        for vehicle in sink["vehicles"]
    )
    return table(rows, [c.VEHICLE, *_SINK])
