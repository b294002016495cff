"""Stops that vehicles have left behind: SUMO keeps them all, and grows slow over them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from loopgate.drive.driver import Driver
from loopgate.traffic.base import Traffic

__all__ = ["UsedStops"]

_MOST: Final = 10
"""So many stops are left behind before SUMO is made to forget them, now and then."""


class UsedStops:
    """Lets SUMO forget stops: on one edge those made on all others, on the next those made on that.

    Parameters
    ----------
    traffic
        The running simulation.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._done: dict[str, int] = {}
        """In how many of its rounds a vehicle's stops have been forgotten."""

    def made(self, driver: Driver) -> None:
        """Take note that a vehicle has come to rest at a stop."""
        driver.stops += 1
        if driver.stops > _MOST and driver.track.rounds:
            driver.row["heeds_renewal"] = True

    def renewed(self, driver: Driver) -> None:
        """Take note that the vehicle's route has been renewed: only now may it be changed."""
        if driver.stops > _MOST:
            self._done.setdefault(driver.id, 0)

    def forget(self, drivers: Mapping[str, Driver]) -> None:
        """Let stops be forgotten where that can be now."""
        for vehicle, done in list(self._done.items()):
            driver = drivers[vehicle]
            if driver.row["held"] or driver.row["steered"]:
                continue  # its stop ahead would be forgotten too
            if not self._traffic.forget_stops(vehicle, *driver.track.rounds[done]):
                continue
            self._done[vehicle] = done + 1
            if done + 1 == len(driver.track.rounds):
                self.drop(vehicle)
                driver.stops = 0

    def drop(self, vehicle: str) -> None:
        """Take note that there is nothing to be forgotten."""
        self._done.pop(vehicle, None)
