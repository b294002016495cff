"""Checks that held vehicles can stop at their stop lines, and brakes hard the vehicles that cannot."""

from __future__ import annotations

from loopgate.control.diary import Row
from loopgate.control.motion import braking_m
from loopgate.control.places import TOLERANCE_M, Vehicle
from loopgate.results.columns import Event
from loopgate.traffic.base import Traffic


class Brakes:
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
