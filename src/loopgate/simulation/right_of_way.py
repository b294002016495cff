"""What is kept for those that have been passed over for too long: their way across, and the last slot."""

from __future__ import annotations

from collections.abc import Collection

from loopgate.gates import Reason
from loopgate.simulation.occupancy import Occupancy
from loopgate.simulation.pending import Pending

__all__ = ["GIVES_WAY_S", "PATIENCE_S", "PATIENCE_THERE_S", "SHORT_OF_SLOTS_S", "RightOfWay"]

PATIENCE_S = 60.0
"""How long a request is passed over, on its crossing or for a slot, before others have to let it pass [s]."""

SHORT_OF_SLOTS_S = 30.0
"""How old a request is that finds no slot when those who could leave one get more attention [s]."""

PATIENCE_THERE_S = 10.0
"""How long these are passed over [s]: a long queue would else leave one by one, each after a minute."""

GIVES_WAY_S = 10.0
"""How long one that the gate has refused keeps nothing for itself [s]."""


class RightOfWay:
    """Keeps way and last slot for some; oldest request first.

    A long crossing is hardly ever clear all along by itself, and the slot that a full place gives back is
    taken by whoever has the shorter way. Those on the crossing drive on to slots of their own, so it clears.
    Nobody keeps a way to a place that has no slot for it, and of two that are in each other's way the older
    keeps its own: so each waits for older ones only, never two for each other. Who is refused by the gate
    for all that lets others go before it again.

    Parameters
    ----------
    occupancy
        Who holds what.
    """

    def __init__(self, occupancy: Occupancy) -> None:
        self._occupancy = occupancy
        self.way: dict[str, int] = {}
        """For whom a movement is kept clear, by its name."""
        self.slot: dict[int, int] = {}
        """Who has the last slot of a state, by its number."""

    def renew(self, pending: Collection[Pending], now_s: float) -> bool:
        """Keep what is due to each of all requests that are pending; return whether slots changed hands."""
        before = self.slot
        self.way, self.slot = {}, {}
        for late in self._late(pending, now_s):
            robot, wanted = late.request.robot, late.request.wanted
            first = self.slot.setdefault(wanted, robot)
            if self._occupancy.room(wanted) <= (first != robot):
                continue
            if any(mine.id in self.way for mine in late.crossings):
                continue
            for mine in late.crossings:
                for foe in mine.foes:
                    self.way.setdefault(foe, robot)
        return before != self.slot

    def _late(self, pending: Collection[Pending], now_s: float) -> list[Pending]:
        passed_over = [
            one for one in pending if now_s - one.request.since_s >= PATIENCE_THERE_S and one.passed_over
        ]
        short_of_slots = {
            one.request.wanted
            for one in passed_over
            if one.reason is Reason.OCCUPIED
            and now_s - one.request.since_s >= SHORT_OF_SLOTS_S
            and self._occupancy.room(one.request.wanted) <= 0
        }
        late = [
            one
            for one in passed_over
            if now_s - one.asked_at_s >= GIVES_WAY_S
            and (one.request.here in short_of_slots or now_s - one.request.since_s >= PATIENCE_S)
        ]
        return sorted(late, key=lambda one: (one.request.since_s, one.request.robot))
