"""The compiled tables (`loopgate.drive`) as what drives a run, with all that feeds them."""

from collections.abc import Callable
from math import inf

from loopgate.drive.changing import ChangingEngine
from loopgate.drive.observed import ObservedEngine
from loopgate.gates import Gate
from loopgate.model import System
from loopgate.negotiation.base import Negotiation
from loopgate.results.recorder import Recorder
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.containment import Containment
from loopgate.simulation.fleet.departures import Departures, GatedDepartures, OpenDepartures
from loopgate.simulation.fleet.fleet import Fleet, Rules
from loopgate.simulation.fleet.parking import Parking
from loopgate.simulation.fleet.spacing import Holding, SpeedAdvice
from loopgate.simulation.fleet.stops import Stops
from loopgate.simulation.planned import PlannedStanding, find_ways_round
from loopgate.simulation.rerouting import Rerouting
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.session import Session
from loopgate.traffic.base import Traffic
from loopgate.traffic.sumo import SumoTraffic

Keeping = tuple[System, Gate, Negotiation]
"""States, gate and negotiation of a gated run."""


def open_tables(
    scenario: Scenario,
    assembly: Assembly,
    traffic: SumoTraffic,
    recorder: Recorder,
    keeping: Keeping | None,
) -> Session:
    """Return a session in which the tables drive.

    Parameters
    ----------
    keeping
        None where SUMO's right of way rules.
    """
    fleet = None
    if keeping is not None:
        fleet = _fleet(scenario, assembly, traffic, recorder, keeping)
        engine = fleet.engine
    else:
        engine = ObservedEngine(traffic, assembly.tracks, None, recorder)
    around = fleet.around if fleet else None
    parking = Parking(traffic, engine, around.has_room) if around else None
    stops = Stops(traffic, engine, recorder, assembly.stops, parking)
    departures = _departures(assembly, traffic, engine, fleet)
    rerouting = Rerouting(assembly, traffic, engine) if fleet and assembly.anew else None
    containment = _containment(scenario, assembly, traffic, engine, recorder, stops)
    spacing = _spacing(scenario, assembly, traffic, engine)
    looks = (
        *((engine.open_up,) if fleet and (assembly.departures or assembly.stops or containment) else ()),
        *((departures.look,) if assembly.departures else ()),
        *((rerouting.look,) if rerouting else ()),
        *((stops.look,) if assembly.stops else ()),
        *((containment.look,) if containment else ()),
        *((parking.look,) if parking and containment and not assembly.stops else ()),
        *(fleet.around.each_step if fleet else ()),
        *spacing,
    )
    keeper = fleet.keeper if fleet else None
    notes = tuple(parking.notes(assembly.stops)) if parking else ()
    return Session(
        traffic, engine, recorder, keeper, around, stops, departures, rerouting, containment, looks, notes
    )


def _fleet(
    scenario: Scenario, assembly: Assembly, traffic: Traffic, recorder: Recorder, keeping: Keeping
) -> Fleet:
    """Return the fleet of a gated run, whose vehicles are to be taken over."""
    system, gate, orders = keeping
    rules = Rules(
        scenario.gate,
        orders,
        lights=scenario.rule_for_lights == "obey",
        others=bool(scenario.traffic or assembly.others),
        serve_after_s=scenario.serve_after_s or inf,
        foresees=True,
        unforeseen=assembly.unforeseen,
        expects=bool(assembly.departures) or assembly.contains,
    )
    fleet = Fleet(assembly.network, traffic, recorder, rules)
    abstraction = assembly.abstraction
    itineraries = (*abstraction.itineraries, *abstraction.later) if abstraction else ()
    later = (departure.track for departure in (*assembly.departures, *assembly.other_ways))
    tracks = (*assembly.tracks, *(track for track in later if track is not None))
    room = {str(state): most for state, most in zip(system.states, system.room, strict=True)}
    fleet.drive_by(itineraries, tracks, (dict(abstraction.room) if abstraction else {}) or room)
    fleet.begin(system, gate, assembly.tracks)
    return fleet


def _departures(
    assembly: Assembly, traffic: Traffic, engine: ChangingEngine, fleet: Fleet | None
) -> Departures:
    if fleet is not None:
        return GatedDepartures(assembly.departures, assembly.network, traffic, fleet)
    return OpenDepartures(assembly.departures, assembly.network, traffic, engine)


def _containment(
    scenario: Scenario,
    assembly: Assembly,
    traffic: SumoTraffic,
    engine: ObservedEngine,
    recorder: Recorder,
    stops: Stops,
) -> Containment | None:
    if not assembly.contains:
        return None
    standing = PlannedStanding(assembly.incidents, stops, assembly.stops)
    waits, ways = scenario.standing == "wait", find_ways_round(assembly)
    leaves = scenario.gated and scenario.standing == "leave"
    return Containment(
        standing, ways, traffic, engine, recorder, waits=waits, gated=scenario.gated, leaves=leaves
    )


def _spacing(
    scenario: Scenario, assembly: Assembly, traffic: Traffic, engine: ChangingEngine
) -> list[Callable[[], None]]:
    if scenario.rule_for_spacing == "none":
        return []
    loops = {start.vehicle: start.loop for start in assembly.everybody}
    if scenario.rule_for_spacing == "hold":
        return [Holding(assembly.network, loops, engine).look]
    return [SpeedAdvice(assembly.network, loops, engine, traffic).look]
