"""Opens a run under SUMO's own right of way: the same drive as under a gate, without rules."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from loopgate.abstraction.itinerary import DrawnLeg, Track
from loopgate.control.driving import Driving
from loopgate.control.layout import Layout
from loopgate.control.ledger import Ledger
from loopgate.control.start import VehicleStart
from loopgate.model import StateId
from loopgate.results.recorder import Recorder
from loopgate.simulation.asked_gate import NEVER_FULL
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.containment import Containment
from loopgate.simulation.departures import Departures
from loopgate.simulation.drive import Drive
from loopgate.simulation.gated_run import spacing_of
from loopgate.simulation.leading import Leading
from loopgate.simulation.planned import PlannedStanding, find_ways_round
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.session import Session, StopFigures
from loopgate.traffic.base import Traffic


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

    def look(self) -> None:
        """Add the vehicles that SUMO has inserted in the last step."""
        if len(self.departed_s) == len(self._starts):
            return
        tracks: list[Track] = []
        for vehicle in self._traffic.departed():
            start = self._starts.get(vehicle)
            if start is None or vehicle in self.departed_s:
                continue
            self.departed_s[vehicle] = self._traffic.now_s - self._traffic.step_s
            at_m = start.loop.roads[start.edge].begin_m + self._traffic.lane(vehicle)[1]
            tracks.append(alone(replace(start.track, start_m=at_m)))
        if tracks:
            self._driving.welcome(tracks)


def open_ungated(scenario: Scenario, assembly: Assembly, traffic: Traffic, recorder: Recorder) -> Session:
    """Return a session in which no vehicle asks for grants: SUMO's right of way decides."""
    driving = Driving(
        traffic,
        Layout(dict.fromkeys(assembly.names, NEVER_FULL), []),
        Ledger([], step_s=scenario.step_s),
        stops=assembly.stops,
        spacing=spacing_of(scenario, assembly, traffic),
    )
    tracks = [alone(track) for track in assembly.tracks]
    drive = Drive(traffic, recorder, driving, tracks, None)
    leading = Leading(traffic, driving, tracks)
    stops = StopFigures(driving)
    departures, looks = Departures(()), list[Callable[[], None]]()
    if assembly.departures:
        departures = UngatedDepartures(assembly.departures, traffic, driving)
        looks.append(departures.look)
    containment = None
    if assembly.contains:
        standing = PlannedStanding(assembly.incidents, driving.stops, assembly.stops)
        waits, round_ = scenario.standing == "wait", find_ways_round(assembly)
        containment = Containment(standing, round_, traffic, leading, recorder, waits=waits, gated=False)
        looks.append(containment.look)
    return Session(
        traffic, drive, recorder, None, None, stops, departures, None, containment, tuple(looks), ()
    )
