"""Parks vehicles beside the road without their slots, and returns them when they have slots again.

A vehicle returns when its stop is over, the rules let it have a slot of its place, and ordinary vehicles
leave space. It then stands in the line of its place, in the order on the road. SUMO decides when it drives
off into a gap. Under a gate other than the chain rule, parked vehicles keep their slots.
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
from loopgate.traffic.base import Traffic

# Values of `loopgate.results.columns.Event`.
PARK: Final = "park"
RETURN: Final = "return"

_SOON_STEPS: Final = 3
"""A parked vehicle is looked at in this many last steps of its stop.

SUMO puts it back on the road one step before the stop ends; until then it can be told to stay."""

_GO_STEPS: Final = 2
"""With this many steps of its stop left, a vehicle is on the road in the next step, if there is a gap."""

_LONGER_STEPS: Final = 5
"""A vehicle that must stay parked is told to stay this many steps more."""

_GAP_M: Final = 2.5
_REACTION_S: Final = 1.0
"""Gap between standing vehicles [m], and reaction time of drivers [s]: SUMO's defaults."""

_ROUNDING_M: Final = 0.5

_SAME_M: Final = 0.5
"""Vehicles whose fronts are nearer to each other than this stand side by side [m]."""

_PATIENCE_S: Final = 20.0
"""A vehicle that cannot return alternates: it waits this long, then keeps other vehicles out of its place
this long [s]."""


def line_up(ledger: Ledger, vehicle: Vehicle) -> None:
    """Put a vehicle where it belongs in the line of its place: other vehicles may have passed it."""
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
    """Put a vehicle that has just come where it belongs in its place; so far it is the last there."""
    bodies = vehicle.leg.place.bodies
    if len(bodies) > 1:
        body = bodies.pop()
        bodies.insert(_rank(vehicle), body)
        line_up(ledger, vehicle)


def _rank(vehicle: Vehicle) -> int:
    """Return how many vehicles with slots of a vehicle's place are ahead of it.

    At the call, the vehicle itself must hold no slot there.
    """
    left_m = _left_m(vehicle)
    ahead = 0
    for one in vehicle.leg.place.bodies:
        ahead += one.out_m - one.vehicle.make.length_m - one.vehicle.front_m <= left_m
    return ahead


def mend_order(ledger: Ledger, places: Iterable[Place]) -> int:
    """Put the lines of places in the order on the road; return how many lines were not."""
    mended = 0
    for place in places:
        line = place.line
        if any(_left_m(a) > _left_m(b) + _SAME_M for a, b in pairwise(line)):
            line_up(ledger, line[0])
            mended += 1
    return mended


def come_back(ledger: Ledger, vehicle: Vehicle) -> None:
    """Give a vehicle that has stepped aside a slot of its place again.

    `Vehicle.beside` stays true until the vehicle is on the road.
    """
    leg, place = vehicle.leg, vehicle.leg.place
    begin_m = vehicle.line_m - leg.end_m + leg.begin_m
    ledger.take_slot(Body(vehicle, place, begin_m, vehicle.line_m + vehicle.make.length_m), _rank(vehicle))
    line_up(ledger, vehicle)
    ledger.wake(place.line[0])  # its place is fuller


def has_slot_for(vehicle: Vehicle) -> bool:
    """Return whether the chain rule lets a vehicle that has stepped aside have a slot again."""
    place = vehicle.leg.place
    free = place.slots - len(place.bodies)
    if free <= 0 or place.shut or place.mover is not None or (free == 1 and place.kept_for is not None):
        return False
    return not closes_by_returning(place, _in_order([*place.line, vehicle])[0])


def _in_order(line: list[Vehicle]) -> list[Vehicle]:
    """Return the vehicles of a line in the order on the road."""
    return sorted(line, key=_left_m)


def _left_m(vehicle: Vehicle) -> float:
    """Return the distance of a vehicle from the end of its place [m], of its rear if it is beside the road.

    A vehicle next to a parked vehicle cannot let it in, and so goes first.
    """
    return vehicle.left_m() + (vehicle.make.length_m if vehicle.beside else 0.0)


class Parking:
    """Takes the slots of vehicles that park, and keeps the vehicles parked until they have slots again.

    Parameters
    ----------
    has_room
        Returns whether ordinary vehicles leave space for a vehicle in its place.
    rows
        Gets the events.
    """

    def __init__(
        self, traffic: Traffic, ledger: Ledger, has_room: Callable[[Vehicle], bool], rows: list[Row]
    ) -> None:
        self._traffic, self._ledger, self._has_room, self._rows = traffic, ledger, has_room, rows
        self._beside: dict[Vehicle, None] = {}
        self._coming: set[Vehicle] = set()
        """The vehicles that have a slot again and are not on the road yet."""
        self._braked: dict[Vehicle, int] = {}
        """Vehicles at speed 0 until they are on the road and held, or granted a leg after this one."""
        self._since_s: dict[Vehicle, float] = {}
        """Since when each vehicle whose stop is over waits to return [s]."""
        self.late_s = self.latest_s = 0.0
        """How long vehicles stood parked beyond their stops [s]: in all, and at most."""

    def begin(self, vehicle: Vehicle, why: str = "") -> bool:
        """Take its slot away from a vehicle that has just parked; return whether this was possible.

        The vehicle keeps the slot under a gate other than the chain rule, and while it is not wholly in one
        place. `why`: noted in the event.
        """
        # Another gate needs each vehicle to be in a place.
        if not self._ledger.by_chain or not self._ledger.step_aside(vehicle):
            return False
        self._beside[vehicle] = None
        self._note(vehicle, PARK, why)
        return True

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._braked.pop(vehicle, None)
        self._set_back(vehicle)

    def _set_back(self, vehicle: Vehicle) -> None:
        self._beside.pop(vehicle, None)
        self._coming.discard(vehicle)
        self._since_s.pop(vehicle, None)

    def look(self) -> None:
        """Return vehicles to the road where possible, and keep the others parked."""
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
                continue  # its stop is not over
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
        """Return whether a vehicle may drive onto the road in the next step; it gets a free slot first."""
        room = self._has_room(vehicle)
        if vehicle in self._coming:
            line_up(self._ledger, vehicle)
        elif room and has_slot_for(vehicle):
            come_back(self._ledger, vehicle)
            self._coming.add(vehicle)
        return room and vehicle in self._coming and self._is_clear(vehicle, vehicle.leg.place)

    def _let_go(self) -> None:
        """Let vehicles drive that are on the road again and held at their stop line, or granted more."""
        for vehicle, leg in list(self._braked.items()):
            if not vehicle.beside and (vehicle.held or vehicle.granted != leg):
                del self._braked[vehicle]
                self._traffic.keep_to(vehicle.name, None)

    def _starts_over_its_line(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle that returns would pass its stop line before it can be held."""
        if vehicle.leg.after is None:
            return False  # its way ends there
        make, step_s = vehicle.make, self._traffic.step_s
        speed = make.accel * step_s
        return vehicle.left_m() < speed * step_s + braking_m(speed, make.decel, step_s) + _ROUNDING_M

    def _is_clear(self, vehicle: Vehicle, place: Place) -> bool:
        """Return whether all vehicles behind can brake for a vehicle that returns; SUMO does not ask."""
        step_s = self._traffic.step_s
        for body in place.bodies:
            other = body.vehicle
            their_left_m = body.out_m - other.make.length_m - other.front_m
            gap_m = their_left_m - vehicle.left_m() - vehicle.make.length_m
            if other.beside:
                continue
            if gap_m < -vehicle.make.length_m:  # it is ahead; the two may have parked side by side
                if gap_m > -vehicle.make.length_m - other.make.length_m - _GAP_M:
                    return False
                continue
            fast = min(other.make.top, other.speed + other.make.accel * step_s)
            decel = other.make.decel
            if gap_m >= 0.0 and other.speed <= STANDING_MPS and other.stops_here():
                continue  # as at a full car park: it does not start before the vehicle that returns has gone
            if gap_m < _GAP_M + fast * (step_s + _REACTION_S) + braking_m(fast, decel, step_s):
                return False
        return True

    def _note(self, vehicle: Vehicle, event: str, ahead: str) -> None:
        self._rows.append((self._traffic.now_s, vehicle.name, event, vehicle.leg.place.name, ahead))
