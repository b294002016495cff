"""How long a vehicle takes: gaining speed, or behind one that stands."""

from __future__ import annotations

import math

from loopgate.kernel_cache import inner, kernel

__all__ = ["braking_time_s", "time_s"]


@kernel
def braking_time_s(distance_m: float, room_m: float, top_mps: float, decel: float) -> float:
    """Return the time to drive a distance, at most, behind a standing vehicle `room_m` ahead.

    SUMO's drivers have a second to react: at ``g`` before where they must stop they drive no faster than
    ``v`` with ``g = v + v^2 / 2b``. So the time from ``v`` down to ``w`` is ``ln(v / w) + (v - w) / b``.
    """
    if math.isinf(room_m):
        return 0.0
    if room_m <= distance_m:
        return math.inf
    last = _safe_mps(room_m - distance_m, decel)
    if last >= top_mps:
        return distance_m / top_mps
    first = min(top_mps, _safe_mps(room_m, decel))
    freely_m = max(0.0, room_m - first - first * first / (2 * decel))
    return freely_m / first + math.log(first / last) + (first - last) / decel


@inner
def _safe_mps(gap_m: float, decel: float) -> float:
    return math.sqrt(decel * decel + 2 * decel * gap_m) - decel


@kernel
def time_s(distance_m: float, speed: float, accel: float, top_mps: float) -> float:
    """Return the time to drive a distance, gaining speed up to a top speed."""
    if distance_m <= 0:
        return 0.0
    speed = min(speed, top_mps)
    gaining_m = (top_mps * top_mps - speed * speed) / (2 * accel)
    if gaining_m >= distance_m:
        return (math.sqrt(speed * speed + 2 * accel * distance_m) - speed) / accel
    return (top_mps - speed) / accel + (distance_m - gaining_m) / top_mps
