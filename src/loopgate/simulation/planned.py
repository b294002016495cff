"""Tells which vehicles stand and which streets are closed in a run, from its incidents and stops."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from loopgate.abstraction.itinerary import Track
from loopgate.network.incidents import Incidents
from loopgate.network.stops import Stop
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.demand.detours import stands_long
from loopgate.simulation.ways_round import WaysRound


class MadeStops(Protocol):
    """Knows the stops that vehicles are making."""

    def made_now(self) -> Iterator[tuple[str, Stop]]:
        """Yield each vehicle that stands at a stop, with the stop."""

    def may_take(self, vehicle: str, track: Track) -> bool:
        """Return whether a vehicle can make all its stops on a path."""


@dataclass(frozen=True, slots=True)
class PlannedStanding:
    """The standing vehicles and closed roads of a run.

    Attributes
    ----------
    incidents
        The closures and breakdowns.
    stops
        The stops that vehicles are making.
    brakes
        Whether a vehicle that breaks down must be told to stand.
    """

    incidents: Incidents
    stops: MadeStops
    brakes: bool = True

    def at_long_stop(self) -> list[str]:
        """Return the vehicles that stand on the road at a stop that is long or has no known end."""
        return [vehicle for vehicle, stop in self.stops.made_now() if stands_long(stop)]

    def may_take(self, vehicle: str, track: Track) -> bool:
        """Return whether a vehicle can make all its stops on a path, and none is near."""
        return self.stops.may_take(vehicle, track)


def find_ways_round(assembly: Assembly) -> WaysRound:
    """Return the loops of a run, and the detours round planned closures and stops."""
    every = (*assembly.tracks, *(track for track in assembly.later_tracks if track.legs))
    return WaysRound(assembly.network.edges, every, assembly.detours)
