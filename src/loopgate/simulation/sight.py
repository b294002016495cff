"""Whether a vehicle on a conflicting movement is still in the way of one that wants to cross."""

from __future__ import annotations

import math
from collections.abc import Sequence

from loopgate.abstraction.itinerary import Crossing, Itinerary
from loopgate.simulation.driver import Driver
from loopgate.simulation.fleet import Fleet

__all__ = ["Sight"]

_BEYOND_M = 0.5
"""Room between the rear of the first and the stretch that both use [m]."""

_APART_S = 0.5
"""Time between the rear of the first leaving that stretch and the front of the second reaching it [s]."""

_SLOW = 0.7
"""Share of the speed limit on its crossing that the first is taken to reach: its driver may be slow, and the
vehicle before it slower still. At 0.85 SUMO counts a collision now and then in a dense city."""


class Sight:
    """Looks at where vehicles are on their crossings, to free these piece by piece and ahead of time.

    A vehicle is no longer in the way of another once its rear is past the stretch that the two movements
    share. If its front is on that stretch already, it is enough that its rear will be past it before the
    other's front can reach it: nothing holds it there, since it has a slot to drive into and SUMO lets no
    vehicle go first that finds another in its way. Before that, SUMO may let each wait for the other.

    Parameters
    ----------
    drivers
        One per robot.
    itineraries
        One per robot.
    fleet
        Where the vehicles are.
    """

    def __init__(
        self,
        drivers: Sequence[Driver],
        itineraries: Sequence[Itinerary],
        fleet: Fleet,
    ) -> None:
        self._drivers = drivers
        self._itineraries = itineraries
        self._fleet = fleet

    def in_the_way(self, robot: int, mine: Crossing, other: int, foe: str) -> bool:
        """Return whether `other`, under way on `foe`, keeps `robot` from setting out on `mine`."""
        driver, ahead = self._drivers[robot], self._drivers[other]
        shared = mine.overlaps.get(foe)
        if shared is None:
            return True
        fronts, speeds = self._fleet.fronts, self._fleet.speeds
        reach_m = driver.line_m - fronts[robot] + shared[0]
        legs = self._itineraries[other].legs
        clear = False  # a vehicle granted in this very step has not set out
        for leg in range(ahead.crossed, ahead.granted):
            for crossing in legs[ahead.position(leg)].crossings:
                if crossing.id == foe:
                    theirs = crossing.overlaps.get(mine.id)
                    clear = theirs is not None and _passes_before(
                        ahead,
                        speeds[other],
                        fronts[other] - ahead.end_m(leg),
                        crossing.speed_mps,
                        theirs,
                        driver,
                        speeds[robot],
                        reach_m,
                    )
                    if not clear:
                        return True
        return not clear


def _passes_before(
    ahead: Driver,
    speed: float,
    inside_m: float,
    limit_mps: float,
    shared_m: tuple[float, float],
    driver: Driver,
    its_speed: float,
    reach_m: float,
) -> bool:
    left_m = shared_m[1] + ahead.length + _BEYOND_M - inside_m
    if left_m < 0:
        return True
    if inside_m < max(_BEYOND_M, shared_m[0]):
        return False  # not on the shared stretch yet: the two could stop across each other's way
    slow = min(ahead.top, _SLOW * limit_mps)
    passed_s = _time_s(left_m, speed, ahead.accel, slow) + _APART_S
    return passed_s <= _time_s(reach_m, its_speed, driver.accel, driver.top)


def _time_s(distance_m: float, speed: float, accel: float, top_mps: float) -> float:
    """Return the time to drive a distance, gaining speed up to a top speed."""
    if distance_m <= 0:
        return 0.0
    speed = min(speed, top_mps)
    gaining_m = (top_mps * top_mps - speed * speed) / (2 * accel)
    if gaining_m >= distance_m:
        return (math.sqrt(speed * speed + 2 * accel * distance_m) - speed) / accel
    return (top_mps - speed) / accel + (distance_m - gaining_m) / top_mps
