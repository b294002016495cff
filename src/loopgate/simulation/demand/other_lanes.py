"""Finds the starts that a trip could have on the lanes of other trips over the same edges."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable

from loopgate.abstraction.itinerary import Itinerary, Track
from loopgate.control.start import VehicleStart
from loopgate.network import VehicleDemand
from loopgate.simulation.demand.allotment import departs_in_place
from loopgate.simulation.demand.shared_lanes import led_over, wanted_lane


class OtherLanes:
    """The lanes of trips, by their edges and their type.

    A vehicle with a stop keeps its own lanes: its stop may lie on one of them.

    Parameters
    ----------
    trips
        Each trip with its itinerary, and with the path over it.
    """

    def __init__(self, trips: Iterable[tuple[VehicleDemand, Itinerary, Track]] = ()) -> None:
        self._trips: dict[str, VehicleDemand] = {}
        self._ways: defaultdict[Hashable, dict[str, tuple[Itinerary, Track]]] = defaultdict(dict)
        for trip, way, track in trips:
            if trip.loop.closed or trip.stops or trip.led.goes_on:
                continue
            self._trips[trip.id] = trip
            self._ways[_road(trip)].setdefault(trip.loop.id, (way, track))

    def __bool__(self) -> bool:
        return any(len(ways) > 1 for ways in self._ways.values())

    def __contains__(self, vehicle: str) -> bool:
        return vehicle in self._trips

    def starts(self, vehicle: str) -> list[VehicleStart]:
        """Return the starts of a trip on other lanes than its own; none if it is not one of the trips."""
        trip = self._trips.get(vehicle)
        if trip is None:
            return []
        wanted, ways = wanted_lane(trip), self._ways[_road(trip)]
        return [
            departs_in_place(led_over(trip, way.loop), way, track)
            for name, (way, track) in ways.items()
            if name != trip.loop.id and wanted in (None, way.loop.roads[trip.edge].lane_in)
        ]


def _road(trip: VehicleDemand) -> Hashable:
    return trip.loop.edges, trip.edge, trip.type
