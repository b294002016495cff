"""Gives each vehicle a loop and a type, where the route file does not."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from loopgate.errors import ScenarioError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, VehicleType
from loopgate.network.cover.watch import allot, even_starts_m, laps_s
from loopgate.network.vehicle_demand import RoutesFile
from loopgate.network.vehicle_type import type_of_class
from loopgate.simulation.demand.amount import MOST_VEHICLES
from loopgate.simulation.scenario import Scenario, parse_amounts


def give_loops(scenario: Scenario, network: RoadNetwork, file: RoutesFile) -> list[VehicleDemand]:
    """Return the vehicles with loops and types, by the scenario's types or the types of the loop."""
    on_loop: dict[str, VehicleType] = {}
    for vehicle in file.vehicles:
        for way in (vehicle, *(one for one, _ in vehicle.ways)):
            on_loop.setdefault(way.loop.id, way.type)
    chosen = allot_loops(scenario, network, file.loops)
    kinds = mixed_types(scenario, file.types, len(chosen))
    kinds = kinds or [on_loop.get(loop.id, file.default) for loop in chosen]
    return [
        VehicleDemand(f"v{i}", loop, kind)
        for i, (loop, kind) in enumerate(zip(chosen, kinds, strict=True), 1)
    ]


def allot_loops(scenario: Scenario, network: RoadNetwork, loops: Sequence[Loop]) -> list[Loop]:
    """Return the loop of each vehicle, by the scenario's numbers, or one vehicle per loop.

    Raises
    ------
    ScenarioError
        If a loop that is to have vehicles is not there, or there would be more than `MOST_VEHICLES`.
    RouteError
        If there are fewer vehicles than loops that are to be seen equally often.
    """
    _check_number(scenario.vehicles)
    if scenario.on_loops:
        numbers = _on_loops(scenario, loops)
    elif scenario.vehicles_per_km:
        numbers = [max(1, round(scenario.vehicles_per_km * loop.length_m / 1000.0)) for loop in loops]
    elif scenario.rule_for_starts == "even":
        numbers = list(allot(laps_s(network, loops), scenario.vehicles or len(loops)))
    else:
        return [loops[i % len(loops)] for i in range(scenario.vehicles or len(loops))]
    _check_number(sum(numbers))
    return [loop for loop, number in zip(loops, numbers, strict=True) for _ in range(number)]


def _check_number(vehicles: int) -> None:
    if vehicles > MOST_VEHICLES:
        msg = f"vehicles: {vehicles} are asked for; expected at most {MOST_VEHICLES}"
        raise ScenarioError(msg)


def _on_loops(scenario: Scenario, loops: Sequence[Loop]) -> list[int]:
    wanted = parse_amounts(scenario.on_loops)
    unknown = [name for name in wanted if name not in {loop.id for loop in loops}]
    if unknown:
        known = ", ".join(loop.id for loop in loops)
        msg = f"on_loops: there is no loop {unknown[0]} in {scenario.routes or 'this run'}; there are {known}"
        raise ScenarioError(msg)
    return [int(wanted.get(loop.id, 0)) for loop in loops]


def mixed_types(scenario: Scenario, known: Mapping[str, VehicleType], number: int) -> list[VehicleType]:
    """Return a type for each vehicle by the scenario's shares; empty if it has none.

    The types take turns as evenly as their shares allow, so that each loop gets some of each.

    Parameters
    ----------
    scenario
        Its `types` name those of the route file, or SUMO's vehicle classes.
    known
        The types of the route file.

    Raises
    ------
    RouteError
        If a name is neither.
    """
    shares = parse_amounts(scenario.types)
    kinds = {name: known.get(name) or type_of_class(name, "types") for name in shares}
    total = sum(shares.values())
    given = dict.fromkeys(shares, 0)
    chosen = []
    for count in range(1, number + 1 if shares else 0):
        name = max(shares, key=lambda name: shares[name] / total * count - given[name])
        given[name] += 1
        chosen.append(kinds[name])
    return chosen


def evenly_round(network: RoadNetwork, vehicles: Sequence[VehicleDemand]) -> list[VehicleDemand]:
    """Start the vehicles of each loop at even intervals, in time at the speed limits."""
    numbers = Counter(vehicle.loop.id for vehicle in vehicles)
    loops = {vehicle.loop.id: vehicle.loop for vehicle in vehicles}
    starts = {name: iter(even_starts_m(network, loop, numbers[name])) for name, loop in loops.items()}
    return [replace(vehicle, depart_m=next(starts[vehicle.loop.id])) for vehicle in vehicles]
