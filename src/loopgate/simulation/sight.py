"""Whether a vehicle on a conflicting movement is still in the way of one that wants to cross."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from loopgate.abstraction.itinerary import Crossing, Itinerary
from loopgate.simulation.driver import Driver

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
    refresh
        Brings a driver's front and speed up to date.
    """

    def __init__(
        self,
        drivers: Sequence[Driver],
        itineraries: Sequence[Itinerary],
        refresh: Callable[[Driver], None],
    ) -> None:
        self._drivers = drivers
        self._itineraries = itineraries
        self._refresh = refresh

    def in_the_way(self, robot: int, mine: Crossing, other: int, foe: str) -> bool:
        """Return whether `other`, under way on `foe`, keeps `robot` from setting out on `mine`."""
        driver, ahead = self._drivers[robot], self._drivers[other]
        shared = mine.overlaps.get(foe)
        if shared is None:
            return True
        self._refresh(ahead)
        self._refresh(driver)
        reach_m = driver.end_m(driver.granted) - driver.front_m + shared[0]
        legs = self._itineraries[other].legs
        clear = False  # a vehicle granted in this very step has not set out
        for leg in range(ahead.crossed, ahead.granted):
            for crossing in legs[ahead.position(leg)].crossings:
                if crossing.id == foe:
                    theirs = crossing.overlaps.get(mine.id)
                    clear = theirs is not None and _passes_before(
                        ahead, ahead.front_m - ahead.end_m(leg), crossing.speed_mps, theirs, driver, reach_m
                    )
                    if not clear:
                        return True
        return not clear


def _passes_before(
    ahead: Driver,
    inside_m: float,
    speed_mps: float,
    shared_m: tuple[float, float],
    driver: Driver,
    reach_m: float,
) -> bool:
    left_m = shared_m[1] + ahead.length + _BEYOND_M - inside_m
    if left_m < 0:
        return True
    if inside_m < max(_BEYOND_M, shared_m[0]):
        return False  # not on the shared stretch yet: the two could stop across each other's way
    slow = min(ahead.top, _SLOW * speed_mps)
    return _time_s(ahead, left_m, slow) + _APART_S <= _time_s(driver, reach_m, driver.top)


def _time_s(driver: Driver, distance_m: float, top_mps: float) -> float:
    """Return the time to drive a distance, gaining speed up to a top speed."""
    if distance_m <= 0:
        return 0.0
    speed, accel = min(driver.speed, top_mps), driver.accel
    gaining_m = (top_mps * top_mps - speed * speed) / (2 * accel)
    if gaining_m >= distance_m:
        return (math.sqrt(speed * speed + 2 * accel * distance_m) - speed) / accel
    return (top_mps - speed) / accel + (distance_m - gaining_m) / top_mps
