"""The gate on the road decides about the vehicles that no rule refuses; by default it is the chain rule."""

from __future__ import annotations

from typing import Final, Protocol

from loopgate.control.chain import closes
from loopgate.control.places import Vehicle
from loopgate.control.refusal import CHAIN, Refusal

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
