"""Drives a scenario through the ledger for a test, with what no run counts: who waits though free to go."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, cast

import pandas as pd
import sumo

from loopgate.abstraction.itinerary import Abstraction, Track
from loopgate.audit import audit_events
from loopgate.control.departures import DepartureRules
from loopgate.control.diary import Diary
from loopgate.control.driving import Driving
from loopgate.control.start import VehicleStart
from loopgate.gates import make_gate
from loopgate.negotiation.registry import make_negotiation
from loopgate.network import RoadNetwork
from loopgate.network.additional import type_names
from loopgate.network.traffic_file import read_traffic
from loopgate.results.columns import EVENT_COLUMNS
from loopgate.simulation.asked_gate import NEVER_FULL
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.build import make_driving, slots_of
from loopgate.simulation.departures import limits_of
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.input import write_ordinary, write_sumo_input
from loopgate.simulation.sumo.start import plain_options, start_traffic
from loopgate.traffic.base import Traffic


@dataclass(frozen=True, slots=True)
class Driven:
    """What came of a drive."""

    events: pd.DataFrame
    findings: list[Any]
    km: float
    longest_s: float
    collisions: int
    """Those in which a vehicle under the gate has a part."""
    trespasses: int
    free_to_go: int
    """How often a vehicle waited after a step though no rule refused it."""
    arrived: int
    """How many vehicles have come to the ends of their ways."""
    on_red: int
    """How often a vehicle crossed a line on red."""
    joined: int
    """How many vehicles came in after the beginning."""
    ordinary: int
    """How many ordinary vehicles have been met."""
    served: int
    missed: int
    """`served`, `missed`: how many stops have been made and not made."""
    late_back_s: float
    """For how long vehicles stood parked beyond their stops [s]."""


class Turnover:
    """Vehicles that leave one after the other, and come in where they first stood, as soon as they can."""

    def __init__(
        self,
        traffic: Traffic,
        driving: Driving,
        outside: list[Track],
        starts: Sequence[VehicleStart],
        every_s: float,
    ) -> None:
        self._traffic, self._driving, self._outside, self._every_s = traffic, driving, outside, every_s
        self._insertions = {start.vehicle: start.insertion for start in starts}
        self._next_s = every_s
        self.joined = 0

    def step(self) -> None:
        """Let one go and one come, if it is time."""
        self._outside += self._driving.arrivals.missed
        self.joined -= len(self._driving.arrivals.missed)
        if self._traffic.now_s < self._next_s:
            return
        self._next_s += self._every_s
        vehicle = next(iter(self._driving.ledger.vehicles.values()))
        if self.joined:
            self._driving.leave(vehicle.name)
            self._traffic.take_out(vehicle.name)
        driving = self._driving
        fitting = [
            track
            for track in self._outside
            if driving.arrivals.is_clear(track)
            and driving.ledger.fits(driving.paths.of(track)[track.position])
        ]
        for track in fitting[:1]:
            if self._driving.arrivals.let_in(track, self._insertions[track.vehicle]):
                self._outside.remove(track)
                self.joined += 1


def places_of(scenario: Scenario, assembly: Assembly) -> tuple[Path, ...]:
    """Return the additional files with stopping places."""
    return tuple(dict.fromkeys((*scenario.stop_files, *assembly.stop_files)))


def ordinary_options(scenario: Scenario, assembly: Assembly, folder: Path) -> list[str]:
    """Return the options that give SUMO the ordinary vehicles, those of the route file too."""
    files = [str(file) for file in read_traffic(scenario.traffic).route_files] if scenario.traffic else []
    if assembly.others:
        file = folder / "ordinary.rou.xml"
        known = type_names(places_of(scenario, assembly))
        write_ordinary(assembly.ordinary, file, known=known, ungated=assembly.ungated)
        files.append(str(file))
    return ["--route-files", ",".join(files)] if files else []


def draw_trips(network: str, every_s: float, end_s: float, seed: int, file: Path) -> None:
    """Let SUMO draw ordinary trips that can be driven, one every so many seconds."""
    net = RoadNetwork.open(network).file
    words = ["-n", str(net), "-e", f"{end_s:g}", "-p", f"{every_s:g}", "--seed", str(seed), "--validate"]
    script = Path(sumo.SUMO_HOME) / "tools" / "randomTrips.py"
    command = [sys.executable, str(script), *words, "-o", f"{file}.trips.xml", "-r", str(file)]
    subprocess.run(command, check=True, capture_output=True, env={"SUMO_HOME": sumo.SUMO_HOME})


def drive(
    scenario: Scenario,
    assembly: Assembly,
    *,
    everybody: bool = False,
    watched: bool = False,
    turnover_s: float = 0.0,
) -> Driven:
    """Drive a scenario through the ledger.

    Parameters
    ----------
    everybody
        Whether everybody is asked in each step.
    watched
        Whether it is counted how often vehicles wait that are free to go.
    turnover_s
        So often a vehicle leaves and another comes in [s]; half of them are outside at the beginning. Never
        by default.
    """
    system = cast("Abstraction", assembly.abstraction).system
    collisions: set[tuple[str, str]] = set()
    left: list[tuple[Diary, str]] = []
    free_to_go, steps = 0, round(scenario.duration_s / scenario.step_s)
    among, own = bool(scenario.traffic or assembly.others), set(assembly.names)
    here = assembly.starts[: len(assembly.tracks) // 2] if turnover_s else assembly.starts
    gate, orders = make_gate(scenario.gate, system), make_negotiation("pressure", Random(scenario.seed))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        options = [
            *("--net-file", str(assembly.network.file)),
            *write_sumo_input(here, folder, beside=places_of(scenario, assembly), later=assembly.everybody),
            *plain_options(scenario, folder / "log"),
            *ordinary_options(scenario, assembly, folder),
        ]
        traffic = start_traffic(options, backend="libsumo", log=folder / "log", yields=among)
        try:
            traffic.step()
            driving = make_driving(scenario, assembly, traffic, gate, orders, everybody=everybody).driving
            ledger, sight = driving.ledger, driving.sight
            driving.on_leaving = lambda diary, why: left.append((diary, why))
            driving.paths.lay(one.track for one in assembly.departures)
            driving.take_in(assembly.tracks[: len(here)])
            room = sum(most for most in slots_of(assembly).values() if most < NEVER_FULL)
            due = assembly.departures
            limits = limits_of(assembly.network, due)
            departures = DepartureRules(traffic, driving, due, room, limits)
            turnover = Turnover(
                traffic, driving, list(assembly.tracks[len(here) :]), assembly.starts, turnover_s
            )
            for _ in range(steps):
                driving.step()
                found = [(c.collider, c.victim) for c in traffic.collisions()]
                collisions.update(pair for pair in found if not own.isdisjoint(pair))
                if watched:
                    waiting = [v for v in ledger.vehicles.values() if v.asks and v.leg.place.line[0] is v]
                    free_to_go += sum(not (ledger.why_not(v) or v.woken) for v in waiting)
                departures.look()
                if turnover_s:
                    turnover.step()
        finally:
            traffic.close()
    waits = [one.worst_wait_s(ledger.now_s) for one in driving.diary_of.values()]
    events = pd.DataFrame([(*row, "") for row in driving.rows], columns=list(EVENT_COLUMNS))
    laps = {diary.vehicle.name: diary.all_laps for diary in driving.diaries}
    return Driven(
        events=events,
        findings=[] if turnover_s or assembly.departures else audit_events(events, system, laps=laps),
        km=driving.totals.take_flow(driving.diaries)[2] / 1000.0,
        longest_s=max([*waits, *(one.worst_wait_s(ledger.now_s) for one, _ in left)]),
        collisions=len(collisions),
        trespasses=ledger.trespasses,
        free_to_go=free_to_go,
        arrived=sum(why == "arrived" for _, why in left),
        on_red=driving.lights.on_red,
        joined=turnover.joined,
        ordinary=sight.met if sight else 0,
        served=driving.stops.served,
        missed=driving.stops.missed,
        late_back_s=driving.parking.late_s,
    )
