"""Rules: each a function that says why a vehicle may not go on now, or nothing.

A rule takes a vehicle that heads its line, and the time [s]. It changes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final

from loopgate.control.chain import full_after
from loopgate.control.crossings import in_the_way
from loopgate.control.keeping import kept
from loopgate.control.places import Vehicle
from loopgate.control.refusal import Refusal, Rule

PATIENCE_S: Final = 100.0
"""The longest wait for the reserve, from an empty place into a full one [s]."""


def room(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse where the place that the vehicle wants has no slot free."""
    wanted = vehicle.wanted()
    if wanted is None or not wanted.is_full():
        return None
    return Refusal("occupied", [wanted])


def crossing(vehicle: Vehicle, now_s: float) -> Refusal | None:
    """Refuse where a vehicle under way on the crossing is in the way."""
    other = in_the_way(vehicle, now_s)
    if other is None:
        return None
    if other.until_m == -inf:
        return Refusal("crossing")
    return Refusal("crossing", passed=other.vehicle, passed_m=other.until_m)


def reserve(crowded: float) -> Rule:
    """Return the rule of `loopgate.negotiation.pressure`: leave room in crowded places, for a while.

    A place is `crowded` from this share of its slots on.
    """

    def leaves_room(vehicle: Vehicle, now_s: float) -> Refusal | None:
        wanted, here = vehicle.wanted(), vehicle.leg.place
        if wanted is None or len(wanted.bodies) < crowded * wanted.slots:
            return None
        fuller = len(wanted.bodies) / wanted.slots - len(here.bodies) / here.slots
        until_s = vehicle.since_s + PATIENCE_S * fuller
        return Refusal("reserve", [wanted], until_s) if now_s <= until_s else None

    return leaves_room


def chain(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse a move that would close a circle of full places, or lead into one that is there."""
    after = full_after(vehicle)
    return Refusal("deadlock", after.places) if after.circle() else None


def usual(crowded: float = inf, outside: Sequence[Rule] = ()) -> list[Rule]:
    """Return the rules in the order in which they are asked.

    `crowded`: as for `reserve`. `outside`: about what comes from outside, as `loopgate.control.lights.light`.
    """
    return [room, kept, crossing, *outside, *([reserve(crowded)] if crowded < inf else []), chain]
