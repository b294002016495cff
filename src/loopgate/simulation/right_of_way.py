"""What is kept for those that have been passed over for too long: their way across, and the last slot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from loopgate.abstraction.itinerary import Crossing
from loopgate.negotiation.base import Request
from loopgate.simulation.occupancy import Occupancy

__all__ = ["RightOfWay"]


class RightOfWay:
    """Keeps way and last slot for some; oldest request first.

    A long crossing is hardly ever clear all along by itself, and the slot that a full place gives back is
    taken by whoever has the shorter way. Those on the crossing drive on to slots of their own, so it clears.
    Nobody keeps a way to a place that has no slot for it, and of two that are in each other's way the older
    keeps its own: so each waits for older ones only, never two for each other.

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

    def renew(self, late: Iterable[tuple[Request, Sequence[Crossing]]]) -> bool:
        """Keep all for the requests `late`, with their crossings; return whether slots changed hands."""
        before = self.slot
        self.way, self.slot = {}, {}
        for request, crossings in sorted(late, key=lambda late: (late[0].since_s, late[0].robot)):
            robot = request.robot
            first = self.slot.setdefault(request.wanted, robot)
            if self._occupancy.room(request.wanted) <= (first != robot):
                continue
            if any(mine.id in self.way for mine in crossings):
                continue
            for mine in crossings:
                for foe in mine.foes:
                    self.way.setdefault(foe, robot)
        return before != self.slot
