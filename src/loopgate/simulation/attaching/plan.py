"""The loops of the vehicles under an attached gate, cut into places and crossings; loops can be added."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from loopgate.abstraction.itinerary import Crossing, DrawnLeg, Itinerary, Track, make_track
from loopgate.abstraction.movements import QueuePlace
from loopgate.abstraction.queue_layout import QueueLayout, lay_out_queues
from loopgate.network import Loop, RoadNetwork, VehicleType


class Plan:
    """Loops, the types of vehicles on them, and the places and crossings that follow from both.

    Parameters
    ----------
    users
        Each loop with each type of vehicle on it.

    Raises
    ------
    RefusedLoopError
        If a loop cannot be cut into queues.
    """

    def __init__(self, network: RoadNetwork, users: tuple[tuple[Loop, VehicleType], ...]) -> None:
        self.network = network
        self.users = users
        self.layout: QueueLayout = lay_out_queues(network, users)
        self._tracks = {name: make_track(network, way) for name, way in self.layout.itineraries.items()}

    def extended(self, users: Iterable[tuple[Loop, VehicleType]]) -> Plan:
        """Return a plan with further loops and types; the same plan if it has all of them."""
        every = tuple(dict.fromkeys((*self.users, *users)))
        return self if len(every) == len(self.users) else Plan(self.network, every)

    @property
    def room(self) -> dict[str, int]:
        """The capacity of each place, by name."""
        return {name: place.capacity for name, place in self.layout.places.items()}

    @property
    def itineraries(self) -> list[Itinerary]:
        """The itineraries of all loops."""
        return list(self.layout.itineraries.values())

    @property
    def tracks(self) -> list[Track]:
        """A path for each loop, without a vehicle."""
        return list(self._tracks.values())

    def track(self, vehicle: str, loop: str, *, front_m: float, position: int) -> Track:
        """Return the path of a vehicle from a position on its loop."""
        known = self._tracks[loop]
        return replace(known, vehicle=vehicle, start_m=front_m, position=position, renews=True)

    def goes_on_with(self, earlier: Plan) -> bool:
        """Return whether vehicles under an earlier plan can follow this plan without joining anew.

        They can if their places and the roads between the places are the same, and no two movements of the
        earlier plan come into conflict. A new movement may conflict with an earlier movement.
        """
        before, now = earlier.layout, self.layout
        movements = {c.id for way in earlier.itineraries for leg in way.legs for c in leg.crossings}
        return all(_as_before(now.places.get(name), place) for name, place in before.places.items()) and all(
            _among(movements, way.legs) == _among(movements, now.itineraries[name].legs)
            for name, way in before.itineraries.items()
        )


def _as_before(now: QueuePlace | None, before: QueuePlace) -> bool:
    """Return whether a place lies where it was and has the same slots; more loops may lead to it."""
    return now is not None and (now.length_m, now.capacity) == (before.length_m, before.capacity)


def _among(movements: set[str], legs: tuple[DrawnLeg, ...]) -> list[DrawnLeg]:
    """Return the legs without conflicts that involve other movements than these."""
    return [replace(leg, crossings=tuple(_without(movements, c) for c in leg.crossings)) for leg in legs]


def _without(movements: set[str], crossing: Crossing) -> Crossing:
    overlaps = {foe: where for foe, where in crossing.overlaps.items() if foe in movements}
    sized = {foe: table for foe, table in crossing.sized.items() if foe in movements}
    return replace(crossing, foes=crossing.foes & movements, overlaps=overlaps, sized=sized)
