"""Whether a vehicle on a conflicting movement is still in the way of one that wants to cross."""

from __future__ import annotations

import math
from collections.abc import Sequence

from loopgate.abstraction.itinerary import Crossing, Itinerary
from loopgate.model import System
from loopgate.simulation.driver import Driver
from loopgate.simulation.fleet import Fleet
from loopgate.simulation.motion import braking_time_s, time_s
from loopgate.simulation.occupancy import Occupancy

__all__ = ["APART_S", "BEYOND_M", "GAP_M", "SLOW", "Sight"]

BEYOND_M = 0.5
"""Room between the rear of the first and the stretch that both use [m]."""

APART_S = 0.5
"""Time between the rear of the first leaving that stretch and the front of the second reaching it [s]."""

SLOW = 0.7
"""Share of the speed limit on its crossing that the first is taken to reach: its driver may be slow, and the
vehicle before it slower still. At 0.85 SUMO counts a collision now and then in a dense city."""

GAP_M = 2.5
"""Room that the first keeps to the vehicle before it [m], which may be standing."""


class Sight:
    """Looks at where vehicles are on their crossings, to free these piece by piece and ahead of time.

    A vehicle is no longer in the way of another once its rear is past the stretch that the two movements
    share. If its front is on that stretch already, it is enough that its rear will be past it before the
    other's front can reach it: nothing holds it there, since it has a slot to drive into and SUMO lets no
    vehicle go first that finds another in its way. Before that, SUMO may let each wait for the other. Nor is
    anything foreseen of one that may itself have to wait on the junction, for a third that was granted before
    it and is still in its way. The vehicle that it follows into its place is taken to stand.

    Parameters
    ----------
    drivers
        One per robot.
    itineraries
        One per robot.
    fleet
        Where the vehicles are.
    system, occupancy
        Who holds which state, in which order.
    foresees
        Whether it is enough that one on the shared stretch will be past. Else it has to be past already:
        where vehicles give way to ordinary traffic they may stand on the junction for that.
    """

    def __init__(
        self,
        drivers: Sequence[Driver],
        itineraries: Sequence[Itinerary],
        fleet: Fleet,
        system: System,
        occupancy: Occupancy,
        *,
        foresees: bool = True,
    ) -> None:
        self._paths = system.paths
        self._occupancy = occupancy
        self._drivers = drivers
        self._itineraries = itineraries
        self._fleet = fleet
        self._foresees = foresees

    def in_the_way(self, robot: int, mine: Crossing, other: int, foe: str) -> bool:
        """Return whether `other`, under way on `foe`, keeps `robot` from setting out on `mine`."""
        driver, ahead = self._drivers[robot], self._drivers[other]
        shared = mine.overlaps.get(foe)
        if shared is None:
            return True
        reach_m = driver.line_m - self._fleet.fronts[robot] + shared[0]
        legs = self._itineraries[other].legs
        clear = False  # a vehicle granted in this very step has not set out
        for leg in range(ahead.crossed, ahead.granted):
            for crossing in legs[ahead.position(leg)].crossings:
                if crossing.id == foe:
                    theirs = crossing.overlaps.get(mine.id)
                    clear = theirs is not None and self._passes_before(
                        ahead, leg, crossing.speed_mps, theirs, driver, reach_m
                    )
                    if not clear:
                        return True
        return not clear

    def _passes_before(
        self,
        ahead: Driver,
        leg: int,
        limit_mps: float,
        shared_m: tuple[float, float],
        driver: Driver,
        reach_m: float,
    ) -> bool:
        fronts, speeds = self._fleet.fronts, self._fleet.speeds
        inside_m = fronts[ahead.robot] - ahead.end_m(leg)
        left_m = shared_m[1] + ahead.length + BEYOND_M - inside_m
        if left_m < 0:
            return True
        if not self._foresees or inside_m < max(BEYOND_M, shared_m[0]):
            return False  # not on the shared stretch yet: the two could stop across each other's way
        slow = min(ahead.top, SLOW * limit_mps)
        passed_s = time_s(left_m, speeds[ahead.robot], ahead.accel, slow) + APART_S
        reached_s = time_s(reach_m, speeds[driver.robot], driver.accel, driver.top)
        if passed_s > reached_s or self._may_be_held(ahead, leg):
            return False
        return braking_time_s(left_m, self._room_m(ahead, leg), slow, ahead.decel) + APART_S <= reached_s

    def _may_be_held(self, ahead: Driver, leg: int) -> bool:
        """Return whether SUMO may let a vehicle wait on the junction for one that was granted before it."""
        number = ahead.behind[leg - ahead.crossed].grant
        for crossing in self._itineraries[ahead.robot].legs[ahead.position(leg)].crossings:
            for other, foe in self._occupancy.foes_on_way(crossing, ahead.robot):
                first = self._drivers[other]
                for its, joint in enumerate(first.behind, start=first.crossed):
                    if joint.grant < number and self._is_before(first, its, foe, crossing):
                        return True
        return False

    def _is_before(self, first: Driver, leg: int, foe: str, crossing: Crossing) -> bool:
        """Return whether `first`, if it is on the movement `foe` behind `leg`, is not yet past `crossing`."""
        past_m = self._fleet.fronts[first.robot] - first.length - BEYOND_M - first.end_m(leg)
        return any(
            theirs.id == foe and past_m < theirs.overlaps.get(crossing.id, (0.0, math.inf))[1]
            for theirs in self._itineraries[first.robot].legs[first.position(leg)].crossings
        )

    def _room_m(self, ahead: Driver, leg: int) -> float:
        """Return how far a vehicle can go from `leg` if the one before it in its place stands [m]."""
        state = self._paths[ahead.robot][ahead.position(leg + 1)]
        holders = self._occupancy.holders(state)
        before = holders.index(ahead.robot)
        if not before:
            return math.inf
        first = self._drivers[holders[before - 1]]
        path = self._paths[first.robot]
        held = range(first.granted, first.tail - 1, -1)
        its = next((j for j in held if path[first.position(j)] == state), None)
        if its is None:
            return math.inf
        fronts = self._fleet.fronts
        between = fronts[first.robot] - first.begin_m(its) - fronts[ahead.robot] + ahead.begin_m(leg + 1)
        return between - first.length - GAP_M
