"""Makes SUMO forget the stops that vehicles have made: SUMO keeps all of them, and gets slower."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.diary import Diary
from loopgate.control.places import Vehicle
from loopgate.traffic.base import Traffic

_MOST: Final = 10
"""SUMO is made to forget the stops of a vehicle after this many."""


class UsedStops:
    """Makes SUMO forget the stops that vehicles have made.

    On one edge SUMO forgets the stops made on all other edges; on the next edge it forgets the rest.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._made: dict[Vehicle, int] = {}
        self._done: dict[Vehicle, int] = {}
        """On how many of the two edges SUMO has forgotten stops of a vehicle."""

    def made(self, vehicle: Vehicle, track: Track) -> None:
        """Count a stop of a vehicle; SUMO makes a stop wherever a vehicle is held."""
        if track.rounds:
            self._made[vehicle] = self._made.get(vehicle, 0) + 1

    def renewed(self, vehicle: Vehicle) -> None:
        """Note that SUMO has renewed a vehicle's route: only from now on may the route be changed."""
        if self._made.get(vehicle, 0) > _MOST:
            self._done.setdefault(vehicle, 0)

    def look(self, diaries: Sequence[Diary]) -> None:
        """Make SUMO forget stops of the vehicles for which it can do so now."""
        for vehicle, done in list(self._done.items()):
            if vehicle.held or vehicle.steered:
                continue  # SUMO would forget the stop ahead too
            rounds = diaries[vehicle.row].track.rounds
            edge, route, alone = rounds[done]
            if not self._traffic.forget_stops(vehicle.name, edge, route, alone):
                continue
            self._done[vehicle] = done + 1
            if done + 1 == len(rounds):
                self.forget(vehicle)

    def turned_off(self, vehicle: Vehicle) -> None:
        """Note that a vehicle changes to another route: its stops are forgotten in a later round."""
        self._done.pop(vehicle, None)

    def forget(self, vehicle: Vehicle) -> None:
        """Set the count of a vehicle's stops to zero, or drop a vehicle that has left."""
        self._made.pop(vehicle, None)
        self._done.pop(vehicle, None)
