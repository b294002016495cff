"""A scenario's simulation under way: started, its vehicles placed, not yet driven."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from math import inf
from random import Random
from time import perf_counter

from loopgate.audit import write_layout
from loopgate.disk import writing
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.gates import make_gate
from loopgate.model import write_system
from loopgate.negotiation.base import Negotiation
from loopgate.negotiation.registry import make_negotiation
from loopgate.network.traffic_file import read_traffic
from loopgate.results.recorder import Recorder
from loopgate.simulation import outcome
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.outcome import Folder
from loopgate.simulation.positions import make_layout, record_positions
from loopgate.simulation.room import Room
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.spacing import Holding, Leads, SpeedAdvice
from loopgate.simulation.stops import Stops
from loopgate.simulation.sumo_input import write_sumo_input
from loopgate.simulation.sumo_options import SumoOptions, sumo_options
from loopgate.simulation.sumo_start import output_options, plain_options, start_traffic
from loopgate.simulation.surroundings import Surroundings
from loopgate.simulation.window import Window
from loopgate.traffic.base import Traffic

__all__ = ["Session", "open_session"]


@dataclass(frozen=True, slots=True)
class Session:
    """What drives the vehicles of a scenario.

    Attributes
    ----------
    traffic, engine, recorder
        The simulation, the drive, and what takes the events.
    keeper, around
        What answers requests, and what is about; None where no gate rules.
    stops
        Those that vehicles make on the way.
    each_step
        What is to be called after each step.
    notes
        What SUMO was not told of what a configuration says.
    """

    traffic: Traffic
    engine: Engine
    recorder: Recorder
    keeper: Gatekeeper | None
    around: Surroundings | None
    stops: Stops
    each_step: tuple[Callable[[], None], ...]
    notes: tuple[str, ...]


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
    scenario, assembly
        What is run.
    folder
        Where the results go.
    backend
        ``libsumo``, ``traci`` or ``gui``.
    negotiation
        Instead of the scenario's.

    Raises
    ------
    LoopgateError
        If the scenario does not fit together, SUMO refuses it, or the disk is full.
    """
    said = sumo_options(scenario)
    keeper = _gatekeeper(scenario, assembly, negotiation)
    with writing(folder / outcome.SCENARIO):
        scenario.write(folder / outcome.SCENARIO)
    if assembly.abstraction is not None:
        write_system(assembly.abstraction.system, folder / outcome.SYSTEM)
    log = folder / outcome.SUMO_LOG
    options = [
        *said.arguments,
        *("--net-file", str(assembly.network.file)),
        *_input_options(scenario, assembly, folder, said),
        *plain_options(scenario, log),
        *output_options(scenario, folder.path),
        *(record_positions(folder / outcome.POSITIONS) if scenario.positions else ()),
    ]
    room = [Room(folder / outcome.POSITIONS).check] if scenario.positions else []
    if scenario.positions and assembly.abstraction is not None:
        write_layout(make_layout(assembly, scenario.step_s), folder / outcome.LAYOUT)
    with ExitStack() as stack:
        traffic = start_traffic(
            options, backend=backend, log=log, yields=bool(scenario.traffic), words=scenario.sumo
        )
        stack.callback(traffic.close)
        recorder = Recorder(folder / outcome.EVENTS)
        stack.callback(recorder.close)
        engine = Engine(traffic, assembly.tracks, keeper, recorder, foresees=assembly.foresees)
        around = _surroundings(scenario, assembly, traffic, engine, keeper) if keeper else None
        stops = Stops(traffic, engine, recorder, assembly.stops)
        spacing = _spacing(scenario, assembly, traffic, engine)
        seen = [Window(traffic, engine, assembly.loops).look] if backend == "gui" else []
        looks = (stops.look, *(around.each_step if around else ()), *spacing, *room, *seen)
        yield Session(traffic, engine, recorder, keeper, around, stops, looks, said.notes)


def _surroundings(
    scenario: Scenario, assembly: Assembly, traffic: Traffic, engine: Engine, keeper: Gatekeeper
) -> Surroundings:
    obeyed = scenario.rule_for_lights == "obey"
    around = Surroundings(
        assembly.network, traffic, engine, keeper, lights=obeyed, others=bool(scenario.traffic)
    )
    system = keeper.system
    room = {str(state): most for state, most in zip(system.states, system.room, strict=True)}
    itineraries = assembly.abstraction.itineraries if assembly.abstraction else ()
    around.plan(itineraries, assembly.tracks, room)
    return around


def _spacing(
    scenario: Scenario, assembly: Assembly, traffic: Traffic, engine: Engine
) -> list[Callable[[], None]]:
    if scenario.rule_for_spacing == "none":
        return []
    leads = Leads(assembly.network, assembly.starts)
    if scenario.rule_for_spacing == "hold":
        return [Holding(leads, engine).look]
    return [SpeedAdvice(leads, traffic, engine).look]


def _input_options(scenario: Scenario, assembly: Assembly, folder: Folder, said: SumoOptions) -> list[str]:
    beside = tuple(dict.fromkeys((*said.additional_files, *scenario.stop_files, *assembly.stop_files)))
    routes = ["--route-files", ""] if said.configured else []
    if scenario.traffic:
        ordinary = read_traffic(scenario.traffic)
        ordinary.check_names(start.vehicle for start in assembly.starts)
        beside, routes = tuple(dict.fromkeys((*beside, *ordinary.additional_files))), ordinary.options()
    starts = write_sumo_input(assembly.starts, folder.path, beside=beside, begin_s=said.begin_s)
    return [*starts, *routes]


def _gatekeeper(scenario: Scenario, assembly: Assembly, negotiation: Negotiation | None) -> Gatekeeper | None:
    if not scenario.gated or assembly.abstraction is None:
        return None
    gate = make_gate(scenario.gate, assembly.abstraction.system, perf_counter)
    orders = negotiation or make_negotiation(scenario.rule_for_negotiation, Random(scenario.seed))
    after_s = scenario.serve_after_s or inf
    return Gatekeeper(assembly.abstraction.system, gate, orders, serve_after_s=after_s)
