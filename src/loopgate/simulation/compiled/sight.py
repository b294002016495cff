"""`loopgate.simulation.sight.Sight`, compiled; see there for what is done and why."""

from __future__ import annotations

import math

from numba import njit

from loopgate.simulation.compiled.tables import Books
from loopgate.simulation.motion import braking_time_s, time_s
from loopgate.simulation.sight import APART_S, BEYOND_M, GAP_M, SLOW

__all__ = ["begin_m", "end_m", "in_the_way", "leg_of"]


@njit(cache=True, error_model="numpy")
def leg_of(i: int, leg: int, b: Books) -> int:
    """Return where leg `leg` of the way of vehicle `i` is in the tables."""
    v = b.vehicles
    return int(v[i].leg_at + leg % v[i].legs)


@njit(cache=True, error_model="numpy")
def end_m(i: int, leg: int, b: Books) -> float:
    """Return where the leg ends [m]; infinity where there is but one."""
    v = b.vehicles
    if v[i].legs <= 1:
        return math.inf
    lap = leg // v[i].legs
    return float(lap * v[i].lap_m + b.legs[leg_of(i, leg, b)].end_m)


@njit(cache=True, error_model="numpy")
def begin_m(i: int, leg: int, b: Books) -> float:
    """Return where the leg begins [m]."""
    v = b.vehicles
    lap = leg // v[i].legs
    return float(lap * v[i].lap_m + b.legs[leg_of(i, leg, b)].begin_m)


@njit(cache=True, error_model="numpy")
def _shared(k: int, foe: int, b: Books) -> int:
    """Return where the stretch of pass `k` is that it shares with the foe, or -1."""
    for f in range(b.passes[k].foe_at, b.passes[k].foe_end):
        if b.foes[f].movement == foe:
            return -1 if math.isnan(b.foes[f].to_m) else f
    return -1


@njit(cache=True, error_model="numpy")
def in_the_way(i: int, k: int, f: int, other: int, b: Books) -> bool:
    """Return whether `other`, under way on foe `f` of pass `k`, keeps vehicle `i` from setting out on it."""
    v = b.vehicles
    if math.isnan(b.foes[f].to_m):
        return True
    foe = b.foes[f].movement
    reach_m = v[i].line_m - v[i].front + b.foes[f].from_m
    clear = False
    for leg in range(v[other].crossed, v[other].granted):
        j = leg_of(other, leg, b)
        for theirs in range(b.legs[j].pass_at, b.legs[j].pass_end):
            if b.passes[theirs].movement == foe:
                shared = _shared(theirs, b.passes[k].movement, b)
                clear = shared >= 0 and _passes_before(other, leg, theirs, shared, i, reach_m, b)
                if not clear:
                    return True
    return not clear


@njit(cache=True, error_model="numpy")
def _passes_before(
    ahead: int,
    leg: int,
    theirs: int,
    shared: int,
    i: int,
    reach_m: float,
    b: Books,
) -> bool:
    v = b.vehicles
    inside_m = v[ahead].front - end_m(ahead, leg, b)
    left_m = b.foes[shared].to_m + v[ahead].length_m + BEYOND_M - inside_m
    if left_m < 0:
        return True
    if inside_m < max(BEYOND_M, b.foes[shared].from_m):
        return False
    slow = min(v[ahead].top, SLOW * b.passes[theirs].speed_mps)
    passed_s = time_s(left_m, v[ahead].speed, v[ahead].accel, slow) + APART_S
    reached_s = time_s(reach_m, v[i].speed, v[i].accel, v[i].top)
    if passed_s > reached_s or _may_be_held(ahead, leg, b):
        return False
    room_m = _room_m(ahead, leg, b)
    return braking_time_s(left_m, room_m, slow, v[ahead].decel) + APART_S <= reached_s


@njit(cache=True, error_model="numpy")
def _number(i: int, leg: int, b: Books) -> int:
    """Return the number of the grant that led out of the leg."""
    v = b.vehicles
    return int(b.pool[v[i].number_at + (leg + 1) % v[i].numbers])


@njit(cache=True, error_model="numpy")
def _may_be_held(ahead: int, leg: int, b: Books) -> bool:
    v = b.vehicles
    number = _number(ahead, leg, b)
    j = leg_of(ahead, leg, b)
    for k in range(b.legs[j].pass_at, b.legs[j].pass_end):
        for f in range(b.passes[k].foe_at, b.passes[k].foe_end):
            foe = b.foes[f].movement
            at = b.moves[foe].passing
            for n in range(at, at + b.moves[foe].under_way):
                first = b.pool[n]
                if first == ahead:
                    continue
                for its in range(v[first].crossed, v[first].granted):
                    earlier = _number(first, its, b) < number
                    if earlier and _is_before(first, its, foe, b.passes[k].movement, b):
                        return True
    return False


@njit(cache=True, error_model="numpy")
def _is_before(first: int, leg: int, foe: int, movement: int, b: Books) -> bool:
    v = b.vehicles
    past_m = v[first].front - v[first].length_m - BEYOND_M - end_m(first, leg, b)
    j = leg_of(first, leg, b)
    for theirs in range(b.legs[j].pass_at, b.legs[j].pass_end):
        if b.passes[theirs].movement == foe:
            shared = _shared(theirs, movement, b)
            if shared < 0 or past_m < b.foes[shared].to_m:
                return True
    return False


@njit(cache=True, error_model="numpy")
def _room_m(ahead: int, leg: int, b: Books) -> float:
    v = b.vehicles
    state = b.legs[leg_of(ahead, leg + 1, b)].state
    at = b.states[state].holders
    first = -1
    for n in range(at, at + b.states[state].held_by):
        if b.pool[n] == ahead:
            break
        first = b.pool[n]
    if first < 0:
        return math.inf
    for its in range(v[first].granted, v[first].tail - 1, -1):
        if b.legs[leg_of(first, its, b)].state == state:
            between = v[first].front - begin_m(first, its, b) - v[ahead].front + begin_m(ahead, leg + 1, b)
            return float(between - v[first].length_m - GAP_M)
    return math.inf
