"""Spaces the vehicles of each loop evenly: holds them at gates, or advises speeds.

Without spacing, vehicles bunch behind slow ones, and streets wait long for the bunch. A vehicle is delayed
while it is ahead of the middle between its two neighbours on the loop; so the spacing evens out without a
timetable (Bartholdi and Eisenstein, "A self-coordinating bus route to resist bus bunching", Transp. Res. B
46, 2012). How far a vehicle is ahead is computed when a rule asks for it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from math import nan
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.part import Part
from loopgate.control.places import Vehicle
from loopgate.control.refusal import Refusal
from loopgate.traffic.base import Traffic

_HOLD_S: Final = 48.0
"""Hold time of a vehicle that is ahead by one even spacing [s].

Where one driver is slow, the other vehicles stay ahead by the delays of a lap. Longer holds bring them nearer
to even spacing, but cost kilometres."""

_EVERY_S: Final = 5.0
_SLOWEST: Final = 0.8
FASTEST: Final = 1.1
"""Slowest and fastest advice, as shares of the speed limit."""

_LEAST_CHANGE: Final = 0.005


_SPACING: Final = Refusal("spacing", outside=True)


class Ring:
    """The vehicles of one loop.

    `ends_m`: arc lengths along the loop, ascending from 0 to its length [m]. `ends_s`: the times to get there
    at the speed limits [s].
    """

    def __init__(self, ends_m: Sequence[float], ends_s: Sequence[float]) -> None:
        self._ends_m: Final = list(ends_m)
        self._ends_s: Final = list(ends_s)
        self._lap_s: Final = self._ends_s[-1]
        self.vehicles: dict[Vehicle, None] = {}
        self._seen_s = nan
        self._order: list[tuple[float, int]] = []
        """Where each vehicle was at `_seen_s`, as time from the beginning of the loop [s], and its number."""
        self._rank: dict[Vehicle, int] = {}

    def add(self, vehicle: Vehicle) -> None:
        """Add a vehicle that has come to the loop."""
        self.vehicles[vehicle] = None
        self._seen_s = nan

    def drop(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the loop."""
        del self.vehicles[vehicle]
        self._seen_s = nan

    def lead(self, vehicle: Vehicle, now_s: float = nan) -> float:
        """Return how far a vehicle is ahead of the middle between its neighbours, in even spacings.

        It is 0 in the middle, and 1 where the vehicle ahead is two even spacings nearer than the vehicle
        behind. `now_s`: the positions of all vehicles are looked up once for each time [s].
        """
        if self._seen_s != now_s:
            self._look(now_s)
        order, lap_s = self._order, self._lap_s
        many, rank = len(order), self._rank[vehicle]
        if many == 1:
            return 0.0
        here_s = order[rank][0]
        ahead_s = (order[(rank + 1) % many][0] - here_s) % lap_s
        behind_s, before = lap_s, rank
        while behind_s == lap_s and (before - 1) % many != rank:  # past those at the same place
            before = (before - 1) % many
            behind_s = lap_s - (order[before][0] - here_s) % lap_s
        return (behind_s - ahead_s) * many / (2.0 * lap_s)

    def _look(self, now_s: float) -> None:
        """Put all vehicles in order."""
        every = list(self.vehicles)
        self._order = sorted((self._at_s(vehicle), number) for number, vehicle in enumerate(every))
        self._rank = {every[number]: rank for rank, (_, number) in enumerate(self._order)}
        self._seen_s = now_s

    def _at_s(self, vehicle: Vehicle) -> float:
        """Return the time from the beginning of the loop to a vehicle's position [s]."""
        ends_m, ends_s = self._ends_m, self._ends_s
        at_m = vehicle.front_m % ends_m[-1]
        k = min(bisect_right(ends_m, at_m), len(ends_m) - 1)
        share = (at_m - ends_m[k - 1]) / (ends_m[k] - ends_m[k - 1])
        return ends_s[k - 1] + share * (ends_s[k] - ends_s[k - 1])


class Spacing(Part):
    """Holds or advises vehicles that are ahead on their loop.

    Parameters
    ----------
    rings
        By the name of the loop.
    advises
        Whether vehicles get speed advice; otherwise they are held at gates.
    """

    def __init__(self, traffic: Traffic, rings: Mapping[str, Ring], *, advises: bool) -> None:
        self._traffic, self._rings, self._advises = traffic, rings, advises
        self._on: dict[Vehicle, Ring] = {}
        self._next_s = 0.0
        self._told: dict[Vehicle, float] = {}

    def take_in(self, vehicle: Vehicle, track: Track) -> None:
        """Add a vehicle that has come."""
        ring = self._rings.get(track.loop)
        if ring is not None:
            self._on[vehicle] = ring
            ring.add(vehicle)

    def turned_off(self, vehicle: Vehicle, track: Track) -> None:
        """Space a vehicle on another loop."""
        self.forget(vehicle)
        self.take_in(vehicle, track)

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        ring = self._on.pop(vehicle, None)
        if ring is not None:
            ring.drop(vehicle)
        self._told.pop(vehicle, None)

    def holds(self, vehicle: Vehicle, now_s: float) -> Refusal | None:
        """Refuse a vehicle for a while if it is ahead on its loop and no vehicle waits behind it."""
        ring = self._on.get(vehicle)
        if ring is None or self._advises or len(vehicle.leg.place.line) > 1:
            return None
        waited_s = now_s - vehicle.since_s
        if waited_s >= _HOLD_S * len(ring.vehicles) / 2.0 or waited_s >= _HOLD_S * ring.lead(vehicle, now_s):
            return None
        return _SPACING

    def is_behind(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle is behind the middle between its neighbours."""
        ring = self._on.get(vehicle)
        return ring is not None and ring.lead(vehicle, self._traffic.now_s) < 0.0

    def look(self) -> None:
        """Give speed advice every 5 s; call it after each step."""
        if not self._advises or self._traffic.now_s < self._next_s:
            return
        self._next_s = self._traffic.now_s + _EVERY_S
        for vehicle, ring in self._on.items():
            factor = min(FASTEST, max(_SLOWEST, 1.0 - ring.lead(vehicle, self._traffic.now_s) / 2.0))
            if abs(factor - self._told.get(vehicle, FASTEST)) > _LEAST_CHANGE:
                self._told[vehicle] = factor
                self._traffic.advise(vehicle.name, factor)
