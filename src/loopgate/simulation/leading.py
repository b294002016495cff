"""Leads vehicles to other paths than their own: round incidents, or where another path is quicker."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Container, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

from loopgate.abstraction.itinerary import Track
from loopgate.control.blocking import ahead
from loopgate.control.diary import Diary
from loopgate.control.driving import Driving, make_of
from loopgate.control.places import STANDING_MPS
from loopgate.gates.base import Reason
from loopgate.traffic.base import Dynamics, Traffic

_MOST_NAMED = 3
"""Most vehicles that are named for which a vehicle waits."""


class Leading:
    """Leads vehicles to other paths, by the name of a vehicle or of a place.

    Parameters
    ----------
    driving
        Drives the vehicles.
    tracks
        The paths of all vehicles, also of later ones, and all other paths. They are laid out at once.
    """

    def __init__(self, traffic: Traffic, driving: Driving, tracks: Iterable[Track]) -> None:
        self._traffic, self._driving, self._ledger = traffic, driving, driving.ledger
        tracks = list(tracks)
        self._laid = {id(track.legs) for track in tracks}
        driving.paths.lay(tracks)
        self._withheld: AbstractSet[str] = frozenset()

    @property
    def changes(self) -> int:
        """How often vehicles have come, gone or changed to another path."""
        return self._driving.changes

    @property
    def diaries(self) -> Mapping[str, Diary]:
        """The diaries of the vehicles on the road, by name of the vehicle."""
        return self._driving.diary_of

    @property
    def beside(self) -> Container[str]:
        """The vehicles without a slot: they park, or are not back on the road yet."""
        return {name for name, vehicle in self._ledger.vehicles.items() if vehicle.beside}

    def knows(self, track: Track) -> bool:
        """Return whether a path is laid out, so that vehicles can be led to it."""
        return id(track.legs) in self._laid

    def line(self, place: str) -> Sequence[Diary]:
        """Return the diaries of the vehicles in the line of a place, first in line first."""
        return [self.diaries[vehicle.name] for vehicle in self._driving.paths.places[place].line]

    def slots(self, place: str) -> int:
        """Return the number of slots of a place."""
        return self._driving.paths.places[place].slots

    def least_slots(self, place: str) -> int:
        """Return the number of slots that a place has at any time."""
        return self._driving.paths.places[place].least

    def waits_behind(self, vehicle: str) -> Sequence[str]:
        """Return the vehicles that a vehicle waits for: the first in its line, else its blockers."""
        every = self._ledger.vehicles
        return [other.name for other in ahead(every[vehicle], every.values(), self._ledger.gate)]

    def why(self, vehicle: str) -> str:
        """Return why a vehicle may not go on now, and for whom it waits, in words; "" if it may."""
        one = self._ledger.vehicles[vehicle]
        first = one.leg.place.line[0] if one.leg.place.line else one
        if first is not one:
            return f"{Reason.BEHIND.words}: {first.name}" if one.held or one.speed <= STANDING_MPS else ""
        if not one.asks or not one.reason:
            return ""
        known = {str(reason): reason.words for reason in Reason}
        words = known.get(one.reason, one.reason) + (f": {one.cause}" if one.cause else "")
        others = self.waits_behind(vehicle)
        return (
            words if one.cause or not others else f"{words}; it waits for {', '.join(others[:_MOST_NAMED])}"
        )

    def close(self, place: str, reason: str, cause: str) -> None:
        """Refuse all vehicles that want to enter a place for this reason; an empty reason opens it again."""
        known = self._driving.paths.places.get(place)
        if known is not None:
            self._ledger.close(known, reason, cause)

    def stand(self, causes: Mapping[str, str]) -> None:
        """Refuse vehicles that want to cross where one of these vehicles stands; no other vehicle stands.

        `causes`: which vehicle, why and until when, by its name.
        """
        for name, vehicle in self._ledger.vehicles.items():
            vehicle.stands = causes.get(name, "")

    def withhold(self, reasons: Mapping[str, str]) -> None:
        """Grant nothing to these vehicles from now on, each for its reason.

        Vehicles that the call before named, and this call does not, get grants again.
        """
        every = self._ledger.vehicles
        for name in (self._withheld | reasons.keys()) & every.keys():
            every[name].withheld = reasons.get(name, "")
        self._withheld = reasons.keys()

    def turn_off(self, vehicle: str, track: Track, position: int) -> bool:
        """Lead a vehicle from its place to another path; return whether that can be done now."""
        if not self._ledger.by_chain:
            return False  # another gate is made for the paths at its start
        track = replace(track, vehicle=vehicle, position=position)
        begins = [begin_m for begin_m, _ in track.edges]
        here = bisect_left(begins, track.legs[position].end_m) - 1
        return self._driving.turn_off(self._ledger.vehicles[vehicle], track, track.onward(here))

    def drives_like(self, vehicle: str, can: Dynamics) -> None:
        """Use new driving limits; a vehicle that is already faster than its top speed keeps its speed."""
        diary, haste = self.diaries[vehicle], max(1.0, can.speed_factor)
        one, top = diary.vehicle, diary.track.top_speed_mps * haste
        if one.speed > top:
            top = one.speed + can.accel_mps2 * self._traffic.step_s
        before = one.make
        one.make = make_of(can, top, foreseen=before.foreseen, brakes_late=before.brakes_late)
        if one.make.figures != before.figures:
            self._ledger.consider(one)  # the vehicle may have to ask sooner
