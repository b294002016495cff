"""Slows refused vehicles down early, so that they arrive at their stop lines rolling.

A vehicle that stands at its line starts from zero when it is granted, and is over the junction later than a
vehicle that comes at speed. So where other vehicles are in the way of a refused vehicle, `Rolling` predicts
when they will have passed, and slows the vehicle so that it is before its line about then.

The rules of the ledger do not change: a slowed vehicle holds no grant and keeps the stop at its line. It is
slowed only while its place has a free slot, so that vehicles behind it fit in, and for half a minute at most.
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
"""A vehicle whose request is older drives up to its line [s]."""

AHEAD_S: Final = 3
"""Vehicles are predicted for so many seconds. A vehicle that is in the way then is taken to go soon after."""

_AT_LINE_M: Final = 1.0
"""A vehicle so near to its line is not slowed [m]."""

_OVER_M: Final = 20.0
"""A vehicle is slowed if so it will be this far behind its line earlier [m]."""

_EARLIER_S: Final = 0.05
"""By so much earlier at least [s]."""

_PACE: Final = 0.75
"""The share of their acceleration that vehicles are predicted to use."""

_SPEEDS: Final = 7
"""How many speeds are compared."""


class Rolling:
    """Slows vehicles that brake for their stop lines, if it is switched `on`."""

    def __init__(self, traffic: Traffic, brakes: Brakes) -> None:
        self._traffic, self._brakes = traffic, brakes
        self.on = False
        self._slowed: dict[Vehicle, None] = {}

    def forget(self, vehicle: Vehicle) -> None:
        """Take note that the vehicle is in the ledger no longer."""
        self._slowed.pop(vehicle, None)

    def lift(self) -> None:
        """Lift the limits of the step before; called first in each step."""
        for vehicle in self._slowed:
            self._traffic.keep_to(vehicle.name, None)
        self._slowed.clear()

    def look(self) -> None:
        """Slow vehicles in the next step; called once in each step, after all answers."""
        now_s, step_s = self._traffic.now_s, self._traffic.step_s
        for vehicle in self._brakes.braking if self.on else ():
            if not may_be_slowed(vehicle, now_s, step_s):
                continue
            speed = best_speed(vehicle, free_in_s(vehicle, now_s, step_s), step_s)
            if speed < vehicle.speed + vehicle.make.accel * step_s:
                self._traffic.keep_to(vehicle.name, speed)
                self._slowed[vehicle] = None


def may_be_slowed(vehicle: Vehicle, now_s: float, step_s: float) -> bool:
    """Return whether a vehicle waits only for its crossing, and delays no other vehicle if it hangs back."""
    if not vehicle.asks or vehicle.reason != "crossing" or now_s - vehicle.since_s > MOST_S:
        return False
    if vehicle.leg.place.is_full() or not vehicle.is_settled() or vehicle.stops_here():
        return False
    left_m = vehicle.left_m()
    return left_m >= _AT_LINE_M and braking_m(vehicle.speed, vehicle.make.decel, step_s) <= left_m


def free_in_s(vehicle: Vehicle, now_s: float, step_s: float) -> int:
    """Predict in how many seconds no vehicle is in the way of a refused vehicle.

    Return 1 to `AHEAD_S`, or one more if a vehicle is in the way then. The refused vehicle is predicted to
    brake for its line as late as it can, the other vehicles to drive on.
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
    # The fronts and speeds are put ahead for `in_the_way`, and put back at the end.
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
    """Put a vehicle ahead by a step; a held vehicle stays."""
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
    """Return the speed in the next step of a vehicle `left_m` before its line that keeps to `most` [m/s]."""
    fast = min(speed + _PACE * make.accel * step_s, make.top, most)
    fast = min(fast, safe_speed(max(0.0, left_m), make.decel, step_s))
    return max(fast, speed - make.decel * step_s, 0.0)


def best_speed(vehicle: Vehicle, free_s: int, step_s: float) -> float:
    """Return the limit in the next step with which a vehicle gains most if it is granted in `free_s` [m/s].

    It is infinite if the vehicle does not gain by one. The vehicle keeps to the limit for some of the
    seconds.
    """
    if free_s <= 1:
        return inf
    make, speed, left_m, per_s = vehicle.make, vehicle.speed, vehicle.left_m(), max(1, round(1.0 / step_s))
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
    """Return how long after a grant a vehicle is over the junction [s].

    The vehicle is granted in so many `steps`, and keeps to `most` [m/s] in the first `keeps` of them.
    """
    for step in range(steps):
        speed = _next(left_m, speed, most if step < keeps else inf, make, step_s)
        left_m -= speed * step_s
    return time_s(left_m + _OVER_M, speed, _PACE * make.accel, make.top)
