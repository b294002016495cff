"""Where ordinary vehicles are, with front and rear, and which junctions they come to."""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import NOBODY
from loopgate.drive.motion import time_s
from loopgate.drive.sense import STANDING_MPS
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import constant, inner, part

__all__ = [
    "ANYBODY",
    "BEYOND_M",
    "UNSEEN",
    "fit",
    "follow_routes",
    "is_across",
    "is_in",
    "is_upon",
    "mark",
    "next_lane",
    "see",
    "way_of",
]

BEYOND_M: Final = 0.3
"""How far past the end of a place vehicles may stand that are in it [m]."""

_GAP_M: Final = 2.5
"""Room that a vehicle keeps free before it when it stands: SUMO's default [m]."""

ANYBODY: Final = constant(0)
UNSEEN: Final = constant(1)
"""Those across a movement, or of them those that SUMO does not see."""

_AGAIN_S: Final = 5.0
"""So long a route is taken to be as it was [s]: SUMO may lead vehicles another way."""

_HORIZON_S: Final = 20.0
"""Nobody looks farther ahead [s]: by then who sets out now is over any junction."""

_REACTS_S: Final = 1.0
"""SUMO's drivers brake so late [s]."""

_AT_LINE_M: Final = 30.0
"""So far before a junction a vehicle may stand that is the first at its line [m], or in the queue behind."""


@part
def follow_routes(t: Tables) -> int:
    """Take note of how far those on the road are on their routes; return how many routes are to be looked at.

    First those that are not known or do not lead over the lane, `DriveRow.found`, then those known for so
    long that they may have changed.
    """
    run = t.run[0]
    lost = due = 0
    for n in range(run.others):
        s = t.others[n].read
        one = t.others[s]
        if one.parks:
            continue
        if one.on != one.lane and one.route_at < one.route_end:
            edge = t.lanes[one.lane].edge
            if t.lanes[one.lane].inside or t.routes[one.at, 0] == edge:
                one.on = one.lane
            elif one.at + 1 < one.route_end and t.routes[one.at + 1, 0] == edge:
                one.at += 1
                one.on = one.lane
        if one.on != one.lane or run.now_s >= one.until_s:
            one.until_s = run.now_s + _AGAIN_S
            if one.on != one.lane:
                t.others[lost + due].found = t.others[lost].found
                t.others[lost].found = s
                lost += 1
            else:
                t.others[lost + due].found = s
                due += 1
    run.found = lost
    return lost + due


@part
def see(t: Tables) -> int:
    """List those on the road by lane, their rears, and who comes to which junction.

    Return how many rows the longer of the last two lists takes: where there are fewer in its table it is to
    be asked again with more.
    """
    _forget(t)
    _list_fronts(t)
    return max(_list_rears(t), _list_arrivals(t))


@part
def _forget(t: Tables) -> None:
    run = t.run[0]
    for n in range(run.seen):
        one = t.others[t.others[n].seen]
        t.lanes[one.listed].first = NOBODY
    for n in range(run.rears):
        t.lanes[t.rears[n].lane].over = NOBODY
    for n in range(run.arrivals):
        t.junctions[t.arrivals[n].junction].first = NOBODY


@part
def _list_fronts(t: Tables) -> None:
    """List those on the road: lane by lane, in the order in which they are read."""
    run = t.run[0]
    lanes = 0
    for n in range(run.others):
        s = t.others[n].read
        one = t.others[s]
        if one.parks:
            continue
        lane = t.lanes[one.lane]
        one.listed, one.following = one.lane, NOBODY
        if lane.first == NOBODY:
            lane.first = s
            t.others[lanes].found = one.lane
            lanes += 1
        else:
            t.others[lane.last].following = s
        lane.last = s
    run.seen = 0
    for n in range(lanes):
        s = t.lanes[t.others[n].found].first
        while s != NOBODY:
            t.others[run.seen].seen = s
            run.seen += 1
            s = t.others[s].following


@part
def _list_rears(t: Tables) -> int:
    run = t.run[0]
    count = 0
    for n in range(run.seen):
        s = t.others[n].seen
        one = t.others[s]
        lane, left_m, at = one.lane, one.length_m - one.position_m, one.at
        while left_m > 0.0 and one.route_at < one.route_end:
            edge = NOBODY
            if not t.lanes[lane].inside:
                at = at if t.routes[at, 0] == t.lanes[lane].edge else at - 1
                if at <= one.route_at:
                    break
                edge = t.routes[at - 1, 0]
            lane = _linked(t.lanes[lane].behind_at, t.lanes[lane].behind_end, edge, t)
            if lane == NOBODY:
                break
            rear_m = t.lanes[lane].length_m - left_m
            left_m = -rear_m
            if count < len(t.rears):
                row = t.rears[count]
                row.other, row.lane, row.rear_m, row.following = s, lane, rear_m, t.lanes[lane].over
                t.lanes[lane].over = count
            count += 1
    run.rears = min(count, len(t.rears))
    return count


@inner
def _linked(begin: int, end: int, edge: int, t: Tables) -> int:
    """Return the lane among some links that belongs to an edge, or `NOBODY`."""
    for k in range(begin, end):
        if t.links[k].edge in (edge, NOBODY):
            return int(t.links[k].lane)
    return int(NOBODY)


@inner
def next_lane(lane: int, edge: int, t: Tables) -> int:
    """Return the lane of an edge to which a lane leads, over a junction or inside it, or `NOBODY`."""
    return _linked(t.lanes[lane].ahead_at, t.lanes[lane].ahead_end, edge, t)


@part
def _list_arrivals(t: Tables) -> int:
    """List who comes to junctions, those lane by lane, and of each the ones before it in order.

    Of vehicles that stand, those that are not near the line of a junction are left out: they may wait for
    anything.
    """
    run = t.run[0]
    count = 0
    for n in range(run.seen):
        s = t.others[n].seen
        one = t.others[s]
        lane = t.lanes[one.lane]
        speed, left_m = one.speed, lane.length_m - one.position_m
        at = one.at + (1 if lane.inside else 0)
        if one.route_at == one.route_end or at + 1 >= one.route_end:
            continue
        if speed <= STANDING_MPS:
            if not lane.inside and left_m <= _AT_LINE_M:
                first_s = time_s(left_m, 0.0, one.accel, lane.speed_mps)
                count = _comes_to(t.routes[at, 1], s, first_s, math.inf, 0.0, count, t)
            continue
        stops_m = _REACTS_S * speed + speed * speed / (2 * one.decel)
        if lane.inside:
            left_m += t.edges[t.routes[at, 0]].length_m
        while at + 1 < one.route_end:
            first_s = time_s(left_m, speed, one.accel, max(speed, t.edges[t.routes[at, 0]].limit_mps))
            if first_s > _HORIZON_S:
                break
            junction = t.routes[at, 1]
            count = _comes_to(junction, s, first_s, left_m / speed, left_m - stops_m, count, t)
            through_m = t.junctions[junction].through_m if junction != NOBODY else 0.0
            at += 1
            left_m += through_m + t.edges[t.routes[at, 0]].length_m
    run.arrivals = min(count, len(t.arrivals))
    return count


@inner
def _comes_to(
    junction: int, s: int, first_s: float, last_s: float, spare_m: float, count: int, t: Tables
) -> int:
    """Append an arrival to the list of a junction, if it is one; return how many there are.

    The vehicle can stop so far before it, and not at all if that is below 0 [m].
    """
    if junction == NOBODY:
        return count
    if count < len(t.arrivals):
        row, there = t.arrivals[count], t.junctions[junction]
        row.other, row.junction, row.first_s, row.last_s = s, junction, first_s, last_s
        row.stands, row.near, row.following = math.isinf(last_s), spare_m < 0.0, NOBODY
        if there.first == NOBODY:
            there.first = count
        else:
            t.arrivals[there.last].following = count
        there.last = count
    return count + 1


@inner
def is_upon(lane: int, past_m: float, t: Tables) -> bool:
    """Return whether a front is on a lane, or some part still before `past_m` of one that has left it."""
    if t.lanes[lane].first != NOBODY:
        return True
    n = t.lanes[lane].over
    while n != NOBODY:
        if t.rears[n].rear_m < past_m:
            return True
        n = t.rears[n].following
    return False


@inner
def is_across(c: int, which: int, t: Tables) -> bool:
    """Return whether anybody inside the junction is in the way of a movement: `ANYBODY`, or `UNSEEN`."""
    for k in range(t.crossed[c].across_at, t.crossed[c].across_end):
        one = t.across[k]
        if (one.unseen or which == ANYBODY) and is_upon(one.lane, one.past_m, t):
            return True
    return False


@inner
def is_in(s: int, w: int, t: Tables) -> bool:
    """Return whether a vehicle on the lane of a place is in that."""
    return bool(t.ways[w].begin_m <= t.others[s].position_m <= t.ways[w].end_m + BEYOND_M)


@inner
def fit(w: int, at: int, robots: int, length_m: float, t: Tables) -> float:
    """Return how many more vehicles of a length fit into a place beside those and the robots of a list.

    That is infinite where there is no ordinary vehicle: then it is for the gate to say. Its slots are as
    long as the longest vehicle needs; where there are ordinary ones, each takes what it is long.
    """
    taken_m, count = 0.0, robots
    s = t.lanes[t.ways[w].lane].first
    while s != NOBODY:
        if is_in(s, w, t):
            taken_m += t.others[s].length_m
            count += 1
        s = t.others[s].following
    for k in range(t.ways[w].into_at, t.ways[w].into_end):
        s = t.lanes[t.lane_lists[k]].first
        while s != NOBODY:
            taken_m += t.others[s].length_m
            count += 1
            s = t.others[s].following
    if count == robots:
        return math.inf
    for n in range(at, at + robots):
        taken_m += t.vehicles[t.lists[n]].length_m
    left_m = t.ways[w].end_m - t.ways[w].begin_m - taken_m - _GAP_M * count
    return float(max(0.0, math.floor(left_m / (length_m + _GAP_M))))


@inner
def mark(s: int, t: Tables) -> bool:
    """Mark a vehicle; return whether it was not marked since the marks were last renewed."""
    fresh = t.others[s].marked != t.run[0].marks
    t.others[s].marked = t.run[0].marks
    return bool(fresh)


@inner
def way_of(i: int, leg: int, t: Tables) -> int:
    """Return where leg `leg` of the way of gated vehicle `i` is among the ways."""
    return int(t.way_at[t.vehicles[i].loop] + leg % t.vehicles[i].legs)
