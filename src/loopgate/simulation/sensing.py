"""The compiled part of a step: what each vehicle reached in it."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "MARGIN_M",
    "MUST_ASK",
    "PIVOTED",
    "REAR_PASSED",
    "TOLERANCE_M",
    "TRESPASS",
    "Vehicles",
    "Ways",
    "braking_m",
    "must_ask",
    "sense",
]

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Codes = NDArray[np.int32]

MARGIN_M: Final = 1.0
"""Room kept beyond the braking distance when a stop is set [m]."""

TOLERANCE_M: Final = 0.5
"""Rounding allowed before a front beyond its leg counts as one [m]; stop lines keep more than this clear."""

REAR_PASSED: Final = 0
"""The rear has passed the point at which something is to be given back."""
PIVOTED: Final = 1
"""The front is on the edge where SUMO renews the route."""
TRESPASS: Final = 2
"""The front went past the last granted leg, or is back."""
MUST_ASK: Final = 3
"""The next step could take the vehicle past the point where it must brake."""


@njit(cache=True)
def braking_m(speed: float, decel: float, step_s: float) -> float:
    """Return the braking distance from `speed` [m].

    It is that of SUMO's Euler update: a step at each speed on the way down to zero. A stop nearer than that
    is refused by SUMO; it adds no reaction time, which it keeps to vehicles ahead only.
    """
    loss = decel * step_s
    steps = int(speed / loss)
    return step_s * (steps * speed - loss * steps * (steps + 1) / 2)


@njit(cache=True)
def must_ask(left_m: float, speed: float, top: float, accel: float, decel: float, step_s: float) -> bool:
    """Return whether the next step could take a vehicle past the point where it must brake."""
    fast = min(top, speed + accel * step_s)
    return left_m < fast * step_s + braking_m(fast, decel, step_s) + MARGIN_M


class Vehicles(NamedTuple):
    """By vehicle, what changes as it drives.

    Attributes
    ----------
    offset, front, speed
        What to add to the odometer, and the resulting front [m] and speed [m/s].
    rear_m, line_m
        Where something is to be given back, and where the last granted leg ends [m].
    trespassing, asking
        Whether the front was past its line; whether the caller is to be told when it must ask.
    next_lap_m, laps
        Front at which the next lap ends [m], laps so far.
    road, road_lap
        The next edge as index into its way's edges, and the lap it lies in.
    entered, granted
        The leg of the front and the last granted one.
    """

    offset: Floats
    front: Floats
    speed: Floats
    rear_m: Floats
    line_m: Floats
    trespassing: Flags
    asking: Flags
    next_lap_m: Floats
    laps: Numbers
    road: Numbers
    road_lap: Numbers
    entered: Numbers
    granted: Numbers


class Ways(NamedTuple):
    """What stays as it is: by vehicle, its abilities and its way; then the ways, one after the other.

    Attributes
    ----------
    top, accel, decel
        Top speed [m/s], acceleration and deceleration [m/s2].
    lap_m, loop_code, vehicle_code
        Length of a lap [m], the loop's and the vehicle's names by number.
    road_begin, road_count, pivot
        Where in ``road_m`` its edges are, how many, and which of them is where the route is renewed.
    leg_begin, leg_count
        Where in ``leg_m`` its legs are, and how many.
    road_m, road_code, leg_m, leg_code
        Arc lengths at which edges and legs begin [m], and their names by number.
    """

    top: Floats
    accel: Floats
    decel: Floats
    lap_m: Floats
    loop_code: Codes
    vehicle_code: Codes
    road_begin: Numbers
    road_count: Numbers
    pivot: Numbers
    leg_begin: Numbers
    leg_count: Numbers
    road_m: Floats
    road_code: Codes
    leg_m: Floats
    leg_code: Codes


@njit(cache=True, inline="always")
def _note(rows: Codes, noted: int, vehicle: int, event: int, place: int) -> int:
    rows[noted, 0] = vehicle
    rows[noted, 1] = event
    rows[noted, 2] = place
    return noted + 1


@njit(cache=True, inline="always")
def _call(calls: Codes, called: int, vehicle: int, why: int) -> int:
    calls[called, 0] = vehicle
    calls[called, 1] = why
    return called + 1


@njit(cache=True)
def _pass_edges(i: int, v: Vehicles, w: Ways, event: int, rows: Codes, noted: int) -> tuple[int, bool]:
    """Note the edges entered; return how many rows there are, and whether the route is renewed."""
    pivoted = False
    begin, count = w.road_begin[i], w.road_count[i]
    while noted < rows.shape[0] and v.front[i] >= v.road_lap[i] * w.lap_m[i] + w.road_m[begin + v.road[i]]:
        noted = _note(rows, noted, w.vehicle_code[i], event, w.road_code[begin + v.road[i]])
        pivoted |= v.road[i] == w.pivot[i]
        v.road[i] += 1
        if v.road[i] == count:
            v.road[i] = 0
            v.road_lap[i] += 1
    return noted, pivoted


@njit(cache=True)
def _pass_laps(i: int, v: Vehicles, w: Ways, event: int, rows: Codes, noted: int) -> int:
    while noted < rows.shape[0] and v.front[i] >= v.next_lap_m[i]:
        noted = _note(rows, noted, w.vehicle_code[i], event, w.loop_code[i])
        v.laps[i] += 1
        v.next_lap_m[i] += w.lap_m[i]
    return noted


@njit(cache=True)
def _pass_legs(i: int, v: Vehicles, w: Ways, event: int, rows: Codes, noted: int) -> int:
    begin, count = w.leg_begin[i], w.leg_count[i]
    while noted < rows.shape[0] and v.entered[i] < v.granted[i]:
        leg = v.entered[i] + 1
        if v.front[i] < leg // count * w.lap_m[i] + w.leg_m[begin + leg % count]:
            break
        noted = _note(rows, noted, w.vehicle_code[i], event, w.leg_code[begin + leg % count])
        v.entered[i] = leg
    return noted


@njit(cache=True)
def sense(
    odometer: Floats,
    v: Vehicles,
    w: Ways,
    step_s: float,
    events: tuple[int, int, int],
    rows: Codes,
    calls: Codes,
) -> tuple[int, int]:
    """Bring all vehicles up to date; return how many `rows` (for the trace) and `calls` there are.

    Parameters
    ----------
    odometer
        What SUMO says, by vehicle [m].
    v, w
        The vehicles and their ways.
    step_s
        Length of a step [s].
    events
        The events for an edge, a lap, and a state entered, by number.
    rows
        Out: vehicle, event and place by number. What does not fit is noted in the next step.
    calls
        Out: vehicle and one of the constants above.
    """
    edge, lap, enter = events
    noted, called = 0, 0
    for i in range(odometer.size):
        front = odometer[i] + v.offset[i]
        v.speed[i] = (front - v.front[i]) / step_s
        v.front[i] = front
        noted, pivoted = _pass_edges(i, v, w, edge, rows, noted)
        noted = _pass_laps(i, v, w, lap, rows, noted)
        noted = _pass_legs(i, v, w, enter, rows, noted)
        if pivoted:
            called = _call(calls, called, i, PIVOTED)
        if front >= v.rear_m[i]:
            called = _call(calls, called, i, REAR_PASSED)
        if (front > v.line_m[i] + TOLERANCE_M) != v.trespassing[i]:
            called = _call(calls, called, i, TRESPASS)
        left_m = v.line_m[i] - front
        if v.asking[i] and must_ask(left_m, v.speed[i], w.top[i], w.accel[i], w.decel[i], step_s):
            called = _call(calls, called, i, MUST_ASK)
    return noted, called
