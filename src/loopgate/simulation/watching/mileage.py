"""Counts distance and standing time of vehicles without a gate, step by step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from math import nan

import numpy as np

from loopgate.arrays import Ints
from loopgate.control.places import STANDING_MPS
from loopgate.simulation.watching.flow import Row
from loopgate.simulation.watching.trips import Trip
from loopgate.traffic.base import Traffic

__all__ = ["Driven", "Mileage"]

_LEAP_MPS2 = 5.0
"""An odometer that accelerates more than this, or runs back, is compared with the vehicle's speed [m/s2]."""

_LEAP_M = 1.0
"""An odometer has leapt if it advances this much more in a step than the vehicle's speed allows [m]."""

_COLUMNS = "_at_m", "_speed_mps", "_driven_m", "_stood_s", "_stands_s", "_longest_s"


@dataclass(frozen=True, slots=True)
class Driven:
    """The distance and times of one vehicle in the measured time.

    Attributes
    ----------
    distance_m
        Distance driven [m].
    time_s
        Time on the road, or at stops beside it [s].
    stood_s, longest_s
        Time below 0.1 m/s, in all and at most at once [s].
    """

    distance_m: float = 0.0
    time_s: float = 0.0
    stood_s: float = 0.0
    longest_s: float = 0.0


class Mileage:
    """Counts distance and standing of vehicles that no gate controls.

    If SUMO's odometer leaps, as it does when a train turns round, the speed counts in that step instead.

    Parameters
    ----------
    traffic
        The running simulation.
    own
        The vehicles to count; None for all.
    """

    def __init__(self, traffic: Traffic, own: Container[str] | None = None) -> None:
        self._traffic, self._own = traffic, own
        self._there: Sequence[str] = ()
        self._rows: Ints = np.zeros(0, dtype=np.int64)
        """The rows of the vehicles on the road."""
        self._row_of: dict[str, int] = {}
        self._at_m, self._speed_mps, self._driven_m = (np.zeros(0) for _ in range(3))
        self._stood_s, self._stands_s, self._longest_s = (np.zeros(0) for _ in range(3))
        self._last_m: dict[str, float] = {}
        """The last odometer of each vehicle that has left [m]."""
        self._came_s: dict[str, float] = {}
        self._gone_s: dict[str, float] = {}
        self.stops: Counter[str] = Counter()
        """How many stops each vehicle has made since it departed."""
        self.begin_s = traffic.now_s
        """When the measured time began [s]."""
        self._steps, self._standing, self._metres = 0, 0, 0.0

    def look(self) -> None:
        """Count the last step; call after each step."""
        traffic, now, step_s = self._traffic, self._traffic.now_s, self._traffic.step_s
        for vehicle in traffic.arrived():
            if vehicle in self._row_of:
                self._gone_s[vehicle] = now
        self.stops.update(v for v in traffic.stops_ended() if self._own is None or v in self._own)
        everyone = traffic.vehicles()
        there = everyone if self._own is None else [v for v in everyone if v in self._own]
        if there != self._there:
            self._take_over(there, now)
        at_m = np.array(traffic.odometers(there))
        moved_m = at_m - self._at_m[self._rows]
        before_mps = self._speed_mps[self._rows]
        leaps = (moved_m > (before_mps + _LEAP_MPS2 * step_s) * step_s) | (moved_m < 0.0)
        for place in np.flatnonzero(leaps).tolist():
            speed_mps = traffic.speed(there[place])
            could_m = max(speed_mps, float(before_mps[place])) * step_s
            if not -_LEAP_M <= moved_m[place] <= could_m + _LEAP_M:
                moved_m[place] = speed_mps * step_s
        fresh = np.isnan(moved_m)
        stands = ~fresh & (moved_m < STANDING_MPS * step_s)
        moved_m[fresh] = 0.0
        self._at_m[self._rows] = at_m
        self._speed_mps[self._rows] = moved_m / step_s
        self._driven_m[self._rows] += moved_m
        self._stood_s[self._rows[stands]] += step_s
        self._stands_s[self._rows[stands]] += step_s
        self._stands_s[self._rows[~stands]] = 0.0
        np.maximum(self._longest_s, self._stands_s, out=self._longest_s)
        self._steps += 1
        self._standing += int(stands.sum())
        self._metres += float(moved_m.sum())

    def _take_over(self, there: Sequence[str], now: float) -> None:
        """Use the vehicles that are on the road now; no distance is known for the time of an absence."""
        self._last_m.update(zip(self._there, self._at_m[self._rows].tolist(), strict=True))
        fresh = [vehicle for vehicle in there if vehicle not in self._row_of]
        for vehicle in fresh:
            self._row_of[vehicle], self._came_s[vehicle] = len(self._row_of), now
        if len(self._row_of) > len(self._at_m):
            more = np.zeros(2 * len(self._row_of) - len(self._at_m))
            for name in _COLUMNS:
                setattr(self, name, np.concatenate((getattr(self, name), more)))
        rows = np.array([self._row_of[vehicle] for vehicle in there], dtype=np.int64)
        known, self._at_m = self._at_m, np.full(len(self._at_m), nan)
        still = np.intersect1d(rows, self._rows)
        self._at_m[still] = known[still]
        self._there, self._rows = there, rows

    @property
    def now_s(self) -> float:
        """The time that is counted so far [s]."""
        return self._traffic.now_s

    @property
    def seen(self) -> AbstractSet[str]:
        """The vehicles that were on the road."""
        return self._row_of.keys()

    def measure_from_now(self) -> None:
        """Begin the measured time: set all counts to zero."""
        self.begin_s = self._traffic.now_s
        for counts in (self._driven_m, self._stood_s, self._stands_s, self._longest_s):
            counts[:] = 0.0

    def flow(self) -> Row:
        """Return the row of the flow table for the time since the last row."""
        standing = self._standing / max(1, self._steps)
        row = self._traffic.now_s, len(self._there), standing, self._metres, 0
        self._steps, self._standing, self._metres = 0, 0, 0.0
        return row

    def last_part(self, trip: Trip) -> tuple[float, float]:
        """Return when a vehicle left [s], and how far it drove in that step [m]."""
        row, gone_s = self._row_of.get(trip.vehicle), self._gone_s.get(trip.vehicle, 0.0)
        if row is None or trip.vehicle not in self._last_m:
            return gone_s, 0.0
        step_s = self._traffic.step_s
        most_mps = float(self._speed_mps[row]) + _LEAP_MPS2 * step_s
        return gone_s, trip.last_part_m(self._last_m[trip.vehicle], most_mps * step_s)

    def of(self, trip: Trip) -> Driven:
        """Return how far a vehicle drove, how long it was under way and how long of that it stood.

        The figures begin with the measured time. `trip`: what SUMO says of the vehicle.
        """
        vehicle = trip.vehicle
        row = self._row_of.get(vehicle)
        gone_s = self._gone_s.get(vehicle, self._traffic.now_s)
        if row is None or gone_s <= self.begin_s:
            return Driven()
        driven_m, stood = float(self._driven_m[row]), (float(self._stood_s[row]), float(self._longest_s[row]))
        driven_m += self.last_part(trip)[1]
        return Driven(driven_m, gone_s - max(self._came_s[vehicle], self.begin_s), *stood)
