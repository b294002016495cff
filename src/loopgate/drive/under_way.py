"""Where vehicles under way are on their legs, who may hold them there, and how far they can go."""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import NOBODY
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import constant, inner, part

__all__ = [
    "APART",
    "BEYOND_M",
    "begin_m",
    "end_m",
    "follows_aside",
    "leg_of",
    "may_be_held",
    "room_before_m",
    "shared_with",
    "state_of",
]

APART: Final = constant(-2)
"""In place of a shared stretch: two movements that do not conflict on these ways."""

BEYOND_M: Final = 0.5
"""Room between the rear of the first and the stretch that both use [m]."""

_GAP_M: Final = 2.5
"""Room that the first keeps to the vehicle before it [m], which may be standing."""


@inner
def leg_of(i: int, leg: int, t: Tables) -> int:
    """Return where leg `leg` of the way of vehicle `i` is in the table of legs."""
    return int(t.vehicles[i].leg_at + leg % t.vehicles[i].legs)


@inner
def state_of(i: int, leg: int, t: Tables) -> int:
    """Return the state in which the leg lies."""
    return int(t.legs[leg_of(i, leg, t)].state)


@inner
def end_m(i: int, leg: int, t: Tables) -> float:
    """Return where the leg ends [m]; infinity where there is but one."""
    one = t.vehicles[i]
    if one.legs <= 1:
        return math.inf
    return float(leg // one.legs * one.lap_m + t.legs[leg_of(i, leg, t)].end_m)


@inner
def begin_m(i: int, leg: int, t: Tables) -> float:
    """Return where the leg begins [m]."""
    one = t.vehicles[i]
    return float(leg // one.legs * one.lap_m + t.legs[leg_of(i, leg, t)].begin_m)


@inner
def shared_with(k: int, foe: int, t: Tables) -> int:
    """Return where the stretch of pass `k` is that it shares with the foe.

    `NOBODY` if they share all of it; `APART` if they do not conflict: vehicles come to one by the other.
    """
    for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
        if t.foes[f].movement == foe:
            return NOBODY if math.isnan(t.foes[f].to_m) else f
    return APART


@part
def _number(i: int, leg: int, t: Tables) -> int:
    """Return the number of the grant that led out of the leg."""
    return int(t.numbers[i, (leg + 1) % t.numbers.shape[1]])


@part
def may_be_held(ahead: int, leg: int, t: Tables) -> bool:
    """Return whether SUMO may let a vehicle wait on the junction for one that was granted before it."""
    number = _number(ahead, leg, t)
    j, on_m = leg_of(ahead, leg, t), t.vehicles[ahead].front - end_m(ahead, leg, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
            move = t.moves[t.foes[f].movement]
            for n in range(move.passing, move.passing + move.under_way):
                first = t.lists[n]
                if first == ahead:
                    continue
                for its in range(t.vehicles[first].crossed, t.vehicles[first].granted):
                    before = _number(first, its, t) < number or on_m < t.foes[f].from_m
                    if before and is_before(first, its, f, k, t):
                        return True
    return t.legs[j].pass_at < t.legs[j].pass_end and follows_aside(ahead, number, t.legs[j].pass_at, t)


@part
def follows_aside(ahead: int, number: int, k: int, t: Tables) -> bool:
    """Return whether one granted before still crosses the junction from the place of pass `k` another way."""
    movement = t.passes[k].movement
    beside = t.moves[movement].beside
    while beside != movement:
        move = t.moves[beside]
        for n in range(move.passing, move.passing + move.under_way):
            first = t.lists[n]
            for its in range(t.vehicles[first].crossed, t.vehicles[first].granted):
                leg = t.legs[leg_of(first, its, t)]
                leads = leg.pass_at < leg.pass_end and t.passes[leg.pass_at].movement == beside
                if leads and first != ahead and _number(first, its, t) < number:
                    return True
        beside = move.beside
    return False


@part
def is_before(first: int, leg: int, f: int, k: int, t: Tables) -> bool:
    """Return whether `first`, if it is on foe `f` behind its leg, is not yet past pass `k`."""
    past_m = t.vehicles[first].front - t.vehicles[first].length_m - BEYOND_M - end_m(first, leg, t)
    j = leg_of(first, leg, t)
    for theirs in range(t.legs[j].pass_at, t.legs[j].pass_end):
        if t.passes[theirs].movement == t.foes[f].movement:
            shared = shared_with(theirs, t.passes[k].movement, t)
            if shared == APART:
                continue
            if shared < 0 or past_m < t.foes[shared].to_m:
                return True
    return False


@part
def room_before_m(ahead: int, leg: int, t: Tables) -> float:
    """Return how far a vehicle can go from its leg if the one before it in its place stands [m]."""
    state = state_of(ahead, leg + 1, t)
    at = t.states[state].holders
    first = NOBODY
    for n in range(at, at + t.states[state].held_by):
        if t.lists[n] == ahead:
            break
        first = t.lists[n]
    if first < 0:
        return math.inf
    before = t.vehicles[first]
    for its in range(before.granted, before.tail - 1, -1):
        if state_of(first, its, t) == state:
            between_m = (
                before.front - begin_m(first, its, t) - t.vehicles[ahead].front + begin_m(ahead, leg + 1, t)
            )
            return float(between_m - before.length_m - _GAP_M)
    return math.inf
