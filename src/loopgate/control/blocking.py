"""Finds the vehicles that a vehicle waits for, to detect deadlocks and to explain why vehicles starve."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from math import inf

from loopgate.control.chain import RoadGate
from loopgate.control.keeping import PASSED_OVER
from loopgate.control.ordinary import is_too_full
from loopgate.control.places import Vehicle
from loopgate.control.roads import BEYOND_M, Other, RoadLane
from loopgate.control.slack import Slack
from loopgate.gates.base import Reason

_NOBODY = frozenset(["", *(str(reason) for reason in Reason if not reason.for_others)])
"""Refusals that no gated vehicle can end by moving on."""

_KNOWN = frozenset(str(reason) for reason in Reason)
"""The reasons of the gates and rules of this package. Another reason is that of a user's own rule."""


def blockers(vehicle: Vehicle, everybody: Collection[Vehicle], gate: RoadGate) -> list[list[Vehicle]]:
    """Return the gated vehicles that block a refused vehicle, as a list of sets.

    In each set, at least one vehicle has to move before the refused vehicle can. A vehicle that a user's own
    rule refuses waits for no vehicle.
    """
    wanted = vehicle.wanted()
    if not vehicle.asks or wanted is None or vehicle.reason in _NOBODY:
        return []
    ways = [over.movement.kept_for for over in vehicle.leg.passes]
    if vehicle.reason == Reason.OCCUPIED:
        if vehicle.finds_room(wanted):
            return _late([wanted.kept_for], vehicle)
        return [[body.vehicle for body in wanted.bodies if body.vehicle is not vehicle]]
    if vehicle.reason == Reason.CROSSING:
        return [*_late(ways, vehicle), *([other] for other in _on_the_way(vehicle))]
    if vehicle.reason in {Reason.SERVICE, Reason.BLOCKED}:
        movers = [other for other in _named([wanted.mover, *ways], vehicle) if other.mover]
        stand = [other for other in everybody if other.stands and _stands_before(other, vehicle)]
        return [[other] for other in (movers if vehicle.reason == Reason.SERVICE else stand)]
    names = gate.blockers(vehicle) if vehicle.reason != Reason.RESERVE else []
    found = [other for other in everybody if other.name in names]
    known = vehicle.reason in _KNOWN
    if known and not found:
        found = [other for other in everybody if other is not vehicle]
    return [found] if known or found else []


def _stands_before(other: Vehicle, vehicle: Vehicle) -> bool:
    """Return whether another vehicle stands in the place that a vehicle wants next, or on the way there."""
    wanted = vehicle.wanted()
    return any(body.place is wanted for body in other.bodies) or other in _on_the_way(vehicle)


def _named(some: Iterable[Vehicle | None], vehicle: Vehicle) -> list[Vehicle]:
    """Return the vehicles of `some` except `vehicle`, each once, in the order of their numbers."""
    others = {other for other in some if other is not None and other is not vehicle}
    return sorted(others, key=lambda one: one.number)


def _late(some: Iterable[Vehicle | None], vehicle: Vehicle) -> list[list[Vehicle]]:
    """Return the vehicles of `some` that still wait for a slot or a crossing, each in its own list."""
    return [[other] for other in _named(some, vehicle) if other.asks and other.reason in PASSED_OVER]


def ahead(vehicle: Vehicle, everybody: Collection[Vehicle], gate: RoadGate) -> list[Vehicle]:
    """Return the vehicles that a vehicle waits for: the first in its line, else its `blockers`."""
    line, wanted = vehicle.leg.place.line, vehicle.wanted()
    if line and line[0] is not vehicle:
        return line[:1]
    if vehicle.asks and vehicle.reason == Reason.STOP and vehicle.stop_m == inf and wanted is not None:
        return wanted.line[:1]  # a vehicle in the wanted place is about to stop
    found = {other for some in blockers(vehicle, everybody, gate) for other in some}
    return sorted(found - {vehicle}, key=lambda one: one.number)


def outside(vehicle: Vehicle, slack: Slack, everybody: Collection[Vehicle]) -> list[list[str]]:
    """Return the ordinary vehicles that block a vehicle, by name, in sets like those of `blockers`.

    The reason of the last refusal does not count: it may be over while ordinary vehicles still block. Where
    ordinary vehicles fill a place or a circle, the set also has the gated vehicles that could make space.
    """
    wanted = vehicle.wanted()
    if not vehicle.asks or wanted is None or vehicle.reason == Reason.STOP:
        return []
    found = [[other.name] for other in dict.fromkeys(_before(vehicle))]
    if is_too_full(vehicle):
        inside = dict.fromkeys(other.name for other in _inside(vehicle))
        found.append([*inside, *(body.vehicle.name for body in wanted.bodies)])
    elif slack.too_tight(vehicle):
        found.append([other.name for other in everybody if other is not vehicle])
    return found


def _before(vehicle: Vehicle) -> Iterator[Other]:
    """Yield the ordinary vehicles ahead of a vehicle on its lane, or across its path."""
    here = vehicle.leg.stretch
    if here is None:
        return
    front_m = here.end_m - vehicle.left_m()
    for other in here.lane.fronts:
        if front_m < other.position_m <= here.end_m + BEYOND_M:
            yield other
    for over in vehicle.leg.passes:
        for across in over.lookout.across if over.lookout is not None else ():
            yield from _upon(across.lane, across.past_m)
    for lane in here.between:
        yield from _upon(lane, inf)


def _upon(lane: RoadLane, past_m: float) -> Iterator[Other]:
    """Yield the ordinary vehicles with their front on a lane, or with their rear before `past_m` on it."""
    yield from lane.fronts
    for rear in lane.rears:
        if rear.rear_m < past_m:
            yield rear.other


def _inside(vehicle: Vehicle) -> Iterator[Other]:
    """Yield the ordinary vehicles in the place that a vehicle wants next, and the ones that drive into it."""
    after = vehicle.leg.after
    if after is None or after.stretch is None:
        return
    for other in after.stretch.lane.fronts:
        if after.stretch.holds(other):
            yield other
    for lane in after.stretch.into:
        yield from lane.fronts


def _on_the_way(vehicle: Vehicle) -> Iterator[Vehicle]:
    """Yield the vehicles with a grant over a movement that conflicts with the crossing ahead of a vehicle."""
    for over in vehicle.leg.passes:
        for trip in over.movement.junction.trips:
            if trip.over.movement in over.foes and trip.vehicle is not vehicle:
                yield trip.vehicle
