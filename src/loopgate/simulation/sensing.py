"""The compiled part of a step: what each vehicle reached in it."""

from __future__ import annotations

import math
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


@njit(cache=True, error_model="numpy")
def braking_m(speed: float, decel: float, step_s: float) -> float:
    """Return the braking distance from `speed` [m].

    It is that of SUMO's Euler update: a step at each speed on the way down to zero. A stop nearer than that
    is refused by SUMO; it adds no reaction time, which it keeps to vehicles ahead only.
    """
    loss = decel * step_s
    steps = int(speed / loss)
    return step_s * (steps * speed - loss * steps * (steps + 1) / 2)


@njit(cache=True, error_model="numpy")
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
    note_m, rear_m, line_m
        Where the next edge, lap or leg begins at the earliest; where something is to be given back; where the
        last granted leg ends [m].
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
    note_m: Floats
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


@njit(cache=True, inline="always", error_model="numpy")
def _note(rows: Codes, noted: int, vehicle: int, event: int, place: int) -> int:
    rows[noted, 0] = vehicle
    rows[noted, 1] = event
    rows[noted, 2] = place
    return noted + 1


@njit(cache=True, inline="always", error_model="numpy")
def _call(calls: Codes, called: int, vehicle: int, why: int) -> int:
    calls[called, 0] = vehicle
    calls[called, 1] = why
    return called + 1


@njit(cache=True, error_model="numpy")
def _edge_m(i: int, v: Vehicles, w: Ways) -> float:
    """Return where the next edge begins [m]."""
    return float(v.road_lap[i] * w.lap_m[i] + w.road_m[w.road_begin[i] + v.road[i]])


@njit(cache=True, error_model="numpy")
def _leg_m(i: int, v: Vehicles, w: Ways) -> float:
    """Return where the next granted leg begins [m]; infinity if there is none."""
    if v.entered[i] >= v.granted[i]:
        return math.inf
    lap, position = divmod(v.entered[i] + 1, w.leg_count[i])
    return float(lap * w.lap_m[i] + w.leg_m[w.leg_begin[i] + position])


@njit(cache=True, error_model="numpy")
def _pass(
    i: int, v: Vehicles, w: Ways, events: tuple[int, int, int], rows: Codes, noted: int
) -> tuple[int, bool]:
    """Note edges, laps and legs entered; return how many rows there are, and whether the route is renewed."""
    edge, lap, enter = events
    pivoted = False
    while noted < rows.shape[0] and v.front[i] >= _edge_m(i, v, w):
        noted = _note(rows, noted, w.vehicle_code[i], edge, w.road_code[w.road_begin[i] + v.road[i]])
        pivoted |= v.road[i] == w.pivot[i]
        v.road[i] += 1
        if v.road[i] == w.road_count[i]:
            v.road[i] = 0
            v.road_lap[i] += 1
    while noted < rows.shape[0] and v.front[i] >= v.next_lap_m[i]:
        noted = _note(rows, noted, w.vehicle_code[i], lap, w.loop_code[i])
        v.laps[i] += 1
        v.next_lap_m[i] += w.lap_m[i]
    while noted < rows.shape[0] and v.front[i] >= _leg_m(i, v, w):
        v.entered[i] += 1
        leg = w.leg_begin[i] + v.entered[i] % w.leg_count[i]
        noted = _note(rows, noted, w.vehicle_code[i], enter, w.leg_code[leg])
    v.note_m[i] = min(_edge_m(i, v, w), v.next_lap_m[i], _leg_m(i, v, w))
    return noted, pivoted


@njit(cache=True, error_model="numpy")
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
    noted, called = 0, 0
    for i in range(odometer.size):
        front = odometer[i] + v.offset[i]
        v.speed[i] = (front - v.front[i]) / step_s
        v.front[i] = front
        if front >= v.note_m[i]:
            noted, pivoted = _pass(i, v, w, events, rows, noted)
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
