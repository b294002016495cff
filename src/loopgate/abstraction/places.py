"""Finds the parts of lanes where waiting vehicles touch no vehicle on another path, and their slots."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from loopgate.abstraction.itinerary import CLEARANCE_M
from loopgate.abstraction.swept import BETWEEN_M, Touches
from loopgate.network.loop import HOLD_MARGIN_M
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import VehicleType

_BACK_M = 2 * BETWEEN_M
"""Distance that a waiting body keeps from the last touched body [m]; bodies are checked at this interval."""

_FIRST_M = 7.0
"""Space before the stop line at the start [m]: a vehicle drives one step before it can be held."""

_SPREAD_M = 0.3
"""Extra space between standing vehicles at the start, beyond their gaps [m]."""

_ROUNDING = 1e-9


class Part(NamedTuple):
    """A part of a lane [m]."""

    begin_m: float
    end_m: float


def waiting_parts(network: RoadNetwork, touches: Touches, tails: Mapping[str, float]) -> Mapping[str, Part]:
    """Find, for each lane with touches, the longest part in which no body touches another path.

    A body in a part has its rear beyond the part's beginning and its front before its end. Stop lines move
    back where other vehicles swing out over them. A vehicle counts as under way until its rear is beyond all
    passing vehicles. Lanes that are not named are free in full length.

    Parameters
    ----------
    touches
        The touches of all paths.
    tails
        For each lane, how far vehicles that turn off swing back over it, see `tails_over` [m].
    """
    touched: dict[str, list[tuple[float, float]]] = {lane: [] for lane in tails}
    on_roads = np.array([not network.lanes[course.lane].internal for course in touches.paths], dtype=bool)
    sides = (
        (touches.one, touches.one_at_m, touches.one_length_m),
        (touches.other, touches.other_at_m, touches.other_length_m),
    )
    for course, at_m, length_m in sides:
        here = on_roads[course] & (at_m >= length_m - _BACK_M)
        rows = pd.DataFrame({"course": course[here], "at": at_m[here], "length": length_m[here]})
        for number, at, length in rows.drop_duplicates().itertuples(index=False):
            touched.setdefault(touches.paths[number].lane, []).append((at, length))
    ends_m = {lane: network.lanes[lane].length_m - tails.get(lane, 0.0) for lane in touched}
    return {lane: _longest(ends_m[lane], fronts) for lane, fronts in touched.items()}


def _longest(length_m: float, fronts: Iterable[tuple[float, float]]) -> Part:
    """Return the longest part without touches.

    Each touched body has its front beyond the part, or its rear before it.
    """
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


@dataclass(frozen=True, slots=True)
class QueuePlace:
    """A place where vehicles queue: a lane, or the part before or behind a change stretch."""

    name: str
    """The lane's id; with ``/1`` for the part before a stretch, ``/2`` for the part behind it."""
    length_m: float
    needs: tuple[tuple[float, int], ...]
    """Lengths of its visitors with their gaps [m], and the largest number of each, longest first."""
    away: bool = False
    """Whether it stands for the end of an open route, where vehicles have arrived, and is not on the road."""

    @property
    def needed_m(self) -> float:
        """Length that the longest visitor takes in the queue [m]: its length and its gap."""
        return self.needs[0][0]

    @property
    def capacity(self) -> int:
        """The number of slots: how many of the longest visitors fit."""
        left_m = self.length_m - HOLD_MARGIN_M - CLEARANCE_M
        held = 0
        for need_m, count in self.needs:
            fitting = math.floor(left_m / need_m + _ROUNDING)
            if fitting < count:
                return held + fitting
            held += count
            left_m -= count * need_m
        return held + math.floor(left_m / self.needs[-1][0] + _ROUNDING)

    @property
    def at_start(self) -> int:
        """The number of vehicles that may start on the place: at most one less than its slots.

        Then no place is full at the start, so there is no circle of full places: the start is live.
        """
        return max(1, min(self.capacity - 1, int(self._first_slot_m / (self.needed_m + _SPREAD_M))))

    def slots_m(self, types: Sequence[VehicleType]) -> list[float]:
        """Return the start positions of the fronts, the head first [m]."""
        front = self._first_slot_m
        fronts: list[float] = []
        for number, kind in enumerate(types):
            if number:
                # The gap is that of the follower: SUMO counts less than that as a collision.
                front -= types[number - 1].length_m + kind.min_gap_m + _SPREAD_M
            fronts.append(front)
        return fronts

    @property
    def _first_slot_m(self) -> float:
        line_m = self.length_m - HOLD_MARGIN_M
        return line_m - min(_FIRST_M, line_m - self.needed_m)
