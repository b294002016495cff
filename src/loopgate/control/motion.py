"""How far and how long vehicles drive: braking, gaining speed, or behind a vehicle that stands."""

from __future__ import annotations

from math import floor, inf, log, sqrt
from typing import Final

STANDING_MPS: Final = 0.1
"""A slower vehicle stands, as with SUMO's waiting time [m/s]."""


def braking_m(speed: float, decel: float, step_s: float) -> float:
    """Return SUMO's braking distance from `speed` [m]: one step at each speed on the way down to zero."""
    loss = decel * step_s
    steps = float(int(speed / loss))
    return step_s * (steps * speed - loss * steps * (steps + 1.0) / 2.0)


def safe_speed(room_m: float, decel: float, step_s: float) -> float:
    """Return the highest speed of the next step from which a vehicle can still stop in some metres [m/s].

    It drives a step at that speed, and then `braking_m`.
    """
    loss = decel * step_s
    steps = float(floor((sqrt(1.0 + 8.0 * room_m / (step_s * loss)) - 1.0) / 2.0))
    return (room_m / step_s + loss * steps * (steps + 1.0) / 2.0) / (steps + 1.0)


def time_s(distance_m: float, speed: float, accel: float, top: float) -> float:
    """Return the time to drive a distance, gaining speed up to a top speed [s]."""
    if distance_m <= 0.0:
        return 0.0
    speed = min(speed, top)
    gaining_m = (top * top - speed * speed) / (2.0 * accel)
    if gaining_m >= distance_m:
        return (sqrt(speed * speed + 2.0 * accel * distance_m) - speed) / accel
    return (top - speed) / accel + (distance_m - gaining_m) / top


def braking_time_s(distance_m: float, room_m: float, top: float, decel: float) -> float:
    """Return the time to drive a distance, at most, behind a standing vehicle `room_m` ahead [s].

    SUMO's drivers have a second to react: at ``g`` before where they must stop they drive no faster than
    ``v`` with ``g = v + v^2 / 2b``. So the time from ``v`` down to ``w`` is ``ln(v / w) + (v - w) / b``.
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
