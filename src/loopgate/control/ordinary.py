"""The rule `traffic`: it refuses a vehicle while ordinary vehicles are in its way or leave it no space.

The rule refuses a vehicle while an ordinary vehicle

- stands or drives ahead of it on its lane;
- is, with some part, on a lane inside the junction, or inside one beside it, that crosses its path;
- stands or creeps on a lane that joins its path there, or between the junctions of its crossing: one that
  drives on is followed, as SUMO's drivers do (`Lookout.is_blocked`);
- comes over the junction where nothing keeps the two apart, too late to pass before the vehicle and too soon
  to let it pass (`loopgate.simulation.surroundings.crossing_ways` finds these approaches);
- takes the last space in the next place, or is about to drive into it;
- would find no space in a circle of places that the vehicle wants to enter (`loopgate.control.slack`).

The rule looks at ordinary vehicles anew in each step, for each request. A granted vehicle gives way to an
ordinary vehicle that comes later: before the junction (`loopgate.control.courtesy`), and by SUMO's right of
way.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Final

from loopgate.control.places import STANDING_MPS, Vehicle, braking_m, time_s
from loopgate.control.refusal import Refusal, Rule
from loopgate.control.roads import BEYOND_M, Coming, Lookout, Other, RoadEdge
from loopgate.control.sight import HORIZON_S, Sight
from loopgate.control.slack import Slack, fit_beside

_REACTION_S: Final = 1.0
"""Reaction time of drivers [s]: SUMO's default."""

_SETS_OUT_S: Final = 5.0
"""A vehicle that has stood longer than this at its stop line, though it may drive, has
another cause to wait [s]."""

_PASSED_S: Final = 2.0
"""An ordinary vehicle with the right of way passes the junction within this time of getting there [s]."""

_APART_S: Final = 1.0
"""A gated vehicle is past at least this long before a vehicle with the right of way gets there [s]."""

_AT_LINE_M: Final = 30.0
"""A vehicle that stands within this distance of a junction is at its stop line or in the queue behind it [m].
"""

_REACTS_S: Final = 1.0
"""Reaction time of SUMO's drivers before they brake [s]."""


_TRAFFIC: Final = Refusal("traffic")


def traffic(sight: Sight, slack: Slack) -> Rule:
    """Return the rule that refuses a vehicle while ordinary vehicles are in its way or leave no space.

    `slack`: finds the moves that would leave too little space in a circle of places.
    """

    def gives_way(vehicle: Vehicle, now_s: float) -> Refusal | None:
        if not sight.others:
            return None
        wanted = vehicle.wanted()
        if wanted is not None and is_too_full(vehicle):
            return Refusal("traffic", [wanted], outside=True)
        if _meets(vehicle, now_s):
            return _TRAFFIC
        tight = slack.too_tight(vehicle)
        return Refusal("traffic", tight, outside=True) if tight else None

    return gives_way


def is_too_full(vehicle: Vehicle) -> bool:
    """Return whether ordinary vehicles leave no space in the place that a vehicle wants next."""
    after = vehicle.leg.after
    if after is None or after.stretch is None:
        return False
    return fit_beside(after.stretch, after.place.bodies, vehicle.make.length_m) < 1.0


def _meets(vehicle: Vehicle, now_s: float) -> bool:
    """Return whether an ordinary vehicle is ahead of a vehicle, on its crossing, or comes to it."""
    here = vehicle.leg.stretch
    if here is None:
        return False
    left_m = vehicle.line_m - vehicle.front_m
    for other in here.lane.fronts:
        if here.end_m - left_m < other.position_m <= here.end_m + BEYOND_M:
            return True
    passes = vehicle.leg.passes
    for over in passes:
        if over.lookout is not None and over.lookout.is_blocked():
            return True
    for lane in here.between:
        if lane.is_blocked(inf):
            return True
    for over in passes:
        lookout = over.lookout
        if lookout is not None and comes(vehicle, lookout, left_m + lookout.from_m, now_s):
            return True
    return False


def comes(vehicle: Vehicle, lookout: Lookout, left_m: float, now_s: float) -> bool:
    """Return whether an ordinary vehicle would meet a vehicle that is `left_m` before a movement."""
    there_s = over_s = -1.0
    for approach in lookout.approaches:
        if not approach.turn.coming or not approach.is_open(now_s):
            continue
        if over_s < 0.0:
            there_s, over_s = _reaches_s(vehicle, lookout, left_m), _is_over_s(vehicle, lookout, left_m)
        for coming in approach.turn.coming:
            other = coming.other
            before_m = coming.to_m - other.position_m
            if other.speed <= STANDING_MPS:
                if _may_set_out(coming) and _first_s(coming, before_m) < over_s and _sets_out(other, now_s):
                    return True
            elif before_m / other.speed > there_s - _PASSED_S:
                first_s = _first_s(coming, before_m)
                if first_s < over_s and first_s <= HORIZON_S:
                    return True
    return False


def is_late(lookout: Lookout, now_s: float) -> bool:
    """Return whether an ordinary vehicle comes to a movement and cannot stop any more."""
    for approach in lookout.approaches:
        if not approach.turn.coming or not approach.is_open(now_s):
            continue
        for coming in approach.turn.coming:
            other = coming.other
            if other.speed <= STANDING_MPS:
                continue
            before_m = coming.to_m - other.position_m
            stops_m = _REACTS_S * other.speed + other.speed * other.speed / (2.0 * other.decel)
            if before_m < stops_m and _first_s(coming, before_m) <= HORIZON_S:
                return True
    return False


def _may_set_out(coming: Coming) -> bool:
    """Return whether a vehicle that stands is near the junction; farther off it may wait for anything."""
    return coming.first and coming.to_m - coming.other.position_m <= _AT_LINE_M


def _first_s(coming: Coming, before_m: float) -> float:
    """Return after which time an ordinary vehicle is at the turn at the earliest [s]."""
    other = coming.other
    return time_s(before_m, other.speed, other.accel, max(other.speed, coming.limit))


def _sets_out(other: Other, now_s: float) -> bool:
    """Return whether a vehicle that stands at its stop line, and may drive, is about to set out."""
    if now_s - other.seen_s > _SETS_OUT_S:
        other.stood_s = now_s
    other.seen_s = now_s
    return now_s - other.stood_s < _SETS_OUT_S


def _reaches_s(vehicle: Vehicle, lookout: Lookout, left_m: float) -> float:
    make = vehicle.make
    return time_s(left_m, vehicle.speed, make.accel, min(make.top, lookout.speed))


def _is_over_s(vehicle: Vehicle, lookout: Lookout, left_m: float) -> float:
    """Return after which time a vehicle is past a movement, with time to spare [s]."""
    make, wait_m = vehicle.make, lookout.wait_m
    top = min(make.top, lookout.speed)
    over_s = time_s(left_m + wait_m, vehicle.speed, make.accel, top) + _APART_S
    going = 0.0  # the speed behind the point where it may have to wait
    if wait_m == 0.0:
        going = min(top, sqrt(vehicle.speed * vehicle.speed + 2.0 * make.accel * max(0.0, left_m)))
    return over_s + time_s(lookout.length_m - wait_m + make.length_m, going, make.accel, top)


def lets_return(vehicle: Vehicle, step_s: float) -> bool:
    """Return whether ordinary vehicles leave the gap that a parked vehicle needs, and can brake behind it.

    SUMO does not ask the vehicles behind, and the gated vehicle would drive in front of them.
    """
    here = vehicle.leg.stretch
    if here is None:
        return True
    front_m = here.end_m - vehicle.left_m()
    rear_m = front_m - vehicle.make.length_m
    for other in here.lane.fronts:
        if other.position_m < rear_m:
            if rear_m - other.position_m < _brakes_behind_m(other, vehicle, step_s):
                return False
        elif other.position_m - other.length_m < front_m + vehicle.make.gap_m:
            return False
    for rear in here.lane.rears:
        if rear_m < rear.rear_m < front_m + vehicle.make.gap_m:
            return False
    for other in here.lane.edge.coming:
        if _way_to_m(other, here.lane.edge) + rear_m < _brakes_behind_m(other, vehicle, step_s):
            return False
    return True


def _way_to_m(other: Other, edge: RoadEdge) -> float:
    """Return how far an ordinary vehicle drives until it comes to an edge of its route [m]."""
    lane = other.lane
    if lane is None or other.parks:
        return inf
    way_m = lane.length_m - other.position_m
    for number in range(other.at, len(other.edges) - 1):
        turn = other.turns[number]
        if turn is not None and not (lane.inside and number == other.at):
            way_m += turn.through_m
        if other.edges[number + 1] is edge:
            return way_m
        way_m += other.edges[number + 1].length_m
    return inf


def _brakes_behind_m(other: Other, vehicle: Vehicle, step_s: float) -> float:
    """Return the gap that an ordinary vehicle needs to brake for a vehicle that returns ahead of it [m]."""
    fast = other.speed + other.accel * step_s
    drives_s = 2.0 * step_s + _REACTION_S  # it was seen a step ago
    return vehicle.make.gap_m + fast * drives_s + braking_m(fast, other.decel, step_s)
