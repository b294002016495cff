"""Vehicles that depart during a run: wanted and real departure times, and figures of their arrivals."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from loopgate.abstraction.itinerary import DrawnLeg, Track
from loopgate.control.departures import DepartureRules, Manner
from loopgate.control.diary import Diary
from loopgate.control.driving import Driving
from loopgate.control.places import Place
from loopgate.control.start import VehicleStart
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.model import StateId
from loopgate.network import RoadNetwork
from loopgate.traffic.base import Traffic


@dataclass(frozen=True, slots=True)
class Arrived:
    """What a vehicle did that has arrived.

    Attributes
    ----------
    at_s
        When it arrived [s].
    distance_m, hold_s, stood_s, longest_stood_s, longest_wait_s
        Its distance [m], hold time, standing time, longest time standing and longest wait for a grant [s].
    odometer_m, top_mps
        Its odometer one step before [m], and its top speed [m/s].
    """

    at_s: float
    distance_m: float
    hold_s: float
    stood_s: float
    longest_stood_s: float
    longest_wait_s: float
    odometer_m: float
    top_mps: float


class Departures:
    """Wanted and real departure times of vehicles.

    Parameters
    ----------
    departures
        In the order of the wanted times.
    """

    def __init__(self, departures: Sequence[VehicleStart]) -> None:
        self._coming = deque(departures)
        self.wanted_s = {one.vehicle: one.demand.depart_s for one in departures}
        """When vehicles wanted to depart [s]."""
        self.departed_s: dict[str, float] = {}
        """When vehicles departed [s]."""
        self.arrived: dict[str, Arrived] = {}
        """The vehicles that have driven their routes to the end, by name."""

    @property
    def over(self) -> bool:
        """Whether every vehicle has departed."""
        return not self._coming

    def look(self) -> None:
        """Let the vehicles depart that are due; call it after each step."""

    def delay_s(self, vehicle: str, now_s: float) -> float:
        """Return how long a vehicle waited to depart, or has waited so far [s]."""
        wanted_s = self.wanted_s.get(vehicle, now_s)
        return max(0.0, self.departed_s.get(vehicle, now_s) - wanted_s) if vehicle in self.wanted_s else 0.0

    def report(self, now_s: float) -> dict[str, Any]:
        """Return the figures of departures for ``summary.json``; empty if no vehicle departs later."""
        due = [vehicle for vehicle, at_s in self.wanted_s.items() if at_s <= now_s]
        if not self.wanted_s:
            return {}
        delays = [self.delay_s(vehicle, now_s) for vehicle in due]
        return {
            "departed": len(self.departed_s),
            "waiting_to_depart": len(due) - len(self.departed_s),
            "mean_depart_delay_s": round(sum(delays) / len(delays), 3) if delays else 0.0,
            "max_depart_delay_s": round(max(delays, default=0.0), 3),
        }


def limits_of(network: RoadNetwork, starts: Iterable[VehicleStart]) -> dict[str, float]:
    """Return the speed limit of each place on the paths of vehicles, by name [m/s]."""
    paths = {id(one.track.legs): one.track.legs for one in starts}.values()
    lines = {leg.state: leg.line for path in paths for leg in path if not leg.away}
    return {name: network.edges[line.edge].lanes[line.lane].speed_mps for name, line in lines.items()}


class GatedDepartures(Departures):
    """Wanted and real departure times of gated vehicles, and figures of the vehicles that have arrived.

    Parameters
    ----------
    driving
        Drives the vehicles that are there from the beginning.
    slots
        Number of slots of all places on the road.
    admits
        Returns whether the gate would admit a further vehicle. By default, condition (S) of
        `loopgate.gates.certified.crowding` decides for vehicles on loops.
    manner
        As for `loopgate.control.departures.DepartureRules`.
    """

    def __init__(
        self,
        departures: Sequence[VehicleStart],
        network: RoadNetwork,
        traffic: Traffic,
        driving: Driving,
        slots: int,
        admits: Callable[[Track], bool] | None = None,
        *,
        manner: Manner,
    ) -> None:
        self._manner = manner
        super().__init__(departures)
        self._admits = admits or self._may_stay
        self._traffic, self._driving = traffic, driving
        self._due, self._slots = departures, slots
        self._limits = limits_of(network, departures)
        self._rules: DepartureRules | None = None
        self.departed_s = driving.arrivals.departed_s
        driving.paths.lay([one.track for one in self._due])
        once = {id(one.track.legs): one.track for one in self._due if one.track.legs[-1].away}
        self._passing = [driving.paths.of(track) for track in once.values()]
        driving.on_leaving = self._leaves

    @property
    def over(self) -> bool:
        """Whether all vehicles have departed and arrived."""
        return len(self.departed_s) == len(self._due) and not self._driving.ledger.vehicles

    def look(self) -> None:
        """Let vehicles depart that are due and may."""
        if self._rules is None:  # by now the vehicles of the beginning are on the road
            rules = self._traffic, self._driving, self._due, self._slots, self._limits
            self._rules = DepartureRules(*rules, admits=self._admits, manner=self._manner)
        self._rules.look()

    def _may_stay(self, track: Track) -> bool:
        """Return whether all vehicles, later trips too, can go on for ever with one more on a loop."""
        driving = self._driving
        if track.legs[-1].away:
            return True
        coming = [one for one in (*driving.arrivals.coming, track) if not one.legs[-1].away]
        number: dict[Place, int] = {}
        loops, passing = (
            [[number.setdefault(leg.place, len(number)) for leg in path] for path in paths]
            for paths in ([*driving.rounds, *map(driving.paths.of, coming)], self._passing)
        )
        return find_crowd(loops, [max(SPARE, place.least) for place in number], passing) is None

    def _leaves(self, diary: Diary, _why: str) -> None:
        """Store the figures of a vehicle that has arrived."""
        now_s, vehicle = self._traffic.now_s, diary.vehicle
        self.arrived[vehicle.name] = Arrived(
            now_s,
            diary.distance_m,
            diary.total_hold_s(now_s),
            diary.stood_s,
            diary.longest_stood_s,
            diary.worst_wait_s(now_s),
            vehicle.front_m - vehicle.offset_m,
            vehicle.make.top,
        )


def alone(track: Track) -> Track:
    """Return a path without requests: one endless leg in a place of the vehicle's own."""
    front_m = track.front_m
    leg = DrawnLeg(StateId(track.vehicle), front_m, front_m + track.lap_m)
    return replace(track, legs=(leg,), position=0, start_m=front_m)


class UngatedDepartures(Departures):
    """Adds vehicles to the drive that SUMO inserts by itself.

    Parameters
    ----------
    departures
        In the order of the wanted times.
    """

    def __init__(
        self,
        departures: Sequence[VehicleStart],
        traffic: Traffic,
        driving: Driving,
    ) -> None:
        super().__init__(departures)
        self._traffic, self._driving = traffic, driving
        self._starts = {one.vehicle: one for one in departures}
        self._fresh = traffic.vehicles
        """Returns who may have departed; at first everybody, since steps were made before the first look."""

    def look(self) -> None:
        """Add the vehicles that SUMO has inserted in the last step."""
        if len(self.departed_s) == len(self._starts):
            return
        tracks: list[Track] = []
        fresh, self._fresh = self._fresh(), self._traffic.departed
        for vehicle in fresh:
            start = self._starts.get(vehicle)
            if start is None or vehicle in self.departed_s:
                continue
            self.departed_s[vehicle] = self._traffic.now_s - self._traffic.step_s
            at_m = start.loop.roads[start.edge].begin_m + self._traffic.lane(vehicle)[1]
            tracks.append(alone(replace(start.track, start_m=at_m)))
        if tracks:
            self._driving.welcome(tracks)
