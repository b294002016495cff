"""Finds streets that no vehicle entered while a place on their loops was blocked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from loopgate.abstraction.itinerary import Track
from loopgate.arrays import Floats
from loopgate.results.columns import EVENT, PLACE, TIME, Event

_LEAST_S = 300.0
"""A street without a visit for a shorter time is not reported [s]."""


def note_unwatched(
    blocked: Iterable[dict[str, Any]],
    tracks: Iterable[Track],
    events: pd.DataFrame,
    *,
    begin_s: float,
    end_s: float,
) -> None:
    """Add to each blocked place the streets without a visit meanwhile, each with its last visit [s].

    These are the edges of loops through the place that no vehicle entered while it was blocked, for at least
    300 s and for longer than ever before.

    Parameters
    ----------
    blocked
        As in ``summary.json``; each gets the key ``unwatched``.
    tracks
        At least one path on each loop.
    events
        The events of entered edges.
    begin_s, end_s
        When the run began and ended [s].
    """
    ways: dict[str, dict[str, None]] = {}
    for track in {one.loop: one for one in tracks}.values():
        for leg in track.legs:
            ways.setdefault(leg.state, {}).update(dict.fromkeys(name for _, name in track.edges))
    rows = events[events[EVENT] == Event.EDGE.value]
    entered = {str(edge): np.sort(some.to_numpy(np.float64)) for edge, some in rows.groupby(PLACE)[TIME]}
    for one in blocked:
        until_s = end_s if one["to_s"] is None else float(one["to_s"])
        edges = ways.get(one["place"], {})
        one["unwatched"] = _unwatched(edges, entered, (begin_s, float(one["from_s"]), until_s, end_s))


def _unwatched(
    edges: Iterable[str], entered: Mapping[str, Floats], times_s: Sequence[float]
) -> dict[str, float]:
    begin_s, from_s, until_s, end_s = times_s
    found: dict[str, float] = {}
    for edge in edges:
        at_s = entered.get(edge, np.zeros(0))
        before, after = at_s[at_s < from_s], at_s[at_s >= from_s]
        if not before.size or (after.size and after[0] < until_s):
            continue
        since_s, seen_s = float(before[-1]), float(after[0]) if after.size else end_s
        longest_s = max(later - sooner for sooner, later in pairwise([begin_s, *before.tolist()]))
        if seen_s - since_s >= max(_LEAST_S, longest_s):
            found[edge] = since_s
    return dict(sorted(found.items()))
