"""Leads vehicles to other paths than their own: round incidents, or where another path is quicker."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Container, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from math import inf

from loopgate.abstraction.itinerary import DrawnLeg
from loopgate.abstraction.track import Track
from loopgate.control.blocking import ahead
from loopgate.control.driving import Driving
from loopgate.control.leading import wait_again, wait_for_nothing
from loopgate.control.places import Make, Vehicle
from loopgate.control.rules import chain
from loopgate.traffic.base import Dynamics, Traffic


class LedVehicle:
    """A gated vehicle whose path can be changed; in `attach`, its owner may change it too."""

    def __init__(self, driving: Driving, vehicle: Vehicle, track: Track) -> None:
        self._driving, self.vehicle, self.track = driving, vehicle, track
        self.id = vehicle.name

    @property
    def granted(self) -> int:
        """The number of the last leg granted to it."""
        return self.vehicle.granted

    @property
    def held(self) -> range:
        """The numbers of the legs whose places it holds."""
        return range(self.granted + 1 - len(self.vehicle.bodies), self.granted + 1)

    @property
    def crossed(self) -> range:
        """The numbers of the legs whose crossings its rear has not cleared."""
        vehicle = self.vehicle
        if not vehicle.trips:
            return range(0)
        return range(self.held[vehicle.bodies.index(vehicle.trips[0].into)] - 1, self.granted)

    @property
    def settled(self) -> bool:
        """Whether it is in one place and holds nothing else."""
        return self.vehicle.is_settled()

    @property
    def speed_mps(self) -> float:
        """Its speed in the last step [m/s]."""
        return self.vehicle.speed

    @property
    def stops_here(self) -> bool:
        """Whether it stops by itself before the end of its last granted leg."""
        return self.vehicle.stops_here()

    @property
    def front_m(self) -> float:
        """Arc length of its front after the last step [m]."""
        return self.vehicle.front_m

    @property
    def line_m(self) -> float:
        """Arc length at which its last granted leg ends [m]."""
        return self.vehicle.line_m

    @property
    def offset_m(self) -> float:
        """Arc length of its front minus its odometer [m]."""
        return self._driving.fronts.offset_m(self.vehicle.row)

    @property
    def length_m(self) -> float:
        """Its length [m]."""
        return self.vehicle.make.length_m

    @property
    def accel_mps2(self) -> float:
        """Its acceleration [m/s2]."""
        return self.vehicle.make.accel

    @property
    def decel_mps2(self) -> float:
        """Its deceleration [m/s2]."""
        return self.vehicle.make.decel

    @property
    def stop_m(self) -> float:
        """Arc length at which it stops next by itself [m]; infinity if it does not."""
        return self.vehicle.stop_m

    @property
    def halted(self) -> bool:
        """Whether it stands at the stop line where it is held."""
        return self._driving.accounts.of[self.id].halted_s < inf

    def drives_like(self, can: Dynamics, step_s: float) -> None:
        """Use new driving limits; a vehicle that is already faster than its top speed keeps its speed."""
        vehicle, haste = self.vehicle, max(1.0, can.speed_factor)
        top = self.track.top_speed_mps * haste
        if vehicle.speed > top:
            top = vehicle.speed + can.accel_mps2 * step_s
        before = vehicle.make
        now = (can.length_m, can.accel_mps2, can.decel_mps2, top, haste)
        if now != (before.length_m, before.accel, before.decel, before.top, before.haste):
            vehicle.make = Make(*now, foreseen=before.foreseen)
            self._driving.ledger.consider(vehicle)  # the vehicle may have to ask sooner

    def leg(self, number: int) -> DrawnLeg:
        """Return a leg of its endless path."""
        return self.track.legs[number % len(self.track.legs)]

    def left_m(self, state: str) -> float:
        """Return the distance to the end of a place that it holds [m]."""
        vehicle = self.vehicle
        for body in vehicle.bodies:
            if body.place.name == state:
                return body.out_m - vehicle.make.length_m - vehicle.front_m
        return vehicle.left_m()


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
        self._tracks = {track.vehicle: track for track in tracks}
        self._laid = {id(track.legs) for track in tracks}
        driving.paths.lay(tracks)
        self._known: dict[str, LedVehicle] = {}
        self._seen = -1
        self._withheld: AbstractSet[str] = frozenset()

    @property
    def sets_aside(self) -> bool:
        """Whether vehicles can step aside: only under the chain rule.

        Other gates need each vehicle in a place.
        """
        return chain in self._ledger.rules

    def know(self, tracks: Iterable[Track]) -> None:
        """Add the paths of vehicles that come."""
        self._tracks |= {track.vehicle: track for track in tracks}

    @property
    def changes(self) -> int:
        """How often vehicles have come, gone or changed to another path."""
        return self._driving.changes

    @property
    def driver_of(self) -> Mapping[str, LedVehicle]:
        """The gated vehicles, by name."""
        if self._seen != self._driving.changes:
            self._seen, known = self._driving.changes, self._known
            self._known = {
                name: known[name]
                if name in known and known[name].vehicle is vehicle
                else LedVehicle(self._driving, vehicle, self._tracks[name])
                for name, vehicle in self._ledger.vehicles.items()
            }
        return self._known

    @property
    def beside(self) -> Container[str]:
        """The vehicles without a slot: they park, or are not back on the road yet."""
        return {name for name, vehicle in self._ledger.vehicles.items() if vehicle.beside}

    def knows(self, track: Track) -> bool:
        """Return whether a path is laid out, so that vehicles can be led to it."""
        return id(track.legs) in self._laid

    def line(self, place: str) -> Sequence[LedVehicle]:
        """Return the vehicles in the line of a place, first in line first."""
        known = self.driver_of
        return [known[vehicle.name] for vehicle in self._driving.paths.places[place].line]

    def slots(self, place: str) -> int:
        """Return the number of slots of a place."""
        return self._driving.paths.places[place].slots

    def waits_behind(self, vehicle: str) -> Sequence[str]:
        """Return the vehicles that a vehicle waits for: the first in its line, else its blockers."""
        every = self._ledger.vehicles
        return [other.name for other in ahead(every[vehicle], every.values())]

    def shut(self, place: str) -> None:
        """Let no vehicle enter a place in the next step."""
        self._ledger.shut(self._driving.paths.places[place])

    def withhold(self, vehicles: AbstractSet[str]) -> None:
        """Grant nothing to these vehicles from now on.

        Vehicles that the call before named, and this call does not, get grants again.
        """
        every = self._ledger.vehicles
        for name in (self._withheld | vehicles) & every.keys():
            every[name].withheld = "stop" if name in vehicles else ""
        self._withheld = vehicles

    def turn_off(self, vehicle: str, track: Track, position: int) -> bool:
        """Lead a vehicle from its place to another path; return whether that can be done now."""
        if chain not in self._ledger.rules:
            return False  # another gate is made for the paths at its start
        led = self.driver_of[vehicle]
        track = replace(track, vehicle=vehicle, position=position)
        begins = [begin_m for begin_m, _ in track.edges]
        here = bisect_left(begins, track.legs[position].end_m) - 1
        if not self._driving.turn_off(led.vehicle, track, track.onward(here)):
            return False
        led.track = track
        return True

    def wait_for_nothing(self, vehicle: str) -> None:
        """Withdraw a vehicle's request and its stop at the line; it makes no request until `wait_again`.

        The caller stops the vehicle on the road.
        """
        waits = self._ledger.vehicles[vehicle]
        wait_for_nothing(self._ledger, waits)
        if waits.held:
            waits.held = waits.halted = False
            self._driving.accounts.of[vehicle].goes_on(self._traffic.now_s)
            self._traffic.release(vehicle)

    def wait_again(self, vehicle: str) -> None:
        """Let a vehicle ask for grants again."""
        wait_again(self._ledger, self._ledger.vehicles[vehicle])

    def step_aside(self, vehicle: str, why: str = "") -> bool:
        """Let a vehicle that parks give up its slot; return whether it does."""
        return self._driving.parking.begin(self._ledger.vehicles[vehicle], why)

    def call_back(self, vehicle: str) -> None:
        """Let a vehicle that waits for nothing drive on as soon as it is back on the road."""
        self._ledger.vehicles[vehicle].stop_m = inf
