"""Looks whether held vehicles can still stop at their stop lines, and brakes those that cannot."""

from __future__ import annotations

from loopgate.control.diary import Row
from loopgate.control.motion import braking_m
from loopgate.control.places import TOLERANCE_M, Vehicle
from loopgate.results.columns import Event
from loopgate.traffic.base import Traffic


class Brakes:
    """The vehicles that brake for their stop lines.

    `overruns`: how often a held vehicle could not stop at its stop line.
    """

    def __init__(self, traffic: Traffic, rows: list[Row]) -> None:
        self._traffic, self._rows = traffic, rows
        self._braking: dict[Vehicle, None] = {}
        self.overruns = 0

    def holds(self, vehicle: Vehicle) -> None:
        """Watch a vehicle from now on that is to stop at its line."""
        self._braking[vehicle] = None

    def forget(self, vehicle: Vehicle) -> None:
        """Watch a vehicle no longer: it stands, may go on, or has left."""
        self._braking.pop(vehicle, None)

    def look(self) -> None:
        """Brake the vehicles that would come to rest past their lines."""
        step_s = self._traffic.step_s
        for vehicle in list(self._braking):
            if not vehicle.held:
                self.forget(vehicle)
                continue
            left_m, speed, decel = vehicle.line_m - vehicle.front_m, vehicle.speed, vehicle.make.decel
            if 2.0 * decel * left_m > speed * speed:
                continue  # it stops in less, however long a step is
            if left_m < braking_m(speed, decel, step_s) - TOLERANCE_M:
                self.overrun(vehicle)

    def overrun(self, vehicle: Vehicle) -> None:
        """Note that a vehicle cannot stop at its line, and brake it as hard as it can."""
        self.forget(vehicle)
        self.overruns += 1
        wanted = vehicle.wanted()
        place = wanted.name if wanted else ""
        self._rows.append((self._traffic.now_s, vehicle.name, Event.OVERRUN, place, ""))
        self._traffic.brake(vehicle.name)
