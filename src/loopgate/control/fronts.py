"""Positions of all vehicles' fronts along their paths, read from their odometers in one call."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from loopgate.arrays import Floats
from loopgate.control.places import Vehicle
from loopgate.traffic.base import Traffic


class Fronts:
    """The fronts of all vehicles after the last step.

    `names`: the vehicles. `at_m`: the arc length of each front along its path [m]. `tops`: the top speed of
    each vehicle [m/s]. All three have the same order.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.names: list[str] = []
        self.at_m: Floats = np.zeros(0)
        self.tops: Floats = np.zeros(0)
        self._offset_m: Floats = np.zeros(0)

    def add(self, vehicles: Sequence[Vehicle]) -> None:
        """Add vehicles that have come, with their fronts as they are now."""
        names = [vehicle.name for vehicle in vehicles]
        at_m = np.array([vehicle.front_m for vehicle in vehicles])
        self._offset_m = np.append(self._offset_m, at_m - self._traffic.odometers(names))
        self.at_m = np.append(self.at_m, at_m)
        self.tops = np.append(self.tops, [vehicle.make.top for vehicle in vehicles])
        self.names += names

    def drop(self, row: int) -> None:
        """Drop the vehicle in a row; the rows after it move up."""
        del self.names[row]
        columns = self._offset_m, self.at_m, self.tops
        self._offset_m, self.at_m, self.tops = (np.delete(column, row) for column in columns)

    def shift(self, row: int, by_m: float) -> None:
        """Note that the vehicle in a row changes to another path, where arc lengths are `by_m` larger."""
        self._offset_m[row] += by_m
        self.at_m[row] += by_m

    def jumped(self, row: int, skipped_m: float) -> None:
        """Note that SUMO moved the vehicle in a row `skipped_m` ahead; its odometer does not count that."""
        self._offset_m[row] += skipped_m

    def offset_m(self, row: int) -> float:
        """Return the arc length of a front minus the odometer of its vehicle [m]."""
        return float(self._offset_m[row])

    def read(self) -> Floats:
        """Read all fronts; return how far each has come since the last call [m]."""
        before, self.at_m = self.at_m, self._traffic.odometers(self.names) + self._offset_m
        return self.at_m - before

    def odometers(self) -> Floats:
        """Return the odometers as they were after the last step [m]."""
        return self.at_m - self._offset_m
