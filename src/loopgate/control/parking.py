"""Parks vehicles beside the road without their slots, and returns them when they have slots again.

A vehicle returns when its stop is over, and two things hold in the same step: the rules let it have a slot of
its place, and no vehicle that drives, stands or returns is in the gap that it needs. The ledger then gives it
the slot, and its position in the line: the vehicles behind it can brake, so none passes it before it is on
the road. If SUMO keeps it off the road in that step, it gives the slot back. Under a gate other than the
chain rule no vehicle parks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from math import inf
from typing import Final, NamedTuple

from loopgate.control.chain import closes_by_returning
from loopgate.control.diary import Row
from loopgate.control.ledger import Ledger
from loopgate.control.places import STANDING_MPS, Body, Place, Vehicle, braking_m
from loopgate.network.stops import Stop
from loopgate.traffic.base import Traffic

# Values of `loopgate.results.columns.Event`.
PARK: Final = "park"
RETURN: Final = "return"

_GO_STEPS: Final = 2
"""With this many steps of its stop left, a vehicle is on the road in the next step, if SUMO finds a gap."""

_LONGER_STEPS: Final = 5
"""A vehicle that must stay parked is told to stay this many steps more."""

_REACTION_S: Final = 1.0
"""Reaction time of drivers [s]: SUMO's default."""

_ROUNDING_M: Final = 0.5

_POSITION_M: Final = 1e-4
"""What sums of positions lose; SUMO allows vehicles ten times this [m]."""

_SAME_M: Final = 0.5
"""Vehicles whose fronts are nearer to each other than this stand side by side [m]."""

_PATIENCE_S: Final = 20.0
"""A vehicle that cannot return alternates: it waits this long, then keeps other vehicles out of its place
this long [s]."""


_AT_STOP_M: Final = 0.5
"""A vehicle that stands nearer than this to its gap behind a vehicle at a stop is where SUMO lets it wait."""


class _Park(NamedTuple):
    """A stopping place beside the road: its name, its place, and how far before that one's end it ends [m].

    `lots`: whether it has lots, as a parking area has; at others vehicles stand one behind the other.
    """

    name: str
    place: Place
    before_end_m: float
    lots: bool

    def is_next_of(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle is on the road in the place, and stops here next."""
        before_end_m = vehicle.line_m - vehicle.stop_m
        return vehicle.leg.place is self.place and abs(before_end_m - self.before_end_m) < _ROUNDING_M


def line_up(ledger: Ledger, vehicle: Vehicle) -> None:
    """Put a vehicle where it belongs in the line of its place: other vehicles may have passed it.

    While a vehicle returns to the place, its line stays as it was when the rules let the vehicle return.
    """
    place = vehicle.leg.place
    if vehicle in place.line and any(other.beside for other in place.line):
        return
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
    return sum(_left_of(body) <= left_m for body in vehicle.leg.place.bodies)


def _left_of(body: Body) -> float:
    """Return the distance of a vehicle's front from the end of a place where it holds a slot [m]."""
    vehicle = body.vehicle
    return body.out_m - vehicle.make.length_m - vehicle.front_m - vehicle.lot_m


def mend_order(ledger: Ledger, places: Iterable[Place]) -> int:
    """Put the lines of places in the order on the road; return how many lines were not."""
    mended = 0
    for place in places:
        line = place.line
        returns = any(one.beside for one in line)
        if not returns and any(_left_m(a) > _left_m(b) + _SAME_M for a, b in pairwise(line)):
            line_up(ledger, line[0])
            mended += 1
    return mended


def come_back(ledger: Ledger, vehicle: Vehicle) -> None:
    """Give a vehicle that has stepped aside a slot of its place again, and its position in the line.

    `Vehicle.beside` stays true until the vehicle is on the road.
    """
    leg, place = vehicle.leg, vehicle.leg.place
    begin_m = vehicle.line_m - leg.end_m + leg.begin_m
    ledger.take_slot(Body(vehicle, place, begin_m, vehicle.line_m + vehicle.make.length_m), _rank(vehicle))
    line_up(ledger, vehicle)
    ledger.note_changes(leg.nears)
    ledger.wake(place.line[0])  # its place is fuller


def has_slot_for(vehicle: Vehicle, *, first: bool = False) -> bool:
    """Return whether a vehicle that has stepped aside may have a slot of its place again.

    The chain rule must allow it. `first`: whether it goes before a vehicle for which the last slot is kept.
    """
    place = vehicle.leg.place
    free = place.slots - len(place.bodies)
    if free <= 0 or place.shut or place.closed or (free == 1 and place.mover is not None):
        return False
    if free == 1 and place.kept_for is not None and not first:
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


def _keeps_out(waits_s: float) -> bool:
    """Return whether a vehicle that has waited this long to return keeps other vehicles out of its place."""
    return waits_s % (2.0 * _PATIENCE_S) >= _PATIENCE_S


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
        self._beside: dict[Vehicle, _Park | None] = {}
        """The vehicles that are beside the road, each with the stopping place that it is at, if any."""
        self._coming: set[Vehicle] = set()
        """The vehicles that have a slot again, and should be on the road after the next step."""
        self._parked_m: dict[Vehicle, float] = {}
        """Where vehicles with lots elsewhere parked, on their paths [m]."""
        self._braked: dict[Vehicle, int] = {}
        """Vehicles at speed 0 until they are on the road and held, or granted a leg after this one."""
        self._since_s: dict[Vehicle, float] = {}
        """Since when each vehicle whose stop is over waits to return [s]."""
        self.parked = 0
        """How often vehicles have given up their slots."""
        self.late_s = self.latest_s = 0.0
        """How long vehicles stood parked beyond their stops [s]: in all, and at most."""

    def begin(self, vehicle: Vehicle, stop: Stop) -> bool:
        """Take its slot away from a vehicle that has just parked; return whether this was possible.

        The vehicle keeps the slot under a gate other than the chain rule, and while it is not wholly in one
        place.
        """
        # Another gate needs each vehicle to be in a place.
        if not self._ledger.by_chain or not self._ledger.step_aside(vehicle):
            return False
        lots = stop.kind == "parkingArea"
        if lots:
            vehicle.lot_m = self._traffic.lot_ahead_m(vehicle.name, stop)
            self._parked_m[vehicle] = vehicle.front_m
        before_end_m = vehicle.line_m - vehicle.stop_m
        self._beside[vehicle] = (
            _Park(stop.name, vehicle.leg.place, before_end_m, lots) if stop.kind != "lane" else None
        )
        self.parked += 1
        self._note(vehicle, PARK, "")
        return True

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._braked.pop(vehicle, None)
        self._set_back(vehicle)

    def _set_back(self, vehicle: Vehicle) -> None:
        self._beside.pop(vehicle, None)
        self._parked_m.pop(vehicle, None)
        self._coming.discard(vehicle)
        self._since_s.pop(vehicle, None)

    def look(self) -> None:
        """Return vehicles to the road where possible, and keep the others parked."""
        now_s, step_s = self._traffic.now_s, self._traffic.step_s
        self._let_go()
        for vehicle, at_m in self._parked_m.items():
            if vehicle.front_m > at_m and abs(vehicle.front_m - at_m - vehicle.lot_m) < _ROUNDING_M:
                vehicle.lot_m = 0.0  # SUMO has put it on its lane beside its lot, before it drives
        first_s: dict[Place, float] = {}
        """Since when the first vehicle waits to return to each place [s]."""
        for vehicle in sorted(self._beside, key=self._since):
            if self._has_come(vehicle):
                self._is_back(vehicle)
                continue
            if vehicle not in self._since_s and self._traffic.stays_s(vehicle.name) > _GO_STEPS * step_s:
                continue
            if self._traffic.awaits(vehicle.name):
                self._traffic.stay(vehicle.name, _LONGER_STEPS * step_s)
                continue
            since_s = self._since_s.setdefault(vehicle, now_s)
            self.late_s += step_s if now_s > since_s else 0.0
            self.latest_s = max(self.latest_s, now_s - since_s)
            waits_s = now_s - first_s.setdefault(vehicle.leg.place, since_s)
            goes = self._may_go(vehicle, first=_keeps_out(waits_s))
            if goes:
                self._goes(vehicle)
            self._traffic.stay(vehicle.name, (_GO_STEPS if goes else _LONGER_STEPS) * step_s)
        for place, since_s in first_s.items():
            if _keeps_out(now_s - since_s):
                self._ledger.shut(place)

    def _since(self, vehicle: Vehicle) -> float:
        """Return since when a vehicle waits to return [s]; the vehicle that has waited longest goes first."""
        return self._since_s.get(vehicle, inf)

    def _has_come(self, vehicle: Vehicle) -> bool:
        """Return whether a parked vehicle is on the road; if SUMO kept it off, it gives its slot back."""
        on_road = bool(self._traffic.lane(vehicle.name)[0])
        if vehicle in self._coming:
            self._coming.discard(vehicle)
            if not on_road:
                self._ledger.step_aside(vehicle)
        elif on_road:  # nobody has asked for it to be there, but there it is
            come_back(self._ledger, vehicle)
        return on_road

    def _goes(self, vehicle: Vehicle) -> None:
        """Let a vehicle drive onto the road in the next step."""
        come_back(self._ledger, vehicle)
        vehicle.stop_m = inf  # from now on it may drive
        self._coming.add(vehicle)
        if vehicle not in self._braked and self._starts_over_its_line(vehicle):
            self._braked[vehicle] = vehicle.granted
            self._traffic.keep_to(vehicle.name, 0.0)

    def _is_back(self, vehicle: Vehicle) -> None:
        self._set_back(vehicle)
        vehicle.beside, vehicle.lot_m = False, 0.0
        before = [other for other in vehicle.leg.place.line if not other.beside]
        at = before.index(vehicle)
        self._note(vehicle, RETURN, before[at - 1].name if at else "")
        self._ledger.consider(vehicle)

    def _may_go(self, vehicle: Vehicle, *, first: bool) -> bool:
        """Return whether a vehicle may have a slot of its place and drive onto the road in the next step."""
        return self._has_room(vehicle) and has_slot_for(vehicle, first=first) and self._is_clear(vehicle)

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

    def _is_clear(self, vehicle: Vehicle) -> bool:
        """Return whether nobody is in the gap that a vehicle needs, and all vehicles behind can brake for it.

        SUMO does not ask the vehicles behind. A vehicle that returns too is where it stands now.
        """
        for body in vehicle.leg.place.bodies:
            other = body.vehicle
            gap_m = _left_of(body) - vehicle.left_m() - vehicle.make.length_m
            if gap_m < -vehicle.make.length_m:  # it is ahead; the two may have parked side by side
                if gap_m > -vehicle.make.length_m - other.make.length_m - vehicle.make.gap_m:
                    return False
            elif body is not other.bodies[-1]:
                return False  # it has a grant for the next place, and would hold it behind this vehicle
            elif gap_m < self._needs_m(other, self._beside[vehicle], gap_m):
                return False
        return True

    def _needs_m(self, other: Vehicle, park: _Park | None, gap_m: float) -> float:
        """Return the gap that a vehicle needs to brake for one that returns ahead of it, from a stop [m].

        A vehicle that stands before a full stop of its own does not start before there is space at it.
        `gap_m`: how far behind the vehicle that returns it is [m].
        """
        make, step_s = other.make, self._traffic.step_s
        if other.speed <= STANDING_MPS and park is not None and park.is_next_of(other):
            full = self._traffic.is_full(park.name) if park.lots else gap_m < make.gap_m + _AT_STOP_M
            if full:
                return make.gap_m - _POSITION_M
        fast = min(make.top, other.speed + make.accel * step_s)
        return make.gap_m + fast * (step_s + _REACTION_S) + braking_m(fast, make.decel, step_s)

    def _note(self, vehicle: Vehicle, event: str, ahead: str) -> None:
        self._rows.append((self._traffic.now_s, vehicle.name, event, vehicle.leg.place.name, ahead))
