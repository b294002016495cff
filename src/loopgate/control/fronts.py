"""Positions of all vehicles' fronts along their paths, read from their odometers in one call."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from loopgate.arrays import Floats
from loopgate.control.places import Vehicle
from loopgate.traffic.base import Traffic


class Fronts:
    """The fronts of all vehicles after the last step.

    `names`: the vehicles, in the order of their rows.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.names: list[str] = []
        self._fronts_m: list[float] = []
        self._offsets_m: list[float] = []
        self._at_m: Floats = np.zeros(0)
        self._offset_m: Floats = np.zeros(0)
        self._changed = False
        """Whether the lists have changed since the arrays were made of them."""

    @property
    def at_m(self) -> Floats:
        """The arc length of each front along its path [m]."""
        self._settle()
        return self._at_m

    def _settle(self) -> None:
        if self._changed:
            self._changed = False
            self._at_m, self._offset_m = np.array(self._fronts_m), np.array(self._offsets_m)

    def add(self, vehicles: Sequence[Vehicle]) -> None:
        """Add vehicles that have come, with their fronts as they are now."""
        names = [vehicle.name for vehicle in vehicles]
        odometers: list[float] = self._traffic.odometers(names).tolist()
        for vehicle, odometer in zip(vehicles, odometers, strict=True):
            self._fronts_m.append(vehicle.front_m)
            self._offsets_m.append(vehicle.front_m - odometer)
        self.names += names
        self._changed = True

    def drop(self, row: int) -> None:
        """Drop the vehicle in a row; the rows after it move up."""
        del self.names[row], self._fronts_m[row], self._offsets_m[row]
        self._changed = True

    def shift(self, row: int, by_m: float) -> None:
        """Note that the vehicle in a row changes to another path, where arc lengths are `by_m` larger."""
        self._fronts_m[row] += by_m
        self.jumped(row, by_m)

    def jumped(self, row: int, skipped_m: float) -> None:
        """Note that SUMO moved the vehicle in a row `skipped_m` ahead; its odometer does not count that."""
        self._offsets_m[row] += skipped_m
        self._changed = True

    def offset_m(self, row: int) -> float:
        """Return the arc length of a front minus the odometer of its vehicle [m]."""
        return self._offsets_m[row]

    def read(self, there: int) -> tuple[list[float], float]:
        """Read all fronts; return them, and how far the first `there` vehicles came since the last call [m].

        The distance is the sum over these vehicles.
        """
        before = self.at_m
        self._at_m = self._traffic.odometers(self.names) + self._offset_m
        self._fronts_m = self._at_m.tolist()
        return self._fronts_m, float(np.add.reduce((self._at_m - before)[:there]))

    def odometer(self, row: int) -> float:
        """Return the odometer of the vehicle in a row as it was after the last step [m]."""
        return self._fronts_m[row] - self._offsets_m[row]

    def odometers(self) -> Floats:
        """Return the odometers as they were after the last step [m]."""
        return self.at_m - self._offset_m
