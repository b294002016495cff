"""The compiled part of a step: what each vehicle reached in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "MARGIN_M",
    "MOST_CALLS",
    "MOST_ROWS",
    "MUST_ASK",
    "PIVOTED",
    "REAR_PASSED",
    "RUNS_THROUGH",
    "TOLERANCE_M",
    "TRESPASS",
    "Mark",
    "Vehicle",
    "Vehicles",
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

MOST_ROWS: Final = 16
"""So many edges, laps and legs per vehicle are noted in a step; what is more waits for the next."""
MOST_CALLS: Final = 5
"""So many calls there can be per vehicle in a step."""

REAR_PASSED: Final = 0
"""The rear has passed the point at which something is to be given back."""
PIVOTED: Final = 1
"""The front is on the edge where SUMO renews the route."""
TRESPASS: Final = 2
"""The front went past the last granted leg, or is back."""
MUST_ASK: Final = 3
"""The next step could take the vehicle past the point where it must brake."""
RUNS_THROUGH: Final = 4
"""The vehicle is held, and can brake for that no longer."""


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


class Vehicle:
    """One vehicle: a row of the table that compiled code works on.

    Attributes
    ----------
    offset, front, speed
        What to add to the odometer, and the resulting front [m] and speed [m/s].
    note_m, rear_m, line_m
        Where the next edge, lap or leg begins at the earliest; where something is to be given back; where the
        last granted leg ends [m].
    held_m
        Where it is held; infinity if it is not [m].
    trespassing, asking
        Whether the front was past its line; whether the caller is to be told when it must ask.
    next_lap_m, laps
        Front at which the next lap ends [m], laps so far.
    road, road_lap
        The next edge as index into its way's edges, and the lap it lies in.
    entered, granted
        The leg of the front and the last granted one.
    top, accel, decel
        Top speed [m/s], acceleration and deceleration [m/s2].
    lap_m, loop, name
        Length of a lap [m], the loop's and the vehicle's names by number.
    road_at, roads, pivot
        Where its edges are in the table of edges, how many, and on which of them the route is renewed.
    mark_at, legs
        Where the beginnings of its legs are in the table of legs, and how many.
    """

    offset: float
    front: float
    speed: float
    note_m: float
    rear_m: float
    line_m: float
    held_m: float
    trespassing: bool
    asking: bool
    next_lap_m: float
    laps: int
    road: int
    road_lap: int
    entered: int
    granted: int
    top: float
    accel: float
    decel: float
    lap_m: float
    loop: int
    name: int
    road_at: int
    roads: int
    pivot: int
    mark_at: int
    legs: int


class Mark:
    """Where an edge or a leg begins [m], and its name by number."""

    begin_m: float
    name: int


class Vehicles(NamedTuple):
    """The columns of a table of `Vehicle` that are for the engine to read and set."""

    offset: Floats
    front: Floats
    speed: Floats
    note_m: Floats
    rear_m: Floats
    line_m: Floats
    held_m: Floats
    trespassing: Flags
    asking: Flags
    next_lap_m: Floats
    laps: Numbers
    granted: Numbers


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
def _edge_m(i: int, v: Sequence[Vehicle], roads: Sequence[Mark]) -> float:
    """Return where the next edge begins [m]."""
    return v[i].road_lap * v[i].lap_m + roads[v[i].road_at + v[i].road].begin_m


@njit(cache=True, error_model="numpy")
def _leg_m(i: int, v: Sequence[Vehicle], legs: Sequence[Mark]) -> float:
    """Return where the next granted leg begins [m]; infinity if there is none."""
    if v[i].entered >= v[i].granted:
        return math.inf
    lap, position = divmod(v[i].entered + 1, v[i].legs)
    return lap * v[i].lap_m + legs[v[i].mark_at + position].begin_m


@njit(cache=True, error_model="numpy")
def _pass(
    i: int,
    v: Sequence[Vehicle],
    roads: Sequence[Mark],
    legs: Sequence[Mark],
    events: tuple[int, int, int],
    rows: Codes,
    noted: int,
) -> tuple[int, bool]:
    """Note edges, laps and legs entered; return how many rows there are, and whether the route is renewed."""
    edge, lap, enter = events
    pivoted = False
    while noted < rows.shape[0] and v[i].front >= _edge_m(i, v, roads):
        noted = _note(rows, noted, v[i].name, edge, roads[v[i].road_at + v[i].road].name)
        pivoted |= v[i].road == v[i].pivot
        v[i].road += 1
        if v[i].road == v[i].roads:
            v[i].road = 0
            v[i].road_lap += 1
    while noted < rows.shape[0] and v[i].front >= v[i].next_lap_m:
        noted = _note(rows, noted, v[i].name, lap, v[i].loop)
        v[i].laps += 1
        v[i].next_lap_m += v[i].lap_m
    while noted < rows.shape[0] and v[i].front >= _leg_m(i, v, legs):
        v[i].entered += 1
        noted = _note(rows, noted, v[i].name, enter, legs[v[i].mark_at + v[i].entered % v[i].legs].name)
    v[i].note_m = min(_edge_m(i, v, roads), v[i].next_lap_m, _leg_m(i, v, legs))
    return noted, pivoted


@njit(cache=True, error_model="numpy")
def sense(
    odometer: Floats,
    v: Sequence[Vehicle],
    roads: Sequence[Mark],
    legs: Sequence[Mark],
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
    v, roads, legs
        The vehicles, their edges and their legs.
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
        front = odometer[i] + v[i].offset
        v[i].speed = (front - v[i].front) / step_s
        v[i].front = front
        if front >= v[i].note_m:
            noted, pivoted = _pass(i, v, roads, legs, events, rows, noted)
            if pivoted:
                called = _call(calls, called, i, PIVOTED)
        if front >= v[i].rear_m:
            called = _call(calls, called, i, REAR_PASSED)
        if (front > v[i].line_m + TOLERANCE_M) != v[i].trespassing:
            called = _call(calls, called, i, TRESPASS)
        if v[i].held_m - front < braking_m(v[i].speed, v[i].decel, step_s) - TOLERANCE_M:
            called = _call(calls, called, i, RUNS_THROUGH)
        left_m = v[i].line_m - front
        if v[i].asking and must_ask(left_m, v[i].speed, v[i].top, v[i].accel, v[i].decel, step_s):
            called = _call(calls, called, i, MUST_ASK)
    return noted, called
