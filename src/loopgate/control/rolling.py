"""Slows refused vehicles down early, so that they arrive at their stop lines rolling.

A vehicle that stands at its stop line starts from zero when it gets its grant, and clears the junction later
than a vehicle that arrives at speed. So while other vehicles are in the way of a refused vehicle, `Rolling`
predicts when they will have passed. It slows the vehicle so that it comes to its stop line about then.

The rules of the ledger do not change: a slowed vehicle holds no grant, and still stops at its stop line. It
is slowed only while its place has a free slot, so that vehicles behind it have space, and for half a minute
at most.
"""

from __future__ import annotations

from math import inf
from typing import Final

from loopgate.control.brakes import Brakes
from loopgate.control.crossings import in_the_way
from loopgate.control.motion import braking_m, safe_speed, time_s
from loopgate.control.places import Make, Vehicle
from loopgate.traffic.base import Traffic

MOST_S: Final = 30.0
"""A vehicle whose request is older than this drives up to its stop line [s]."""

AHEAD_S: Final = 3
"""Vehicles are predicted for this long [s]. A vehicle that is in the way then is assumed to go soon after."""

_AT_LINE_M: Final = 1.0
"""A vehicle this near to its stop line is not slowed [m]."""

_OVER_M: Final = 20.0
"""A vehicle is slowed only if it then comes earlier to this distance behind its stop line [m]."""

_EARLIER_S: Final = 0.05
"""By how much earlier it must come there, at least [s]."""

_PACE: Final = 0.75
"""Share of their acceleration that vehicles are predicted to use."""

_GRAIN: Final = 0.25
"""Distances [m] and speeds [m/s] are rounded to multiples of this, so that each limit is computed once."""

_SPEEDS: Final = 7
"""Number of speeds that are compared."""


class Rolling:
    """Slows vehicles that brake for their stop lines, if `on`."""

    def __init__(self, traffic: Traffic, brakes: Brakes, *, on: bool = True) -> None:
        self._traffic, self._brakes = traffic, brakes
        self._on = on
        self._slowed: dict[Vehicle, None] = {}
        self._limits: dict[tuple[float, float, float, float, float, int], float] = {}
        """The limits found so far [m/s]."""

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._slowed.pop(vehicle, None)

    def lift(self) -> None:
        """Lift the speed limits of the last step; call it first in each step."""
        for vehicle in self._slowed:
            self._traffic.keep_to(vehicle.name, None)
        self._slowed.clear()

    def look(self) -> None:
        """Set speed limits for the next step; call it once in each step, after all answers."""
        now_s, step_s = self._traffic.now_s, self._traffic.step_s
        for vehicle in self._brakes.braking if self._on else ():
            if not may_be_slowed(vehicle, now_s, step_s):
                continue
            speed = self._limit(vehicle, free_in_s(vehicle, now_s, step_s), step_s)
            if speed < vehicle.speed + vehicle.make.accel * step_s:
                self._traffic.keep_to(vehicle.name, speed)
                self._slowed[vehicle] = None

    def _limit(self, vehicle: Vehicle, free_s: int, step_s: float) -> float:
        """Return `best_speed` of a vehicle that is about as fast and as near, up to a `_GRAIN`."""
        make, top = vehicle.make, float(round(vehicle.make.top))
        left_m, speed = _GRAIN * (vehicle.left_m() // _GRAIN), _GRAIN * round(vehicle.speed / _GRAIN)
        key = left_m, speed, make.accel, make.decel, top, free_s
        limit = self._limits.get(key)
        if limit is None:
            limit = self._limits[key] = best_speed(left_m, speed, make.with_top(top), free_s, step_s)
        return limit


def may_be_slowed(vehicle: Vehicle, now_s: float, step_s: float) -> bool:
    """Return whether a vehicle waits only for its crossing, and delays no vehicle by driving slowly."""
    if not vehicle.asks or vehicle.reason != "crossing" or now_s - vehicle.since_s > MOST_S:
        return False
    if vehicle.leg.place.is_full() or not vehicle.is_settled() or vehicle.stops_here():
        return False
    left_m = vehicle.left_m()
    return left_m >= _AT_LINE_M and braking_m(vehicle.speed, vehicle.make.decel, step_s) <= left_m


def free_in_s(vehicle: Vehicle, now_s: float, step_s: float) -> int:
    """Predict in how many seconds no vehicle is in the way of a refused vehicle.

    The result is 1 to `AHEAD_S`, or one more if a vehicle is still in the way then. The prediction lets the
    refused vehicle brake for its stop line as late as it can, and the other vehicles drive on.
    """
    others: dict[Vehicle, tuple[float, float]] = {}
    for over in vehicle.leg.passes:
        for trip in over.movement.junction.trips:
            others[trip.vehicle] = trip.vehicle.front_m, trip.vehicle.speed
            for body in trip.into.place.bodies:
                others[body.vehicle] = body.vehicle.front_m, body.vehicle.speed
    others.pop(vehicle, None)
    front_m, speed = vehicle.front_m, vehicle.speed
    steps = max(1, round(1.0 / step_s))
    free_s = 1
    # Fronts and speeds are moved ahead for `in_the_way`, and restored at the end.
    while free_s <= AHEAD_S:
        for _ in range(steps):
            for other in others:
                _drive_on(other, step_s)
            vehicle.speed = _next(vehicle.left_m(), vehicle.speed, inf, vehicle.make, step_s)
            vehicle.front_m += vehicle.speed * step_s
        if in_the_way(vehicle, now_s + free_s) is None:
            break
        free_s += 1
    vehicle.front_m, vehicle.speed = front_m, speed
    for other, (other_m, other_speed) in others.items():
        other.front_m, other.speed = other_m, other_speed
    return free_s


def _drive_on(other: Vehicle, step_s: float) -> None:
    """Move a vehicle ahead by one step; a held vehicle stays."""
    make = other.make
    if other.trips:
        fast = min(other.speed + _PACE * make.accel * step_s, max(other.speed, other.trips[0].over.speed))
        fast = min(fast, make.top)
        if other.line_m < inf:
            fast = min(fast, safe_speed(max(0.0, other.left_m()), make.decel, step_s))
        other.speed = fast
    elif other.held:
        return
    other.front_m += other.speed * step_s


def _next(left_m: float, speed: float, most: float, make: Make, step_s: float) -> float:
    """Return the speed in the next step of a vehicle `left_m` before its stop line, at most `most` [m/s]."""
    fast = min(speed + _PACE * make.accel * step_s, make.top, most)
    fast = min(fast, safe_speed(max(0.0, left_m), make.decel, step_s))
    return max(fast, speed - make.decel * step_s, 0.0)


def best_speed(left_m: float, speed: float, make: Make, free_s: int, step_s: float) -> float:
    """Return the speed limit for the next step that helps a vehicle most [m/s].

    The vehicle is `left_m` before its stop line, gets its grant in `free_s` seconds, and keeps to the limit
    for some of them. The result is infinite if no limit helps.
    """
    if free_s <= 1:
        return inf
    per_s = max(1, round(1.0 / step_s))
    fastest, slowest = speed + _PACE * make.accel * step_s, max(0.0, speed - make.decel * step_s)
    best, best_s = inf, _over_s(left_m, speed, inf, 0, free_s * per_s, make, step_s) - _EARLIER_S
    for number in range(_SPEEDS):
        most = slowest + (fastest - slowest) * number / _SPEEDS
        for seconds in range(1, free_s + 1):
            over_s = _over_s(left_m, speed, most, seconds * per_s, free_s * per_s, make, step_s)
            if over_s < best_s:
                best, best_s = _next(left_m, speed, most, make, step_s), over_s
    return best


def _over_s(
    left_m: float, speed: float, most: float, keeps: int, steps: int, make: Make, step_s: float
) -> float:
    """Return how long after its grant a vehicle is `_OVER_M` behind its stop line [s].

    The grant comes after `steps` steps; in the first `keeps` of them the vehicle keeps to `most` [m/s].
    """
    for step in range(steps):
        speed = _next(left_m, speed, most if step < keeps else inf, make, step_s)
        left_m -= speed * step_s
    return time_s(left_m + _OVER_M, speed, _PACE * make.accel, make.top)
