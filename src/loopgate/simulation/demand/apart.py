"""Separates gated vehicles from vehicles that no gate can drive.

A trip that no gate can drive becomes ordinary traffic. A vehicle on a loop that no gate can drive is refused.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from loopgate.abstraction.itinerary import Abstraction
from loopgate.abstraction.stopping import fit_stops
from loopgate.errors import NobodyGatedError, ScenarioError
from loopgate.network import RoadNetwork, VehicleDemand
from loopgate.network.stops import Stop
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.ungated import UngatedFleet
from loopgate.network.vehicle_demand import RoutesFile
from loopgate.simulation.demand.allotment import evenly_round
from loopgate.simulation.demand.once import choose_gated, fit_in, left_out
from loopgate.simulation.demand.placing import by_departure
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.settings import why_unsafe
from loopgate.simulation.sumo.devices import ReroutingPolicy, led_anew
from loopgate.simulation.sumo.leading_off import led_off


@dataclass(slots=True)
class SortedOut:
    """The vehicles of a run before their states are known.

    Attributes
    ----------
    everybody, vehicles, later
        All gated vehicles; those there from the beginning; those that depart later, in the order of time.
    ordinary, ungated
        Vehicles in ordinary traffic; `ungated` is written as the file has them.
    others
        One nameless vehicle on each further path of trips that may be rerouted.
    anew
        For each trip that may be rerouted, the policy.
    apart
        For each vehicle that no gate can drive, the reason.
    lines, moved
        Warnings about trips whose paths cannot be cut into queues; about vehicles that do not depart in time.
    """

    everybody: list[VehicleDemand]
    ordinary: list[VehicleDemand]
    vehicles: list[VehicleDemand]
    later: list[VehicleDemand]
    moved: tuple[str, ...]
    ungated: UngatedFleet
    others: list[VehicleDemand] = field(default_factory=list)
    anew: Mapping[str, ReroutingPolicy] = field(default_factory=dict)
    apart: dict[str, str] = field(default_factory=dict)
    lines: tuple[str, ...] = ()

    def put_apart(self, whys: Mapping[str, str]) -> None:
        """Turn each named vehicle that has not departed yet into ordinary traffic."""
        self.apart |= whys
        self.let_go({v.id: v for v in self.later if v.id in whys})

    def let_go(self, those: Mapping[str, VehicleDemand]) -> None:
        """Make vehicles that depart later ordinary traffic."""
        self.ordinary += those.values()
        self.later, self.everybody = (
            [v for v in some if v.id not in those] for some in (self.later, self.everybody)
        )


def sort_out(
    scenario: Scenario, network: RoadNetwork, everybody: Sequence[VehicleDemand], file: RoutesFile | None
) -> SortedOut:
    """Separate gated vehicles, with their departures, from ordinary traffic.

    Raises
    ------
    LoopgateError
        If no vehicle is gated, or a vehicle on a loop cannot be gated.
    """
    mine, ordinary = choose_gated(scenario, everybody) if scenario.gated else (list(everybody), [])
    vehicles, later, moved = by_departure(scenario, mine, file)
    ungated = file.ungated if file and not scenario.counts_vehicles else UngatedFleet()
    found = SortedOut(mine, ordinary, vehicles, later, moved, ungated)
    if scenario.gated:
        found.apart = {one.id: one.why for one in ungated.vehicles}
        found.put_apart(of_no_safe_type(later, scenario.step_s))
        found.put_apart(led_off(_beside(scenario, file), found.later))
        found.anew = led_anew(scenario, found.later)
    if scenario.rule_for_starts == "even":
        found.vehicles = evenly_round(network, vehicles)
    if scenario.gated and any(not v.loop.closed for v in found.later):
        unfit, found.others = fit_in(network, [*found.vehicles, *found.later], found.anew)
        found.let_go({v.id: v for some in unfit.values() for v in some})
        found.lines = tuple(left_out(unfit))
    if not found.everybody:
        nobody = (
            f"--gated {scenario.rule_for_gated} leaves none"
            if ordinary
            else "no vehicle departs during the run"
        )
        why = next(iter((*found.lines, *(f"{name}: {why}" for name, why in found.apart.items()))), nobody)
        msg = f"{scenario.routes or scenario.network}: none of its vehicles is gated: {why}; or --gate open"
        raise NobodyGatedError(msg)
    return found


def _beside(scenario: Scenario, file: RoutesFile | None) -> list[Path]:
    """Return the additional files that SUMO gets with the vehicles."""
    files = [*scenario.stop_files, *(file.stop_files if file else ())]
    for name in dict.fromkeys((scenario.network, scenario.traffic)):
        files += read_sumo_config(name).additional_files if is_sumo_config(name) else ()
    return list(dict.fromkeys(files))


def of_no_safe_type(vehicles: Sequence[VehicleDemand], step_s: float) -> dict[str, str]:
    """Return the trips whose type no gate can drive, with the reason, by name."""
    once = [v for v in vehicles if not v.loop.closed]
    whys = {kind: why_unsafe(kind, step_s) for kind in {v.type for v in once}}
    return {v.id: f"vType {v.type.id}: {whys[v.type]}" for v in once if whys[v.type]}


def cannot_stop(vehicles: Sequence[VehicleDemand], abstraction: Abstraction | None) -> dict[str, str]:
    """Return the trips with a stop that no gate can handle, with the reason, by name."""
    ways = {way.loop.id: way for way in (abstraction.later if abstraction else ())}
    found = {}
    for vehicle in (v for v in vehicles if v.stops and not v.loop.closed and v.loop.id in ways):
        try:
            fit_stops(ways[vehicle.loop.id], vehicle.type, vehicle.stops, what="")
        except ScenarioError as error:
            found[vehicle.id] = str(error).removeprefix(": ")
    return found


def fitted_stops(
    scenario: Scenario, vehicles: Sequence[VehicleDemand], abstraction: Abstraction | None
) -> dict[str, tuple[Stop, ...]]:
    """Return the stops of each vehicle under a gate, by the vehicle's name.

    Raises
    ------
    ScenarioError
        If vehicles have stops that no gate can handle; the text names them all.
    """
    stops = {vehicle.id: vehicle.stops for vehicle in vehicles if vehicle.stops}
    if not scenario.gated or abstraction is None:
        return stops
    ways = {way.loop.id: way for way in (*abstraction.itineraries, *abstraction.later)}
    wrong: list[str] = []
    for vehicle in (vehicle for vehicle in vehicles if vehicle.stops):
        way, what = ways[vehicle.loop.id], f"vehicle {vehicle.id}"
        try:
            stops[vehicle.id] = fit_stops(way, vehicle.type, vehicle.stops, what=what)
        except ScenarioError as error:
            wrong.append(str(error))
    if wrong:
        msg = f"{scenario.routes or scenario.network}: {'; '.join(wrong)}"
        raise ScenarioError(msg)
    return stops
