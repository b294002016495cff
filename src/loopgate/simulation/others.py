"""Ordinary traffic among gated vehicles: where it is in their way."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.motion import time_s
from loopgate.gates import Reason
from loopgate.simulation.circles import Circles
from loopgate.simulation.coming import Arrival, Coming
from loopgate.simulation.crossing_ways import Approach, Movement, Way
from loopgate.simulation.sight import BEYOND_M, Sight
from loopgate.simulation.timetable import Timetable
from loopgate.traffic.base import Traffic

__all__ = ["PROMISE", "Others"]

PROMISE = (
    "The gate sees to gated vehicles only: none of its grants closes a circle of them, and they leave room "
    "in each for ordinary ones. More of those than there is room for can still hold them up for good, and "
    "between the two there is no more than SUMO's right of way."
)
"""What holds with ordinary traffic about."""

_STANDING_MPS = 0.1

_AT_LINE_M = 5.0
"""So far before its line a vehicle may stand that is about to set out [m]."""

_MOST_KEPT_S = 60.0
"""After this time it is SUMO's right of way alone that says when it sets out [s]."""

_PASSED_S = 2.0
"""Time in which an ordinary vehicle with the right of way is over the junction once it is there [s]."""

_APART_S = 1.0
"""Time to spare between a gated vehicle leaving and one with the right of way getting there [s]."""


class Others:
    """An obstacle: ordinary traffic, which no gate rules and nobody can count on.

    A vehicle is refused while an ordinary one

    - stands or drives before it on its own lane;
    - is, with some part, on a lane inside the junction that crosses or joins its way;
    - comes over the junction where nothing keeps the two apart, too late to pass before it and too soon to
      let it pass (see `Movement.approaches`);
    - takes the last room of its next state, or is about to drive into it; or could not find room in a circle
      of places that it would come into (`Circles`).

    It is looked at where the ordinary vehicles are when a request comes to be decided, in each step anew; a
    step without requests costs nothing. What comes later is SUMO's to sort out: with ordinary traffic about,
    gated vehicles keep its right of way too. Where that has stopped one before the junction, it does not set
    out while somebody is in its way: SUMO may let both go in one step.

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
    sight, coming, circles
        Where ordinary vehicles are, who gets to which junction when, and whom there is room for.
    """

    def __init__(
        self,
        traffic: Traffic,
        drivers: Sequence[Driver],
        ways: Mapping[str, Sequence[Way]],
        keeper: Gatekeeper,
        timetable: Timetable,
        sight: Sight,
        coming: Coming,
        circles: Circles,
    ) -> None:
        self._traffic = traffic
        self._drivers = drivers
        self._ways = ways
        self._keeper = keeper
        self._timetable = timetable
        self._sight, self._coming, self._circles = sight, coming, circles
        self._since_s: dict[str, float] = {}
        """Since when vehicles with grants stand before a junction with somebody in their way [s]."""
        self._still: set[str] = set()
        """Those of them that are kept there; by name, since numbers change when vehicles join and leave."""
        self._arrivals: dict[tuple[str, str], list[Arrival]] | None = None

    def in_the_way(self, robot: int) -> Reason | None:
        """Return TRAFFIC while an ordinary vehicle is in the way of `robot`."""
        self._look_around()
        if not self._sight.on:
            return None
        way = self._way(robot)
        if self._too_full(robot, way) or self._before(robot, way) or self._across(way):
            return Reason.TRAFFIC
        driver = self._drivers[robot]
        left_m = driver.line_m - driver.front_m
        near = any(self._is_near(driver, movement, left_m) for movement in way.movements[:1])
        return Reason.TRAFFIC if near or self._circles.too_tight(robot) else None

    def look(self) -> None:
        """Keep those at their lines that stand there with their grants while somebody is in their way."""
        now, since_s, self._since_s = self._traffic.now_s, self._since_s, {}
        still = set()
        for driver in self._drivers:
            if (
                driver.speed_mps < _STANDING_MPS
                and not driver.row["steered"]
                and self._may_not_set_out(driver)
            ):
                self._since_s[driver.id] = since_s.get(driver.id, now)
                if now - self._since_s[driver.id] < _MOST_KEPT_S:
                    still.add(driver.id)
        here = {driver.id for driver in self._drivers}
        for vehicle in sorted((self._still ^ still) & here):
            self._traffic.stand(vehicle, still=vehicle in still)
        self._still = still

    def _may_not_set_out(self, driver: Driver) -> bool:
        """Return whether a vehicle stands before a junction that it may cross, with somebody in its way."""
        ways = self._ways[driver.track.loop]
        for leg in range(int(driver.row["crossed"]), driver.granted):
            line_m = driver.end_m(leg) - driver.front_m
            for number, movement in enumerate(ways[leg % len(ways)].movements):
                left_m = line_m + movement.from_m
                if left_m >= -BEYOND_M and (left_m if number else line_m) <= _AT_LINE_M:
                    self._look_around()
                    inside = any(self._sight.upon(lane) for lane in movement.across)
                    return inside or self._is_near(driver, movement, left_m)
        return False

    def granted(self, robot: int) -> None:
        """Do nothing: SUMO's right of way sees to the rest."""

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return who is in the way of `robot` now."""
        self._look_around()
        way = self._way(robot)
        sets = [[other] for other in (*self._before(robot, way), *self._across(way))]
        if self._too_full(robot, way):
            inside = [seen.vehicle for seen in self._sight.inside(way.next)]
            holders = self._keeper.holders(self._keeper.wanted(robot))
            sets.append(inside + [self._drivers[other].id for other in holders])
        elif self._circles.too_tight(robot):
            sets.append([driver.id for driver in self._drivers if driver.robot != robot])
        return sets

    def figures(self) -> dict[str, Any]:
        """Return what ``summary.json`` says of ordinary traffic."""
        return {"vehicles": self._sight.count, "promise": PROMISE}

    def _way(self, robot: int) -> Way:
        driver = self._drivers[robot]
        return self._ways[driver.track.loop][driver.granted % len(driver.track.legs)]

    def _before(self, robot: int, way: Way) -> list[str]:
        """Return the ordinary vehicles between `robot` and its line."""
        seen = self._sight.on.get(way.lane, ())
        if not seen:
            return []
        driver = self._drivers[robot]
        here_m = way.line_m - (driver.line_m - driver.front_m)
        return [s.vehicle for s in seen if here_m < s.position_m <= way.line_m + BEYOND_M]

    def _across(self, way: Way) -> list[str]:
        lanes = [*(lane for movement in way.movements for lane in movement.across), *way.between]
        return [seen.vehicle for lane in dict.fromkeys(lanes) for seen in self._sight.upon(lane)]

    def _is_near(self, driver: Driver, movement: Movement, left_m: float) -> bool:
        """Return whether somebody would get in the way of one that is so far before a junction."""
        if not movement.approaches:
            return False
        speed, accel = driver.speed_mps, driver.accel_mps2
        top = min(driver.top_mps, movement.speed_mps)
        there_s = time_s(left_m, speed, accel, top)
        over_s = time_s(left_m + movement.wait_m, speed, accel, top) + _APART_S
        gained = math.sqrt(speed * speed + 2 * accel * max(0.0, left_m))
        going = 0.0 if movement.wait_m else min(top, gained)  # who may have to wait sets out from there
        over_s += time_s(movement.length_m - movement.wait_m + driver.length_m, going, accel, top)
        return any(
            arrival.last_s > there_s - _PASSED_S and arrival.first_s < over_s
            for approach in movement.approaches
            for arrival in self._comes(approach)
        )

    def _comes(self, approach: Approach) -> Sequence[Arrival]:
        if approach.signal is not None and not self._timetable.is_open(*approach.signal):
            return ()
        if self._arrivals is None:
            self._arrivals = self._coming.arrivals()
        return self._arrivals.get((approach.from_edge, approach.to_edge), ())

    def _too_full(self, robot: int, way: Way) -> bool:
        holders = self._keeper.holders(self._keeper.wanted(robot))
        return self._sight.fit(way.next, holders, self._drivers[robot].length_m) < 1

    def _look_around(self) -> None:
        if self._sight.look():
            self._arrivals = None
