"""Fronts of all vehicles along their ways, read from their odometers in one go."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from loopgate.arrays import Floats
from loopgate.control.places import Vehicle
from loopgate.traffic.base import Traffic


class Fronts:
    """Where the fronts of vehicles were after the last step.

    `names`: the vehicles. `at_m`: their fronts along their ways [m], `tops`: their top speeds [m/s], both in
    that order.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.names: list[str] = []
        self.at_m: Floats = np.zeros(0)
        self.tops: Floats = np.zeros(0)
        self._offset_m: Floats = np.zeros(0)

    def add(self, vehicles: Sequence[Vehicle]) -> None:
        """Add vehicles that have come, where they are now."""
        names = [vehicle.name for vehicle in vehicles]
        at_m = np.array([vehicle.front_m for vehicle in vehicles])
        self._offset_m = np.append(self._offset_m, at_m - self._traffic.odometers(names))
        self.at_m = np.append(self.at_m, at_m)
        self.tops = np.append(self.tops, [vehicle.make.top for vehicle in vehicles])
        self.names += names

    def drop(self, row: int) -> None:
        """Forget the vehicle in a row; those behind it move up."""
        del self.names[row]
        columns = self._offset_m, self.at_m, self.tops
        self._offset_m, self.at_m, self.tops = (np.delete(column, row) for column in columns)

    def shift(self, row: int, by_m: float) -> None:
        """Note that the vehicle in a row goes by another way, on which arc lengths are so much more [m]."""
        self._offset_m[row] += by_m
        self.at_m[row] += by_m

    def jumped(self, row: int, skipped_m: float) -> None:
        """Note that the simulator moved the vehicle in a row ahead [m]."""
        self._offset_m[row] += skipped_m

    def offset_m(self, row: int) -> float:
        """Return how much more the arc length of a front is than the odometer of its vehicle [m]."""
        return float(self._offset_m[row])

    def read(self) -> Floats:
        """Read where the fronts are now; return how far they have come since the call before [m]."""
        before, self.at_m = self.at_m, self._traffic.odometers(self.names) + self._offset_m
        return self.at_m - before

    def odometers(self) -> Floats:
        """Return what the odometers read after the last step [m]."""
        return self.at_m - self._offset_m
