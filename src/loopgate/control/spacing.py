"""Even spacing of the vehicles on each loop: by holding them at gates, or by advice on their speeds.

Without it vehicles bunch behind slow ones, and streets wait long for a bunch. Each vehicle is delayed while
it is ahead of the middle between its neighbours on its loop; so spacing evens out without a timetable
(Bartholdi and Eisenstein, "A self-coordinating bus route to resist bus bunching", Transp. Res. B 46, 2012).
How far a vehicle is ahead is computed where a rule asks.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Final

from loopgate.control.places import Vehicle
from loopgate.control.refusal import Refusal
from loopgate.traffic.base import Traffic

_HOLD_S: Final = 48.0
"""For how long a vehicle is held that is ahead by the even spacing [s].

Where one driver is slow the others stay as far ahead as the delays of a lap take: longer holds keep them
nearer to even, but cost kilometres."""

_EVERY_S: Final = 5.0
_SLOWEST: Final = 0.8
FASTEST: Final = 1.1
"""Shares of the speed limit."""

_LEAST_CHANGE: Final = 0.005


class Ring:
    """The vehicles on a loop.

    `ends_m`, `ends_s`: arc lengths along it [m], ascending from 0 to its length, and the times there at the
    speeds allowed [s].
    """

    def __init__(self, ends_m: Sequence[float], ends_s: Sequence[float]) -> None:
        self._ends_m: Final = list(ends_m)
        self._ends_s: Final = list(ends_s)
        self._lap_s: Final = self._ends_s[-1]
        self.vehicles: dict[Vehicle, None] = {}

    def lead(self, vehicle: Vehicle) -> float:
        """Return how far a vehicle is ahead of the middle between its neighbours.

        In units of even spacing: 0 in the middle, 1 where the one ahead is two spacings nearer than the one
        behind.
        """
        lap_s, here_s = self._lap_s, self._at_s(vehicle)
        ahead_s = behind_s = lap_s
        for other in self.vehicles:
            if other is not vehicle:
                gap_s = (self._at_s(other) - here_s) % lap_s
                ahead_s, behind_s = min(ahead_s, gap_s), min(behind_s, lap_s - gap_s)
        return (behind_s - ahead_s) * len(self.vehicles) / (2.0 * lap_s)

    def _at_s(self, vehicle: Vehicle) -> float:
        """Return where a vehicle is, as time from the beginning of the loop [s]."""
        ends_m, ends_s = self._ends_m, self._ends_s
        at_m = vehicle.front_m % ends_m[-1]
        k = min(bisect_right(ends_m, at_m), len(ends_m) - 1)
        share = (at_m - ends_m[k - 1]) / (ends_m[k] - ends_m[k - 1])
        return ends_s[k - 1] + share * (ends_s[k] - ends_s[k - 1])


class Spacing:
    """Spaces vehicles on loops.

    Parameters
    ----------
    rings
        By the name of the loop.
    advises
        Whether vehicles are told how fast to drive; else they are held.
    """

    def __init__(self, traffic: Traffic, rings: Mapping[str, Ring], *, advises: bool) -> None:
        self._traffic, self._rings, self._advises = traffic, rings, advises
        self._on: dict[Vehicle, Ring] = {}
        self._next_s = 0.0
        self._told: dict[Vehicle, float] = {}

    def take_in(self, vehicle: Vehicle, loop: str) -> None:
        """Take note of a vehicle that has come."""
        ring = self._rings.get(loop)
        if ring is not None:
            self._on[vehicle] = ring
            ring.vehicles[vehicle] = None

    def forget(self, vehicle: Vehicle) -> None:
        """Take note that the vehicle is in the ledger no longer."""
        ring = self._on.pop(vehicle, None)
        if ring is not None:
            del ring.vehicles[vehicle]
        self._told.pop(vehicle, None)

    def holds(self, vehicle: Vehicle, now_s: float) -> Refusal | None:
        """Refuse, for a while, to let a vehicle go on that is ahead, and behind which none waits."""
        ring = self._on.get(vehicle)
        if ring is None or self._advises or len(vehicle.leg.place.line) > 1:
            return None
        waited_s = now_s - vehicle.since_s
        if waited_s >= _HOLD_S * len(ring.vehicles) / 2.0 or waited_s >= _HOLD_S * ring.lead(vehicle):
            return None
        return Refusal("spacing", outside=True)

    def is_behind(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle is behind the middle between its neighbours."""
        ring = self._on.get(vehicle)
        return ring is not None and ring.lead(vehicle) < 0.0

    def look(self) -> None:
        """Give advice if it is time; to be called after each step."""
        if not self._advises or self._traffic.now_s < self._next_s:
            return
        self._next_s = self._traffic.now_s + _EVERY_S
        for vehicle, ring in self._on.items():
            factor = min(FASTEST, max(_SLOWEST, 1.0 - ring.lead(vehicle) / 2.0))
            if abs(factor - self._told.get(vehicle, FASTEST)) > _LEAST_CHANGE:
                self._told[vehicle] = factor
                self._traffic.advise(vehicle.name, factor)
