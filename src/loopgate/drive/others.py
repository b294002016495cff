"""Where ordinary traffic, which no gate rules and nobody can count on, is in the way of gated vehicles.

A vehicle is refused while an ordinary one

- stands or drives before it on its own lane;
- is, with some part, on a lane inside the junction that crosses or joins its way;
- comes over the junction where nothing keeps the two apart, too late to pass before it and too soon to let it
  pass (see `loopgate.simulation.around.crossing_ways`);
- takes the last room of its next state, or is about to drive into it; or could not find room in a circle of
  places that it would come into (`loopgate.drive.cycle_slack`).

It is looked at where the ordinary vehicles are when a request comes to be decided, in each step anew. Who
comes later is given way to before the junction (`loopgate.drive.yielding`), and by SUMO's own right of way,
which gated vehicles keep too with ordinary traffic about.
"""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import NOBODY
from loopgate.drive.cycle_slack import is_too_tight
from loopgate.drive.gaps import begin_m, state_of
from loopgate.drive.motion import time_s
from loopgate.drive.occupancy import last_state, wanted_state
from loopgate.drive.seen import ANYBODY, BEYOND_M, fit, is_across, is_in, is_upon, mark, way_of
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner, only_with, part

__all__ = ["comes", "find_in_the_way", "find_inside", "has_room", "is_late", "obstruct"]

_CLEAR_M: Final = 40.0
"""So far behind who drives onto its lane from beside it no ordinary vehicle may be [m]."""

_SETS_OUT_S: Final = 5.0
"""A vehicle that stands in the queue at a line for longer, and may set out, waits for something else [s]."""

_PASSED_S: Final = 2.0
"""Time in which an ordinary vehicle with the right of way is over the junction once it is there [s]."""

_APART_S: Final = 1.0
"""Time to spare between a gated vehicle leaving and one with the right of way getting there [s]."""


@only_with("others", otherwise=False)
def obstruct(i: int, t: Tables) -> bool:
    """Return whether an ordinary vehicle is in the way of the vehicle, which wants to set out."""
    if t.run[0].seen == 0:
        return False
    return bool(_is_too_full(i, t) or _meets(i, t) or is_too_tight(i, t.vehicles[i].granted + 1, t))


@inner
def _is_too_full(i: int, t: Tables) -> bool:
    state = t.states[wanted_state(i, t)]
    there = way_of(i, t.vehicles[i].granted + 1, t)
    return bool(fit(there, state.holders, state.held_by, t.vehicles[i].length_m, t) < 1.0)


@part
def _meets(i: int, t: Tables) -> bool:
    """Return whether somebody is before the vehicle on its lane, across its way, or comes there."""
    one = t.vehicles[i]
    w = way_of(i, one.granted, t)
    left_m = one.line_m - one.front
    s = t.lanes[t.ways[w].lane].first
    while s != NOBODY:
        if _is_before(s, w, left_m, t):
            return True
        s = t.others[s].following
    for c in range(t.ways[w].crossed_at, t.ways[w].crossed_end):
        if is_across(c, ANYBODY, t):
            return True
    for k in range(t.ways[w].between_at, t.ways[w].between_end):
        if is_upon(t.lane_lists[k], math.inf, t):
            return True
    for c in range(t.ways[w].crossed_at, t.ways[w].crossed_end):
        if comes(i, c, left_m + t.crossed[c].from_m, t):
            return True
    return False


@inner
def _is_before(s: int, w: int, left_m: float, t: Tables) -> bool:
    """Return whether one on the lane of a way is before a vehicle that is so far from its line there."""
    return bool(t.ways[w].end_m - left_m < t.others[s].position_m <= t.ways[w].end_m + BEYOND_M)


@inner
def comes(i: int, c: int, left_m: float, t: Tables) -> bool:
    """Return whether somebody would get in the way of a vehicle that is so far before a movement."""
    way = t.crossed[c]
    there_s = over_s = -1.0
    for k in range(way.approach_at, way.approach_end):
        n = t.junctions[t.approaches[k].junction].first if t.approaches[k].is_open else NOBODY
        if n != NOBODY and over_s < 0.0:
            there_s = _reaches_s(i, left_m, c, t)
            over_s = _is_over_s(i, left_m, c, t)
        while n != NOBODY:
            arrival = t.arrivals[n]
            meets = arrival.last_s > there_s - _PASSED_S and arrival.first_s < over_s
            if meets and (not arrival.stands or _sets_out(arrival.other, t)):
                return True
            n = arrival.following
    return False


@part
def _reaches_s(i: int, left_m: float, c: int, t: Tables) -> float:
    one = t.vehicles[i]
    return time_s(left_m, one.speed, one.accel, min(one.top, t.crossed[c].speed_mps))


@part
def _is_over_s(i: int, left_m: float, c: int, t: Tables) -> float:
    """Return after which time a vehicle has passed a movement, with some to spare [s]."""
    one, way = t.vehicles[i], t.crossed[c]
    top = min(one.top, way.speed_mps)
    over_s = time_s(left_m + way.wait_m, one.speed, one.accel, top) + _APART_S
    going = 0.0  # who may have to wait sets out from there
    if way.wait_m == 0.0:
        going = min(top, math.sqrt(one.speed * one.speed + 2 * one.accel * max(0.0, left_m)))
    return over_s + time_s(way.length_m - way.wait_m + one.length_m, going, one.accel, top)


@inner
def _sets_out(s: int, t: Tables) -> bool:
    """Return whether one that stands at its line, and may drive, is about to set out."""
    one, now_s = t.others[s], t.run[0].now_s
    if now_s - one.seen_s > _SETS_OUT_S:
        one.since_s = now_s
    one.seen_s = now_s
    return bool(now_s - one.since_s < _SETS_OUT_S)


@inner
def is_late(c: int, t: Tables) -> bool:
    """Return whether somebody comes to a movement who cannot stop any more."""
    for k in range(t.crossed[c].approach_at, t.crossed[c].approach_end):
        n = t.junctions[t.approaches[k].junction].first if t.approaches[k].is_open else NOBODY
        while n != NOBODY:
            if t.arrivals[n].near:
                return True
            n = t.arrivals[n].following
    return False


@part
def has_room(i: int, t: Tables) -> bool:
    """Return whether one that comes back from beside the road has room in its place and in its circle."""
    if t.run[0].seen == 0:
        return True
    one = t.vehicles[i]
    state = last_state(i, t)
    inside_m = math.inf
    for leg in range(one.tail, one.granted + 1):
        if state_of(i, leg, t) == state:
            inside_m = min(inside_m, one.front - begin_m(i, leg, t))
    w = way_of(i, one.granted, t)
    here_m = t.ways[w].begin_m + inside_m
    s = t.lanes[t.ways[w].lane].first
    while s != NOBODY:
        if -_CLEAR_M < t.others[s].position_m - here_m < t.others[s].length_m:
            return False
        s = t.others[s].following
    free = fit(w, t.states[state].holders, t.states[state].held_by, one.length_m, t)
    return bool(free >= 1.0 and not is_too_tight(i, one.granted, t))


@part
def find_in_the_way(i: int, t: Tables) -> None:
    """Find the ordinary vehicles each of which is in the way of the vehicle now, before it or across."""
    w, left_m = way_of(i, t.vehicles[i].granted, t), t.vehicles[i].line_m - t.vehicles[i].front
    _begin(t)
    s = t.lanes[t.ways[w].lane].first
    while s != NOBODY:
        if _is_before(s, w, left_m, t):
            _find(s, t)
        s = t.others[s].following
    for c in range(t.ways[w].crossed_at, t.ways[w].crossed_end):
        for k in range(t.crossed[c].across_at, t.crossed[c].across_end):
            _find_upon(t.across[k].lane, t.across[k].past_m, t)
    for k in range(t.ways[w].between_at, t.ways[w].between_end):
        _find_upon(t.lane_lists[k], math.inf, t)


@part
def find_inside(i: int, t: Tables) -> bool:
    """Return whether the vehicle wants for room in its next state; find the ordinary ones inside."""
    _begin(t)
    if not _is_too_full(i, t):
        return False
    w = way_of(i, t.vehicles[i].granted + 1, t)
    s = t.lanes[t.ways[w].lane].first
    while s != NOBODY:
        if is_in(s, w, t):
            _find(s, t)
        s = t.others[s].following
    for k in range(t.ways[w].into_at, t.ways[w].into_end):
        _find_upon(t.lane_lists[k], -math.inf, t)
    return True


@inner
def _begin(t: Tables) -> None:
    t.run[0].found = 0
    t.run[0].marks += 1


@inner
def _find(s: int, t: Tables) -> None:
    """Find a vehicle, once for each mark."""
    if mark(s, t):
        t.others[t.run[0].found].found = s
        t.run[0].found += 1


@inner
def _find_upon(lane: int, past_m: float, t: Tables) -> None:
    s = t.lanes[lane].first
    while s != NOBODY:
        _find(s, t)
        s = t.others[s].following
    n = t.lanes[lane].over
    while n != NOBODY:
        if t.rears[n].rear_m < past_m:
            _find(t.rears[n].other, t)
        n = t.rears[n].following
