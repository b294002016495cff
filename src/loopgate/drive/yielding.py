"""Gated vehicles give way to ordinary ones before junctions, never inside them.

SUMO lets who turns across others wait for them inside the junction, where they drive by so near that bodies
touch; and of ways that touch though they are no foes it knows nothing. So a vehicle that has its grant is
slowed down before a junction as long as it can still stop there, and does not set out from one, while
somebody is in its way or comes. What comes later is SUMO's to sort out, as it is after a minute; but who
drove in when nobody came does not wait inside, in the way of one that departs just then and can still stop.
Nor does it wait for ever before its line for another gated one: where lights are off SUMO lets each of two
wait for the other whose ways do not even touch.
"""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import NOBODY
from loopgate.drive.gaps import end_m
from loopgate.drive.others import comes, is_late
from loopgate.drive.seen import ANYBODY, BEYOND_M, UNSEEN, is_across, way_of
from loopgate.drive.sense import MARGIN_M, STANDING_MPS, braking_m, safe_mps
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner, part

__all__ = ["KEPT", "WAITS", "give_way"]

KEPT: Final = 1
"""How fast a vehicle may drive has changed."""
WAITS: Final = 2
"""Whether a vehicle may wait inside has changed."""

_AT_LINE_M: Final = 5.0
"""So far before its line a vehicle may stand that is about to set out [m]."""

_SHORT_OF_M: Final = 0.5
"""So far before a junction a vehicle comes to rest that is kept out of it [m]."""

_MOST_KEPT_S: Final = 60.0
"""After this time it is SUMO's right of way alone that says when it goes on [s]."""

_HELD_UP_S: Final = 5.0
"""A vehicle that stands at its line so long with nobody in its way waits for one with its own grant [s]."""


@part
def give_way(t: Tables) -> int:
    """Keep those out of the next junction who can stop before it and must not drive into it.

    Return how many are to be told something else than before: `Tables.calls` says who, and what.
    """
    told = 0
    for i in range(len(t.vehicles)):
        one = t.vehicles[i]
        kept_mps, first = one.kept_mps, one.first
        since_s, clear, freed, stands_s = one.yields_s, one.clear, one.freed, one.stands_s
        one.kept_mps, one.first = math.nan, False
        one.yields_s, one.clear, one.freed, one.stands_s = math.nan, NOBODY, NOBODY, math.nan
        if one.crossed < one.granted and not one.steered:
            noted = clear != NOBODY or freed != NOBODY or not (math.isnan(since_s) and math.isnan(stands_s))
            if noted or (_is_soon(i, t) and _matters(i, t)):
                _give_way(i, since_s, clear, freed, stands_s, t)
        at_will = math.isnan(one.kept_mps) and math.isnan(kept_mps)
        what = KEPT if one.kept_mps != kept_mps and not at_will else 0
        if one.first != first:
            what |= WAITS
        if what:
            t.calls[told, 0], t.calls[told, 1] = i, what
            told += 1
    return told


@part
def _is_soon(i: int, t: Tables) -> bool:
    """Return whether a vehicle may not be able to stop before its first junction when it is looked next."""
    one, step_s = t.vehicles[i], t.run[0].step_s
    left_m = end_m(i, one.crossed, t) - one.front
    fast = min(one.top, one.speed + one.accel * step_s)
    late_m = fast * step_s + fast * fast / (2 * one.decel) + MARGIN_M + _SHORT_OF_M
    return bool(left_m < max(late_m, 2 * _AT_LINE_M))


@inner
def _find_next(i: int, beyond_m: float, of_length: float, t: Tables) -> tuple[int, float, float]:
    """Return the first movement before a vehicle, and how far it is to that, and to where it may stand [m].

    Or `NOBODY`. One that the vehicle is on counts until its front is so far beyond its beginning: some
    metres, and some share of its length.
    """
    one = t.vehicles[i]
    for leg in range(one.crossed, one.granted):
        line_m = end_m(i, leg, t) - one.front
        w = way_of(i, leg, t)
        for c in range(t.ways[w].crossed_at, t.ways[w].crossed_end):
            left_m = line_m + t.crossed[c].from_m
            if left_m >= -(beyond_m + of_length * t.crossed[c].length_m):
                return c, left_m, left_m if c > t.ways[w].crossed_at else line_m
    return int(NOBODY), 0.0, 0.0


@part
def _matters(i: int, t: Tables) -> bool:
    """Return whether a vehicle stands before its next movement, or may not have that to itself."""
    c, _, _ = _find_next(i, BEYOND_M, 0.0, t)
    if c == NOBODY:
        return False
    return bool(t.vehicles[i].speed < STANDING_MPS or t.crossed[c].waits_in_way or not _is_quiet(c, t))


@part
def _is_quiet(c: int, t: Tables) -> bool:
    """Return whether nobody is across a movement, and nobody comes on any way to it."""
    for k in range(t.crossed[c].approach_at, t.crossed[c].approach_end):
        if t.junctions[t.approaches[k].junction].first != NOBODY:
            return False
    return not is_across(c, ANYBODY, t)


@part
def _give_way(i: int, since_s: float, clear: int, freed: int, stands_s: float, t: Tables) -> None:
    """See what a vehicle is to do, and take note of it; with what was noted of it before."""
    one, now_s = t.vehicles[i], t.run[0].now_s
    if clear != NOBODY:
        _go_on(i, clear, t)
    speed = _speed(i, not math.isnan(since_s), t)
    if math.isnan(speed):
        if _is_free(i, freed, now_s if math.isnan(stands_s) else stands_s, t):
            one.first = True
        return
    one.yields_s = now_s if math.isnan(since_s) else since_s
    if now_s - one.yields_s < _MOST_KEPT_S:
        one.kept_mps = speed


@part
def _go_on(i: int, clear: int, t: Tables) -> None:
    """Take note of one that drives onto a clear movement, as long as it could have to wait there."""
    one = t.vehicles[i]
    for leg in range(one.crossed, one.granted):
        w = way_of(i, leg, t)
        if t.ways[w].crossed_at <= clear < t.ways[w].crossed_end:
            left_m = end_m(i, leg, t) - one.front + t.crossed[clear].from_m
            if left_m > -t.crossed[clear].wait_m:
                one.clear = clear
                if left_m < 0.0 and not is_late(clear, t):
                    one.first = True


@part
def _is_free(i: int, freed: int, since_s: float, t: Tables) -> bool:
    """Return whether a vehicle goes on without giving way, as nobody is in its way who has no grant."""
    one = t.vehicles[i]
    c, left_m, line_m = _find_next(i, 0.0, 1.0, t)
    if c == NOBODY:
        return False
    goes = c == freed
    if left_m >= 0.0 and line_m <= _AT_LINE_M and one.speed < STANDING_MPS:
        one.stands_s = since_s
        goes = goes or t.run[0].now_s - since_s >= _HELD_UP_S
    if goes and not is_late(c, t):
        one.freed = c
        return True
    return False


@part
def _speed(i: int, before: bool, t: Tables) -> float:  # noqa: FBT001  compiled
    """Return how fast a vehicle may drive that is to be kept out of a junction [m/s]; else not a number."""
    c, left_m, line_m = _find_next(i, BEYOND_M, 0.0, t)
    if c == NOBODY:
        return math.nan
    if t.vehicles[i].speed < STANDING_MPS:
        return 0.0 if line_m <= _AT_LINE_M and _is_closed(i, c, left_m, t) else math.nan
    return _slowed(i, c, left_m, before, t)


@part
def _slowed(i: int, c: int, left_m: float, before: bool, t: Tables) -> float:  # noqa: FBT001  compiled
    """Return how fast a vehicle may drive that is under way to a junction [m/s]; not a number: at will."""
    one, step_s = t.vehicles[i], t.run[0].step_s
    room_m = max(0.0, left_m - _SHORT_OF_M)
    fast = min(one.top, one.speed + one.accel * step_s)
    late = room_m < fast * step_s + braking_m(fast, one.decel, step_s) + MARGIN_M
    if not (late or before) or left_m < braking_m(one.speed, one.decel, step_s):
        return math.nan
    return safe_mps(room_m, one.decel, step_s) if _is_closed(i, c, left_m, t) else math.nan


@inner
def _is_closed(i: int, c: int, left_m: float, t: Tables) -> bool:
    """Return whether somebody is in the way of a vehicle that is so far before a movement, or comes."""
    one, way = t.vehicles[i], t.crossed[c]
    waits = way.wait_m > 0.0 or one.speed < STANDING_MPS
    closed = is_across(c, ANYBODY if waits else UNSEEN, t) or comes(i, c, left_m, t)
    one.clear = c if way.waits_in_way and not closed else NOBODY
    return bool(closed)
