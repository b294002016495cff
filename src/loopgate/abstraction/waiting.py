"""Where on a lane a vehicle may wait: out of reach of all bodies that do not follow it."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from loopgate.abstraction.swept import BETWEEN_M, Touches
from loopgate.network.road import RoadNetwork

_BACK_M = 2 * BETWEEN_M
"""How far from the last body that is touched a waiting one stays [m]: they are looked at so far apart."""


class Part(NamedTuple):
    """A part of a lane [m]."""

    begin_m: float
    end_m: float


def waiting_parts(network: RoadNetwork, touches: Touches, tails: Mapping[str, float]) -> Mapping[str, Part]:
    """Find on each lane with touches the longest part in which no body touches another way.

    A body in a part has its rear behind the part's beginning and its front before its end. Stop lines move
    back from where others swing out over them, and a vehicle counts as under way until its rear is where
    nobody passes any more. Lanes that are not named are free all along.

    Parameters
    ----------
    touches
        Of all courses that are driven.
    tails
        How far those who turn off swing back over the lane that they leave, see `tails_over` [m].
    """
    touched: dict[str, list[tuple[float, float]]] = {lane: [] for lane in tails}
    on_roads = np.array([not network.lanes[course.lane].internal for course in touches.courses], dtype=bool)
    sides = (
        (touches.one, touches.one_at_m, touches.one_length_m),
        (touches.other, touches.other_at_m, touches.other_length_m),
    )
    for course, at_m, length_m in sides:
        here = on_roads[course] & (at_m >= length_m - _BACK_M)
        rows = pd.DataFrame({"course": course[here], "at": at_m[here], "length": length_m[here]})
        for number, at, length in rows.drop_duplicates().itertuples(index=False):
            touched.setdefault(touches.courses[number].lane, []).append((at, length))
    ends_m = {lane: network.lanes[lane].length_m - tails.get(lane, 0.0) for lane in touched}
    return {lane: _longest(ends_m[lane], fronts) for lane, fronts in touched.items()}


def _longest(length_m: float, fronts: Iterable[tuple[float, float]]) -> Part:
    """Return the longest part: of each body that touches the front lies beyond it, or the rear before it."""
    rows = sorted(fronts)
    best = Part(0.0, 0.0)
    begin = 0.0
    for number in range(len(rows) + 1):
        end = min(rows[number][0] - _BACK_M, length_m) if number < len(rows) else length_m
        if end - begin > best.end_m - best.begin_m:
            best = Part(begin, end)
        if number < len(rows):
            front, length = rows[number]
            begin = max(begin, front - length + _BACK_M)
    return best
