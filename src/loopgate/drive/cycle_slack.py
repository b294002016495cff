"""Room in circles of places, each of whose first wants the next, for ordinary vehicles, which do not ask.

The chain rule of a gate leaves a slot free in each circle, so that it can go round. An ordinary vehicle takes
that slot without asking. So here ordinary vehicles count as vehicles in places, in whose line they may be
first; and who would come into a circle from elsewhere leaves it a slot more, and one for each ordinary
vehicle that is about to come there. Within a circle everyone may go on, so somebody can. Who must move next
(`loopgate.drive.service`) need not leave more than the one slot.
"""

from __future__ import annotations

from typing import Final

from loopgate.drive.codes import NOBODY
from loopgate.drive.gaps import end_m
from loopgate.drive.seen import fit, is_in, mark, next_lane, way_of
from loopgate.drive.sense import STANDING_MPS
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner, part

__all__ = ["is_too_tight"]

_SHARE: Final = 5
"""One slot in so many of a place is for ordinary vehicles, one at least where there are three."""

_AHEAD: Final = 5
"""Whoever has a place among so many of the next edges on its route is about to come to it."""


@inner
def is_too_tight(i: int, leg: int, t: Tables) -> bool:
    """Return whether the move of the vehicle would leave too little room for ordinary vehicles.

    It is the move into its next leg, or back into its own, from beside the road.
    """
    one = t.vehicles[i]
    entered = t.ways[way_of(i, leg, t)]
    if entered.away:
        return False  # who arrives leaves room
    t.run[0].marks += 1
    begin = t.run[0].marks
    here = NOBODY if leg == one.granted else t.ways[way_of(i, one.granted, t)].place
    place, length_m, holes, crowded = entered.place, one.length_m, 0.0, False
    while place not in (here, NOBODY) and t.places[place].marked != begin:
        if t.places[place].state == NOBODY:
            return crowded
        state = t.states[t.places[place].state]
        free = min(state.room - state.queue, fit(t.places[place].way, state.line, state.queue, length_m, t))
        if place == entered.place:
            free -= 1
            crowded = not one.mover and free < (state.room + 2) // _SHARE
        holes += max(0.0, free)
        t.places[place].marked = begin
        first, its_leg = i, leg
        if state.queue > 0:
            first = int(t.lists[state.line])
            its_leg = t.vehicles[first].granted
        elif place != entered.place:
            first = NOBODY
        place, length_m = _following(t.places[place].way, first, its_leg, t)
    if place == here and place != NOBODY:
        return False
    if place != entered.place:
        return crowded
    return bool(crowded or holes < (1 if one.mover else 2 + _coming(begin, t)))


@part
def _following(w: int, i: int, leg: int, t: Tables) -> tuple[int, float]:
    """Return where the first in a place wants to go, `NOBODY` if to no place, and how long that is [m].

    The first is the gated vehicle, if there is one, in a leg of its way; or one of the ordinary ones before
    that: in the place, or standing on the crossing behind it.
    """
    other = _first_other(w, t)
    if i != NOBODY and not _is_before(other, i, leg, w, t):
        other = _in_the_way(way_of(i, leg, t), t)
        if other == NOBODY:
            return t.ways[way_of(i, leg + 1, t)].place, t.vehicles[i].length_m
    return (_sought(other, t), t.others[other].length_m) if other != NOBODY else (int(NOBODY), 0.0)


@inner
def _first_other(w: int, t: Tables) -> int:
    """Return the first of the ordinary vehicles that stand or drive in a place, or `NOBODY`."""
    first = NOBODY
    s = t.lanes[t.ways[w].lane].first
    while s != NOBODY:
        if is_in(s, w, t) and (first == NOBODY or t.others[s].position_m > t.others[first].position_m):
            first = s
        s = t.others[s].following
    return int(first)


@inner
def _is_before(other: int, i: int, leg: int, w: int, t: Tables) -> bool:
    """Return whether an ordinary vehicle, if there is one, is before a gated one in its place."""
    if other == NOBODY:
        return False
    return bool(end_m(i, leg, t) - t.vehicles[i].front > t.ways[w].end_m - t.others[other].position_m)


@part
def _in_the_way(w: int, t: Tables) -> int:
    """Return an ordinary vehicle that stands on the crossing behind a leg, or `NOBODY`."""
    for k in range(t.ways[w].between_at, t.ways[w].between_end):
        s = _standing_on(t.lane_lists[k], t)
        if s != NOBODY:
            return s
    for c in range(t.ways[w].crossed_at, t.ways[w].crossed_end):
        for k in range(t.crossed[c].across_at, t.crossed[c].across_end):
            s = _standing_on(t.across[k].lane, t)
            if s != NOBODY:
                return s
    return int(NOBODY)


@inner
def _standing_on(lane: int, t: Tables) -> int:
    s = t.lanes[lane].first
    while s != NOBODY and t.others[s].speed >= STANDING_MPS:
        s = t.others[s].following
    return int(s)


@part
def _sought(other: int, t: Tables) -> int:
    """Return the next place on the route of an ordinary vehicle, or `NOBODY`."""
    one = t.others[other]
    lane = one.lane
    for at in range(one.at + 1, min(one.at + 1 + _AHEAD, one.route_end)):
        lane = next_lane(lane, t.routes[at, 0], t)
        if lane == NOBODY:
            return int(NOBODY)
        if t.lanes[lane].place != NOBODY:
            return int(t.lanes[lane].place)
    return int(NOBODY)


@part
def _coming(begin: int, t: Tables) -> int:
    """Return how many ordinary vehicles are about to come into the circle of marked places from elsewhere."""
    for p in range(len(t.places)):
        if t.places[p].marked == begin:
            w = t.places[p].way
            t.edges[t.lanes[t.ways[w].lane].edge].marked = begin
            s = t.lanes[t.ways[w].lane].first
            while s != NOBODY:
                if is_in(s, w, t):
                    mark(s, t)
                s = t.others[s].following
            for k in range(t.ways[w].into_at, t.ways[w].into_end):
                s = t.lanes[t.lane_lists[k]].first
                while s != NOBODY:
                    mark(s, t)
                    s = t.others[s].following
    count = 0
    for n in range(t.run[0].seen):
        one = t.others[t.others[n].seen]
        if one.marked == begin:
            continue
        for at in range(one.at + 1, min(one.at + 1 + _AHEAD, one.route_end)):
            if t.edges[t.routes[at, 0]].marked == begin:
                count += 1
                break
    return count
