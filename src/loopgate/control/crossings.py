"""Decides whether vehicles with a grant over a crossing are still in the way of a vehicle that asks.

Two movements that conflict share a stretch. The other vehicle is in the way until one of these holds:

- Its rear is past the stretch.
- Its front is on the stretch, and its rear will be past before the front of the vehicle that asks can get
  there (`_relation`). Nothing holds the other vehicle there: it has room beyond, behind the vehicle ahead,
  and SUMO lets no vehicle go first that has another vehicle in its way.
- It will be past the stretch before the vehicle that asks comes into the junction (`_passes_first`). Until
  then SUMO finds neither in the way of the other. It must have passed all lights before the stretch.
- It stands at a red light before the stretch, and has lent the rest of its crossing (`Lending`). The vehicle
  that asks must neither come behind it nor go to the same place.
- The vehicle that asks will be past the stretch with its rear before the other vehicle can be there
  (`_comes_later`). It must not have to wait for a light, or for another vehicle, also not for one that has
  yet to leave its next place. The other vehicle must not go to the same place, since it is in the line there
  already.

For the vehicle that must be past first, the rule assumes a weak start and slow driving. For the vehicle that
comes, it assumes the highest speed that limits and driver allow. The vehicle ahead in a place is assumed to
stand. Lights inside the crossing count too: a granted vehicle may stop at a light that does not surely stay
open until it is past (`_room_to_light_m`), and a vehicle that asks comes no sooner than its light opens
(`_own_red_s`).

Each vehicle's own length, acceleration, top speed and speed factor decide (`Make`). A vehicle that is led to
a lane is assumed to stop where it is led (`Vehicle.guide_m`): only there does it change lanes. The rule
predicts nothing of a vehicle that follows another model than SUMO's cars, or that may have to wait on the
junction: for an earlier grant in its way, behind a vehicle that left the same lane in another direction, for
persons who cross, or for an ordinary vehicle that comes (`GrantedPass.quiet`).
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Final

from loopgate.control.lamps import OPEN, RED
from loopgate.control.lights import passes_lights
from loopgate.control.places import (
    Body,
    Foe,
    GrantedPass,
    Leg,
    Pass,
    Vehicle,
    braking_time_s,
    shared_by,
    time_s,
)

PAST: Final = 0
BEFORE: Final = 1
LATER: Final = 2
IN_THE_WAY: Final = 3

_BEYOND_M: Final = 0.5
_APART_S: Final = 0.5
_REACTS_S: Final = 1.0
"""A driver slows down so much sooner for a lower limit than it must [s]."""

_AHEAD_S: Final = 2.0
_GAP_M: Final = 2.5
_NEXT: Final = 1 << 60
"""Stands for the number of a grant yet to come."""


class Hindrance:
    """A vehicle in the way. It stays in the way at least until its front is at arc length `until_m` [m].

    `until_m` is minus infinity if nothing is known.
    """

    __slots__ = ("until_m", "vehicle")

    def __init__(self, vehicle: Vehicle, until_m: float) -> None:
        self.vehicle: Final = vehicle
        self.until_m: Final = until_m


def in_the_way(vehicle: Vehicle, now_s: float) -> Hindrance | None:  # noqa: C901, PLR0912  in turn
    """Return the vehicle that keeps a vehicle from crossing now; None if there is none."""
    order, length_m = PAST, vehicle.make.length_m
    behind: bool | None = None
    for over in vehicle.leg.passes:
        if not over.movement.junction.trips:
            continue
        foes = over.foes
        for trip in over.movement.junction.trips:
            other = trip.vehicle
            other_m = other.make.length_m
            foe = shared_by(foes.get(trip.over.movement), length_m, other_m)
            shared = shared_by(trip.over.foes.get(over.movement), other_m, length_m)
            # Without a shared stretch the two touch nowhere, or the other vehicle has come by this movement
            # and is followed.
            if foe is None or shared is None or other is vehicle or not trip.seen:
                continue
            if trip.lent and not other.claims and trip.into.place is not vehicle.wanted():
                behind = comes_behind(vehicle, vehicle.leg) if behind is None else behind
                if not behind:
                    continue
            if other.stops_here():
                return Hindrance(other, -inf)
            if shared.to_m == inf or foe.to_m == inf:  # noqa: PLR1714  a tuple costs three times this
                return Hindrance(other, trip.clear_m)
            inside_m = other.front_m - trip.line_m
            left_m = shared.to_m + other_m + _BEYOND_M - inside_m
            if left_m < 0.0:
                continue
            if shared.from_m - shared.to_m > other_m or foe.from_m - foe.to_m > length_m:
                continue  # one of the two is too short to touch the stretch that they share
            relation = _relation(vehicle, foe, trip, shared, now_s)
            if relation == IN_THE_WAY and _passes_first(vehicle, over, foe, trip, shared, now_s):
                relation = BEFORE
            if relation == IN_THE_WAY and _comes_later(vehicle, over, foe, trip, shared, now_s):
                relation = LATER
            if relation == IN_THE_WAY and not (other.make.foreseen or vehicle.make.foreseen):
                # It is in the way until its rear is past the stretch, whatever the two vehicles do.
                past_m = trip.line_m + shared.to_m + other_m + _BEYOND_M
                return Hindrance(other, min(past_m, trip.clear_m))
            if relation == IN_THE_WAY or order not in (PAST, relation):
                return Hindrance(other, -inf)  # both vehicles' speeds decide, in each step
            order = relation
    return None


def _relation(vehicle: Vehicle, foe: Foe, trip: GrantedPass, shared: Foe, now_s: float) -> int:
    """Return whether another vehicle that is not past the stretch is before a vehicle, or in its way."""
    other = trip.vehicle
    inside_m = other.front_m - trip.line_m
    if not other.make.foreseen or not trip.quiet or inside_m < max(_BEYOND_M, shared.from_m) or other.lends:
        return IN_THE_WAY
    make = vehicle.make
    slow = other.make.surely(_limit(trip, shared.to_m + other.make.length_m))
    left_m = shared.to_m + other.make.length_m + _BEYOND_M - inside_m
    reach_m = vehicle.line_m - vehicle.front_m + foe.from_m
    reached_s = time_s(reach_m, vehicle.speed, make.accel, make.top) - _APART_S
    if vehicle.leg.inner:
        reached_s = max(reached_s, _own_red_s(vehicle, foe.from_m, now_s))
    if time_s(left_m, other.speed, other.make.sure_accel, slow) > reached_s or _may_be_held(trip, inside_m):
        return IN_THE_WAY
    room_m = _room_m(other, trip.into)
    if inside_m < trip.over.wait_m:
        room_m = min(room_m, trip.over.wait_m - inside_m)
    if trip.leg.inner:
        room_m = min(room_m, _room_to_light_m(trip, inside_m, slow, now_s))
    return BEFORE if braking_time_s(left_m, room_m, slow, other.make.decel) <= reached_s else IN_THE_WAY


def _passes_first(
    vehicle: Vehicle, over: Pass, foe: Foe, trip: GrantedPass, shared: Foe, now_s: float
) -> bool:
    """Return whether another vehicle is past the stretch before a vehicle comes into its junction."""
    other, make, theirs = trip.vehicle, vehicle.make, trip.over
    if not other.make.foreseen or not trip.quiet or other.lends:
        return False
    inside_m = other.front_m - trip.line_m
    for lit in trip.leg.passes:
        if lit.signal is not None and lit.ahead_m >= inside_m:
            return False
        if lit is theirs:
            break
    enters_m = min(over.ahead_m, foe.from_m)
    soonest_s = foe.soonest_s - (foe.from_m - enters_m) / foe.least
    to_go_m = vehicle.line_m - vehicle.front_m + enters_m
    reached_s = max(soonest_s / make.haste, time_s(to_go_m, vehicle.speed, make.accel, make.top))
    if vehicle.leg.inner:
        reached_s = max(reached_s, _own_red_s(vehicle, enters_m, now_s))
    left_m = shared.to_m + other.make.length_m + _BEYOND_M - inside_m
    slow = other.make.surely(min(_limit(trip, shared.to_m + other.make.length_m), shared.least))
    passed_s = time_s(left_m, other.speed, other.make.weak_accel, slow)
    if passed_s + _AHEAD_S > reached_s:
        return False
    room_m = _room_m(other, trip.into)
    if inside_m < theirs.wait_m and theirs.wait_m > theirs.ahead_m + _BEYOND_M:
        room_m = min(room_m, theirs.wait_m - inside_m)
    if trip.leg.inner:
        room_m = min(room_m, _room_to_light_m(trip, inside_m, slow, now_s))
    passed_s = braking_time_s(left_m, room_m, slow, other.make.decel)
    return passed_s + _AHEAD_S <= reached_s and not _may_be_held(trip, inside_m)


def _comes_later(
    vehicle: Vehicle, over: Pass, foe: Foe, trip: GrantedPass, shared: Foe, now_s: float
) -> bool:
    """Return whether a vehicle that goes now is surely past the stretch before the other gets there."""
    other = trip.vehicle
    inside_m = other.front_m - trip.line_m
    to_go_m = shared.from_m - inside_m
    joins = trip.into.place is vehicle.wanted()  # it is in the line there already, so it must come first
    if joins or _may_be_slow(vehicle) or to_go_m <= _BEYOND_M:
        return False
    if vehicle.leg.stretch is not None and not vehicle.leg.is_quiet(now_s):
        return False
    if not passes_lights(vehicle, now_s) or _follows_aside(vehicle.leg.passes[0], vehicle, _NEXT):
        return False
    for own in vehicle.leg.passes:
        if own.walked:
            return False
    comes_s = max(
        (shared.soonest_s - max(0.0, inside_m) / shared.least) / other.make.haste,
        time_s(to_go_m, other.speed, other.make.accel, other.make.top),
    )
    make = vehicle.make
    to_m = max(0.0, foe.to_m + vehicle.line_m - vehicle.front_m)
    slow = make.surely(foe.mean)
    rear_s = (make.length_m + _BEYOND_M) / make.surely(over.speed)
    if time_s(to_m, vehicle.speed, make.weak_accel, slow) + rear_s + _AHEAD_S > comes_s:
        return False
    room_m = min(_room_ahead_m(vehicle), vehicle.line_m + vehicle.leg.guide_m - vehicle.front_m)
    room_m -= make.length_m + _BEYOND_M
    return braking_time_s(to_m, room_m, slow, make.decel) + rear_s + _AHEAD_S <= comes_s


def _may_be_slow(vehicle: Vehicle) -> bool:
    """Return whether a vehicle may take any time: also if others must leave its next place first."""
    wanted = vehicle.wanted()
    return vehicle.steered or not vehicle.make.foreseen or (wanted is not None and wanted.is_full())


def _own_red_s(vehicle: Vehicle, until_m: float, now_s: float) -> float:
    """Return for how long a red light inside surely keeps a vehicle that goes now from a position [s].

    `until_m`: the position, from its stop line [m]. The result is 0 if no light does. A vehicle may pass the
    light at the line without heeding any, so it must be able to stop from there.
    """
    make = vehicle.make
    to_line_m = max(0.0, vehicle.line_m - vehicle.front_m)
    fast = min(make.top, sqrt(vehicle.speed * vehicle.speed + 2.0 * make.accel * to_line_m))
    stops_m = 2.0 * fast + fast * fast / (2.0 * make.decel)
    for over in vehicle.leg.inner:
        signal = over.signal
        if signal is not None and stops_m <= over.ahead_m <= until_m:
            red_s = signal.stays_s(RED, now_s)
            if red_s > 0.0:
                return red_s + (until_m - over.ahead_m) / make.top
    return 0.0


def _room_to_light_m(trip: GrantedPass, inside_m: float, slow: float, now_s: float) -> float:
    """Return how far a granted vehicle can go to the next light that may stop it [m].

    `slow`: the speed that it surely keeps [m/s].
    """
    other = trip.vehicle
    for own in other.trips:
        signal, ahead_m = own.over.signal, own.over.ahead_m - inside_m
        if own.leg is not trip.leg or own.lit or signal is None or ahead_m < 0.0:
            continue
        slow_s = time_s(ahead_m, other.speed, other.make.sure_accel, slow) + _APART_S
        fast_s = time_s(ahead_m, other.speed, other.make.accel, other.make.top)
        fixed = signal.lamp.program.fixed  # it may be red now, and surely open when the vehicle gets there
        open_s = slow_s if fixed and signal.opens_s(now_s, fast_s, slow_s) == fast_s else 0.0
        if max(open_s, signal.stays_s(OPEN, now_s)) < slow_s:
            return ahead_m
    return inf


def _limit(trip: GrantedPass, past_m: float) -> float:
    """Return the lowest limit that a vehicle heeds until its front is at `past_m` from its stop line [m/s].

    It brakes early for a lower limit on the next movement of the same crossing.
    """
    limit, decel = trip.over.speed, trip.vehicle.make.decel
    for later in trip.leg.passes:
        if later.ahead_m > trip.over.ahead_m and later.speed < limit:
            brakes_m = (limit * limit - later.speed * later.speed) / (2.0 * decel)
            if later.ahead_m - past_m < brakes_m + limit * _REACTS_S:
                limit = later.speed
    return limit


def _may_be_held(trip: GrantedPass, inside_m: float) -> bool:
    """Return whether SUMO may make a granted vehicle wait before or on the junction.

    `inside_m`: how far its front is beyond its stop line [m].
    """
    ahead, length_m = trip.vehicle, trip.vehicle.make.length_m
    if inside_m < trip.over.ahead_m + _BEYOND_M and _room_m(ahead, trip.into) < trip.clear_m - ahead.front_m:
        return True  # if the vehicle ahead stands, this one cannot clear the junction, and SUMO keeps it out
    for over in trip.leg.passes:
        if over.walked:
            return True
        for first in over.movement.junction.trips:
            first_m = first.vehicle.make.length_m
            foe = shared_by(over.foes.get(first.over.movement), length_m, first_m)
            if foe is None or first.vehicle is ahead or not first.seen:
                continue
            if first.lent and not _follows(trip.leg, first.vehicle):
                continue
            if first.number < trip.number or inside_m < foe.from_m:
                shared = shared_by(first.over.foes.get(over.movement), first_m, length_m)
                past_m = first.vehicle.front_m - first_m - _BEYOND_M - first.line_m
                if shared is not None and past_m < shared.to_m:
                    return True
    return _follows_aside(trip.leg.passes[0], ahead, trip.number)


def is_unsettled(trip: GrantedPass, *, lent: bool = False) -> bool:
    """Return whether a vehicle and another with a grant have yet to pass a stretch that they share.

    `trip`: over one of the first vehicle's movements. `lent`: whether what others have lent counts.
    """
    vehicle, over = trip.vehicle, trip.over
    mine_m, inside_m = vehicle.make.length_m, vehicle.front_m - trip.line_m
    for other in over.movement.junction.trips:
        if other.vehicle is vehicle or (other.lent and not lent):
            continue
        theirs_m = other.vehicle.make.length_m
        own = shared_by(over.foes.get(other.over.movement), mine_m, theirs_m)
        theirs = shared_by(other.over.foes.get(over.movement), theirs_m, mine_m)
        if own is None or theirs is None or own.to_m + mine_m + _BEYOND_M < inside_m:
            continue
        if other.vehicle.front_m - other.line_m <= theirs.to_m + theirs_m + _BEYOND_M:
            return True
    return False


def comes_behind(vehicle: Vehicle, leg: Leg) -> bool:
    """Return whether a vehicle would come behind one that lends, after a leg; others may be between."""
    for over in leg.passes:
        for trip in over.movement.junction.trips:
            other = trip.vehicle
            if (other.lends or other.behind) and other is not vehicle and _follows(leg, other):
                return True
    return False


def _follows(leg: Leg, other: Vehicle) -> bool:
    """Return whether a vehicle comes behind another, after a leg.

    It does if its crossing leads over a lane that the other vehicle is on or has yet to pass, or over the
    lane before that: SUMO's drivers keep their gap to a vehicle that has just parted. What the other has lent
    does not count.
    """
    rear_m = other.front_m - other.make.length_m
    before: GrantedPass | None = None
    for trip in other.trips:
        if before is not None and rear_m <= trip.light_m + _GAP_M and _leads_over(leg, before):
            return True
        before = trip
        if trip.lent:
            break
    return before is not None and _leads_over(leg, before)


def _leads_over(leg: Leg, trip: GrantedPass) -> bool:
    """Return whether the crossing after a leg leads over the lane before a movement."""
    lane = trip.over.movement.lane
    for over in leg.passes:  # noqa: SIM110  as in `Leg.is_quiet`
        if over.movement.lane == lane:
            return True
    return False


def _follows_aside(over: Pass, vehicle: Vehicle, number: int) -> bool:
    """Return whether a vehicle with an earlier grant still crosses from the same place another way."""
    beside = over.movement.beside
    if beside:
        for trip in over.movement.junction.trips:  # a generator costs five times this
            if trip.number >= number or not trip.over.first or trip.vehicle is vehicle:
                continue
            if trip.over.movement in beside:
                return True
    return False


def _room_m(vehicle: Vehicle, body: Body) -> float:
    """Return how far a vehicle can go if the vehicle before it in a place of its own stands [m].

    It can go no farther than the stop by which it is led to a lane.
    """
    first: Body | None = None
    for one in body.place.bodies:
        if one is body:
            break
        first = one
    room_m = vehicle.guide_m - vehicle.front_m
    return room_m if first is None else min(room_m, _behind_m(vehicle, first, body.begin_m))


def _room_ahead_m(vehicle: Vehicle) -> float:
    """Return how far a vehicle can go if the last vehicle in the place that it wants stands [m]."""
    after = vehicle.leg.after
    if after is None or not after.place.bodies:
        return inf
    return _behind_m(vehicle, after.place.bodies[-1], vehicle.after_begins_m(after))


def _behind_m(vehicle: Vehicle, first: Body, begin_m: float) -> float:
    before = first.vehicle
    between_m = before.front_m - first.begin_m - vehicle.front_m + begin_m
    return between_m - before.make.length_m - max(_GAP_M, vehicle.make.gap_m)
