"""Whether a vehicle on a conflicting movement is still in the way of one that wants to cross.

A vehicle is no longer in the way of another once its rear is past the stretch that the two movements share.
If its front is on that stretch already, it is enough that its rear will be past it before the other's front
can reach it: nothing holds it there, since it has a slot to drive into and SUMO lets no vehicle go first that
finds another in its way. Before that, SUMO may let each wait for the other; and where the junction begins, or
at a waiting point inside, which may lie on that stretch, whoever has the right of way goes first. Nor is
anything foreseen of one that has to change lanes on its way, since it slows down for that; or that may itself
have to wait on the junction, for a third that was granted before it and is still in its way, or that has left
the same lane in another direction: SUMO keeps a vehicle behind those, too. Nor is anything foreseen of a
vehicle that is long, or whose driver is not as SUMO's cars have it. Others may still be foreseen to be past
before such a vehicle comes: no model of SUMO drives faster than acceleration and limits allow, and where
bodies touch is worked out for every length.
The vehicle that it follows into its place is taken to stand.

Nor is it in the way of one that will be past that stretch, rear and all, before it can be there: where it has
far to go, or slow roads to take since the last place to wait at. Who goes first like that is taken to set out
weakly and to be slow, and must not have to wait for anybody, nor for a light; who comes is as fast as limits
and driver allow.
"""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import NOBODY
from loopgate.drive.motion import braking_time_s, time_s
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import constant, inner, part

__all__ = [
    "BEFORE",
    "IN_THE_WAY",
    "LATER",
    "PAST",
    "begin_m",
    "end_m",
    "leg_of",
    "relation",
    "state_of",
    "together",
]

# What a vehicle under way is to one that wants to set out.
PAST: Final = constant(0)
BEFORE: Final = constant(1)
LATER: Final = constant(2)
IN_THE_WAY: Final = constant(3)

_BEYOND_M: Final = 0.5
"""Room between the rear of the first and the stretch that both use [m]."""

_APART_S: Final = 0.5
"""Time between the rear of the first leaving that stretch and the front of the second reaching it [s]."""

_SLOW: Final = 0.7
"""Share of the speed limit on its crossing that the first is taken to reach: its driver may be slow, and the
vehicle before it slower still. At 0.85 SUMO counts a collision now and then in a dense city."""

_AHEAD_S: Final = 2.0
"""Time between the rear of one that goes first leaving that stretch and the other reaching it [s]."""

_WEAK: Final = 0.5
"""Share of its acceleration that one that goes first is taken to use: SUMO's drivers dawdle."""

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
def _shared(k: int, foe: int, t: Tables) -> int:
    """Return where the stretch of pass `k` is that it shares with the foe, or `NOBODY`."""
    for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
        if t.foes[f].movement == foe:
            return NOBODY if math.isnan(t.foes[f].to_m) else f
    return NOBODY


@inner
def relation(i: int, k: int, f: int, other: int, t: Tables) -> int:
    """Return what `other`, under way on foe `f` of pass `k`, is to vehicle `i` that wants to set out on it.

    `PAST`: no longer in its way. `BEFORE`, `LATER`: it uses what both share before `i`, or after it.
    `IN_THE_WAY`: none of these is sure.
    """
    one, ahead = t.vehicles[i], t.vehicles[other]
    if math.isnan(t.foes[f].to_m):
        return IN_THE_WAY
    if not _is_ever_on(f, one.length_m, t):
        return PAST
    foe = t.foes[f].movement
    reach_m = one.line_m - one.front + t.foes[f].from_m
    found = NOBODY
    for leg in range(ahead.crossed, ahead.granted):
        j = leg_of(other, leg, t)
        for theirs in range(t.legs[j].pass_at, t.legs[j].pass_end):
            if t.passes[theirs].movement == foe:
                shared = _shared(theirs, t.passes[k].movement, t)
                if shared < 0:
                    return IN_THE_WAY
                each = PAST
                if _is_ever_on(shared, ahead.length_m, t):
                    each = _relation(other, leg, theirs, shared, i, reach_m, t)
                if each == IN_THE_WAY and _comes_later(other, leg, shared, i, k, f, t):
                    each = LATER
                found = together(found, each)
    return found if found >= 0 else IN_THE_WAY


@inner
def _is_ever_on(f: int, length_m: float, t: Tables) -> bool:
    """Return whether a body of that length is ever on the stretch that is shared with foe `f`.

    The stretch lasts from the first front to the last rear of all bodies that touch the foe. Where it begins
    farther beyond its end than a body is long, only longer ones touch: the front of that body comes to the
    stretch when its rear is past it.
    """
    return bool(t.foes[f].from_m - t.foes[f].to_m <= length_m)


@inner
def together(one: int, other: int) -> int:
    """Return what two are together: nobody goes before some where it may have to wait for others."""
    least, most = min(one, other), max(one, other)
    return most if least <= PAST or least == most else IN_THE_WAY


@inner
def _is_foreseen(i: int, t: Tables) -> bool:
    """Return whether it can be told when the vehicle will be past a crossing."""
    return bool(t.run[0].foresees and t.vehicles[i].foreseen)


@part
def _relation(other: int, leg: int, theirs: int, shared: int, i: int, reach_m: float, t: Tables) -> int:
    one, ahead = t.vehicles[i], t.vehicles[other]
    inside_m = ahead.front - end_m(other, leg, t)
    left_m = t.foes[shared].to_m + ahead.length_m + _BEYOND_M - inside_m
    if left_m < 0:
        return PAST
    if ahead.steered or not _is_foreseen(other, t) or inside_m < max(_BEYOND_M, t.foes[shared].from_m):
        return IN_THE_WAY  # not on the shared stretch yet: the two could stop across each other's way
    slow = min(ahead.top, _SLOW * t.passes[theirs].speed_mps)
    passed_s = time_s(left_m, ahead.speed, ahead.accel, slow) + _APART_S
    reached_s = time_s(reach_m, one.speed, one.accel, one.top)
    if passed_s > reached_s or _may_be_held(other, leg, t):
        return IN_THE_WAY
    room_m = _room_m(other, leg, t)
    if inside_m < t.passes[theirs].wait_m:
        room_m = min(room_m, t.passes[theirs].wait_m - inside_m)
    leaves_s = braking_time_s(left_m, room_m, slow, ahead.decel) + _APART_S
    return BEFORE if leaves_s <= reached_s else IN_THE_WAY


@part
def _comes_later(other: int, leg: int, shared: int, i: int, k: int, f: int, t: Tables) -> bool:
    """Return whether `i`, let go now, is past the stretch shared with the foe before `other` comes."""
    one, ahead, here = t.vehicles[i], t.vehicles[other], leg_of(i, t.vehicles[i].granted, t)
    run = t.run[0]
    if t.legs[here].pinned or one.steered or not (_is_foreseen(i, t) and run.at_once):
        return False
    if _follows_aside(i, run.grants + 1, t.legs[here].pass_at, t):
        return False
    inside_m = ahead.front - end_m(other, leg, t)
    to_go_m = t.foes[shared].from_m - inside_m
    if to_go_m <= _BEYOND_M:
        return False
    spent_s = max(0.0, inside_m) / t.foes[shared].least_mps
    comes_s = max(
        (t.foes[shared].soonest_s - spent_s) / ahead.haste,
        time_s(to_go_m, ahead.speed, ahead.accel, ahead.top),
    )
    to_m = max(0.0, t.foes[f].to_m + one.line_m - one.front)
    slow = min(one.top, _SLOW * t.foes[f].mean_mps)
    past_s = max(
        time_s(to_m, one.speed, _WEAK * one.accel, slow),
        braking_time_s(to_m, _room_m(i, one.granted, t) - one.length_m - _BEYOND_M, slow, one.decel),
    )
    rear_s = (one.length_m + _BEYOND_M) / min(one.top, _SLOW * t.passes[k].speed_mps)
    return past_s + rear_s + _AHEAD_S <= comes_s


@part
def _number(i: int, leg: int, t: Tables) -> int:
    """Return the number of the grant that led out of the leg."""
    return int(t.numbers[i, (leg + 1) % t.numbers.shape[1]])


@part
def _may_be_held(ahead: int, leg: int, t: Tables) -> bool:
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
                    if before and _is_before(first, its, f, k, t):
                        return True
    return t.legs[j].pass_at < t.legs[j].pass_end and _follows_aside(ahead, number, t.legs[j].pass_at, t)


@part
def _follows_aside(ahead: int, number: int, k: int, t: Tables) -> bool:
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
def _is_before(first: int, leg: int, f: int, k: int, t: Tables) -> bool:
    """Return whether `first`, if it is on foe `f` behind its leg, is not yet past pass `k`."""
    past_m = t.vehicles[first].front - t.vehicles[first].length_m - _BEYOND_M - end_m(first, leg, t)
    j = leg_of(first, leg, t)
    for theirs in range(t.legs[j].pass_at, t.legs[j].pass_end):
        if t.passes[theirs].movement == t.foes[f].movement:
            shared = _shared(theirs, t.passes[k].movement, t)
            if shared < 0 or past_m < t.foes[shared].to_m:
                return True
    return False


@part
def _room_m(ahead: int, leg: int, t: Tables) -> float:
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
