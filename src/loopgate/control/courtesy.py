"""Makes gated vehicles give way to ordinary vehicles before a junction, not inside it.

In SUMO a turning vehicle waits inside the junction, so near to other traffic that vehicles touch. SUMO also
knows nothing of movements that touch without being foes. So a granted vehicle is slowed down before a
junction while an ordinary vehicle is in its way or is coming, as long as the granted vehicle can still stop
there. After 60 s, and for ordinary vehicles that come later, SUMO's right of way decides.

Three cases are exempt from SUMO's right of way. A vehicle to whose way no ordinary vehicle comes goes where
the gate lets it, as in a run without such vehicles. A vehicle that drove in when no other vehicle came does
not wait inside for one that departs afterwards and can still stop. And two gated vehicles whose movements
do not touch do not wait for each other at their stop lines for ever, as SUMO has them do where lights are
off.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import Final

from loopgate.control.ordinary import comes, is_late
from loopgate.control.part import Part
from loopgate.control.places import MARGIN_M, STANDING_MPS, GrantedPass, Vehicle, braking_m, safe_speed
from loopgate.control.roads import BEYOND_M, CREEPS_MPS, Lookout
from loopgate.traffic.base import Traffic

_AT_LINE_M: Final = 5.0
"""A vehicle that stands within this distance of its stop line may be about to set out [m]."""

_SHORT_OF_M: Final = 0.5
"""A vehicle that gives way comes to rest this far before the junction [m]."""

_MOST_KEPT_S: Final = 60.0
"""After this time only SUMO's right of way keeps a vehicle from going on [s]."""

_HELD_UP_S: Final = 5.0
"""A vehicle that stands this long at its stop line, with no vehicle in its way, waits for another granted
vehicle [s]."""


class _Manners:
    """How one granted vehicle gives way, and what SUMO was told about it.

    `speed`: its speed limit for giving way [m/s]; infinite for none. `first`: whether it ignores SUMO's right
    of way. `since_s`: since when it gives way [s]. `stands_s`: since when it stands at its stop line [s].
    `clear`: the trip on which it does not wait inside the junction. `freed`: the trip on which it goes on
    without giving way. `soon_m`: the arc length of its front from which it is checked in each step [m].
    `alone`: whether no ordinary vehicle was near its way in the last step.
    """

    __slots__ = ("alone", "clear", "first", "freed", "since_s", "soon_m", "speed", "stands_s")

    def __init__(self) -> None:
        self.speed = inf
        self.first = self.alone = False
        self.since_s = inf
        self.stands_s = inf
        self.clear: GrantedPass | None = None
        self.freed: GrantedPass | None = None
        self.soon_m = -inf

    def heeds(self) -> bool:
        """Return whether the vehicle is checked in each step, wherever it is."""
        return self.clear is not None or self.freed is not None or self.since_s < inf or self.stands_s < inf


class Courtesy(Part):
    """Keeps vehicles out of the next junction while they must give way and can still stop before it."""

    def __init__(self, traffic: Traffic) -> None:
        self._traffic: Final = traffic
        self._under_way: dict[Vehicle, _Manners] = {}

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._under_way.pop(vehicle, None)

    def look(self, granted: Iterable[Vehicle]) -> None:
        """Tell vehicles how to give way; call it once in each step, after all answers.

        `granted`: the vehicles that got a grant since the last call.
        """
        for vehicle in granted:
            self._under_way.setdefault(vehicle, _Manners()).soon_m = -inf
        kept: list[tuple[str, float]] = []
        first: list[tuple[str, bool]] = []
        now_s, step_s = self._traffic.now_s, self._traffic.step_s
        for vehicle, manners in list(self._under_way.items()):
            speed, before = manners.speed, manners.first
            if not self._is_let_alone(vehicle, manners):
                if vehicle.front_m < manners.soon_m:
                    continue
                self._look_at(vehicle, manners, now_s, step_s)
            if manners.speed != speed:
                kept.append((vehicle.name, manners.speed))
            if manners.first != before:
                first.append((vehicle.name, manners.first))
            if not vehicle.trips:
                del self._under_way[vehicle]
        for name, limit in sorted(kept):
            self._traffic.keep_to(name, None if limit == inf else limit)
        for name, goes in sorted(first):
            self._traffic.give_way(name, gives=not goes)

    def _is_let_alone(self, vehicle: Vehicle, manners: _Manners) -> bool:
        """Return whether a vehicle goes on as without ordinary vehicles; else note that it no longer does."""
        before, manners.alone = manners.alone, _is_alone(vehicle, self._traffic.now_s)
        if manners.alone != before:
            for trip in vehicle.trips:
                trip.quiet = manners.alone
        if manners.alone:
            manners.speed, manners.first = inf, True
            manners.since_s = manners.stands_s = inf
            manners.clear = manners.freed = None
        elif before:
            ahead = next_trip(vehicle, 0.0, 1.0)
            lookout = None if ahead is None else ahead.over.lookout
            manners.soon_m = -inf
            manners.clear = ahead if lookout is not None and lookout.waits_in_way else None
        return manners.alone

    def _look_at(self, vehicle: Vehicle, manners: _Manners, now_s: float, step_s: float) -> None:
        """Set the speed limit of a vehicle, and whether it ignores SUMO's right of way."""
        since_s, stands_s, clear, freed = manners.since_s, manners.stands_s, manners.clear, manners.freed
        heeds = manners.heeds()
        manners.speed, manners.first = inf, False
        manners.since_s = manners.stands_s = inf
        manners.clear = manners.freed = None
        if not vehicle.trips:
            return
        if not heeds and not self._is_soon(vehicle, manners, step_s):
            return
        trip = next_trip(vehicle, BEYOND_M, 0.0)
        if trip is not None and _is_behind_guide(vehicle, trip):
            return
        if not heeds and not _matters(vehicle, trip):
            return
        if clear is not None:
            _go_on(vehicle, clear, manners, now_s)
        speed = self._limit(vehicle, trip, manners, now_s, step_s, before=since_s < inf)
        if speed == inf:
            if _is_free(vehicle, freed, manners, now_s if stands_s == inf else stands_s, now_s):
                manners.first = True
            return
        manners.since_s = now_s if since_s == inf else since_s
        if now_s - manners.since_s < _MOST_KEPT_S:
            manners.speed = speed

    def _is_soon(self, vehicle: Vehicle, manners: _Manners, step_s: float) -> bool:
        """Return whether a vehicle might be too late to stop before its junction at the next check."""
        make, line_m = vehicle.make, vehicle.trips[0].line_m
        most_m = make.top * step_s + make.top * make.top / (2.0 * make.decel) + MARGIN_M + _SHORT_OF_M
        manners.soon_m = line_m - max(most_m, 2.0 * _AT_LINE_M)
        fast = min(make.top, vehicle.speed + make.accel * step_s)
        late_m = fast * step_s + fast * fast / (2.0 * make.decel) + MARGIN_M + _SHORT_OF_M
        return line_m - vehicle.front_m < max(late_m, 2.0 * _AT_LINE_M)

    def _limit(
        self,
        vehicle: Vehicle,
        trip: GrantedPass | None,
        manners: _Manners,
        now_s: float,
        step_s: float,
        *,
        before: bool,
    ) -> float:
        """Return the highest speed of a vehicle that gives way [m/s]; infinity if it need not.

        `before`: whether it gave way in the last step.
        """
        lookout = None if trip is None else trip.over.lookout
        if trip is None or lookout is None:
            return inf
        make, line_m = vehicle.make, trip.line_m - vehicle.front_m
        left_m = line_m + lookout.from_m
        if vehicle.speed < STANDING_MPS:
            stands_m = line_m if lookout.first else left_m
            closed = stands_m <= _AT_LINE_M and _is_closed(vehicle, trip, lookout, left_m, manners, now_s)
            return 0.0 if closed else inf
        room_m = max(0.0, left_m - _SHORT_OF_M)
        fast = min(make.top, vehicle.speed + make.accel * step_s)
        late = room_m < fast * step_s + braking_m(fast, make.decel, step_s) + MARGIN_M
        if not (late or before) or left_m < braking_m(vehicle.speed, make.decel, step_s):
            return inf
        if not _is_closed(vehicle, trip, lookout, left_m, manners, now_s):
            return inf
        return safe_speed(room_m, make.decel, step_s)


def _is_alone(vehicle: Vehicle, now_s: float) -> bool:
    """Return whether a vehicle has grants, and no ordinary vehicle may come into its way on them."""
    if not vehicle.trips:
        return False
    for trip in vehicle.trips:  # noqa: SIM110  as in `Leg.is_quiet`
        if not trip.leg.is_quiet(now_s):
            return False
    return True


def next_trip(vehicle: Vehicle, beyond_m: float, of_length: float) -> GrantedPass | None:
    """Return the trip over the first movement ahead of a vehicle.

    A movement that the vehicle has entered still counts while its front is less than `beyond_m`, plus
    `of_length` times the movement's length, past the movement's beginning.
    """
    for trip in vehicle.trips:
        lookout = trip.over.lookout
        if lookout is not None:
            left_m = trip.line_m - vehicle.front_m + lookout.from_m
            if left_m >= -(beyond_m + of_length * lookout.length_m):
                return trip
    return None


def _is_behind_guide(vehicle: Vehicle, trip: GrantedPass) -> bool:
    """Return whether a movement begins behind the next point where a steered vehicle may have to stop."""
    lookout = trip.over.lookout
    return lookout is not None and trip.line_m + lookout.from_m > vehicle.guide_m


def _matters(vehicle: Vehicle, trip: GrantedPass | None) -> bool:
    """Return whether a vehicle stands before its next movement, or may have to give way on it."""
    lookout = None if trip is None else trip.over.lookout
    if lookout is None:
        return False
    return vehicle.speed < STANDING_MPS or lookout.waits_in_way or not lookout.is_quiet()


def _is_closed(
    vehicle: Vehicle, trip: GrantedPass, lookout: Lookout, left_m: float, manners: _Manners, now_s: float
) -> bool:
    """Return whether an ordinary vehicle is on the movement `left_m` ahead, or comes to it."""
    waits = lookout.wait_m > 0.0 or vehicle.speed < CREEPS_MPS
    used = lookout.is_blocked() if waits else lookout.is_used_unseen()
    closed = used or comes(vehicle, lookout, left_m, now_s)
    manners.clear = trip if lookout.waits_in_way and not closed else None
    return closed


def _go_on(vehicle: Vehicle, clear: GrantedPass, manners: _Manners, now_s: float) -> None:
    """Let a vehicle drive on over a movement that was clear, while it could have to wait inside."""
    lookout = clear.over.lookout
    if lookout is None or clear not in vehicle.trips:
        return
    left_m = clear.line_m - vehicle.front_m + lookout.from_m
    if left_m > -lookout.wait_m:
        manners.clear = clear
        if left_m < 0.0 and not is_late(lookout, now_s):
            manners.first = True


def _is_free(
    vehicle: Vehicle, freed: GrantedPass | None, manners: _Manners, since_s: float, now_s: float
) -> bool:
    """Return whether a vehicle goes on without giving way, because it waits only for granted vehicles."""
    trip = next_trip(vehicle, 0.0, 1.0)
    lookout = None if trip is None else trip.over.lookout
    if trip is None or lookout is None:
        return False
    line_m = trip.line_m - vehicle.front_m
    left_m = line_m + lookout.from_m
    goes = trip is freed
    stands_m = line_m if lookout.first else left_m
    if left_m >= 0.0 and stands_m <= _AT_LINE_M and vehicle.speed < STANDING_MPS:
        manners.stands_s = since_s
        goes = goes or now_s - since_s >= _HELD_UP_S
    if goes and not lookout.is_used() and not is_late(lookout, now_s):
        manners.freed = trip
        return True
    return False
