"""Stops that vehicles have left behind: SUMO keeps them all, and grows slow over them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from loopgate.control.diary import Diary
from loopgate.control.places import Vehicle
from loopgate.control.way import Way
from loopgate.traffic.base import Traffic

_MOST: Final = 10
"""A vehicle leaves so many stops behind before SUMO is made to forget them."""


class UsedStops:
    """Lets SUMO forget stops: on one edge those made on all others, on the next those made on that."""

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._made: dict[Vehicle, int] = {}
        self._done: dict[Vehicle, int] = {}
        """On how many edges the stops of a vehicle have been forgotten."""

    def made(self, vehicle: Vehicle, way: Way) -> None:
        """Note that a vehicle has come to rest at a stop."""
        if way.rounds:
            self._made[vehicle] = self._made.get(vehicle, 0) + 1

    def renewed(self, vehicle: Vehicle) -> None:
        """Note that the route of a vehicle has been renewed: only now may it be changed."""
        if self._made.get(vehicle, 0) > _MOST:
            self._done.setdefault(vehicle, 0)

    def look(self, diaries: Sequence[Diary]) -> None:
        """Let stops be forgotten where that can be now."""
        for vehicle, done in list(self._done.items()):
            if vehicle.held or vehicle.steered:
                continue  # its stop ahead would be forgotten too
            rounds = diaries[vehicle.row].way.rounds
            edge, route, alone = rounds[done]
            if not self._traffic.forget_stops(vehicle.name, edge, route, alone):
                continue
            self._done[vehicle] = done + 1
            if done + 1 == len(rounds):
                self.forget(vehicle)

    def turned_off(self, vehicle: Vehicle) -> None:
        """Note that a vehicle drives on by another route: the stops are forgotten in a later round."""
        self._done.pop(vehicle, None)

    def forget(self, vehicle: Vehicle) -> None:
        """Count the stops of a vehicle anew, or no longer."""
        self._made.pop(vehicle, None)
        self._done.pop(vehicle, None)
