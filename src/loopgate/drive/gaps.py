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

One whose front is not on that stretch yet is out of the way too if it will be past it before the other comes
into the junction on which it lies, as far along the other's crossing as that may be: until then SUMO finds
neither in the other's way, so none waits. It must have passed all lights before that stretch. It is taken to
set out weakly, and to be slow all along.

Nor is it in the way of one that will be past that stretch, rear and all, before it can be there: where it has
far to go, or slow roads to take since the last place to wait at. Who goes first like that is taken to set out
weakly and to be slow, and must not have to wait for anybody, nor for a light: those that let it go let it
pass if it is over their lines before red (`lights`); who comes is as fast as limits and driver allow.
"""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import NOBODY
from loopgate.drive.motion import braking_time_s, time_s
from loopgate.drive.tables import Tables
from loopgate.drive.under_way import (
    APART,
    BEYOND_M,
    begin_m,
    end_m,
    follows_aside,
    leg_of,
    may_be_held,
    room_before_m,
    shared_with,
    state_of,
)
from loopgate.kernel_cache import constant, inner, only_with, part

__all__ = [
    "BEFORE",
    "FAR_M",
    "IN_THE_WAY",
    "LATER",
    "PAST",
    "PATIENCE_S",
    "begin_m",
    "end_m",
    "leg_of",
    "passes_lights",
    "relation",
    "state_of",
    "together",
]

# What a vehicle under way is to one that wants to set out.
PAST: Final = constant(0)
BEFORE: Final = constant(1)
LATER: Final = constant(2)
IN_THE_WAY: Final = constant(3)

_APART_S: Final = 0.5
"""Time between the rear of the first leaving that stretch and the front of the second reaching it [s]."""

_SLOW: Final = 0.7
"""Share of the speed limit on its crossing that the first is taken to reach: its driver may be slow, and the
vehicle before it slower still. At 0.85 SUMO counts a collision now and then in a dense city."""

_AHEAD_S: Final = 2.0
"""Time between the rear of one that goes first leaving that stretch and the other reaching it [s]."""

_WEAK: Final = 0.5
"""Share of its acceleration that one that goes first is taken to use: SUMO's drivers dawdle."""

PATIENCE_S: Final = 180.0
"""After this long a vehicle with green before it no longer waits for the lights further on its crossing, nor
for a green that lasts until it is there [s]: lights that are never green together would keep it for ever."""

FAR_M: Final = 50.0
"""A light farther than this from where vehicles are held is of no account to one that sets out
there [m]: it is too early to tell, and an actuated one waits for somebody to come near."""


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
                shared = shared_with(theirs, t.passes[k].movement, t)
                if shared == NOBODY:
                    return IN_THE_WAY
                each = PAST
                if shared != APART and _is_ever_on(shared, ahead.length_m, t):
                    each = _relation(other, leg, theirs, shared, i, reach_m, t)
                if each == IN_THE_WAY and _passes_first(other, leg, theirs, shared, i, k, f, t):
                    each = BEFORE
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
    left_m = t.foes[shared].to_m + ahead.length_m + BEYOND_M - inside_m
    if left_m < 0:
        return PAST
    if ahead.steered or not _is_foreseen(other, t) or inside_m < max(BEYOND_M, t.foes[shared].from_m):
        return IN_THE_WAY  # not on the shared stretch yet: the two could stop across each other's way
    slow = min(ahead.top, _SLOW * t.passes[theirs].speed_mps)
    passed_s = time_s(left_m, ahead.speed, ahead.accel, slow) + _APART_S
    reached_s = time_s(reach_m, one.speed, one.accel, one.top)
    if passed_s > reached_s or may_be_held(other, leg, t) or _is_kept_out(other, leg, theirs, t):
        return IN_THE_WAY
    room_m = room_before_m(other, leg, t)
    if inside_m < t.passes[theirs].wait_m:
        room_m = min(room_m, t.passes[theirs].wait_m - inside_m)
    leaves_s = braking_time_s(left_m, room_m, slow, ahead.decel) + _APART_S
    return BEFORE if leaves_s <= reached_s else IN_THE_WAY


@part
def _is_kept_out(other: int, leg: int, theirs: int, t: Tables) -> bool:
    """Return whether SUMO may hold a vehicle before the junction of a pass, to keep that clear.

    It does so where the vehicle would not be past the junction if the vehicle before it in its place stands.
    """
    ahead, j = t.vehicles[other], leg_of(other, leg, t)
    to_line_m = t.passes[theirs].light_m - t.legs[j].end_m - ahead.front + end_m(other, leg, t)
    if to_line_m <= -BEYOND_M:
        return False
    needed_m = begin_m(other, leg + 1, t) + ahead.length_m - ahead.front
    return bool(room_before_m(other, leg, t) < needed_m)


@part
def _passes_first(other: int, leg: int, theirs: int, shared: int, i: int, k: int, f: int, t: Tables) -> bool:
    """Return whether `other` is past the stretch shared with the foe before `i` comes into its junction."""
    one, ahead, here = t.vehicles[i], t.vehicles[other], leg_of(i, t.vehicles[i].granted, t)
    j = leg_of(other, leg, t)
    if ahead.steered or not _is_foreseen(other, t):
        return False
    from_m = end_m(other, leg, t)
    inside_m = ahead.front - from_m
    light_m = t.legs[j].end_m + inside_m
    for n in range(t.legs[j].pass_at, theirs + 1):
        if t.passes[n].signal != NOBODY and t.passes[n].light_m >= light_m:
            return False
    # Who swings out or is swung over shares a stretch that begins before the junction.
    enters_m = min(t.passes[k].light_m - t.legs[here].end_m, t.foes[f].from_m)
    soonest_s = t.foes[f].soonest_s - (t.foes[f].from_m - enters_m) / t.foes[f].least_mps
    reached_s = max(
        soonest_s / one.haste, time_s(one.line_m - one.front + enters_m, one.speed, one.accel, one.top)
    )
    left_m = t.foes[shared].to_m + ahead.length_m + BEYOND_M - inside_m
    slow = min(ahead.top, _SLOW * min(t.passes[theirs].speed_mps, t.foes[shared].least_mps))
    room_m, wait_m = room_before_m(other, leg, t), t.passes[theirs].wait_m
    if inside_m < wait_m and wait_m > t.passes[theirs].light_m - t.legs[j].end_m + BEYOND_M:
        room_m = min(room_m, wait_m - inside_m)
    passed_s = max(
        time_s(left_m, ahead.speed, _WEAK * ahead.accel, slow),
        braking_time_s(left_m, room_m, slow, ahead.decel),
    )
    held = may_be_held(other, leg, t) or _is_kept_out(other, leg, theirs, t)
    return bool(passed_s + _AHEAD_S <= reached_s and not held)


@only_with("signals", otherwise=True)
def passes_lights(i: int, here: int, t: Tables) -> bool:
    """Return whether the vehicle, if the lights let it go behind that leg, passes all of them for sure.

    They do not let it go else if it is patient yet, but for a light that is far or changes with the traffic.
    """
    for k in range(t.legs[here].pass_at, t.legs[here].pass_end):
        signal = t.passes[k].signal
        if signal == NOBODY:
            continue
        if t.run[0].now_s - t.vehicles[i].red_since_s >= PATIENCE_S:
            return False
        if t.passes[k].light_m - t.legs[here].end_m > FAR_M:
            return False
        if k > t.legs[here].pass_at and not t.lights[t.signals[signal].light].fixed:
            return False
    return True


@part
def _comes_later(other: int, leg: int, shared: int, i: int, k: int, f: int, t: Tables) -> bool:
    """Return whether `i`, let go now, is past the stretch shared with the foe before `other` comes."""
    one, ahead, here = t.vehicles[i], t.vehicles[other], leg_of(i, t.vehicles[i].granted, t)
    run = t.run[0]
    if t.legs[here].pinned or one.steered or not (_is_foreseen(i, t) and run.at_once):
        return False
    if follows_aside(i, run.grants + 1, t.legs[here].pass_at, t) or not passes_lights(i, here, t):
        return False
    inside_m = ahead.front - end_m(other, leg, t)
    to_go_m = t.foes[shared].from_m - inside_m
    if to_go_m <= BEYOND_M:
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
        braking_time_s(to_m, room_before_m(i, one.granted, t) - one.length_m - BEYOND_M, slow, one.decel),
    )
    rear_s = (one.length_m + BEYOND_M) / min(one.top, _SLOW * t.passes[k].speed_mps)
    return past_s + rear_s + _AHEAD_S <= comes_s
