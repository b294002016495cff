"""The rules: each is a function that returns why a vehicle may not go on now, or None.

A rule takes a vehicle that is first in its line, and the time [s]. It changes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final

from loopgate.control.crossings import in_the_way
from loopgate.control.keeping import kept
from loopgate.control.lights import light
from loopgate.control.places import Vehicle
from loopgate.control.refusal import Refusal, Rule


def stop(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse a vehicle with a stop of its own before its stop line."""
    if vehicle.stops_here():
        return Refusal("stop", passed=vehicle, passed_m=vehicle.stop_m)
    return None


def room(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse a vehicle whose next place has no free slot, or no space behind a vehicle that stops there."""
    wanted = vehicle.wanted()
    if wanted is None:
        return None
    if wanted.closed:
        return Refusal(wanted.closed, [wanted], cause=wanted.cause)
    if wanted.shut or not vehicle.finds_room(wanted):
        # A vehicle that leaves may surely do so from the next step on.
        return Refusal("occupied", [wanted], outside=len(wanted.bodies) > len(wanted.line))
    for ahead, other in enumerate(reversed(wanted.line)):
        if other.stop_m >= other.line_m:
            continue  # as `stops_here`, written out since it is asked for each vehicle in the line
        leg = other.leg
        space_m = other.stop_m - other.line_m + leg.end_m - leg.begin_m
        # A vehicle that parks would be passed, and would not be first in line when it returns.
        if other.parks or (ahead + 2) * leg.slot_m > space_m:
            return Refusal("stop", [wanted], outside=True)
    return None


_CROSSING: Final = Refusal("crossing")


def crossing(vehicle: Vehicle, now_s: float) -> Refusal | None:
    """Refuse a vehicle while another has a grant for a conflicting movement and may be in its way."""
    other = in_the_way(vehicle, now_s)
    if other is None:
        return None
    if other.vehicle.stands:
        return Refusal("blocked", cause=other.vehicle.stands)
    if other.until_m == -inf:
        return _CROSSING
    return Refusal("crossing", passed=other.vehicle, passed_m=other.until_m)


def withheld(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse a vehicle that gets no grants for now, for the reason in `Vehicle.withheld`."""
    return Refusal(vehicle.withheld, outside=True) if vehicle.withheld else None


def sensed() -> list[Rule]:
    """Return the rules of vehicles that decide by messages: what each senses by itself.

    These are its own stops, its light, and the vehicles that it sees on its crossing. Whether the next place
    has a slot only its post knows.
    """
    return [stop, light, crossing, withheld]


def usual(outside: Sequence[Rule] = (), *, lit: bool = True) -> list[Rule]:
    """Return the rules in the order in which they are asked.

    `outside`: the rules about spacing and ordinary traffic. `lit`: whether vehicles obey lights.

    A light is asked before room and crossing. A vehicle at red is refused for the light then: it is not
    passed over by the vehicles at green, and `Keeping` keeps nothing for it at their cost.
    """
    lights = [light] if lit else []
    return [stop, *lights, room, kept, crossing, *outside, withheld]
