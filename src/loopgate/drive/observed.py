"""The engine as a run and its observers ask it: by names of vehicles, with nothing of the tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.drive.changing import ChangingEngine
from loopgate.drive.codes import REASONS, STOPPING
from loopgate.drive.driver import Driver

__all__ = ["ObservedEngine"]

_FIGURES = "steps", "standing", "ended", "driven_m"


class ObservedEngine(ChangingEngine):
    """An engine that answers what a run asks (`loopgate.simulation.drives.Drive`)."""

    def count_from(self, at_s: float) -> None:
        """Count the time that vehicles stand only from then on [s]."""
        self.run["counts_from_s"] = at_s

    def names(self) -> Sequence[str]:
        """Return the vehicles by number."""
        return self._ids

    def granted(self) -> Ints:
        """Return the number of the last leg granted to each."""
        return cast("Ints", self.vehicles["granted"].copy())

    def fronts(self) -> Floats:
        """Return where their fronts were after the last step, along their loops, laps counted on [m]."""
        v = self.vehicles
        return cast("Floats", v["front"] - v["moved_m"])

    def take_flow(self) -> tuple[int, float, float, int]:
        """Return how many there are, and since the last call the mean number that stand, metres, and laps."""
        steps, standing, ended, driven_m = (self.run[name].item() for name in _FIGURES)
        for name in _FIGURES:
            self.run[name] = 0
        return len(self.vehicles), standing / steps, driven_m, ended

    @property
    def records(self) -> Mapping[str, Driver]:
        """What the vehicles on the road have done, by name."""
        return self.driver_of

    def trespasses_now(self, vehicle: str) -> bool:
        """Return whether a vehicle is where it was granted nothing."""
        return bool(self.driver_of[vehicle].row["trespassing"])

    def waits_behind(self, vehicle: str) -> Sequence[str]:
        """Return the vehicles that one waits for: the first in its line, else those that block it."""
        keeper, robot = self.keeper, self.driver_of[vehicle].robot
        line = keeper.line(keeper.here(robot))
        if line and line[0] != robot:
            return [self._ids[line[0]]]
        row: Any = self.vehicles[robot]
        if row["pending"] and int(row["reason"]) == int(STOPPING) and not np.isfinite(row["stop_m"]):
            others = keeper.line(keeper.wanted(robot))[:1]  # it waits behind one that is to stop
        else:
            others = sorted({other for some in keeper.blockers(robot) for other in some} - {robot})
        return [self._ids[other] for other in others]

    def asks(self, vehicle: str) -> bool:
        """Return whether a vehicle waits for a grant."""
        return bool(self.driver_of[vehicle].row["pending"])

    def reason(self, vehicle: str) -> str:
        """Return why it was refused last, or an empty text."""
        reason = REASONS[int(self.driver_of[vehicle].row["reason"])]
        return str(reason.value) if reason else ""

    def wanted(self, vehicle: str) -> str:
        """Return the state that it wants next."""
        driver = self.driver_of[vehicle]
        return driver.leg(driver.granted + 1).state
