"""Ordinary traffic among gated vehicles: where it is in their way."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.motion import time_s
from loopgate.gates import Reason
from loopgate.simulation.timetable import Timetable
from loopgate.simulation.ways import Approach, Way
from loopgate.traffic.base import Traffic

__all__ = ["PROMISE", "Others"]

PROMISE = (
    "The gate sees to gated vehicles only: none of its grants closes a circle of them. Ordinary vehicles can "
    "still hold them up for good, and between the two there is no more than SUMO's right of way."
)
"""What holds with ordinary traffic about."""

_GAP_M = 2.5
"""What an ordinary vehicle keeps free before it when it stands: SUMO's default [m]."""

_BEYOND_M = 0.3
"""How far past the end of a place vehicles may stand that are in it [m]."""

_STANDING_MPS = 0.1

_PASSED_S = 2.0
"""Time in which an ordinary vehicle with the right of way is over the junction once it is there [s]."""

_APART_S = 1.0
"""Time to spare between a gated vehicle leaving and one with the right of way getting there [s]."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """An ordinary vehicle: its name, the position of its front on its lane and its length [m]."""

    vehicle: str
    position_m: float
    length_m: float


class Others:
    """An obstacle: ordinary traffic, which no gate rules and nobody can count on.

    A vehicle is refused while an ordinary one

    - stands or drives before it on its own lane;
    - is on a lane inside the junction that crosses or joins its way;
    - comes near with the right of way, too late to pass before it and too soon to let it pass;
    - takes the last room of its next state, or is about to drive into it.

    It is looked at where the ordinary vehicles are when a request comes to be decided, in each step anew; a
    step without requests costs nothing. What comes later is SUMO's to sort out: with ordinary traffic about,
    gated vehicles keep its right of way too.

    Parameters
    ----------
    traffic
        The running simulation.
    drivers
        Of all robots: their grants, and where they are.
    ways
        By loop, then position.
    keeper
        Knows what the gated vehicles hold.
    timetable
        What the lights show.
    """

    def __init__(
        self,
        traffic: Traffic,
        drivers: Sequence[Driver],
        ways: Mapping[str, Sequence[Way]],
        keeper: Gatekeeper,
        timetable: Timetable,
    ) -> None:
        self._traffic = traffic
        self._drivers = drivers
        self._ways = ways
        self._keeper = keeper
        self._timetable = timetable
        self._lengths: dict[str, float] = {}
        self._count = 0
        self._seen_s = -math.inf
        self._on: dict[str, list[_Seen]] = {}

    def in_the_way(self, robot: int) -> Reason | None:
        """Return TRAFFIC while an ordinary vehicle is in the way of `robot`."""
        self._look_around()
        if not self._on:
            return None
        way = self._way(robot)
        full = self._too_full(robot, way)
        if full or self._before(robot, way) or self._across(way) or self._coming(robot, way):
            return Reason.TRAFFIC
        return None

    def granted(self, robot: int) -> None:
        """Do nothing: SUMO's right of way sees to the rest."""

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return who is in the way of `robot` now."""
        self._look_around()
        way = self._way(robot)
        sets = [[other] for other in (*self._before(robot, way), *self._across(way))]
        if self._too_full(robot, way):
            inside = [seen.vehicle for seen in self._next(way)]
            holders = self._keeper.holders(self._keeper.wanted(robot))
            sets.append(inside + [self._drivers[other].id for other in holders])
        return sets

    def figures(self) -> dict[str, Any]:
        """Return what ``summary.json`` says of ordinary traffic."""
        return {"vehicles": self._count, "promise": PROMISE}

    def _way(self, robot: int) -> Way:
        driver = self._drivers[robot]
        return self._ways[driver.track.loop][driver.granted % len(driver.track.legs)]

    def _before(self, robot: int, way: Way) -> list[str]:
        """Return the ordinary vehicles between `robot` and its line."""
        seen = self._on.get(way.lane, [])
        if not seen:
            return []
        driver = self._drivers[robot]
        here_m = way.line_m - (driver.line_m - driver.front_m)
        return [s.vehicle for s in seen if here_m < s.position_m <= way.line_m + _BEYOND_M]

    def _across(self, way: Way) -> list[str]:
        return [seen.vehicle for lane in way.across if lane in self._on for seen in self._on[lane]]

    def _coming(self, robot: int, way: Way) -> bool:
        """Return whether somebody with the right of way would get in the way."""
        near = [approach for approach in way.approaches if approach.lane in self._on]
        if not near:
            return False
        driver = self._drivers[robot]
        speed = driver.speed_mps
        left_m = driver.line_m - driver.front_m
        top = min(driver.top_mps, way.speed_mps)
        there_s = time_s(left_m, speed, driver.accel_mps2, top)
        over_s = time_s(left_m + way.over_m + driver.length_m, speed, driver.accel_mps2, top) + _APART_S
        return any(there_s - _PASSED_S < s < over_s for approach in near for s in self._arrivals_s(approach))

    def _arrivals_s(self, approach: Approach) -> list[float]:
        """Return in how many seconds vehicles get to the junction; standing ones may wait for anything."""
        if approach.signal is not None and not self._timetable.is_open(*approach.signal):
            return []
        found = []
        for seen in self._on[approach.lane]:
            speed = self._traffic.speed(seen.vehicle)
            if speed > _STANDING_MPS:
                found.append((approach.length_m - seen.position_m) / speed)
        return found

    def _next(self, way: Way) -> list[_Seen]:
        """Return the ordinary vehicles in the next state, and those about to drive into it."""
        begin, end = way.next_begin_m, way.next_end_m + _BEYOND_M
        inside = [s for s in self._on.get(way.next_lane, ()) if begin <= s.position_m <= end]
        for lane in way.into:
            inside += self._on.get(lane, ())
        return inside

    def _too_full(self, robot: int, way: Way) -> bool:
        inside = self._next(way)
        if not inside:
            return False
        taken = sum(math.ceil((seen.length_m + _GAP_M) / way.slot_m) for seen in inside)
        return taken >= self._keeper.room(self._keeper.wanted(robot))

    def _look_around(self) -> None:
        """Note where the ordinary vehicles are, once per step. O(vehicles)."""
        traffic = self._traffic
        if self._seen_s == traffic.now_s:
            return
        self._seen_s = traffic.now_s
        gated = {driver.id for driver in self._drivers}
        on: dict[str, list[_Seen]] = {}
        lengths: dict[str, float] = {}
        for vehicle in traffic.vehicles():
            if vehicle in gated:
                continue
            length_m = self._lengths.get(vehicle)
            if length_m is None:
                length_m = traffic.dynamics(vehicle).length_m
                self._count += 1
            lengths[vehicle] = length_m
            lane, position_m = traffic.lane(vehicle)
            on.setdefault(lane, []).append(_Seen(vehicle, position_m, length_m))
        self._lengths, self._on = lengths, on
