"""A scenario's simulation under way: started, its vehicles placed, not yet driven."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from math import inf
from random import Random
from time import perf_counter

from loopgate.audit import write_layout
from loopgate.disk import writing
from loopgate.drive.changing import ChangingEngine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.gates import Gate, make_gate
from loopgate.model import System, write_system
from loopgate.negotiation.base import Negotiation
from loopgate.negotiation.registry import make_negotiation
from loopgate.network.additional import type_names
from loopgate.network.traffic_file import read_traffic
from loopgate.results.recorder import Recorder
from loopgate.simulation import outcome
from loopgate.simulation.around.surroundings import Surroundings
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.fleet.departures import Departures, GatedDepartures, OpenDepartures
from loopgate.simulation.fleet.fleet import Fleet, Rules
from loopgate.simulation.fleet.parking import Parking
from loopgate.simulation.fleet.spacing import Holding, SpeedAdvice
from loopgate.simulation.fleet.stops import Stops
from loopgate.simulation.outcome import Folder
from loopgate.simulation.positions import make_layout, record_positions
from loopgate.simulation.rerouting import Rerouting
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.input import without_vehicles, write_ordinary, write_sumo_input
from loopgate.simulation.sumo.leading_off import refuse_what_leads_off
from loopgate.simulation.sumo.room import Room
from loopgate.simulation.sumo.start import output_options, plain_options, start_traffic
from loopgate.simulation.sumo_options import SumoOptions, sumo_options
from loopgate.simulation.watching.window import Window
from loopgate.traffic.base import Traffic

_Keeping = tuple[System, Gate, Negotiation]


@dataclass(frozen=True, slots=True)
class Session:
    """The simulation, drive and surroundings of a scenario.

    Attributes
    ----------
    traffic, engine, recorder
        The simulation, the drive, and what takes the events.
    keeper, around
        What answers requests, and what is about; None where no gate rules.
    stops, departures, rerouting
        Those that vehicles make on the way, the departures of those who come later, and who of these is led
        another way.
    each_step
        What is to be called after each step.
    notes
        What SUMO was not told of what a configuration says.
    """

    traffic: Traffic
    engine: ChangingEngine
    recorder: Recorder
    keeper: Gatekeeper | None
    around: Surroundings | None
    stops: Stops
    departures: Departures
    rerouting: Rerouting | None
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
    keeping = _keeping(scenario, assembly, negotiation)
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
        *output_options(scenario, folder.path, trips=bool(assembly.trips or assembly.ordinary)),
        *(record_positions(folder / outcome.POSITIONS) if scenario.positions else ()),
    ]
    room = [Room(folder / outcome.POSITIONS).check] if scenario.positions else []
    if assembly.abstraction is not None:
        write_layout(make_layout(assembly, scenario.step_s), folder / outcome.LAYOUT)
    with ExitStack() as stack:
        others = bool(scenario.traffic or assembly.ordinary)
        traffic = start_traffic(options, backend=backend, log=log, yields=others, words=scenario.sumo)
        stack.callback(traffic.close)
        recorder = Recorder(folder / outcome.EVENTS)
        stack.callback(recorder.close)
        fleet = None
        if keeping is not None:
            fleet = _fleet(scenario, assembly, traffic, recorder, keeping)
            engine = fleet.begin(*keeping[:2], assembly.tracks)
        else:
            engine = ChangingEngine(traffic, assembly.tracks, None, recorder, foresees=assembly.foresees)
        around = fleet.around if fleet else None
        parking = Parking(traffic, engine, around.has_room) if around else None
        stops = Stops(traffic, engine, recorder, assembly.stops, parking)
        departures = _departures(assembly, traffic, engine, fleet)
        rerouting = Rerouting(assembly, traffic, engine) if fleet and assembly.anew else None
        spacing = _spacing(scenario, assembly, traffic, engine)
        seen = [Window(traffic, engine, assembly.loops).look] if backend == "gui" else []
        looks = (
            *((engine.open_up,) if fleet and (assembly.departures or assembly.stops) else ()),
            *((departures.look,) if assembly.departures else ()),
            *((rerouting.look,) if rerouting else ()),
            *((stops.look,) if assembly.stops else ()),
            *(fleet.looks if fleet else ()),
            *spacing,
            *room,
            *seen,
        )
        keeper = fleet.keeper if fleet else None
        notes = (*said.notes, *(parking.notes(assembly.stops) if parking else ()))
        yield Session(traffic, engine, recorder, keeper, around, stops, departures, rerouting, looks, notes)


def _fleet(
    scenario: Scenario, assembly: Assembly, traffic: Traffic, recorder: Recorder, keeping: _Keeping
) -> Fleet:
    """Return the fleet of a gated run, which has not begun."""
    system, _, orders = keeping
    lights = scenario.rule_for_lights == "obey"
    rules = Rules(
        scenario.gate,
        orders,
        lights=lights,
        others=bool(scenario.traffic or assembly.ordinary),
        serve_after_s=scenario.serve_after_s or inf,
        foresees=assembly.foresees,
    )
    fleet = Fleet(assembly.network, traffic, recorder, rules)
    fleet.stays = bool(assembly.departures)
    abstraction = assembly.abstraction
    itineraries = (*abstraction.itineraries, *abstraction.later) if abstraction else ()
    later = (departure.track for departure in (*assembly.departures, *assembly.other_ways))
    tracks = (*assembly.tracks, *(track for track in later if track is not None))
    room = {str(state): most for state, most in zip(system.states, system.room, strict=True)}
    fleet.drive_by(itineraries, tracks, (dict(abstraction.room) if abstraction else {}) or room)
    return fleet


def _departures(
    assembly: Assembly, traffic: Traffic, engine: ChangingEngine, fleet: Fleet | None
) -> Departures:
    if fleet is not None:
        return GatedDepartures(assembly.departures, assembly.network, traffic, fleet)
    return OpenDepartures(assembly.departures, assembly.network, traffic, engine)


def _spacing(
    scenario: Scenario, assembly: Assembly, traffic: Traffic, engine: ChangingEngine
) -> list[Callable[[], None]]:
    if scenario.rule_for_spacing == "none":
        return []
    loops = {start.vehicle: start.loop for start in assembly.everybody}
    if scenario.rule_for_spacing == "hold":
        return [Holding(assembly.network, loops, engine).look]
    return [SpeedAdvice(assembly.network, loops, engine, traffic).look]


def _input_options(scenario: Scenario, assembly: Assembly, folder: Folder, said: SumoOptions) -> list[str]:
    beside = tuple(dict.fromkeys((*said.additional_files, *scenario.stop_files, *assembly.stop_files)))
    routes = ["--route-files", ""] if said.configured else []
    if scenario.traffic:
        ordinary = read_traffic(scenario.traffic)
        ordinary.check_names(assembly.names)
        beside, routes = tuple(dict.fromkeys((*beside, *ordinary.additional_files))), ordinary.options()
    if assembly.ordinary:
        file = folder / outcome.ORDINARY
        write_ordinary(assembly.ordinary, file, known=type_names(beside))
        if scenario.traffic:
            ordinary.check_names(vehicle.id for vehicle in assembly.ordinary)
        routes = ["--route-files", ",".join([*routes[1:], str(file)] if scenario.traffic else [str(file)])]
    if scenario.gated:
        refuse_what_leads_off(beside, assembly.loops)
    beside = without_vehicles(beside, assembly.vehicle_files, folder.path)
    departing = tuple(departure.start for departure in assembly.departures)
    placed, later = (assembly.starts, departing) if scenario.gated else ((*assembly.starts, *departing), ())
    starts = write_sumo_input(placed, folder.path, beside=beside, begin_s=assembly.begin_s, later=later)
    begin = ["--begin", f"{assembly.begin_s:g}"] if assembly.begin_s and not said.configured else []
    return [*starts, *routes, *begin]


def _keeping(scenario: Scenario, assembly: Assembly, negotiation: Negotiation | None) -> _Keeping | None:
    """Return states, gate and negotiation of a gated run: before SUMO starts, since the gate may refuse."""
    if not scenario.gated or assembly.abstraction is None:
        return None
    system = assembly.abstraction.system
    gate = make_gate(scenario.gate, system, perf_counter)
    return (
        system,
        gate,
        negotiation or make_negotiation(scenario.rule_for_negotiation, Random(scenario.seed)),
    )
