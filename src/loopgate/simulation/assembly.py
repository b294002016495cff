"""Puts a run together: network, loops, states, vehicles at their starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from loopgate.abstraction.itinerary import Abstraction
from loopgate.errors import ScenarioError
from loopgate.network import Loop, RoadNetwork, VehicleType, read_loops
from loopgate.network.generate import generate_loops
from loopgate.network.sumo_config import is_sumo_config
from loopgate.simulation.placing import spread
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo_input import Start
from loopgate.simulation.track import Track
from loopgate.simulation.tracks import make_track

__all__ = ["Assembly", "assemble"]

_MOST_LOOPS = 40


@dataclass(frozen=True, slots=True)
class Assembly:
    """What a run consists of before SUMO starts.

    Attributes
    ----------
    network
        The roads.
    loops
        All loops that vehicles drive on.
    starts, tracks
        One per vehicle.
    abstraction
        The states; None where vehicles drive under no gate and no abstraction placed them.
    """

    network: RoadNetwork
    loops: tuple[Loop, ...]
    starts: tuple[Start, ...]
    tracks: tuple[Track, ...]
    abstraction: Abstraction | None


def assemble(scenario: Scenario) -> Assembly:
    """Read the network and the loops, build the abstraction, place the vehicles.

    The loops and starting places depend on the loops' seed and the seed, not on the gate, so that gates
    are compared on the same vehicles.

    Raises
    ------
    LoopgateError
        If any part does not fit; the text says which.
    """
    network = RoadNetwork.open(scenario.network)
    loops, types = _vehicles(scenario, network)
    abstraction = _abstraction(scenario, network, loops, types)
    if abstraction is None:
        fronts: Sequence[float] = spread(loops, types, Random(scenario.seed))
        names = [f"v{number}" for number in range(len(loops))]
    else:
        fronts = abstraction.starts_m
        names = [robot.id for robot in abstraction.system.robots]
    starts = tuple(
        Start(name, loop, front, kind)
        for name, loop, front, kind in zip(names, loops, fronts, types, strict=True)
    )
    if abstraction is None or not scenario.gated:
        tracks = tuple(make_track(network, start) for start in starts)
    else:
        tracks = tuple(
            make_track(network, start, itinerary, robot.start)
            for start, itinerary, robot in zip(
                starts, abstraction.itineraries, abstraction.system.robots, strict=True
            )
        )
    unique = tuple({loop.id: loop for loop in loops}.values())
    return Assembly(network, unique, starts, tracks, abstraction)


def _vehicles(scenario: Scenario, network: RoadNetwork) -> tuple[list[Loop], list[VehicleType]]:
    """Return loop and type of each vehicle."""
    if scenario.routes or is_sumo_config(scenario.network):
        file = read_loops(network, scenario.routes or scenario.network)
        loops = list(file.loops)
        by_name = {loop.id: loop for loop in loops}
        kinds: dict[str, VehicleType] = {}
        for vehicle in file.vehicles:
            kinds.setdefault(vehicle.loop, vehicle.type)
        default = next(iter(file.types.values()), VehicleType())
        if file.vehicles and not scenario.vehicles:
            return [by_name[v.loop] for v in file.vehicles], [v.type for v in file.vehicles]
        types = [kinds.get(loop.id, default) for loop in loops]
    else:
        count = scenario.loops or min(scenario.vehicles, _MOST_LOOPS)
        if not count:
            msg = "no loops: give a route file (routes), a number of random loops (loops), or vehicles"
            raise ScenarioError(msg)
        loops = list(_random_loops(scenario, network, count))
        types = [VehicleType()] * len(loops)
    number = scenario.vehicles or len(loops)
    chosen = [i % len(loops) for i in range(number)]
    return [loops[i] for i in chosen], [types[i] for i in chosen]


def _random_loops(scenario: Scenario, network: RoadNetwork, count: int) -> Sequence[Loop]:
    return generate_loops(network, count, length_m=scenario.loop_length_m, seed=scenario.loops_seed)


def _abstraction(
    scenario: Scenario, network: RoadNetwork, loops: Sequence[Loop], types: Sequence[VehicleType]
) -> Abstraction | None:
    del network, loops, types
    if scenario.gated:
        msg = f"gate {scenario.gate}: no abstraction is built yet"
        raise ScenarioError(msg)
    return None
