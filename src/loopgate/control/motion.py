"""How far and how long vehicles drive: braking distance, safe speed and driving time."""

from __future__ import annotations

from math import floor, inf, log, sqrt
from typing import Final

STANDING_MPS: Final = 0.1
"""A vehicle slower than this stands, as in SUMO's waiting time [m/s]."""


def braking_m(speed: float, decel: float, step_s: float) -> float:
    """Return SUMO's braking distance from `speed` [m]: one step at each lower speed, down to zero."""
    loss = decel * step_s
    steps = float(int(speed / loss))
    return step_s * (steps * speed - loss * steps * (steps + 1.0) / 2.0)


def safe_speed(room_m: float, decel: float, step_s: float) -> float:
    """Return the highest speed in the next step from which a vehicle can stop within `room_m` [m/s].

    It drives one step at that speed, and then brakes over `braking_m`.
    """
    loss = decel * step_s
    steps = float(floor((sqrt(1.0 + 8.0 * room_m / (step_s * loss)) - 1.0) / 2.0))
    return (room_m / step_s + loss * steps * (steps + 1.0) / 2.0) / (steps + 1.0)


def time_s(distance_m: float, speed: float, accel: float, top: float) -> float:
    """Return the time to drive a distance while accelerating from `speed` to `top` [s]."""
    if distance_m <= 0.0:
        return 0.0
    speed = min(speed, top)
    gaining_m = (top * top - speed * speed) / (2.0 * accel)
    if gaining_m >= distance_m:
        return (sqrt(speed * speed + 2.0 * accel * distance_m) - speed) / accel
    return (top - speed) / accel + (distance_m - gaining_m) / top


def braking_time_s(distance_m: float, room_m: float, top: float, decel: float) -> float:
    """Return how long a vehicle takes at most for a distance if it brakes behind one `room_m` ahead [s].

    SUMO's drivers take a second to react: at distance ``g`` from where they must stop, they drive at most at
    ``v`` with ``g = v + v^2 / 2b``. So slowing down from ``v`` to ``w`` takes ``ln(v / w) + (v - w) / b``.
    The result is infinite if the vehicle stops before the end of the distance. It is 0 if no vehicle stands
    ahead (infinite `room_m`), since the vehicle need not brake.
    """
    if room_m == inf:
        return 0.0
    if room_m <= distance_m:
        return inf
    last = sqrt(decel * decel + 2.0 * decel * (room_m - distance_m)) - decel
    if last >= top:
        return distance_m / top
    first = min(top, sqrt(decel * decel + 2.0 * decel * room_m) - decel)
    freely_m = max(0.0, room_m - first - first * first / (2.0 * decel))
    return freely_m / first + log(first / last) + (first - last) / decel
