"""Ordinary traffic among gated vehicles: where it is in their way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.gates import Reason
from loopgate.model import StateId
from loopgate.simulation.around.circles import Circles
from loopgate.simulation.around.crossing_ways import Way
from loopgate.simulation.around.sight import BEYOND_M, Sight
from loopgate.simulation.around.yielding import Yielding

__all__ = ["PROMISE", "Others"]

PROMISE = (
    "The gate sees to gated vehicles only: none of its grants closes a circle of them, and they leave room "
    "in each for ordinary ones. More of those than there is room for can still hold them up for good, and "
    "between the two there is no more than SUMO's right of way."
)
"""The promise that holds with ordinary traffic about."""

_CLEAR_M = 40.0
"""So far behind who drives onto its lane from beside it no ordinary vehicle may be [m]."""


class Others:
    """An obstacle: ordinary traffic, which no gate rules and nobody can count on.

    A vehicle is refused while an ordinary one

    - stands or drives before it on its own lane;
    - is, with some part, on a lane inside the junction that crosses or joins its way;
    - comes over the junction where nothing keeps the two apart, too late to pass before it and too soon to
      let it pass (see `Movement.approaches`);
    - takes the last room of its next state, or is about to drive into it; or could not find room in a circle
      of places that it would come into (`Circles`).

    It is looked at where the ordinary vehicles are when a request comes to be decided, in each step anew.
    Who comes later is given way to before the junction (`Yielding`), and by SUMO's own right of way, which
    gated vehicles keep too with ordinary traffic about.

    Parameters
    ----------
    drivers
        Of all robots: their grants, and where they are.
    ways
        By loop, then position.
    keeper
        Knows what the gated vehicles hold.
    sight, yielding, circles
        Where ordinary vehicles are, who of them comes, and whom there is room for.
    """

    heeds_grants = True

    def __init__(
        self,
        drivers: Sequence[Driver],
        ways: Mapping[str, Sequence[Way]],
        keeper: Gatekeeper,
        sight: Sight,
        yielding: Yielding,
        circles: Circles,
    ) -> None:
        self._drivers = drivers
        self._ways = ways
        self._keeper = keeper
        self._sight, self._yielding, self._circles = sight, yielding, circles
        self._on: object = None
        """Vehicles in sight when it was looked last."""
        self._free: dict[int, set[str]] = {}
        """Who was free to go since then, and the states whose vehicles that rests on."""

    def in_the_way(self, robot: int) -> Reason | None:
        """Return TRAFFIC while an ordinary vehicle is in the way of `robot`."""
        self._yielding.look_around()
        if not self._sight.on:
            return None
        if self._on is not self._sight.on:
            self._on = self._sight.on
            self._free.clear()
        elif robot in self._free:
            return None
        way = self._way(robot)
        if self._too_full(robot, way) or self._meets(robot, way) or self._circles.too_tight(robot):
            return Reason.TRAFFIC
        driver = self._drivers[robot]
        if not driver.row["mover"]:  # of whom more is asked when it is none any more
            self._free[robot] = {str(driver.leg(driver.granted + 1).state), *self._circles.asked}
        return None

    def has_room(self, driver: Driver) -> bool:
        """Return whether one that comes back from beside the road has room in its place and in its circle."""
        self._yielding.look_around()
        if not self._sight.on:
            return True
        ways, state = self._ways[driver.track.loop], str(driver.leg(driver.granted).state)
        holders = self._keeper.holders(self._keeper.system.states.index(StateId(state)))
        place = ways[(driver.granted - 1) % len(ways)].next
        here_m = place.begin_m + driver.inside_m(state)
        if any(-_CLEAR_M < s.position_m - here_m < s.length_m for s in self._sight.on.get(place.lane, ())):
            return False
        free = self._sight.fit(place, holders, driver.length_m)
        return free >= 1 and not self._circles.too_tight(driver.robot, back=True)

    def look(self) -> None:
        """Keep those with grants out of junctions where somebody is in their way."""
        self._yielding.look()

    def granted(self, robot: int) -> None:
        """Ask anew about those who were free to go because of where it was, or is to be."""
        driver = self._drivers[robot]
        left, entered = (str(driver.leg(driver.granted + ahead).state) for ahead in (-1, 0))
        for other, states in [*self._free.items()]:
            if other == robot or left in states or entered in states:
                del self._free[other]

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return who is in the way of `robot` now."""
        self._yielding.look_around()
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

    def _meets(self, robot: int, way: Way) -> bool:
        """Return whether somebody is before `robot` on its lane, across its way, or comes there."""
        if way.lane not in self._sight.on and self._is_quiet(way):
            return False
        if self._before(robot, way) or self._across(way):
            return True
        driver = self._drivers[robot]
        left_m = driver.line_m - driver.front_m
        return any(self._yielding.comes(driver, one, left_m + one.from_m) for one in way.movements)

    def _is_quiet(self, way: Way) -> bool:
        between = self._sight.busy.isdisjoint(way.between)
        return between and all(self._yielding.is_quiet(movement) for movement in way.movements)

    def _before(self, robot: int, way: Way) -> list[str]:
        """Return the ordinary vehicles between `robot` and its line."""
        seen = self._sight.on.get(way.lane, ())
        if not seen:
            return []
        driver = self._drivers[robot]
        here_m = way.line_m - (driver.line_m - driver.front_m)
        return [s.vehicle for s in seen if here_m < s.position_m <= way.line_m + BEYOND_M]

    def _across(self, way: Way) -> list[str]:
        if self._sight.busy.isdisjoint(way.across):
            return []
        there = [seen for movement in way.movements for seen in self._sight.across(movement)]
        there += (seen for lane in way.between for seen in self._sight.upon(lane))
        return list(dict.fromkeys(seen.vehicle for seen in there))

    def _too_full(self, robot: int, way: Way) -> bool:
        if not self._sight.inside(way.next):
            return False
        holders = self._keeper.holders(self._keeper.wanted(robot))
        return self._sight.fit(way.next, holders, self._drivers[robot].length_m) < 1
