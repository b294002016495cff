"""Credits: room that a long vehicle keeps ahead, so that it takes one slot like any other vehicle.

Where vehicles differ in length, a place has slots as long as most of its visitors need. A vehicle that needs
more keeps its extra metres free in each place ahead on its path that lies in a circle of ways
(`loopgate.control.circles`), from when it comes until its rear has left the place for the last time; in other
places while it is there. A place with so many metres kept has

    max(least, floor((room - kept) / slot))

slots, `least` being as many as the longest visitors would fill. So all vehicles that have a slot in a place
fit, whoever they are. Where not even two of the longest fit, so many metres may be kept at most that two
slots are left. The slots only become fewer when a long vehicle comes, and `may_enter` allows that only where
no circle of full places arises (`docs/proofs/roads.md`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Final

from loopgate.control.chain import circle_from, closes_by_entering, closes_by_turning
from loopgate.control.places import Leg, Place, Vehicle

_FOR_EVER: Final = 1 << 30
"""How often a vehicle on a loop comes to a place."""

_ROUNDING_M: Final = 1e-6


def visits(leg: Leg) -> dict[Place, int]:
    """Return how often a path comes to each place from a leg on, the leg's own included."""
    found: dict[Place, int] = {}
    one: Leg | None = leg
    while one is not None:
        found[one.place] = found.get(one.place, 0) + 1
        one = one.after
        if one is leg:
            return dict.fromkeys(found, _FOR_EVER)
    return found


def may_enter(leg: Leg, needed_m: float, held: Mapping[Place, float]) -> bool:
    """Return whether a vehicle may join the line on a leg: with a slot, and no circle of full places closes.

    `needed_m`: its length with its gap [m]. `held`: the places in which its extra metres are kept already.
    """
    return _may_keep(leg, needed_m, held, 1, lambda: closes_by_entering(leg))


def may_turn(vehicle: Vehicle, leg: Leg) -> bool:
    """Return whether a vehicle in a place may change to another path at `leg`, and no circle closes."""
    needed_m = vehicle.make.needed_m
    return _may_keep(leg, needed_m, vehicle.kept, 0, lambda: closes_by_turning(vehicle, leg))


def _may_keep(
    leg: Leg, needed_m: float, held: Mapping[Place, float], more: int, closes: Callable[[], bool]
) -> bool:
    """Return whether a vehicle may keep its extra metres in all places from a leg on that lie in circles.

    All vehicles must keep their slots, and no circle of full places may arise. O(places ahead, and full
    places that they wait for). `held`: the places in which it keeps its extra metres already. `more`: how
    many slots it takes in the place of the leg. `closes`: whether the change closes a circle otherwise.
    """
    before: list[tuple[Place, int]] = []
    for place in visits(leg):
        extra_m = place.extra_m(needed_m)
        if extra_m > 0.0 and place not in held and (place.circled or place is leg.place):
            if place.credit_m + extra_m > place.most_kept_m + _ROUNDING_M:
                _restore(before)
                return False
            before.append((place, place.slots))
            place.slots = place.slots_with(place.credit_m + extra_m)
    fits = len(leg.place.bodies) + more <= leg.place.slots
    for place, _ in before:
        fits = fits and len(place.bodies) <= place.slots
    for place, slots in before:
        if fits and place.slots < slots and len(place.line) >= place.slots:
            fits = not circle_from(place)
    fits = fits and not closes()
    _restore(before)
    return fits


def _restore(before: list[tuple[Place, int]]) -> None:
    for place, slots in before:
        place.slots = slots


def keep(vehicle: Vehicle, changed: Callable[[Place], None]) -> None:
    """Keep the extra metres of a vehicle in all places from its leg on, and no longer elsewhere.

    `changed`: called with each place whose number of slots changes.
    """
    needed_m = vehicle.make.needed_m
    before, vehicle.kept = vehicle.kept, {}
    ahead = visits(vehicle.leg)
    vehicle.credits = {place: times for place, times in ahead.items() if place.extra_m(needed_m) > 0.0}
    for place in vehicle.credits:
        if place.circled or _is_in(vehicle, place):
            vehicle.kept[place] = place.extra_m(needed_m)
            if place not in before:
                _add(place, vehicle.kept[place], changed)
    for place, extra_m in before.items():
        if place not in vehicle.kept:
            _add(place, -extra_m, changed)


def enters(vehicle: Vehicle, place: Place, changed: Callable[[Place], None]) -> None:
    """Keep the extra metres of a vehicle in a place from now on."""
    if place in vehicle.credits and place not in vehicle.kept:
        vehicle.kept[place] = place.extra_m(vehicle.make.needed_m)
        _add(place, vehicle.kept[place], changed)


def _is_in(vehicle: Vehicle, place: Place) -> bool:
    """Return whether a vehicle is in a place, also with its rear only, or parked beside it."""
    return vehicle.leg.place is place or any(body.place is place for body in vehicle.bodies)


def as_if_circled(places: list[Place], vehicles: Iterable[Vehicle], may: Callable[[], bool]) -> bool:
    """Return `may()` as it would be if these places lay in circles; False if they hold too much for that.

    True if there are none. `vehicles`: all that keep extra metres.
    """
    if not places:
        return True
    before = [(place, place.credit_m, place.slots) for place in places]
    there = [vehicle for vehicle in vehicles if vehicle.credits]
    fits = True
    for place in places:
        place.circled = True
        for one in there:
            if place in one.credits and place not in one.kept:
                place.credit_m += place.extra_m(one.make.needed_m)
        place.slots = place.slots_with(place.credit_m)
        fits = fits and len(place.bodies) <= place.slots
        fits = fits and place.credit_m <= place.most_kept_m + _ROUNDING_M
    for place in places:
        if fits and len(place.line) >= place.slots:
            fits = not circle_from(place)
    fits = fits and may()
    for place, credit_m, slots in before:
        place.circled, place.credit_m, place.slots = False, credit_m, slots
    return fits


def count_in(place: Place, vehicles: Iterable[Vehicle], changed: Callable[[Place], None]) -> None:
    """Note that a place lies in a circle from now on: all vehicles on their way there keep their metres."""
    place.circled = True
    for vehicle in vehicles:
        enters(vehicle, place, changed)
    recount(place, changed)


def count_out(place: Place, vehicles: Iterable[Vehicle], changed: Callable[[Place], None]) -> None:
    """Note that a place lies in no circle any more: only vehicles that are there keep their metres."""
    place.circled = False
    for vehicle in vehicles:
        if place in vehicle.kept and not _is_in(vehicle, place):
            _add(place, -vehicle.kept.pop(place), changed)
    recount(place, changed)


def recount(place: Place, changed: Callable[[Place], None]) -> None:
    """Set the number of slots of a place again."""
    _add(place, 0.0, changed)


def reserve(leg: Leg, needed_m: float, changed: Callable[[Place], None]) -> dict[Place, float]:
    """Keep the extra metres of a vehicle that is about to come; return them by place [m].

    `needed_m`: its length with its gap [m].
    """
    found = {
        place: place.extra_m(needed_m)
        for place in visits(leg)
        if place.extra_m(needed_m) > 0.0 and (place.circled or place is leg.place)
    }
    for place, extra_m in found.items():
        _add(place, extra_m, changed)
    return found


def collect(
    leg: Leg, needed_m: float, held: dict[Place, float], changed: Callable[[Place], None]
) -> list[Place]:
    """Keep the extra metres of a vehicle that waits to come in the places ahead where that can be done now.

    Add these places to `held`, and return those in which there are too many vehicles for that. So a vehicle
    that waits for many places need not find all of them free at once. One vehicle at a time may do so: two
    could wait for each other.
    """
    crammed: list[Place] = []
    for place in visits(leg):
        extra_m = place.extra_m(needed_m)
        if extra_m <= 0.0 or place in held or not (place.circled or place is leg.place):
            continue
        before, place.slots = place.slots, place.slots_with(place.credit_m + extra_m)
        fits = len(place.bodies) <= place.slots
        if not fits:
            crammed.append(place)
        fits = fits and place.credit_m + extra_m <= place.most_kept_m + _ROUNDING_M
        if fits and len(place.line) >= place.slots:
            fits = place.slots == before or not circle_from(place)
        place.slots = before
        if fits:
            held[place] = extra_m
            _add(place, extra_m, changed)
    return crammed


def release(reserved: dict[Place, float], changed: Callable[[Place], None]) -> None:
    """Undo `reserve` or `collect`."""
    for place, extra_m in reserved.items():
        _add(place, -extra_m, changed)


def left(vehicle: Vehicle, place: Place, changed: Callable[[Place], None]) -> None:
    """Keep no metres any more in a place that a rear has left, if the vehicle does not come there again.

    Where it does, it keeps them only if the place lies in a circle.
    """
    times = vehicle.credits.get(place, 0)
    if times == 1:
        del vehicle.credits[place]
    elif 1 < times < _FOR_EVER:
        vehicle.credits[place] = times - 1
    if place in vehicle.kept and (times == 1 or not (place.circled or _is_in(vehicle, place))):
        _add(place, -vehicle.kept.pop(place), changed)


def give_up(vehicle: Vehicle, changed: Callable[[Place], None]) -> None:
    """Keep no metres any more for a vehicle that goes."""
    for place, extra_m in vehicle.kept.items():
        _add(place, -extra_m, changed)
    vehicle.credits, vehicle.kept = {}, {}


def _add(place: Place, extra_m: float, changed: Callable[[Place], None]) -> None:
    place.credit_m += extra_m
    slots = place.slots_with(place.credit_m)
    if slots != place.slots or extra_m < 0.0:
        place.slots = slots
        changed(place)
