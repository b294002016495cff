"""Puts vehicles on the road while others drive, and into the ledger once they have departed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.ledger import Ledger
from loopgate.control.paths import Paths
from loopgate.errors import TrafficError
from loopgate.traffic.base import Insertion, Traffic

_GAP_M: Final = 2.5
"""The gap of a new vehicle to the vehicle ahead [m]."""


class Arrivals:
    """Inserts vehicles in SUMO, and puts them into the ledger in the step in which they depart."""

    def __init__(self, traffic: Traffic, ledger: Ledger, paths: Paths) -> None:
        self._traffic, self._ledger, self._paths = traffic, ledger, paths
        self.coming: list[Track] = []
        """The vehicles that shall depart in the next step, with their paths."""
        self.missed: list[Track] = []
        """The vehicles that found no space on the road in the last step, with their paths."""
        self.departed_s: dict[str, float] = {}
        """When each vehicle of `let_in` departed [s]."""

    def let_in(self, track: Track, insertion: Insertion) -> bool:
        """Let a vehicle depart in the next step; call it only if `is_clear` and `Ledger.fits` allow that.

        Return False if SUMO cannot insert it so that it can brake for its stop line.
        """
        line = track.legs[track.position].line
        self._traffic.put_in(track.vehicle, insertion)
        try:
            self._traffic.hold(track.vehicle, line.edge, line.lane, line.position_m)
        except TrafficError:
            self._traffic.take_out(track.vehicle)
            return False
        self.coming.append(track)
        return True

    def come(self, welcome: Callable[[Sequence[Track]], None]) -> None:
        """Call `welcome` for each vehicle that has departed, before the ledger grants its slot to another."""
        departed = set(self._traffic.departed()) if self.coming else set[str]()
        coming, self.coming, self.missed = self.coming, [], []
        for track in coming:
            # Two vehicles that come in one step could close a circle together.
            if track.vehicle in departed and self._ledger.fits(self._paths.of(track)[track.position]):
                welcome([track])
                self._ledger.vehicles[track.vehicle].held = True
                self.departed_s[track.vehicle] = self._traffic.now_s - self._traffic.step_s
            else:
                self._traffic.take_out(track.vehicle)
                self.missed.append(track)

    def is_clear(self, track: Track, gap_m: float = _GAP_M) -> bool:
        """Return whether the place where a vehicle starts has a free slot, and all its vehicles are ahead.

        `gap_m`: the gap that the vehicle keeps to them [m].
        """
        leg = self._paths.of(track)[track.position]
        clear_m = track.front_m - leg.begin_m + gap_m
        if leg.place.is_full():
            return False
        for body in leg.place.bodies:
            other = body.vehicle
            rear_m = other.front_m - body.begin_m - other.make.length_m
            if rear_m < clear_m or (other.parks and other.stops_here()):
                return False
        return True
