"""`loopgate.simulation.engine.Engine` between two steps of the traffic, compiled; see there.

Nothing here speaks to SUMO: what is to be done to vehicles, and what goes into the trace, are rows for the
caller, in the order in which they came about.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from numba import njit

from loopgate.simulation.compiled import count as c
from loopgate.simulation.compiled import gatekeeping as keep
from loopgate.simulation.compiled.sight import begin_m, end_m, leg_of
from loopgate.simulation.compiled.tables import Books
from loopgate.simulation.sensing import (
    MOST_ROWS,
    MUST_ASK,
    PIVOTED,
    REAR_PASSED,
    RUNS_THROUGH,
    Codes,
    Floats,
    Numbers,
    must_ask,
    sense,
)

__all__ = ["FULL", "Orders", "answer", "begin", "look"]

FULL: Final = 24
"""So many rows, and so many acts, there may be per vehicle in one step."""


class Orders(NamedTuple):
    """What came of a step; how much there is of it says the pool.

    Attributes
    ----------
    rows
        For the trace: vehicle, event, place, reason and stage by number.
    acts
        What is to be done to vehicles: vehicle, a constant of `count`, and the last leg granted to it.
    calls
        Room for `sense`.
    """

    rows: Codes
    acts: Numbers
    calls: Codes


@njit(cache=True, error_model="numpy")
def _note(i: int, event: int, state: int, reason: int, stage: int, b: Books, o: Orders) -> None:
    """Write a row for the trace; event, reason and stage are where the pool has their words, 0 for none."""
    n = b.pool[c.ROWS]
    if n >= len(o.rows):
        b.pool[c.LOST] += 1
        return
    o.rows[n, 0] = b.vehicles[i].name
    o.rows[n, 1] = b.pool[event]
    o.rows[n, 2] = b.states[state].word
    o.rows[n, 3] = b.pool[reason] if reason else 0
    o.rows[n, 4] = b.pool[stage] if stage else 0
    b.pool[c.ROWS] += 1


@njit(cache=True, error_model="numpy")
def _act(i: int, what: int, b: Books, o: Orders) -> None:
    n = b.pool[c.ACTS]
    if n >= len(o.acts):
        b.pool[c.LOST] += 1
        return
    o.acts[n, 0] = i
    o.acts[n, 1] = what
    o.acts[n, 2] = b.vehicles[i].granted
    b.pool[c.ACTS] += 1


@njit(cache=True, error_model="numpy")
def _aim_rear(i: int, b: Books) -> None:
    v = b.vehicles
    target = math.inf
    if v[i].crossed < v[i].granted:
        crossed = v[i].crossed
        target = begin_m(i, crossed + 1, b) + v[i].length_m
        if v[i].tail == crossed:
            left_m = end_m(i, crossed, b) + v[i].length_m
            here = keep.state_of(i, crossed, b)
            target = max(target, left_m) if keep.room(here, b) > 0 else left_m
    v[i].rear_m = target


@njit(cache=True, error_model="numpy")
def _aim(i: int, b: Books) -> None:
    v = b.vehicles
    v[i].note_m = -math.inf
    v[i].line_m = end_m(i, v[i].granted, b)
    if v[i].granted - 1 <= v[i].crossed:
        _aim_rear(i, b)


@njit(cache=True, error_model="numpy")
def _free_behind(i: int, b: Books, o: Orders) -> None:
    v = b.vehicles
    rear_m = v[i].front - v[i].length_m
    while v[i].tail != v[i].granted and rear_m >= end_m(i, v[i].tail, b):
        state = keep.state_of(i, v[i].tail, b)
        v[i].tail += 1
        keep.left(i, state, b)
        _note(i, c.LEAVE, state, 0, 0, b, o)
    while v[i].crossed != v[i].tail and rear_m >= begin_m(i, v[i].crossed + 1, b):
        v[i].crossed += 1
        keep.cleared(i, v[i].crossed - 1, b)
    _aim_rear(i, b)


@njit(cache=True, error_model="numpy")
def _note_trespass(i: int, b: Books, o: Orders) -> None:
    v = b.vehicles
    v[i].trespassing = not v[i].trespassing
    if v[i].trespassing:
        b.pool[c.TRESPASSES] += 1
        state = keep.state_of(i, v[i].granted + 1, b)
        _note(i, c.ENTER, state, c.NOT_GRANTED, 0, b, o)


@njit(cache=True, error_model="numpy")
def _hold(i: int, b: Books, o: Orders) -> None:
    v = b.vehicles
    if v[i].held:
        return
    v[i].held = True
    _act(i, c.STOP, b, o)


@njit(cache=True, error_model="numpy")
def _ask(i: int, now_s: float, b: Books, o: Orders) -> None:
    v = b.vehicles
    v[i].asking = False
    if v[i].steered:
        return
    first = keep.first_before(i, b)
    if first < 0:
        keep.asks(i, now_s, b)
        v[i].asked_s = now_s
    elif math.isnan(v[first].halted_s):
        _hold(i, b, o)


@njit(cache=True, error_model="numpy")
def _consider(i: int, now_s: float, step_s: float, b: Books, o: Orders) -> None:
    v = b.vehicles
    if v[i].legs <= 1 or v[i].pending or v[i].steered or v[i].admitted != v[i].granted:
        return
    left_m = v[i].line_m - v[i].front
    if must_ask(left_m, v[i].speed, v[i].top, v[i].accel, v[i].decel, step_s):
        _ask(i, now_s, b, o)
    else:
        v[i].asking = True


@njit(cache=True, error_model="numpy")
def _go(i: int, now_s: float, step_s: float, b: Books, o: Orders) -> None:
    v = b.vehicles
    here = keep.state_of(i, v[i].granted, b)
    pinned = b.legs[leg_of(i, v[i].granted, b)].pinned
    v[i].granted += 1
    b.pool[c.GRANTS] += 1
    b.pool[v[i].number_at + v[i].granted % v[i].numbers] = b.pool[c.GRANTS]
    if v[i].granted - v[i].crossed >= v[i].numbers:
        b.pool[c.LOST] += 1
    _aim(i, b)
    wanted = keep.state_of(i, v[i].granted, b)
    _note(i, c.GRANT, wanted, c.FREE, c.CHAIN, b, o)
    if not math.isnan(v[i].asked_s):
        v[i].longest_s = max(v[i].longest_s, now_s - v[i].asked_s)
        v[i].asked_s = math.nan
    if v[i].held:
        v[i].held = False
        _act(i, c.RELEASE, b, o)
        if not math.isnan(v[i].halted_s):
            v[i].hold_s += now_s - v[i].halted_s
            v[i].halted_s = math.nan
            _note(i, c.GO, wanted, 0, 0, b, o)
    if keep.room(wanted, b) <= 0:
        for n in range(b.states[wanted].holders, b.states[wanted].holders + b.states[wanted].held_by):
            other = b.pool[n]
            if v[other].tail < v[other].granted:
                _aim_rear(other, b)
    if pinned:
        v[i].steered = True
        _act(i, c.STEER, b, o)
    _consider(i, now_s, step_s, b, o)
    at = b.states[here].line
    for n in range(at, at + b.states[here].queue):
        if n == at:
            _consider(b.pool[n], now_s, step_s, b, o)
        elif not v[b.pool[n]].held:
            v[b.pool[n]].asking = True


@njit(cache=True, error_model="numpy")
def begin(now_s: float, step_s: float, b: Books, o: Orders) -> None:
    """Take over all vehicles; `answer` has to follow."""
    for i in range(len(b.vehicles)):
        _aim(i, b)
        _consider(i, now_s, step_s, b, o)


@njit(cache=True, error_model="numpy")
def look(
    odometer: Floats,
    halted: Numbers,
    now_s: float,
    step_s: float,
    b: Books,
    o: Orders,
) -> None:
    """Bring all vehicles up to date after a step of the traffic and do what is due; `answer` has to follow.

    Parameters
    ----------
    odometer
        What SUMO says, by vehicle [m].
    halted
        The vehicles that came to rest at a stop.
    now_s, step_s
        Simulated time and length of a step [s].
    b
        The books.
    o
        Out: what came of it.
    """
    v = b.vehicles
    words = (b.pool[c.EDGE], b.pool[c.LAP], b.pool[c.ENTER])
    room = MOST_ROWS * len(b.vehicles)
    noted, called = sense(odometer, b.vehicles, b.roads, b.marks, step_s, words, o.rows[:room], o.calls)
    o.rows[:noted, 3:] = 0
    b.pool[c.ROWS] = noted
    for i in halted:
        if v[i].held and math.isnan(v[i].halted_s):
            v[i].halted_s = now_s
            wanted = keep.state_of(i, v[i].granted + 1, b)
            _note(i, c.HOLD, wanted, 0, 0, b, o)
    for n in range(called):
        i, why = o.calls[n, 0], o.calls[n, 1]
        if why == MUST_ASK:
            _ask(i, now_s, b, o)
        elif why == REAR_PASSED:
            _free_behind(i, b, o)
        elif why == PIVOTED:
            _act(i, c.PIVOT, b, o)
        elif why == RUNS_THROUGH:
            _act(i, c.BRAKE, b, o)
        else:
            _note_trespass(i, b, o)


@njit(cache=True, error_model="numpy")
def answer(
    freed: Numbers,
    now_s: float,
    step_s: float,
    pressure: tuple[float, float, float],
    b: Books,
    o: Orders,
) -> None:
    """Decide the requests and let vehicles go or stay.

    Parameters
    ----------
    freed
        The vehicles that need to be steered no longer.
    now_s, step_s
        Simulated time and length of a step [s].
    pressure
        From what share on a place is crowded, patience and weight of waiting [s]; see `Pressure`.
    b, o
        As for `look`.
    """
    v = b.vehicles
    for i in freed:
        v[i].steered = False
        _consider(i, now_s, step_s, b, o)
    first = True
    again = True
    while again:
        again = False
        answers = keep.decide(now_s, first, pressure, b)
        first = False
        for n in range(answers):
            i = v[n].answered
            if v[n].yes:
                _go(i, now_s, step_s, b, o)
                again = True
            else:
                reason = v[i].reason
                wanted = keep.state_of(i, v[i].granted + 1, b)
                stage = c.CHAIN if reason == c.DEADLOCK else 0
                _note(i, c.REFUSE, wanted, c.REASON + reason, stage, b, o)
                _hold(i, b, o)
