"""The negotiation `loopgate.negotiation.pressure`: the longest queue goes first, and crowded places wait."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import Final

from loopgate.control.places import Place, Vehicle

PATIENCE_S: Final = 100.0
"""The longest wait for room in crowded places by default [s]."""

WAIT_S: Final = 5.0
"""So long a wait counts as much as one vehicle more behind than before [s]."""


class Pressure:
    """Puts vehicles in order; those that leave room in crowded places are left out.

    A place is `crowded` from this share of its slots on; never, if that is infinite. `patience_s`: the
    longest wait, from an empty place into a full one [s]. `wait_s`: the wait that counts as one vehicle [s].
    """

    def __init__(self, crowded: float = inf, patience_s: float = PATIENCE_S, wait_s: float = WAIT_S) -> None:
        self.crowded, self.patience_s, self.wait_s = crowded, patience_s, wait_s

    def room_for(self, vehicles: int, places: Iterable[Place]) -> None:
        """Let as much be left as so many vehicles leave free in all places that they come to."""
        slots = sum(place.slots for place in places)
        self.crowded = max(0.0, 1.0 - vehicles / slots) if slots else inf

    def order(self, vehicles: list[Vehicle], now_s: float) -> list[Vehicle]:
        """Return the vehicles that need not wait, by falling pressure; ties go by number."""
        going = [(self._rank(one, now_s), one.number, one) for one in vehicles if self._goes(one, now_s)]
        going.sort()
        return [one for _, _, one in going]

    def _rank(self, vehicle: Vehicle, now_s: float) -> float:
        """Return the less, the more pressure is behind a vehicle."""
        here, after = vehicle.leg.place, vehicle.leg.after
        before = 0 if after is None else len(after.place.bodies)
        return before - (len(here.bodies) + here.outside) - (now_s - vehicle.since_s) / self.wait_s

    def _goes(self, vehicle: Vehicle, now_s: float) -> bool:
        """Return whether a vehicle goes: its own place is as full as the next, or it has waited for long."""
        wanted, here = vehicle.wanted(), vehicle.leg.place
        if vehicle.mover or wanted is None or len(wanted.bodies) < self.crowded * wanted.slots:
            return True
        fuller = len(wanted.bodies) / wanted.slots - len(here.bodies) / here.slots
        return fuller < (now_s - vehicle.since_s) / self.patience_s
