"""The first part of a step: what each vehicle reached in it."""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import NOTHING
from loopgate.drive.tables import Floats, Tables
from loopgate.kernel_cache import inner, kernel, part

__all__ = [
    "MARGIN_M",
    "MOST_ROWS",
    "MUST_ASK",
    "PIVOTED",
    "REAR_PASSED",
    "RUNS_THROUGH",
    "STANDING_MPS",
    "TOLERANCE_M",
    "TRESPASS",
    "act",
    "braking_m",
    "must_ask",
    "note",
    "safe_mps",
    "sense",
]

MARGIN_M: Final = 1.0
"""Room kept beyond the braking distance when a stop is set [m]."""

TOLERANCE_M: Final = 0.5
"""Rounding allowed before a front beyond its leg counts as one [m]; stop lines keep more than this clear."""

STANDING_MPS: Final = 0.1
"""A slower vehicle stands, as with SUMO's waiting time [m/s]."""

MOST_ROWS: Final = 16
"""So many edges, laps and legs per vehicle are noted in a step; what is more waits for the next."""

PIVOTED: Final = 1
"""The front is on the edge where SUMO renews the route."""
REAR_PASSED: Final = 2
"""The rear has passed the point at which something is to be given back."""
TRESPASS: Final = 4
"""The front went past the last granted leg, or is back."""
RUNS_THROUGH: Final = 8
"""The vehicle is held, and can brake for that no longer."""
MUST_ASK: Final = 16
"""The next step could take the vehicle past the point where it must brake."""


@kernel
def braking_m(speed: float, decel: float, step_s: float) -> float:
    """Return the braking distance from `speed` [m].

    It is that of SUMO's Euler update: a step at each speed on the way down to zero. A stop nearer than that
    is refused by SUMO; it adds no reaction time, which it keeps to vehicles ahead only.
    """
    loss = decel * step_s
    steps = int(speed / loss)
    return step_s * (steps * speed - loss * steps * (steps + 1) / 2)


@inner
def safe_mps(room_m: float, decel: float, step_s: float) -> float:
    """Return the highest speed of the next step from which a vehicle can still stop in some metres [m/s].

    It drives a step at that speed, and then `braking_m`.
    """
    loss = decel * step_s
    steps = math.floor((math.sqrt(1.0 + 8.0 * room_m / (step_s * loss)) - 1.0) / 2.0)
    return (room_m / step_s + loss * steps * (steps + 1) / 2.0) / (steps + 1)


@inner
def must_ask(i: int, t: Tables) -> bool:
    """Return whether the next step could take a vehicle past the point where it must brake."""
    one, step_s = t.vehicles[i], t.run[0].step_s
    fast = min(one.top, one.speed + one.accel * step_s)
    return bool(one.line_m - one.front < fast * step_s + braking_m(fast, one.decel, step_s) + MARGIN_M)


@inner
def note(i: int, event: int, place: int, reason: int, stage: int, t: Tables) -> None:
    """Write a row for the trace, all words by number."""
    run = t.run[0]
    if run.rows >= len(t.rows):
        run.lost += 1
        return
    row = t.rows[run.rows]
    t.times[run.rows] = run.now_s
    row[0], row[1], row[2], row[3], row[4] = t.vehicles[i].name, event, place, reason, stage
    run.rows += 1


@inner
def act(i: int, what: int, t: Tables) -> None:
    """Say what is to be done to a vehicle after this step, of the kinds in `loopgate.drive.codes`."""
    run = t.run[0]
    if run.acts >= len(t.acts):
        run.lost += 1
        return
    row = t.acts[run.acts]
    row[0], row[1], row[2] = i, what, t.vehicles[i].granted
    run.acts += 1


@inner
def _edge_m(i: int, t: Tables) -> float:
    """Return where the next edge begins [m]."""
    one = t.vehicles[i]
    return float(one.road_lap * one.lap_m + t.roads[one.road_at + one.road].begin_m)


@inner
def _leg_m(i: int, t: Tables) -> float:
    """Return where the next granted leg begins [m]; infinity if there is none."""
    one = t.vehicles[i]
    if one.entered >= one.granted:
        return math.inf
    lap, position = divmod(one.entered + 1, one.legs)
    return float(lap * one.lap_m + t.legs[one.leg_at + position].begin_m)


@part
def _pass(i: int, room: int, t: Tables) -> bool:
    """Note edges, laps and legs entered, up to so many rows; return whether the route is renewed."""
    run, one = t.run[0], t.vehicles[i]
    pivoted = False
    while run.rows < room and one.front >= _edge_m(i, t):
        note(i, run.edge, t.roads[one.road_at + one.road].name, NOTHING, NOTHING, t)
        pivoted |= one.road == one.pivot
        one.road += 1
        if one.road == one.roads:
            one.road = 0
            one.road_lap += 1
    while run.rows < room and one.front >= one.next_lap_m:
        note(i, run.lap, one.loop, NOTHING, NOTHING, t)
        one.laps += 1
        run.ended += 1
        one.next_lap_m += one.lap_m
    while run.rows < room and one.front >= _leg_m(i, t):
        one.entered += 1
        place = t.legs[one.leg_at + one.entered % one.legs].state
        note(i, run.enter, t.states[place].word, NOTHING, NOTHING, t)
    one.note_m = min(_edge_m(i, t), one.next_lap_m, _leg_m(i, t))
    return pivoted


@inner
def _stands(i: int, t: Tables) -> None:
    """Count that the vehicle stood in this step, for itself and the edge that it is on."""
    run, one = t.run[0], t.vehicles[i]
    run.standing += 1
    if run.now_s >= run.counts_from_s:
        one.stood_s += run.step_s
        t.roads[one.road_at + (one.road - 1) % one.roads].stood_s += run.step_s  # `road` is the next


@inner
def sense(odometer: Floats, t: Tables) -> int:
    """Bring all vehicles up to date with what their odometers read [m]; return how many `calls` there are.

    One that has arrived has no odometer: it is not a number, and the vehicle stays where it was. What finds
    no room among the rows is noted in the next step.
    """
    run = t.run[0]
    step_s = run.step_s
    run.steps += 1
    room = run.rows + MOST_ROWS * len(t.vehicles)
    called = 0
    for i in range(odometer.size):
        one = t.vehicles[i]
        arrived = math.isnan(odometer[i])
        front = one.front if arrived else odometer[i] + one.offset
        one.speed = (front - one.front) / step_s
        one.front = front
        t.fronts[i] = front - one.moved_m
        why = 0
        if front >= one.note_m and _pass(i, room, t):
            why |= PIVOTED
        if front >= one.rear_m:
            why |= REAR_PASSED
        if (front > one.line_m + TOLERANCE_M) != one.trespassing:
            why |= TRESPASS
        if one.held_m - front < braking_m(one.speed, one.decel, step_s) - TOLERANCE_M:
            why |= RUNS_THROUGH
        if one.asking and must_ask(i, t):
            why |= MUST_ASK
        run.driven_m += one.speed * step_s
        if one.speed < STANDING_MPS and not arrived:
            _stands(i, t)
        if why:
            t.calls[called, 0], t.calls[called, 1] = i, why
            called += 1
    return called
