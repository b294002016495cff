"""Stops at stop lines: vehicles that cannot stop there brake hard, and SUMO forgets stops that were made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.diary import Diary, Row
from loopgate.control.part import Part
from loopgate.control.places import TOLERANCE_M, Vehicle, braking_m
from loopgate.results.columns import Event
from loopgate.traffic.base import Traffic


class Brakes(Part):
    """Watches the held vehicles that have not come to rest.

    `overruns`: how often a held vehicle could not stop at its stop line.
    """

    def __init__(self, traffic: Traffic, rows: list[Row]) -> None:
        self._traffic, self._rows = traffic, rows
        self.braking: dict[Vehicle, None] = {}
        """The held vehicles that have not come to rest."""
        self.overruns = 0

    def holds(self, vehicle: Vehicle) -> None:
        """Watch a vehicle that has been told to stop at its stop line."""
        self.braking[vehicle] = None

    def forget(self, vehicle: Vehicle) -> None:
        """End the watch of a vehicle: it stands, has a grant, or has left."""
        self.braking.pop(vehicle, None)

    def look(self) -> None:
        """Brake the vehicles that would come to rest beyond their stop lines."""
        step_s = self._traffic.step_s
        for vehicle in list(self.braking):
            if not vehicle.held:
                self.forget(vehicle)
                continue
            left_m, speed, decel = vehicle.line_m - vehicle.front_m, vehicle.speed, vehicle.make.decel
            if 2.0 * decel * left_m > speed * speed:
                continue  # far enough away, whatever the length of a step
            if left_m < braking_m(speed, decel, step_s) - TOLERANCE_M:
                self.overrun(vehicle)

    def overrun(self, vehicle: Vehicle) -> None:
        """Record that a vehicle cannot stop at its stop line, and brake it as hard as it can."""
        self.forget(vehicle)
        self.overruns += 1
        wanted = vehicle.wanted()
        place = wanted.name if wanted else ""
        self._rows.append((self._traffic.now_s, vehicle.name, Event.OVERRUN, place, ""))
        self._traffic.brake(vehicle.name)


_MOST: Final = 10
"""SUMO is made to forget the stops of a vehicle after this many."""


class UsedStops(Part):
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

    def turned_off(self, vehicle: Vehicle, _track: Track) -> None:
        """Note that a vehicle changes to another route: its stops are forgotten in a later round."""
        self._done.pop(vehicle, None)

    def forget(self, vehicle: Vehicle) -> None:
        """Set the count of a vehicle's stops to zero, or drop a vehicle that has left."""
        self._made.pop(vehicle, None)
        self._done.pop(vehicle, None)
