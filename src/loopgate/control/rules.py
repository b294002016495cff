"""Rules: each a function that says why a vehicle may not go on now, or nothing.

A rule takes a vehicle that heads its line, and the time [s]. It changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf
from typing import Final

from loopgate.control.chain import full_after
from loopgate.control.crossings import in_the_way
from loopgate.control.keeping import kept
from loopgate.control.leading import withheld
from loopgate.control.places import Place, Vehicle
from loopgate.control.refusal import Refusal, Rule

PATIENCE_S: Final = 100.0
"""The longest wait for the reserve by default [s]."""


def room(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse where the place that the vehicle wants has no slot free."""
    wanted = vehicle.wanted()
    if wanted is None or not (wanted.is_full() or wanted.shut):
        return None
    return Refusal("occupied", [wanted])


def stop(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse before a stop of the vehicle's own, and behind vehicles that stop so early that none fits."""
    if vehicle.stops_here():
        return Refusal("stop", passed=vehicle, passed_m=vehicle.stop_m)
    wanted = vehicle.wanted()
    if wanted is None:
        return None
    for ahead, other in enumerate(reversed(wanted.line)):
        if not other.stops_here():
            continue
        leg = other.leg
        space_m = other.stop_m - other.line_m + leg.end_m - leg.begin_m
        # One that leaves its lane would be passed, and would no longer be first when it comes back.
        if other.parks or (ahead + 2) * leg.slot_m > space_m:
            return Refusal("stop", [wanted], outside=True)
    return None


def crossing(vehicle: Vehicle, now_s: float) -> Refusal | None:
    """Refuse where a vehicle under way on the crossing is in the way."""
    other = in_the_way(vehicle, now_s)
    if other is None:
        return None
    if other.until_m == -inf:
        return Refusal("crossing")
    return Refusal("crossing", passed=other.vehicle, passed_m=other.until_m)


class Reserve:
    """The rule of `loopgate.negotiation.pressure`: leave room in crowded places, for a while.

    A place is `crowded` from this share of its slots on; never, if that is infinite. `patience_s`: the
    longest wait, from an empty place into a full one [s].
    """

    def __init__(self, crowded: float = inf, patience_s: float = PATIENCE_S) -> None:
        self.crowded, self.patience_s = crowded, patience_s

    def room_for(self, vehicles: int, places: Iterable[Place]) -> None:
        """Let as much be left as so many vehicles leave free in all places that they come to."""
        slots = sum(place.slots for place in places)
        self.crowded = max(0.0, 1.0 - vehicles / slots) if slots else inf

    def leaves_room(self, vehicle: Vehicle, now_s: float) -> Refusal | None:
        """Refuse a crowded place that is fuller than the vehicle's own."""
        wanted, here = vehicle.wanted(), vehicle.leg.place
        if wanted is None or len(wanted.bodies) < self.crowded * wanted.slots:
            return None
        fuller = len(wanted.bodies) / wanted.slots - len(here.bodies) / here.slots
        until_s = vehicle.since_s + self.patience_s * fuller
        return Refusal("reserve", [wanted], until_s) if now_s <= until_s else None


def chain(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse a move that would close a circle of full places, or lead into one that is there."""
    after = full_after(vehicle)
    return Refusal("deadlock", after.places) if after.circle() else None


def usual(
    reserve: Reserve | None = None, outside: Sequence[Rule] = (), last: Sequence[Rule] = (chain,)
) -> list[Rule]:
    """Return the rules in the order in which they are asked.

    `reserve`: none by default. `outside`: about what comes from outside, as `loopgate.control.lights.light`.
    `last`: what decides where all others let a vehicle go.
    """
    leaves_room = [] if reserve is None else [reserve.leaves_room]
    return [stop, room, kept, crossing, *outside, withheld, *leaves_room, *last]
