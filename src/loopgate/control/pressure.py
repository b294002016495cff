"""The negotiation `loopgate.negotiation.pressure` for the ledger: vehicles with long queues go first."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import Final

from loopgate.control.places import Place, Vehicle
from loopgate.negotiation.formulas import leaves_room, pressure

PATIENCE_S: Final = 100.0
"""Default of `PressureOrder.patience_s` [s]."""


class PressureOrder:
    """Orders vehicles by pressure, and leaves out vehicles that must not fill a crowded place.

    The pressure is the share of taken slots behind minus the share ahead, and grows with the wait.
    `crowded`: the share of taken slots from which a place is crowded; infinite for never. `patience_s`: the
    longest time that a vehicle is left out, from an empty place into a full one [s].
    """

    def __init__(self, crowded: float = inf, patience_s: float = PATIENCE_S) -> None:
        self.crowded, self.patience_s = crowded, patience_s

    def room_for(self, vehicles: int, places: Iterable[Place]) -> None:
        """Set `crowded` to the share of slots that `vehicles` leave free in `places`."""
        slots = sum(place.slots for place in places)
        self.crowded = max(0.0, 1.0 - vehicles / slots) if slots else inf

    def order(self, vehicles: list[Vehicle], now_s: float) -> list[Vehicle]:
        """Return the vehicles that are not left out, highest pressure first; ties go by number."""
        going = [(self._rank(one, now_s), one.number, one) for one in vehicles if self._goes(one, now_s)]
        going.sort()
        return [one for _, _, one in going]

    def _rank(self, vehicle: Vehicle, now_s: float) -> float:
        """Return the negative pressure of a vehicle, so that the lowest rank goes first."""
        here, after = vehicle.leg.place, vehicle.leg.after
        ahead = 0.0 if after is None else len(after.place.bodies) / after.place.slots
        return -pressure(len(here.bodies) / here.slots, ahead, now_s - vehicle.since_s)

    def _goes(self, vehicle: Vehicle, now_s: float) -> bool:
        """Return whether a vehicle is not left out."""
        wanted, here = vehicle.wanted(), vehicle.leg.place
        if vehicle.mover or wanted is None:
            return True
        waited = (now_s - vehicle.since_s) / self.patience_s
        taken = len(wanted.bodies) / wanted.slots
        return not leaves_room(taken, len(here.bodies) / here.slots, waited, self.crowded)
