"""Keeps slots free for ordinary vehicles in circles of places, since these vehicles do not ask.

In such a circle, the first vehicle of each place wants the next place. The chain rule leaves one slot free,
so that the circle can turn. An ordinary vehicle takes that slot without asking. So ordinary vehicles count as
vehicles in places. A vehicle that wants to enter a circle must leave one slot more, and one for each ordinary
vehicle that is about to enter. A vehicle within the circle may always go on, so at least one can. A mover
(`loopgate.control.keeping`) must leave one slot only.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import floor, inf
from typing import Final

from loopgate.control.places import STANDING_MPS, Body, Leg, Place, Vehicle
from loopgate.control.roads import Other, RoadEdge, RoadLane, RoadStretch
from loopgate.control.sight import AHEAD

_SHARE: Final = 5
"""One slot in five of a place is kept for ordinary vehicles, at least one if the place has three slots."""

_GAP_M: Final = 2.5
"""Gap that a standing vehicle keeps to the vehicle ahead: SUMO's default [m]."""


_CLEAR_M: Final = 40.0
"""A parked vehicle returns only if no ordinary vehicle is this near behind it [m]."""


def fit(stretch: RoadStretch, there: Iterable[Vehicle], length_m: float) -> float:
    """Return how many more vehicles of a length fit into a place beside the vehicles in it.

    The vehicles in it are `there`, and the ordinary vehicles in the place or on the way into it. Each takes
    its length and a gap. The result is infinite if there is no ordinary vehicle: then the rules about slots
    decide.
    """
    taken_m = _taken_m(stretch)
    if taken_m == 0.0:
        return inf
    for vehicle in there:
        taken_m += vehicle.make.length_m + _GAP_M
    return _more(stretch, taken_m, length_m)


def fit_beside(stretch: RoadStretch, bodies: Iterable[Body], length_m: float) -> float:
    """Return `fit` beside the vehicles that hold the slots `bodies`."""
    taken_m = _taken_m(stretch)
    if taken_m == 0.0:
        return inf
    for body in bodies:
        taken_m += body.vehicle.make.length_m + _GAP_M
    return _more(stretch, taken_m, length_m)


def _taken_m(stretch: RoadStretch) -> float:
    """Return the length that ordinary vehicles take of a place, with their gaps; 0 if there is none [m]."""
    taken_m = 0.0
    for other in stretch.lane.fronts:
        if stretch.holds(other):
            taken_m += other.length_m + _GAP_M
    for lane in stretch.into:
        for other in lane.fronts:
            taken_m += other.length_m + _GAP_M
    return taken_m


def _more(stretch: RoadStretch, taken_m: float, length_m: float) -> float:
    return max(0.0, float(floor((stretch.end_m - stretch.begin_m - taken_m) / (length_m + _GAP_M))))


class Slack:
    """Finds moves of vehicles that would leave too little space for ordinary vehicles.

    Parameters
    ----------
    everywhere
        Whether a share of each place is kept, and not only where ordinary vehicles come or are. With lights
        off that share lets full roads flow: without it the mean delay is 9 and 3 % longer in two districts of
        Bologna with some ungated buses. With lights obeyed it is 4 and 7 % shorter without it.
    """

    def __init__(self, *, everywhere: bool = False) -> None:
        self._everywhere: Final = everywhere
        self._on: dict[RoadLane, Place] = {}
        """The first place on each lane."""
        self._stretches: dict[Place, RoadStretch] = {}

    def know(self, path: Iterable[Leg]) -> None:
        """Store where the places of a path lie on the road."""
        for leg in path:
            stretch = leg.stretch
            if stretch is None or leg.place in self._stretches:
                continue
            self._stretches[leg.place] = stretch
            known = self._on.get(stretch.lane)
            if known is None or self._stretches[known].begin_m > stretch.begin_m:
                self._on[stretch.lane] = leg.place

    def too_tight(self, vehicle: Vehicle) -> list[Place]:
        """Return the places in which a vehicle's next move leaves too few slots; none if it leaves enough."""
        leg = vehicle.leg.after
        if leg is None:
            return []
        return self._too_tight(
            vehicle, leg, vehicle.leg.place, vehicle.after_begins_m(leg) + leg.end_m - leg.begin_m
        )

    def has_room(self, vehicle: Vehicle) -> bool:
        """Return whether ordinary traffic leaves space for a parked vehicle to return, also in its circle."""
        stretch, line_m = vehicle.leg.stretch, vehicle.line_m
        if stretch is None:
            return True
        here_m = stretch.end_m - vehicle.left_m()
        for other in stretch.lane.fronts:
            if -_CLEAR_M < other.position_m - here_m < other.length_m:
                return False
        if fit_beside(stretch, vehicle.leg.place.bodies, vehicle.make.length_m) < 1.0:
            return False
        return not self._too_tight(vehicle, vehicle.leg, None, line_m)

    def _too_tight(self, vehicle: Vehicle, leg: Leg, here: Place | None, line_m: float) -> list[Place]:
        """Return the places in which a move from `here` into `leg` leaves too few slots.

        `line_m`: arc length at which `leg` ends [m].
        """
        if leg.stretch is None or leg.stretch.is_away:
            return []  # a vehicle that arrives takes no slot
        entered = leg.place
        moves_first = vehicle.mover
        circle: dict[Place, None] = {}
        holes, length_m, crowded = 0.0, vehicle.make.length_m, False
        place: Place | None = entered
        while place is not None and place is not here and place not in circle:
            stretch = self._stretches[place]
            free = min(float(place.slots - len(place.line)), fit(stretch, place.line, length_m))
            if place is entered:
                free -= 1.0
                kept = self._everywhere or bool(stretch.lane.edge.coming) or _taken_m(stretch) > 0.0
                crowded = kept and not moves_first and free < (place.slots + 2) // _SHARE
            holes += max(0.0, free)
            circle[place] = None
            first = place.line[0] if place.line else None
            other = _first_in(stretch)
            if first is not None:
                end_m, its_leg = first.line_m, first.leg
            else:
                end_m, its_leg = line_m, leg
                first = vehicle if place is entered else None
            if first is not None and not _is_before(other, first, end_m, stretch):
                other = _stands_behind(its_leg)
                if other is None:
                    length_m = first.make.length_m
                    place = None if its_leg.after is None else its_leg.after.place
                    continue
            place = None if other is None else self._sought(other)
            length_m = 0.0 if other is None else other.length_m
        if place is not None and place is here:
            return []
        tight = crowded
        if place is entered and not tight:
            tight = holes < (1.0 if moves_first else 2.0 + self._coming(circle))
        return list(circle) if tight else []

    def _sought(self, other: Other) -> Place | None:
        """Return the next place on the route of an ordinary vehicle."""
        lane = other.lane
        for edge in other.edges[other.at + 1 : other.at + 1 + AHEAD]:
            lane = None if lane is None else lane.ahead.get(edge)
            if lane is None:
                return None
            if lane in self._on:
                return self._on[lane]
        return None

    def _coming(self, circle: Iterable[Place]) -> int:
        """Return how many ordinary vehicles outside a circle are about to enter it."""
        inside: set[Other] = set()
        edges: dict[RoadEdge, None] = {}
        for place in circle:
            stretch = self._stretches[place]
            edges[stretch.lane.edge] = None
            inside.update(other for other in stretch.lane.fronts if stretch.holds(other))
            for lane in stretch.into:
                inside.update(lane.fronts)
        return len({other for edge in edges for other in edge.coming} - inside)


def _first_in(stretch: RoadStretch) -> Other | None:
    """Return the ordinary vehicle that is farthest ahead in a place."""
    first: Other | None = None
    for other in stretch.lane.fronts:
        if stretch.holds(other) and (first is None or other.position_m > first.position_m):
            first = other
    return first


def _is_before(other: Other | None, vehicle: Vehicle, end_m: float, stretch: RoadStretch) -> bool:
    """Return whether an ordinary vehicle is ahead of a gated vehicle whose place ends at `end_m`."""
    return other is not None and end_m - vehicle.front_m > stretch.end_m - other.position_m


def _stands_behind(leg: Leg) -> Other | None:
    """Return an ordinary vehicle that stands on the crossing after a leg, if there is one."""
    if leg.stretch is not None:
        for lane in leg.stretch.between:
            other = _standing_on(lane)
            if other is not None:
                return other
    for over in leg.passes:
        if over.lookout is not None:
            for one in over.lookout.across:
                other = _standing_on(one.lane)
                if other is not None:
                    return other
    return None


def _standing_on(lane: RoadLane) -> Other | None:
    for other in lane.fronts:
        if other.speed < STANDING_MPS:
            return other
    return None
