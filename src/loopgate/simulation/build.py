"""The one builder of a run: places, rules and observers from what was assembled; no rules without a gate."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from loopgate.abstraction.itinerary import Abstraction, PlaceRoom, Track
from loopgate.arrays import Floats
from loopgate.control.circles import Circles
from loopgate.control.departures import AT_LIGHTS, WITHOUT_LIGHTS, Manner, on_own_lanes
from loopgate.control.driving import Driving
from loopgate.control.ledger import Ledger
from loopgate.control.rules import sensed
from loopgate.control.spacing import Ring, Spacing
from loopgate.errors import ScenarioError
from loopgate.gates import Gate
from loopgate.negotiation.base import Negotiation
from loopgate.network import Loop, RoadNetwork
from loopgate.network.stops import Stop
from loopgate.results.recorder import Recorder
from loopgate.simulation.asked_gate import NEVER_FULL, AskedGate, Deciding, JoinedGate, by_chain
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.containment import Containment
from loopgate.simulation.departures import Departures, GatedDepartures, UngatedDepartures, alone
from loopgate.simulation.drive import Drive
from loopgate.simulation.ground import Ground
from loopgate.simulation.lane_choice import LaneChoice
from loopgate.simulation.leading import Leading
from loopgate.simulation.planned import PlannedStanding, find_ways_round
from loopgate.simulation.rerouting import Rerouting
from loopgate.simulation.scenario import SERVE_AFTER_S, Scenario
from loopgate.simulation.session import Session, StopFigures
from loopgate.simulation.sumo_options import option_of
from loopgate.simulation.ungated_closures import UngatedClosures
from loopgate.traffic.base import Traffic

if TYPE_CHECKING:
    from loopgate.simulation.by_messages.answering import ByMessages


def check(scenario: Scenario, assembly: Assembly) -> None:
    """Refuse decisions by messages where the protocol lacks a part.

    Raises
    ------
    ScenarioError
        If vehicles decide by messages, and depart later, make stops or drive beside ordinary vehicles; or if
        a spacing, a negotiation or a time of service is asked for, which see all vehicles at once.
    """
    if scenario.by_messages is None:
        return
    central = {
        f"spacing {scenario.rule_for_spacing}": scenario.rule_for_spacing != "none",
        f"negotiation {scenario.negotiation}": scenario.negotiation != "",
        f"serve_after {scenario.serve_after_s:g}": scenario.serve_after_s != SERVE_AFTER_S,
    }
    for asked, is_asked in central.items():
        if is_asked:
            msg = f"decide: vehicles know only what they sense and hear, not what {asked} needs; leave it out"
            raise ScenarioError(msg)
    beside = (assembly.departures, assembly.stops, assembly.others)
    if any(beside):
        msg = (
            "decide: vehicles works with loops without stops, whose vehicles are all there from the beginning"
        )
        raise ScenarioError(msg)


def _kept(assembly: Assembly, driving: Driving) -> tuple[str, ...]:
    """Return the warning about vehicles that stand on the road where they would park."""
    names = [stop.name for some in assembly.stops.values() for stop in some if stop.parks]
    if driving.ledger.by_chain or not names:
        return ()
    return (f"stops: under this gate vehicles that park, as at {names[0]}, stand on the road meanwhile",)


def _made_stops(assembly: Assembly, ledger: Ledger) -> Mapping[str, Sequence[Stop]]:
    """Return the stops as vehicles make them: under a gate other than the chain rule on the road only.

    Such a gate needs each vehicle to be in a place, and a vehicle beside the road would be passed there.
    """
    if ledger.by_chain:
        return assembly.stops
    on_road = {
        stop: replace(stop, kind="lane", parks=False, spaces=())
        for some in assembly.stops.values()
        for stop in some
        if stop.parks
    }
    return {name: tuple(on_road.get(stop, stop) for stop in some) for name, some in assembly.stops.items()}


def slots_of(assembly: Assembly) -> dict[str, int]:
    """Return the slots of each place; a private place has as many slots as there are vehicles."""
    abstraction = cast("Abstraction", assembly.abstraction)
    system, later = abstraction.system, assembly.later_tracks
    if later or assembly.contains:
        slots = {str(name): most for name, most in abstraction.room.items()}
        return slots | {str(track.legs[-1].state): NEVER_FULL for track in later if track.legs[-1].away}
    rooms = zip(system.states, system.room, system.private, strict=True)
    return {str(name): len(system.robots) if own else room for name, room, own in rooms}


def rooms_of(scenario: Scenario, assembly: Assembly, gate: Gate) -> Mapping[str, PlaceRoom]:
    """Return the places whose slots depend on the vehicles that come: none but under the chain rule."""
    if assembly.abstraction is None or scenario.by_messages is not None or not by_chain(gate):
        return {}
    return assembly.abstraction.rooms


def times_along(network: RoadNetwork, loop: Loop) -> tuple[Floats, Floats]:
    """Return the arc lengths where a loop's lanes end [m], and the times to get there at the limits [s]."""
    took = [span.length_m / network.lanes[span.lane_id].speed_mps for span in loop.spans]
    ends = [0.0, *(span.end_m for span in loop.spans)]
    return np.array(ends), np.concatenate(([0.0], np.cumsum(took)))


def spacing_of(scenario: Scenario, assembly: Assembly, traffic: Traffic) -> Spacing | None:
    """Return the object that spaces vehicles on their loops, or None if the scenario wants none."""
    if scenario.rule_for_spacing == "none":
        return None
    along = {loop.id: times_along(assembly.network, loop) for loop in assembly.loops}
    rings = {name: Ring(ends_m.tolist(), ends_s.tolist()) for name, (ends_m, ends_s) in along.items()}
    return Spacing(traffic, rings, advises=scenario.rule_for_spacing == "advice")


@dataclass(frozen=True, slots=True)
class Laid:
    """The parts that drive the vehicles of a scenario."""

    driving: Driving
    ground: Ground
    asked: AskedGate | None
    by_messages: ByMessages | None = None


def make_driving(
    scenario: Scenario,
    assembly: Assembly,
    traffic: Traffic,
    gate: Gate,
    negotiation: Negotiation,
    *,
    everybody: bool = False,
) -> Laid:
    """Return the parts that drive the vehicles of a scenario, still without vehicles.

    `everybody`: as in `Ledger`.
    """
    abstraction = cast("Abstraction", assembly.abstraction)
    tracks = [*assembly.tracks, *assembly.later_tracks]
    ground = Ground(
        assembly.network,
        traffic,
        obeys=scenario.rule_for_lights == "obey",
        others=bool(scenario.traffic or assembly.others),
        walkers=bool(assembly.persons),
    )
    ground.itineraries = [*abstraction.itineraries, *abstraction.later]
    spacing = spacing_of(scenario, assembly, traffic)
    outside = [*([spacing.holds] if spacing else []), *ground.rules]
    deciding, air, by_messages = None, scenario.by_messages, None
    if air is not None:
        from loopgate.simulation.by_messages.answering import (  # noqa: PLC0415  most runs do without it
            let_vehicles_decide,
        )

        ledger = Ledger(sensed(), everybody=everybody, step_s=scenario.step_s)
        asked = None
        by_messages = let_vehicles_decide(air, scenario.seed, ledger, abstraction, gate)
    else:
        deciding = Deciding(abstraction.system, gate, negotiation, scenario.serve_after_s)
        ledger = deciding.ledger(outside, step_s=scenario.step_s, lit=ground.is_lit, everybody=everybody)
        asked = deciding.asked
    rooms = rooms_of(scenario, assembly, gate)
    layout = ground.layout(slots_of(assembly), [track.legs for track in tracks], rooms)
    driving = ground.driving(ledger, layout, _made_stops(assembly, ledger), spacing)
    if rooms and not assembly.contains:  # whoever stands for good may stand in any place
        ledger.circles = Circles(layout.places[name] for name in rooms if name in layout.places)
    if deciding is not None:
        deciding.know(driving.paths.places)
    return Laid(driving, ground, asked, by_messages)


def _admits(scenario: Scenario, gate: Gate, laid: Laid, there: int) -> Callable[[Track], bool] | None:
    """Return the function that admits later vehicles; None if condition (S) of the chain rule decides.

    `there`: number of vehicles at the beginning.
    """
    if laid.asked is not None:
        joined = JoinedGate(scenario.gate, laid.driving, laid.asked, there)
        laid.asked.look = joined.look
        return joined.admits
    return None if getattr(gate, "promise", "") == "everyone" else lambda _: True


def open_gated(
    scenario: Scenario,
    assembly: Assembly,
    traffic: Traffic,
    recorder: Recorder,
    gate: Gate,
    negotiation: Negotiation,
) -> Session:
    """Return a session in which the ledger drives gated vehicles; call `check` first."""
    laid = make_driving(scenario, assembly, traffic, gate, negotiation)
    driving, slack = laid.driving, laid.ground.slack
    driving.paths.lay(assembly.tracks)
    drive = Drive(traffic, recorder, driving, assembly.tracks, gate, slack, laid.asked, laid.by_messages)
    departures, looks = Departures(()), list[Callable[[], None]]()
    chooses = bool(assembly.other_lanes) and driving.ledger.by_chain and scenario.by_messages is None
    rerouting = lanes = containment = None
    if assembly.anew or assembly.contains or chooses:
        leading = Leading(traffic, driving, [*assembly.tracks, *assembly.later_tracks])
    if chooses:
        lanes = LaneChoice(assembly, traffic, driving.paths, leading)
    if assembly.departures:
        room = sum(most for most in slots_of(assembly).values() if most < NEVER_FULL)
        departures = GatedDepartures(
            assembly.departures,
            assembly.network,
            traffic,
            driving,
            room,
            _admits(scenario, gate, laid, len(assembly.tracks)),
            manner=Manner(
                AT_LIGHTS if scenario.rule_for_lights == "obey" else WITHOUT_LIGHTS,
                int(option_of(scenario, "max-num-vehicles", 0.0)),
                lanes.at_departure if lanes else on_own_lanes,
            ),
        )
        looks.append(departures.look)
    if assembly.anew:
        rerouting = Rerouting(assembly, traffic, leading)
    if assembly.contains:
        standing = PlannedStanding(assembly.incidents, driving.stops)
        waits = scenario.standing == "wait"
        round_ = find_ways_round(assembly)
        containment = Containment(standing, round_, traffic, leading, recorder, waits=waits)
    looks += [one.look for one in (rerouting, lanes, containment) if one is not None]
    stops = StopFigures(driving, traffic)
    looks += [stops.look] if stops.bus_stops else []
    return Session(
        traffic,
        drive,
        recorder,
        drive,
        laid.ground,
        stops,
        departures,
        rerouting,
        lanes,
        containment,
        tuple(looks),
        _kept(assembly, driving),
        laid.by_messages.close if laid.by_messages else lambda: None,
    )


def open_ungated(scenario: Scenario, assembly: Assembly, traffic: Traffic, recorder: Recorder) -> Session:
    """Return a session in which no vehicle asks for grants: SUMO's right of way decides."""
    ground = Ground(assembly.network, traffic, obeys=False, others=False)
    layout = ground.layout(dict.fromkeys(assembly.names, NEVER_FULL))
    spacing = spacing_of(scenario, assembly, traffic)
    driving = ground.driving(Ledger([], step_s=scenario.step_s), layout, assembly.stops, spacing)
    tracks = [alone(track) for track in assembly.tracks]
    drive = Drive(traffic, recorder, driving, tracks, None)
    leading = Leading(traffic, driving, tracks)
    stops = StopFigures(driving, traffic)
    departures, looks = Departures(()), list[Callable[[], None]]()
    looks += [stops.look] if stops.bus_stops else []
    if assembly.departures:
        departures = UngatedDepartures(assembly.departures, traffic, driving)
        looks.append(departures.look)
    containment = None
    if assembly.contains:
        standing = PlannedStanding(assembly.incidents, driving.stops)
        waits, round_ = scenario.standing == "wait", find_ways_round(assembly)
        containment = Containment(standing, round_, traffic, leading, recorder, waits=waits, gated=False)
        looks.append(containment.look)
    if assembly.incidents.closures:
        closures = UngatedClosures(
            assembly.incidents,
            assembly.network,
            traffic,
            driving,
            recorder,
            assembly.ungated_detours,
            assembly.detours,
        )
        looks.append(closures.look)
        if containment is not None:
            containment.also = closures.report
    return Session(
        traffic, drive, recorder, None, None, stops, departures, None, None, containment, tuple(looks), ()
    )
