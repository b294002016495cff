"""What the vehicles physically hold: states from the grant until the rear has left, and crossings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from loopgate.abstraction.itinerary import Crossing
from loopgate.model import System

__all__ = ["Occupancy"]


class Occupancy:
    """Counts of vehicles per state and per crossing, with O(1) questions.

    A vehicle that drives from one state to the next holds both until its rear has left the first, so these
    counts are at least those of the configuration.
    """

    def __init__(self, system: System) -> None:
        self._room = [
            len(system.robots) if private else room
            for private, room in zip(system.private, system.room, strict=True)
        ]
        self._holders: list[list[int]] = [[] for _ in system.states]
        self._passing: dict[str, list[int]] = {}
        self._active: set[str] = set()

    def held(self, state: int) -> int:
        """Return how many vehicles hold `state`."""
        return len(self._holders[state])

    def room(self, state: int) -> int:
        """Return how many more vehicles fit into `state`."""
        return self._room[state] - len(self._holders[state])

    def holders(self, state: int) -> Sequence[int]:
        """Return the robots that hold `state`, in the order in which they took it."""
        return self._holders[state]

    def take(self, robot: int, state: int) -> None:
        """Let `robot` hold `state` from now on (once more, if the state comes back on its way)."""
        self._holders[state].append(robot)

    def leave(self, robot: int, state: int) -> None:
        """Let `robot` hold `state` no longer."""
        self._holders[state].remove(robot)

    def foes_on_way(self, crossing: Crossing, robot: int) -> list[tuple[int, str]]:
        """Return the other robots on movements that conflict with `crossing`: who, and on what."""
        foes = crossing.foes
        if self._active.isdisjoint(foes):
            return []
        return [
            (other, foe)
            for foe in sorted(foes & self._active)
            for other in self._passing[foe]
            if other != robot
        ]

    def enter(self, robot: int, crossings: Iterable[Crossing]) -> None:
        """Let `robot` be under way on `crossings`."""
        for crossing in crossings:
            self._passing.setdefault(crossing.id, []).append(robot)
            self._active.add(crossing.id)

    def clear(self, robot: int, crossings: Iterable[Crossing]) -> None:
        """Let `robot` be past `crossings`."""
        for crossing in crossings:
            passing = self._passing[crossing.id]
            passing.remove(robot)
            if not passing:
                self._active.discard(crossing.id)
