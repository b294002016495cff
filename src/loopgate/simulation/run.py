"""Runs a scenario, and writes its run folder."""

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace
from pathlib import Path
from random import Random
from time import perf_counter
from typing import Any
from xml.etree import ElementTree as ET

from loopgate.audit import read_layout, write_layout
from loopgate.cache import frozen_objects
from loopgate.disk import writing
from loopgate.errors import NobodyGatedError
from loopgate.folders import remove_abandoned, temporary_folder
from loopgate.gates import Gate, make_gate
from loopgate.model import write_system
from loopgate.negotiation.base import Negotiation
from loopgate.negotiation.registry import make_negotiation
from loopgate.network import RoadNetwork, read_loops
from loopgate.network.additional import type_names
from loopgate.network.sumo_config import is_sumo_config
from loopgate.network.traffic_file import TrafficFile, check_flows, read_traffic
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.network.xml_file import write_xml
from loopgate.results.recorder import Recorder
from loopgate.simulation import run_folder
from loopgate.simulation.assembly import Assembly, assemble
from loopgate.simulation.build import check as check_gated
from loopgate.simulation.build import open_gated, open_ungated, rooms_of
from loopgate.simulation.loop_run import CollisionLog, RunCourse, Tick, after, run_to_end
from loopgate.simulation.plain_run import run_plainly
from loopgate.simulation.positions import make_layout, record_positions
from loopgate.simulation.run_folder import Folder
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.session import Session, sum_up
from loopgate.simulation.sumo.devices import refuse_what_leads_off, unheard
from loopgate.simulation.sumo.greens import ask_for_greens
from loopgate.simulation.sumo.input import without_vehicles, write_ordinary, write_sumo_input
from loopgate.simulation.sumo.start import (
    DiskGuard,
    check_backend,
    check_outputs,
    output_options,
    plain_options,
    start_traffic,
)
from loopgate.simulation.sumo_options import SumoOptions, option_of, sumo_options
from loopgate.simulation.watching.deadlock_detector import DeadlockDetector
from loopgate.simulation.watching.flow import FlowMeter, FrontRecorder
from loopgate.simulation.watching.road_waits import RoadWaits, SimulatedRoad
from loopgate.simulation.watching.starving import StarvationWatch
from loopgate.simulation.watching.verdicts import Verdicts
from loopgate.simulation.watching.window import Window
from loopgate.simulation.ways_driven import as_driven, departed_on

_SHORT_S, _MOST_OF_IT = 300.0, 0.9
"""In a run shorter than the starvation time, vehicles starve after this share of the run, but not before
`_SHORT_S` [s]."""


def simulate(
    scenario: Scenario,
    out: Path | str | None = None,
    *,
    tick: Tick | None = None,
    backend: str = "libsumo",
    overwrite: bool = False,
    detector: type[DeadlockDetector] = DeadlockDetector,
) -> dict[str, Any]:
    """Run a scenario and write a run folder.

    Parameters
    ----------
    out
        The run folder; None keeps nothing but the returned summary.
    tick
        Called every ten simulated seconds with the simulated time [s] and the course so far.
    backend
        ``libsumo``, ``traci`` or ``gui``.
    overwrite
        Whether an earlier run in `out` may be replaced.
    detector
        Class of the deadlock detector, for studies of it.

    Returns
    -------
    dict
        The content of ``summary.json``.

    Raises
    ------
    LoopgateError
        If the scenario does not fit together, SUMO refuses it, or the disk is full; the text says which part.
    PluginError
        If a gate or negotiation of the user's own fails. The results until then are in the folder: its
        summary has the outcome ``interrupted`` and the reason as ``fault``.
    """
    check_backend(backend)
    with ExitStack() as stack:
        if out is None:
            check_outputs(scenario)
            out, overwrite = stack.enter_context(temporary_folder()), True
        else:
            remove_abandoned()
        folder = stack.enter_context(Folder(Path(out), overwrite=overwrite))
        return _run(scenario, folder, tick, backend, detector)


def _run(
    scenario: Scenario,
    folder: Folder,
    tick: Tick | None,
    backend: str,
    detector_class: type[DeadlockDetector],
) -> dict[str, Any]:
    tick = tick or (lambda _now, _course: None)
    if is_plain(scenario):
        return run_plainly(scenario, folder, tick, backend)
    began = perf_counter()
    assembly = assemble(scenario)
    with (
        open_session(scenario, assembly, folder, backend=backend) as session,
        closing(
            FrontRecorder(folder / run_folder.FRONTS, session.traffic, session.drive, session.recorder)
        ) as fronts,
        frozen_objects(),
    ):
        prepared_s = perf_counter() - began
        traffic, drive, recorder = session.traffic, session.drive, session.recorder
        flow = FlowMeter(traffic, drive)
        own, once = frozenset(assembly.names), assembly.trips
        among = bool(scenario.traffic or assembly.others)
        verdicts = None
        if among and session.gated is not None:
            verdicts = Verdicts(assembly.network, traffic, drive)
            session.gated.read_everybody()
        road = SimulatedRoad(traffic, own if session.gated is not None else ())
        detector = detector_class(
            traffic,
            RoadWaits(assembly.network, road, impatient_s=traffic.impatient_s()),
            after_s=scenario.deadlock_after_s,
            at_gate=drive.refused,
            own=own if among else None,
            trails=verdicts.trails if verdicts else None,
            odometers=None if among or assembly.departures else drive.odometers,
            halted=session.containment.broken if session.containment else (),
        )
        detector.gated = own if session.gated is not None else ()
        detector.again = scenario.on_deadlock == "teleport"
        hunger = None
        if session.gated is not None:
            known = session.containment
            told = {"stands": known.why, "reason": known.reason} if known else {}
            hunger = StarvationWatch(drive, traffic, recorder, after_s=_starving_after_s(scenario), **told)
        course = run_to_end(
            drive,
            traffic,
            detector,
            CollisionLog(traffic, recorder, RunCourse(), own=own, verdicts=verdicts),
            scenario=scenario,
            tick=after(flow.look, _watching(hunger, tick)),
            each_step=[*session.each_step, fronts.look],
            over=lambda: bool(once) and session.departures.over,
        )
        if hunger is not None and hunger.sinks:
            course.starving = list(hunger.sinks.values())
            course.outcome = "starving" if course.outcome == "done" else course.outcome
        drive.settle()
        flow.look()
        starts, turns = session.lanes.started if session.lanes else {}, session.turns
        assembly = assembly.departed_on(starts)
        tallies, told = session.tallies(assembly, detector, course), session.report(course.end_s)
        if starts or turns:
            layout = departed_on(read_layout(folder / run_folder.LAYOUT), starts)
            legs = dict(zip(drive.names(), drive.granted().tolist(), strict=True))
            granted = {vehicle: leg for vehicle, leg in legs.items() if vehicle in turns.keys() - once}
            write_layout(as_driven(layout, turns, granted), folder / run_folder.LAYOUT)
    summary = sum_up(scenario, assembly, session, course, tallies, told, flow.rows, folder)
    summary["wall_s"] |= {"prepared": round(prepared_s, 3), "total": round(perf_counter() - began, 3)}
    if course.fault is not None:
        summary["fault"] = str(course.fault)
    folder.write_summary(summary)
    if course.fault is not None:
        raise course.fault
    return summary


def _starving_after_s(scenario: Scenario) -> float:
    """Return the time after which a vehicle starves [s]; it is shorter in a short run."""
    return min(scenario.starving_s, max(_SHORT_S, _MOST_OF_IT * scenario.duration_s))


def _watching(hunger: StarvationWatch | None, tick: Tick) -> Tick:
    """Return a tick that first looks for vehicles that starve."""

    def both(now: float, course: RunCourse) -> None:
        if hunger is not None:
            hunger.check(deadlocked=bool(course.deadlocks))
        tick(now, course)

    return both


def is_plain(scenario: Scenario) -> bool:
    """Return whether a scenario runs vehicles unchanged, without loops.

    These are the vehicles of a ``.sumocfg`` under ``open``, or of a route file under ``open`` whose vehicles
    drive once, or none of which a gate can drive.
    """
    if scenario.gated or scenario.loops or scenario.counts_vehicles:
        return False
    if not scenario.routes:
        return is_sumo_config(scenario.network) and not scenario.traffic
    network = RoadNetwork.open(scenario.network)
    try:
        file = read_loops(network, scenario.routes, stops=scenario.stop_files, once=True)
    except NobodyGatedError:
        return True
    return any(vehicle.once for vehicle in file.vehicles)


@contextmanager
def open_session(
    scenario: Scenario,
    assembly: Assembly,
    folder: Folder,
    *,
    backend: str,
    negotiation: Negotiation | None = None,
) -> Iterator[Session]:
    """Start SUMO for a scenario.

    Parameters
    ----------
    backend
        ``libsumo``, ``traci`` or ``gui``.
    negotiation
        Replaces the scenario's negotiation.

    Raises
    ------
    LoopgateError
        If the scenario does not fit together, SUMO refuses it, or the disk is full.
    """
    said = sumo_options(scenario)
    end_s = assembly.begin_s + scenario.warmup_s + scenario.duration_s
    beside = read_traffic(scenario.traffic) if scenario.traffic else None
    if beside is not None:
        check_flows(beside.flows, assembly.begin_s, end_s, beside.file)
    keeping = _keeping(scenario, assembly, negotiation)
    with writing(folder / run_folder.SCENARIO):
        scenario.write(folder / run_folder.SCENARIO)
    if assembly.abstraction is not None:
        write_system(assembly.abstraction.system, folder / run_folder.SYSTEM)
    log = folder / run_folder.SUMO_LOG
    options = [
        *said.arguments,
        *("--net-file", str(assembly.network.file)),
        *_input_options(scenario, assembly, folder, said, beside),
        *plain_options(scenario, log),
        *output_options(scenario, folder.path, trips=bool(assembly.trips or assembly.others)),
        *(record_positions(folder / run_folder.POSITIONS) if scenario.positions else ()),
    ]
    others = bool(scenario.traffic or assembly.others)
    own = [folder / run_folder.ORDINARY] if assembly.others else []
    among = [*own, *_files_of(beside), *_beside(scenario, assembly, said)]
    blue = unheard(among) if others and scenario.gated else ()
    guard = [DiskGuard(folder / run_folder.POSITIONS).check] if scenario.positions else []
    if assembly.abstraction is not None:
        rooms = {} if keeping is None else rooms_of(scenario, assembly, keeping[0])
        write_layout(make_layout(assembly, scenario.step_s, rooms), folder / run_folder.LAYOUT)
    with ExitStack() as stack:
        traffic = start_traffic(
            options,
            backend=backend,
            log=log,
            yields=others,
            words=scenario.sumo,
            trains=others or not scenario.gated,
        )
        stack.callback(traffic.close)
        recorder = Recorder(folder / run_folder.EVENTS)
        stack.callback(recorder.close)
        if keeping is None:
            session = open_ungated(scenario, assembly, traffic, recorder)
        else:
            session = open_gated(scenario, assembly, traffic, recorder, *keeping)
        stack.callback(session.close)
        if backend == "gui":
            ways = {start.loop.id: start.loop for start in assembly.everybody}
            guard.append(Window(traffic, session.drive, ways.values()).look)
        absent = beside.absent(assembly.begin_s, end_s) if beside else ()
        notes = (*said.notes, *said.taken_over_by(options), *absent, *blue, *session.notes)
        yield replace(session, each_step=(*session.each_step, *guard), notes=notes)


def _beside(scenario: Scenario, assembly: Assembly, said: SumoOptions) -> tuple[Path, ...]:
    """Return the additional files of a run without ordinary traffic."""
    return tuple(dict.fromkeys((*said.additional_files, *scenario.stop_files, *assembly.stop_files)))


def _files_of(beside: TrafficFile | None) -> tuple[Path, ...]:
    return (*beside.route_files, *beside.additional_files) if beside else ()


def _input_options(
    scenario: Scenario,
    assembly: Assembly,
    folder: Folder,
    said: SumoOptions,
    ordinary: TrafficFile | None,
) -> list[str]:
    beside = _beside(scenario, assembly, said)
    scale = option_of(scenario, "scale", 1.0) if scenario.gated else 1.0
    routes = ["--route-files", ""] if said.configured else []
    if ordinary:
        ordinary.check_names(frozenset(assembly.names))
        beside, routes = tuple(dict.fromkeys((*beside, *ordinary.additional_files))), ordinary.options()
    if assembly.others:
        file = folder / run_folder.ORDINARY
        known = type_names(beside)
        write_ordinary(assembly.ordinary, file, known=known, ungated=assembly.ungated, scale=scale)
        if ordinary:
            ordinary.check_names(frozenset(assembly.others))
        routes = ["--route-files", ",".join([*routes[1:], str(file)] if ordinary else [str(file)])]
    if scenario.gated:
        refuse_what_leads_off(beside, assembly.loops, assembly.incidents.closures)
    types = _types_of_others(assembly, ordinary) if scenario.gated else None
    off = scenario.rule_for_lights == "off"
    beside = without_vehicles(beside, assembly.vehicle_files, folder.path, types, lights_off=off)
    if assembly.persons:
        top = ET.Element("additional")
        top.extend(assembly.persons)
        write_xml(top, folder / run_folder.PERSONS)
        beside = (*beside, folder / run_folder.PERSONS)
    if scenario.rule_for_lights == "obey" or not scenario.gated:
        beside = (*beside, *ask_for_greens((one.loop for one in assembly.everybody), folder.path))
    placed, later = (assembly.starts, assembly.departures) if scenario.gated else (assembly.everybody, ())
    round_ = [one for one in assembly.other_ways if one.loop.id in assembly.detours]
    starts = write_sumo_input(
        placed,
        folder.path,
        beside=beside,
        begin_s=assembly.begin_s,
        later=[*later, *round_],
        renews=not assembly.detours,
        scale=scale,
    )
    begins = scenario.begin_s >= 0.0 or (assembly.begin_s and not said.configured)
    begin = ["--begin", f"{assembly.begin_s:g}"] if begins else []
    return [*starts, *routes, *begin, *(assembly.ungated.options if assembly.others else ())]


def _types_of_others(assembly: Assembly, ordinary: TrafficFile | None) -> set[str]:
    """Return the types of the vehicles that no gate drives, by name."""
    found = {v.type.id for v in assembly.ordinary}
    if assembly.ungated.vehicles:
        kinds = (one.get("id", "") for top in assembly.ungated.demand for one in top.iter("vType"))
        found |= {DEFAULT_TYPE.id, *kinds, *(v.element.get("type", "") for v in assembly.ungated.vehicles)}
    if ordinary is not None:
        found |= {DEFAULT_TYPE.id, *type_names(ordinary.additional_files), *type_names(ordinary.route_files)}
    return found - {""}


def _keeping(
    scenario: Scenario, assembly: Assembly, negotiation: Negotiation | None
) -> tuple[Gate, Negotiation] | None:
    """Return gate and negotiation of a gated run; before SUMO starts, since the gate may refuse."""
    if not scenario.gated or assembly.abstraction is None:
        return None
    system = assembly.abstraction.system
    gate = make_gate(scenario.gate, system, perf_counter)
    check_gated(scenario, assembly)
    orders = negotiation or make_negotiation(scenario.rule_for_negotiation, Random(scenario.seed))
    return gate, orders
