"""Runs a SUMO configuration unchanged, and looks for deadlocks."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from math import nan
from pathlib import Path
from time import perf_counter
from typing import Any

from loopgate.disk import writing
from loopgate.errors import NobodyGatedError, ScenarioError
from loopgate.network import RoadNetwork
from loopgate.network.additional import type_names
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.traffic_file import Names, TrafficFile, check_flows, flows_in, read_flows, read_traffic
from loopgate.network.ungated import UngatedFleet
from loopgate.results.columns import BEGINS
from loopgate.results.recorder import Recorder
from loopgate.simulation import run_folder
from loopgate.simulation.assembly import read_vehicles
from loopgate.simulation.loop_run import CollisionLog, RunCourse, Tick, after, run_to_end
from loopgate.simulation.monitoring import monitoring_figures
from loopgate.simulation.positions import record_positions
from loopgate.simulation.run_folder import Folder, Tally
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.input import without_vehicles, write_ordinary
from loopgate.simulation.sumo.start import TRIPS, DiskGuard, output_options, plain_options, start_traffic
from loopgate.simulation.sumo_options import SumoOptions, begins_s, sumo_options
from loopgate.simulation.watching.deadlock_detector import DeadlockDetector
from loopgate.simulation.watching.flow import Row, flow_table, with_last_parts
from loopgate.simulation.watching.mileage import Mileage
from loopgate.simulation.watching.road_waits import RoadWaits, SimulatedRoad
from loopgate.simulation.watching.trips import Trip, read_trips
from loopgate.traffic.base import Traffic

_OF_LOOPS = ("incidents", "spacing", "starts", "revisit_s", "weights", "districts")
_GONE = (0.0, (nan, nan))


def run_plainly(scenario: Scenario, folder: Folder, tick: Tick, backend: str) -> dict[str, Any]:
    """Run the configuration's own vehicles under SUMO's rules; return the content of ``summary.json``.

    The run ends when its last vehicle has arrived (without counting ordinary traffic), after the scenario's
    duration, by default the configuration's, or in a deadlock. Options that hide trouble are off (see
    `plain_options`); all others are as in the configuration. Vehicles may come and go; each trip is a row of
    ``vehicles.parquet``, without a loop and laps.

    Parameters
    ----------
    scenario
        Its network is a ``.sumocfg``, its gate ``open``.
    folder, tick, backend
        As for `loopgate.simulation.run.simulate`.
    """
    _refuse_keys_of_loops(scenario)
    began = perf_counter()
    said = sumo_options(scenario)
    with writing(folder / run_folder.SCENARIO):
        scenario.write(folder / run_folder.SCENARIO)
    log = folder / run_folder.SUMO_LOG
    ordinary = read_traffic(scenario.traffic) if scenario.traffic else None
    _check_flows(scenario, ordinary)
    files, own = _own_files(scenario, folder, said, ordinary)
    options = [
        *said.arguments,
        *files,
        *(("--begin", f"{scenario.begin_s:g}") if scenario.begin_s >= 0.0 and not files else ()),
        *plain_options(scenario, log),
        *output_options(scenario, folder.path, trips=True),
        *(record_positions(folder / run_folder.POSITIONS) if scenario.positions else ()),
    ]
    standing: dict[str, tuple[float, tuple[float, float]]] = {}
    rows: list[Row] = []
    with ExitStack() as stack:
        traffic = start_traffic(options, backend=backend, log=log, words=scenario.sumo, trains=True)
        stack.callback(traffic.close)
        recorder = Recorder(folder / run_folder.EVENTS)
        stack.callback(recorder.close)
        course = RunCourse()
        mileage = Mileage(traffic, own)
        begins = traffic.now_s
        detector = DeadlockDetector(
            traffic,
            RoadWaits(
                RoadNetwork.open(scenario.network), SimulatedRoad(traffic), impatient_s=traffic.impatient_s()
            ),
            after_s=scenario.deadlock_after_s,
            own=own,
        )
        detector.again = scenario.on_deadlock == "teleport"
        collisions = CollisionLog(traffic, recorder, course, own=own)
        guard = [DiskGuard(folder / run_folder.POSITIONS).check] if scenario.positions else []
        end_s = begins + scenario.warmup_s + scenario.duration_s
        drive = PlainDrive(traffic, mileage, None if own is None else own.departing(end_s))
        run_to_end(
            drive,
            traffic,
            detector,
            collisions,
            scenario=scenario,
            tick=after(lambda: rows.append(mileage.flow()), tick),
            each_step=guard,
            over=drive.is_over,
        )
        standing = {v: (detector.standing_s(v), traffic.position(v)) for v in traffic.vehicles()}
    course.total_s = perf_counter() - began
    everybody = read_trips(folder / TRIPS, interrupted=course.outcome == "interrupted").values()
    found = [trip for trip in everybody if own is None or trip.vehicle in own]
    tallies = [_tally(trip, standing, mileage) for trip in found]
    _write_flow(rows, mileage, found, folder)
    folder.write_vehicles(tallies)
    folder.write_edges([], begin_s=course.begin_s, end_s=max(course.end_s, course.begin_s + 1.0))
    absent = ordinary.absent(begins, end_s) if ordinary else ()
    notes = [*said.notes, *said.taken_over_by(options), *absent]
    if course.outcome != "interrupted":
        notes += _untold(mileage, everybody)
    summary = run_folder.summary(scenario, course, tallies, loops=0, folder=folder, warnings=notes)
    summary |= monitoring_figures(None, None) | {BEGINS: round(begins, 3)}
    if own is not None:
        others = sum(trip.departed for trip in everybody if trip.vehicle not in own)
        summary["others"] = {"vehicles": others, "collisions": course.collisions_of_others}
    folder.write_summary(summary)
    return summary


def _refuse_keys_of_loops(scenario: Scenario) -> None:
    given = scenario.to_dict()
    for key in _OF_LOOPS:
        if given[key] != dataclasses.asdict(Scenario(network=scenario.network))[key]:
            msg = (
                f"{scenario.network}: {key} {given[key]} is for vehicles on loops, and no vehicle of "
                "the configuration is on a loop; give loops (--routes, --loops), or leave it out"
            )
            raise ScenarioError(msg)
    if scenario.drivers == "machine" and not scenario.routes:
        msg = (
            f"{scenario.network}: drivers machine: SUMO reads the vehicles of a configuration itself; "
            "give its network and its route file (--routes)"
        )
        raise ScenarioError(msg)


def _check_flows(scenario: Scenario, ordinary: TrafficFile | None) -> None:
    """Refuse flows with more vehicles than the memory allows."""
    begin_s = begins_s(scenario)
    end_s = begin_s + scenario.duration_s
    if not scenario.routes:
        config = read_sumo_config(scenario.network)
        flows = flows_in((*config.route_files, *config.additional_files))
        check_flows(flows, begin_s, end_s, config.file)
    if ordinary is not None:
        check_flows(ordinary.flows, begin_s, end_s, ordinary.file)


def _own_files(
    scenario: Scenario, folder: Folder, said: SumoOptions, ordinary: TrafficFile | None
) -> tuple[list[str], Names | None]:
    """Return SUMO's options for network and routes, if the scenario names a route file.

    The second value has the names of the vehicles whose trips are reported, where there is ordinary traffic
    beside them; otherwise None.
    """
    if not scenario.routes:
        return [], None
    network = RoadNetwork.open(scenario.network)
    try:
        vehicles, _, file = read_vehicles(scenario, network)
    except NobodyGatedError:  # all are as their file has them
        return _unchanged(scenario, network.file, said, ordinary)
    beside = tuple(dict.fromkeys((*said.additional_files, *(file.stop_files if file else ()))))
    ungated = file.ungated if file and not scenario.counts_vehicles else UngatedFleet()
    write_ordinary(vehicles, folder / run_folder.ORDINARY, known=type_names(beside), ungated=ungated)
    own, routes = None, [str(folder / run_folder.ORDINARY)]
    if ordinary:
        apart = [one.element for one in ungated.vehicles]
        own = Names(
            frozenset((*(v.id for v in vehicles), *(v.id for v in ungated.vehicles))),
            dict(read_flows(one for one in apart if one.tag == "flow")),
        )
        ordinary.check_names(own)
        beside = tuple(dict.fromkeys((*beside, *ordinary.additional_files)))
        routes += map(str, ordinary.route_files)
    options = ["--net-file", str(network.file), "--route-files", ",".join(routes)]
    off = scenario.rule_for_lights == "off"
    beside = without_vehicles(beside, file.vehicle_files if file else (), folder.path, lights_off=off)
    options += ["--additional-files", ",".join(map(str, beside))] if beside else []
    begin = [] if is_sumo_config(scenario.network) else ["--begin", f"{begins_s(scenario, file):g}"]
    return [*options, *begin, *ungated.options], own


def _unchanged(
    scenario: Scenario, network: Path, said: SumoOptions, ordinary: TrafficFile | None
) -> tuple[list[str], Names | None]:
    """Return what `_own_files` returns, with the vehicles of the route file as the file has them."""
    mine = read_traffic(scenario.routes)
    every = [mine, ordinary] if ordinary else [mine]
    if ordinary:
        ordinary.check_names(mine.names)
    routes = ",".join(str(file) for one in every for file in one.route_files)
    options = ["--net-file", str(network), "--route-files", routes]
    beside = [
        *said.additional_files,
        *scenario.stop_files,
        *(f for one in every for f in one.additional_files),
    ]
    options += ["--additional-files", ",".join(map(str, dict.fromkeys(beside)))] if beside else []
    if not is_sumo_config(scenario.network):
        begin_s = scenario.begin_s if scenario.begin_s >= 0.0 else max(0.0, min(s for s, _ in mine.departs_s))
        options += ["--begin", f"{begin_s:g}"]
    return options, mine.names if ordinary else None


class PlainDrive:
    """Steps SUMO without touching a vehicle, and counts what vehicles drive.

    `left`: the vehicles whose trips are reported and that have not arrived; None for all vehicles.
    """

    def __init__(self, traffic: Traffic, mileage: Mileage, own: Iterable[str] | None) -> None:
        self._traffic, self._mileage = traffic, mileage
        self._left = None if own is None else set(own)
        self.sumo_s = 0.0

    def begin(self) -> None:
        """Make the first step, which is not measured, as in runs on loops: no vehicle moves in it."""
        self.step()

    def step(self) -> None:
        """Advance SUMO by one step."""
        begin = perf_counter()
        self._traffic.step()
        self.sumo_s += perf_counter() - begin
        self._mileage.look()
        if self._left is not None:
            self._left.difference_update(self._traffic.arrived())

    def measure_from_now(self) -> None:
        """Begin the measured time."""
        self._mileage.measure_from_now()

    def count_from(self, at_s: float) -> None:
        """Do nothing: standing times are counted from `measure_from_now` on."""

    def jumped(self, vehicle: str, skipped_m: float) -> None:
        """Do nothing: odometers are read in each step."""

    def is_over(self) -> bool:
        """Return whether no vehicle is left."""
        return not self._traffic.expects_more() or (self._left is not None and not self._left)


def _write_flow(rows: list[Row], mileage: Mileage, trips: Sequence[Trip], folder: Folder) -> None:
    """Write the flow table, also of the time since its last row."""
    if not rows or rows[-1][0] < mileage.now_s:
        rows.append(mileage.flow())
    parts = (mileage.last_part(trip) for trip in trips)
    folder.write_table(flow_table(with_last_parts(rows, parts)), run_folder.FLOW)


def _untold(mileage: Mileage, trips: Iterable[Trip]) -> Iterator[str]:
    """Yield a warning if SUMO says nothing of the trips of some vehicles."""
    if without := mileage.seen - {trip.vehicle for trip in trips}:
        yield (
            f"{min(without)}: SUMO says nothing of its trip, since its has.tripinfo.device is off; "
            f"{len(without)} such vehicles are in no figure"
        )


def _tally(trip: Trip, standing: Mapping[str, tuple[float, tuple[float, float]]], mileage: Mileage) -> Tally:
    standing_s, position_m = standing.get(trip.vehicle, _GONE)
    driven = mileage.of(trip)
    return Tally(
        vehicle=trip.vehicle,
        loop="",
        loop_length_m=0.0,
        laps=0,
        distance_m=driven.distance_m,
        hold_s=0.0,
        longest_wait_s=0.0,
        standing_s=standing_s,
        position_m=position_m,
        stood_s=driven.stood_s,
        longest_stood_s=driven.longest_s,
        driven_s=driven.time_s,
        depart_delay_s=trip.depart_delay_s,
        stops=mileage.stops[trip.vehicle],
        stopped_s=trip.stopped_s,
        trip=trip,
    )
