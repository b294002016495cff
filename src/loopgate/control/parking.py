"""Vehicles that park beside the road: they give up their slots, and come back when they have one again.

A vehicle comes back when its stop is over, its place has a slot that the rules let it have, and there is room
among ordinary vehicles. It then stands in the line of its place, in the order of the road. SUMO decides when
it drives off into a gap. Under other gates than the certified one with the chain rule, vehicles keep their
slots.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Final

from loopgate.control.chain import closes_by_returning
from loopgate.control.diary import Row
from loopgate.control.ledger import Ledger
from loopgate.control.motion import STANDING_MPS, braking_m
from loopgate.control.places import Body, Place, Vehicle
from loopgate.control.rules import chain
from loopgate.traffic.base import Traffic

# Words of `loopgate.results.columns.Event`.
PARK: Final = "park"
RETURN: Final = "return"

_SOON_STEPS: Final = 3
"""SUMO puts a vehicle back on the road a step before its stop ends: before that it can be told to stay."""

_GO_STEPS: Final = 2
"""With so many left it is on the road in the next step, if there is a gap."""

_LONGER_STEPS: Final = 5
"""For so many steps more it is told to stay."""

_GAP_M: Final = 2.5
_REACTION_S: Final = 1.0
"""Gap that drivers keep when they stand [m], and time in which they react [s]: SUMO's defaults."""

_ROUNDING_M: Final = 0.5

_SAME_M: Final = 0.5
"""Vehicles that are ahead of one another by less than this stand beside each other [m]."""

_PATIENCE_S: Final = 20.0
"""A vehicle that has waited so long for its way back keeps others out of its place for as long, now and
then [s]."""


def line_up(ledger: Ledger, vehicle: Vehicle) -> None:
    """Let a vehicle be where it is in the line of its place: others may have passed it."""
    place = vehicle.leg.place
    before, others = place.line, [other for other in place.line if other is not vehicle]
    place.line = line = _in_order([*others, vehicle])
    for other in others[:1]:
        if other is not line[0]:
            ledger.withdraw(other)
            ledger.consider(other)
    if before != line and not line[0].steered:
        ledger.consider(line[0])


def put_in_order(ledger: Ledger, vehicle: Vehicle) -> None:
    """Let a vehicle that has just come be where it is among those in its place: it is last there."""
    bodies = vehicle.leg.place.bodies
    if len(bodies) > 1:
        body = bodies.pop()
        bodies.insert(_rank(vehicle), body)
        line_up(ledger, vehicle)


def _rank(vehicle: Vehicle) -> int:
    """Return how many of those that hold slots of its place are ahead of a vehicle that holds none there."""
    left_m = _left_m(vehicle)
    ahead = 0
    for one in vehicle.leg.place.bodies:
        ahead += one.out_m - one.vehicle.make.length_m - one.vehicle.front_m <= left_m
    return ahead


def mend_order(ledger: Ledger, places: Iterable[Place]) -> int:
    """Put the lines of all places in the order on the road; return how many were not in it."""
    mended = 0
    for place in places:
        line = place.line
        if any(_left_m(a) > _left_m(b) + _SAME_M for a, b in pairwise(line)):
            line_up(ledger, line[0])
            mended += 1
    return mended


def come_back(ledger: Ledger, vehicle: Vehicle) -> None:
    """Give a vehicle that has stepped aside a slot where it stands; `beside` says when it is there."""
    leg, place = vehicle.leg, vehicle.leg.place
    begin_m = vehicle.line_m - leg.end_m + leg.begin_m
    ledger.take_slot(Body(vehicle, place, begin_m, vehicle.line_m + vehicle.make.length_m), _rank(vehicle))
    line_up(ledger, vehicle)
    ledger.wake(place.line[0])  # its place is fuller


def has_slot_for(vehicle: Vehicle) -> bool:
    """Return whether a vehicle that has stepped aside may have a slot again: the chain rule's answer."""
    place = vehicle.leg.place
    free = place.slots - len(place.bodies)
    if free <= 0 or place.shut or place.mover is not None or (free == 1 and place.kept_for is not None):
        return False
    return not closes_by_returning(place, _in_order([*place.line, vehicle])[0])


def _in_order(line: list[Vehicle]) -> list[Vehicle]:
    """Return vehicles whose last grant is one place in the order in which they are there."""
    return sorted(line, key=_left_m)


def _left_m(vehicle: Vehicle) -> float:
    """Return how far a vehicle is from the end of its place [m]; from its rear for one beside the road.

    One that stands next to it cannot let it in, and so goes first.
    """
    return vehicle.left_m() + (vehicle.make.length_m if vehicle.beside else 0.0)


class Parking:
    """Vehicles that park give up their slots, and stay parked until they have a slot again.

    Parameters
    ----------
    has_room
        Whether there is room for a vehicle in its place, ordinary vehicles considered.
    rows
        Takes the events.
    """

    def __init__(
        self, traffic: Traffic, ledger: Ledger, has_room: Callable[[Vehicle], bool], rows: list[Row]
    ) -> None:
        self._traffic, self._ledger, self._has_room, self._rows = traffic, ledger, has_room, rows
        self._beside: dict[Vehicle, None] = {}
        self._coming: set[Vehicle] = set()
        """The vehicles that have a slot again and are not on the road yet."""
        self._braked: dict[Vehicle, int] = {}
        """Vehicles that stand still until they are on the road and held, or granted a leg after this one."""
        self._since_s: dict[Vehicle, float] = {}
        """Since when those wait whose stops are over [s]."""
        self.late_s = self.latest_s = 0.0
        """For how long vehicles stood parked beyond their stops, in all and at most [s]."""

    def begin(self, vehicle: Vehicle, why: str = "") -> bool:
        """Take the slot of a vehicle that has just parked; return whether it gave it up."""
        # Another gate knows of no vehicle that is in no place.
        if chain not in self._ledger.rules or not self._ledger.step_aside(vehicle):
            return False
        self._beside[vehicle] = None
        self._note(vehicle, PARK, why)
        return True

    def forget(self, vehicle: Vehicle) -> None:
        """Take note that the vehicle is in the ledger no longer."""
        self._braked.pop(vehicle, None)
        self._set_back(vehicle)

    def _set_back(self, vehicle: Vehicle) -> None:
        self._beside.pop(vehicle, None)
        self._coming.discard(vehicle)
        self._since_s.pop(vehicle, None)

    def look(self) -> None:
        """Return vehicles to the road if possible, and keep the others parked."""
        now_s, step_s = self._traffic.now_s, self._traffic.step_s
        self._let_go()
        for vehicle in list(self._beside):
            if vehicle in self._coming and self._traffic.lane(vehicle.name)[0]:
                self._is_back(vehicle)
                continue
            left_s = self._traffic.stays_s(vehicle.name)
            if left_s > _SOON_STEPS * step_s:
                continue
            if vehicle not in self._coming and self._traffic.awaits(vehicle.name):
                self._traffic.stay(vehicle.name, _LONGER_STEPS * step_s)
                continue
            goes = self._may_go(vehicle)
            if goes and vehicle not in self._braked and self._starts_over_its_line(vehicle):
                self._braked[vehicle] = vehicle.granted
                self._traffic.keep_to(vehicle.name, 0.0)
            if goes and left_s > _GO_STEPS * step_s:
                continue  # not before its time
            self._traffic.stay(vehicle.name, (_GO_STEPS if goes else _LONGER_STEPS) * step_s)
            since_s = self._since_s.setdefault(vehicle, now_s)
            self.late_s += step_s if now_s > since_s else 0.0
            self.latest_s = max(self.latest_s, now_s - since_s)
            if (now_s - since_s) % (2.0 * _PATIENCE_S) >= _PATIENCE_S:
                self._ledger.shut(vehicle.leg.place)

    def _is_back(self, vehicle: Vehicle) -> None:
        line_up(self._ledger, vehicle)
        self._set_back(vehicle)
        vehicle.beside = False
        before = [other for other in vehicle.leg.place.line if not other.beside]
        at = before.index(vehicle)
        self._note(vehicle, RETURN, before[at - 1].name if at else "")
        self._ledger.consider(vehicle)

    def _may_go(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle may drive onto the road in the next step; see to its slot."""
        room = self._has_room(vehicle)
        if vehicle in self._coming:
            line_up(self._ledger, vehicle)
        elif room and has_slot_for(vehicle):
            come_back(self._ledger, vehicle)
            self._coming.add(vehicle)
        return room and vehicle in self._coming and self._is_clear(vehicle, vehicle.leg.place)

    def _let_go(self) -> None:
        """Let vehicles drive that are on the road again, and held at their line or granted more."""
        for vehicle, leg in list(self._braked.items()):
            if not vehicle.beside and (vehicle.held or vehicle.granted != leg):
                del self._braked[vehicle]
                self._traffic.keep_to(vehicle.name, None)

    def _starts_over_its_line(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle beside the road would pass the end of its place before it is held."""
        if vehicle.leg.after is None:
            return False  # its way ends there
        make, step_s = vehicle.make, self._traffic.step_s
        speed = make.accel * step_s
        return vehicle.left_m() < speed * step_s + braking_m(speed, make.decel, step_s) + _ROUNDING_M

    def _is_clear(self, vehicle: Vehicle, place: Place) -> bool:
        """Return whether all behind can brake for it: SUMO lets it in before others at speed."""
        step_s = self._traffic.step_s
        for body in place.bodies:
            other = body.vehicle
            their_left_m = body.out_m - other.make.length_m - other.front_m
            gap_m = their_left_m - vehicle.left_m() - vehicle.make.length_m
            if other.beside:
                continue
            if gap_m < -vehicle.make.length_m:  # ahead: they may have parked side by side
                if gap_m > -vehicle.make.length_m - other.make.length_m - _GAP_M:
                    return False
                continue
            fast = min(other.make.top, other.speed + other.make.accel * step_s)
            decel = other.make.decel
            if gap_m >= 0.0 and other.speed <= STANDING_MPS and other.stops_here():
                continue  # as at a car park that is full: it does not start before this one has gone
            if gap_m < _GAP_M + fast * (step_s + _REACTION_S) + braking_m(fast, decel, step_s):
                return False
        return True

    def _note(self, vehicle: Vehicle, event: str, ahead: str) -> None:
        self._rows.append((self._traffic.now_s, vehicle.name, event, vehicle.leg.place.name, ahead))
