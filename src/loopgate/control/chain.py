"""The chain rule on the ledger's own objects: one walk along full places.

The walk itself is `loopgate.gates.certified.chain`.
"""

from __future__ import annotations

from typing import Final, Protocol

from loopgate.control.places import Leg, Place, Vehicle
from loopgate.control.refusal import CHAIN, Refusal
from loopgate.gates.certified import chain


class _Lines:
    """Places of the ledger, as the chain rule reads them."""

    def free(self, place: Place) -> int:
        """Return how many slots of a place are free."""
        return place.slots - len(place.line)

    def first(self, place: Place) -> Vehicle | None:
        """Return the first vehicle in the line of a place, if there is one."""
        return place.line[0] if place.line else None

    def wanted(self, vehicle: Vehicle) -> Place | None:
        """Return the place that a vehicle wants next."""
        return vehicle.wanted()


_LINES = _Lines()


def closes(mover: Vehicle) -> list[Place]:
    """Return the circle of full places that the next move of `mover` would close or join; else []."""
    leg = mover.leg.after
    if leg is None or len(leg.place.line) + 1 < leg.place.slots:
        return []
    place, onward = leg.place, None if leg.after is None else leg.after.place
    return chain.follow(_LINES, place, entered=place, onward=onward, left=mover.leg.place).circle()


def closes_by_entering(leg: Leg) -> bool:
    """Return whether a circle of full places closes if one more vehicle joins the line on `leg`."""
    onward = None if leg.after is None else leg.after.place
    return chain.closes_by_entering(_LINES, leg.place, free=_LINES.free(leg.place), onward=onward)


def closes_by_returning(place: Place, first: Vehicle) -> bool:
    """Return whether a circle of full places closes if one more vehicle returns to a place.

    `first`: the vehicle that is then first in the line of the place.
    """
    return len(place.line) + 1 >= place.slots and chain.leads_round(_LINES, first.wanted(), place)


def closes_by_turning(vehicle: Vehicle, leg: Leg) -> bool:
    """Return whether a circle of full places closes if a vehicle changes to another path at `leg`."""
    place, onward = vehicle.leg.place, None if leg.after is None else leg.after.place
    if len(place.line) < place.slots or place.line[0] is not vehicle:
        return False
    return chain.leads_round(_LINES, onward, place)


def circle_from(place: Place) -> list[Place]:
    """Return the circle of full places that `place` waits for; none if its vehicles can move at some time."""
    return chain.circle_from(_LINES, place)


def full_before(vehicle: Vehicle) -> list[Place]:
    """Return the place of a vehicle, and the full places that it waits for."""
    return [vehicle.leg.place, *chain.follow(_LINES, vehicle.wanted()).places]


def next_mover(served: Vehicle) -> Vehicle | None:
    """Return the vehicle to move next, so that `served` moves after finitely many such moves.

    None if full places already wait for one another in a circle.
    """
    return chain.next_mover(_LINES, served.leg.place)


_DEADLOCK: Final = Refusal("deadlock", stage=CHAIN)


class RoadGate(Protocol):
    """What a ledger asks of a gate. The ledger tells it each grant."""

    def allows(self, vehicle: Vehicle, now_s: float) -> Refusal | None:
        """Return why a vehicle may not move now, or None."""

    def moved(self, vehicle: Vehicle) -> None:
        """Note that a vehicle got a grant."""

    def stage(self, vehicle: Vehicle) -> str:
        """Return the stage of the gate that decided about a vehicle."""

    def blockers(self, vehicle: Vehicle) -> list[str]:
        """Return vehicles, by name, of which some must move before the gate admits a refused vehicle."""


class ChainGate:
    """The chain rule: no move closes a circle of full places, or leads into one (`docs/proofs/roads.md`).

    `stage`: the name of the stage in events and figures.
    """

    def __init__(self, stage: str = CHAIN) -> None:
        self._stage: Final = stage

    def allows(self, vehicle: Vehicle, _now_s: float) -> Refusal | None:
        """Refuse a move that would close a circle of full places, or lead into such a circle."""
        return _DEADLOCK if closes(vehicle) else None

    def moved(self, vehicle: Vehicle) -> None:
        """Do nothing: the ledger's places are all that the rule knows."""

    def stage(self, _vehicle: Vehicle) -> str:
        """Return the name of the stage."""
        return self._stage

    def blockers(self, vehicle: Vehicle) -> list[str]:
        """Return the first vehicles of the circle for which the rule refused a vehicle."""
        if vehicle.reason != _DEADLOCK.reason:
            return []
        return [place.line[0].name for place in closes(vehicle) if place.line]
