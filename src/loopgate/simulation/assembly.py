"""Puts a run together: network, loops, states, vehicles at their starts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from random import Random

from loopgate.abstraction.itinerary import Abstraction, Itinerary
from loopgate.abstraction.queues import make_queues
from loopgate.abstraction.segments import make_segments
from loopgate.abstraction.stopping import fit_stops
from loopgate.drive.track import Track
from loopgate.errors import ScenarioError
from loopgate.network import Loop, RoadNetwork, VehicleType, read_loops
from loopgate.network.cover.watch import allot, even_starts_m, laps_s
from loopgate.network.cover.wishes import read_districts, read_weights
from loopgate.network.routes_file import RoutesFile
from loopgate.network.stops import Stop
from loopgate.network.sumo_config import is_sumo_config
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.placing import spread
from loopgate.simulation.random_loops import random_loops
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.settings import check_types, unforeseen
from loopgate.simulation.spacing import advised_type
from loopgate.simulation.sumo_input import Start
from loopgate.simulation.sumo_options import begins_s
from loopgate.simulation.tracks import make_track

__all__ = ["Assembly", "Departure", "assemble"]

_MOST_LOOPS = 40

_CLEAR_M = 0.5
"""Room behind a vehicle that departs, to the beginning of its place [m]."""

_LEAST_M = 0.5
"""Room before it, to its line [m]."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """Streets to be seen so many times as often as others, and districts by name with their streets."""

    weights: Mapping[str, float] = field(default_factory=dict)
    districts: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Departure:
    """A vehicle that departs later: where, on which track under a gate, and when at the earliest [s]."""

    start: Start
    track: Track | None
    at_s: float


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
    warnings
        What the user should know of how it was put together.
    foresees
        Whether it can be told when a vehicle will be past a crossing; see `unforeseen`.
    wishes
        What the user wants of the watch.
    departures
        Vehicles that depart later, in that order.
    stops
        Where vehicles stop in every round, by vehicle, in the order of its loop.
    stop_files
        Additional files that hold the places of these.
    """

    network: RoadNetwork
    loops: tuple[Loop, ...]
    starts: tuple[Start, ...]
    tracks: tuple[Track, ...]
    abstraction: Abstraction | None
    warnings: tuple[str, ...] = ()
    foresees: bool = True
    wishes: Wishes = Wishes()
    departures: tuple[Departure, ...] = ()
    stops: Mapping[str, tuple[Stop, ...]] = field(default_factory=dict)
    stop_files: tuple[Path, ...] = ()

    @property
    def everybody(self) -> tuple[Start, ...]:
        """All vehicles, also those that depart later."""
        return (*self.starts, *(departure.start for departure in self.departures))

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(start.vehicle for start in self.everybody)


def assemble(scenario: Scenario) -> Assembly:
    """Read the network and the loops, build the abstraction, place the vehicles.

    The loops and starting places depend on the loops' seed and the seed, not on the gate, so that gates
    are compared on the same vehicles. Under ``open`` there may be more vehicles than the abstraction
    allows; they are then spread over the loops without it.

    Raises
    ------
    LoopgateError
        If any part does not fit; the text says which.
    """
    network = RoadNetwork.open(scenario.network)
    everybody, warnings, file = _vehicles(scenario, network)
    vehicles, later, moved = _by_departure(scenario, everybody)
    if scenario.starts == "even":
        vehicles = _evenly_round(network, vehicles)
    peculiar = _peculiar(scenario, network, everybody) if scenario.gated else ()
    loops = [vehicle.loop for vehicle in vehicles]
    abstraction = None
    if scenario.gated or scenario.abstraction != "segments" or len({loop.id for loop in loops}) == len(loops):
        # The first who comes shows the states; nobody stands in them yet.
        abstraction = _abstraction(scenario, network, vehicles or later[:1], later)
    if abstraction is None:
        kinds = [vehicle.type for vehicle in vehicles]
        wishes = [vehicle.depart_m for vehicle in vehicles]
        fronts = dict(enumerate(spread(loops, kinds, Random(scenario.seed), wishes)))
    else:
        fronts = dict(enumerate(abstraction.starts_m))
    lanes = _start_lanes(abstraction) if abstraction else [None] * len(vehicles)
    starts = tuple(
        Start(v.id, v.loop, fronts[number], v.type, lanes[number], v.attributes, v.parameters)
        for number, v in enumerate(vehicles)
    )
    if abstraction is None or not scenario.gated:
        tracks = tuple(make_track(network, start) for start in starts)
        departures = tuple(_at_the_edge(vehicle) for vehicle in later)
    else:
        robots = abstraction.system.robots[: len(starts)]
        tracks = tuple(
            make_track(network, start, itinerary, robot.start, keeps_lane=abstraction.keeps_lane)
            for start, itinerary, robot in zip(starts, abstraction.itineraries, robots, strict=False)
        )
        departures = tuple(
            _in_place(network, vehicle, way) for vehicle, way in zip(later, abstraction.later, strict=True)
        )
    unique = tuple({vehicle.loop.id: vehicle.loop for vehicle in everybody}.values())
    if scenario.rule_for_spacing == "advice":
        starts = tuple(replace(start, type=advised_type(start.type)) for start in starts)
        departures = tuple(
            replace(one, start=replace(one.start, type=advised_type(one.start.type))) for one in departures
        )
    return Assembly(
        network,
        unique,
        starts,
        tracks,
        abstraction,
        warnings=(*warnings, *moved, *peculiar, *_alone(scenario, [v.loop for v in everybody])),
        foresees=not peculiar,
        wishes=_wishes(scenario, network, sorted({vehicle.type.vclass for vehicle in everybody})),
        departures=departures,
        stops=_stops(scenario, [*vehicles, *later], abstraction),
        stop_files=file.stop_files if file else (),
    )


def _stops(
    scenario: Scenario, vehicles: Sequence[_Vehicle], abstraction: Abstraction | None
) -> dict[str, tuple[Stop, ...]]:
    """Return the stops of each vehicle, as it makes them under a gate."""
    stops = {vehicle.id: vehicle.stops for vehicle in vehicles if vehicle.stops}
    if not scenario.gated or abstraction is None:
        return stops
    source = scenario.routes or scenario.network
    ways = {way.loop: way for way in (*abstraction.itineraries, *abstraction.later)}
    return {
        vehicle.id: fit_stops(
            vehicle.loop, way, vehicle.type, vehicle.stops, what=f"{source}: vehicle {vehicle.id}"
        )
        for vehicle in vehicles
        if vehicle.stops
        for way in (ways[vehicle.loop.id],)
    }


def _by_departure(
    scenario: Scenario, vehicles: Sequence[_Vehicle]
) -> tuple[list[_Vehicle], list[_Vehicle], tuple[str, ...]]:
    """Return those who are there from the beginning, those who depart later, in order, and warnings."""
    twice = next((name for name, times in Counter(v.id for v in vehicles).items() if times > 1), None)
    if twice is not None:
        msg = f"{scenario.routes or scenario.network}: two vehicles are called {twice}; rename one"
        raise ScenarioError(msg)
    begin_s = begins_s(scenario)
    later = sorted((v for v in vehicles if v.depart_s > begin_s), key=lambda v: v.depart_s)
    if later and scenario.gated and scenario.abstraction != "queues":
        msg = (
            f"{scenario.routes or scenario.network}: {len(later)} vehicles depart later, first {later[0].id} "
            f"at {later[0].depart_s:g} s: on segments all start at once; it works on --abstraction queues"
        )
        return list(vehicles), [], (msg,)
    return [v for v in vehicles if v.depart_s <= begin_s], later, ()


def _at_the_edge(vehicle: _Vehicle) -> Departure:
    """Return where SUMO is to put a vehicle by itself: where its file says, or else as far back as it can."""
    begin_m = [span.begin_m for span in vehicle.loop.spans if not span.internal][vehicle.edge]
    least_m = begin_m + vehicle.type.length_m
    front_m = least_m if vehicle.depart_m is None else vehicle.depart_m
    return Departure(vehicle.start(front_m, None), None, vehicle.depart_s)


def _in_place(network: RoadNetwork, vehicle: _Vehicle, way: Itinerary) -> Departure:
    """Return where a vehicle departs under a gate: as a whole within the place where its file wants it."""
    roads = [span.begin_m for span in vehicle.loop.spans if not span.internal]
    wish_m = roads[vehicle.edge] if vehicle.depart_m is None else vehicle.depart_m
    lap_m = way.length_m
    position = min(range(len(way.legs)), key=lambda k: (way.legs[k].end_m - _LEAST_M - wish_m) % lap_m)
    leg = way.legs[position]
    first_m, last_m = leg.begin_m + vehicle.type.length_m + _CLEAR_M, leg.end_m - _LEAST_M
    near_m = wish_m + round((first_m - wish_m) / lap_m) * lap_m
    front_m = max(first_m, min(near_m, last_m))
    start = vehicle.start(front_m, leg.lane)
    return Departure(start, make_track(network, start, way, position, keeps_lane=True), vehicle.depart_s)


def _alone(scenario: Scenario, loops: Sequence[Loop]) -> tuple[str, ...]:
    if not scenario.spacing.replace("none", "") or len({loop.id for loop in loops}) < len(loops):
        return ()
    return (f"spacing {scenario.spacing}: no loop has two vehicles, so there is nothing to space",)


def _wishes(scenario: Scenario, network: RoadNetwork, classes: Sequence[str]) -> Wishes:
    """Read what is wanted of the watch; an edge lies in a district if it is open to some vehicle."""
    return Wishes(
        read_weights(network, scenario.weights) if scenario.weights else {},
        read_districts(network, scenario.districts, classes) if scenario.districts else {},
    )


def _peculiar(scenario: Scenario, network: RoadNetwork, vehicles: Sequence[_Vehicle]) -> tuple[str, ...]:
    """Refuse types that no gate can drive; return what is peculiar about those that it can."""
    kinds = [vehicle.type for vehicle in vehicles]
    check_types(kinds, step_s=scenario.step_s, source=scenario.routes or scenario.network)
    if scenario.abstraction != "queues":
        return ()  # nothing is foreseen where there are no crossings
    return unforeseen(network, [(vehicle.loop, vehicle.type) for vehicle in vehicles])


def _start_lanes(abstraction: Abstraction) -> list[int | None]:
    robots = abstraction.system.robots
    return [way.legs[robot.start].lane for way, robot in zip(abstraction.itineraries, robots, strict=True)]


@dataclass(frozen=True, slots=True)
class _Vehicle:
    id: str
    loop: Loop
    type: VehicleType
    depart_m: float | None = None
    stops: tuple[Stop, ...] = ()
    attributes: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, str] = field(default_factory=dict)
    depart_s: float = 0.0
    edge: int = 0

    def start(self, front_m: float, lane: int | None) -> Start:
        """Return its start there, when it departs later."""
        return Start(
            self.id, self.loop, front_m, self.type, lane, self.attributes, self.parameters, self.depart_s
        )


def _vehicles(
    scenario: Scenario, network: RoadNetwork
) -> tuple[list[_Vehicle], tuple[str, ...], RoutesFile | None]:
    """Return the vehicles: the route file's, unless a number of them is asked for; warnings; the file."""
    own = is_sumo_config(scenario.network) and scenario.traffic != scenario.network
    if not scenario.routes and not own:
        count = scenario.loops or min(scenario.vehicles, _MOST_LOOPS)
        if not count:
            msg = "no loops: give a route file (routes), a number of random loops (loops), or vehicles"
            raise ScenarioError(msg)
        found = random_loops(scenario, network, count)
        warnings = (f"{found.shortfall}; going on with these",) if found.shortfall else ()
        return _given_loops(scenario, network, found.loops, {}, DEFAULT_TYPE), warnings, None
    file = read_loops(network, scenario.routes or scenario.network, stops=scenario.stop_files)
    if file.vehicles and not scenario.vehicles:
        by_name = {loop.id: loop for loop in file.loops}
        begin_s = begins_s(scenario)
        end_s = begin_s + scenario.warmup_s + scenario.duration_s
        each = [
            one
            for vehicle in file.vehicles
            for one in vehicle.each(begin_s, end_s, Random(f"{scenario.seed} {vehicle.id}"))
        ]
        mine = [
            _Vehicle(
                v.id,
                by_name[v.loop],
                v.type,
                v.depart_m,
                v.stops,
                v.attributes,
                v.parameters,
                v.depart_s,
                v.edge,
            )
            for v in each
        ]
        return mine, file.left_out, file
    kinds: dict[str, VehicleType] = {}
    for vehicle in file.vehicles:
        kinds.setdefault(vehicle.loop, vehicle.type)
    default = next(iter(file.types.values()), DEFAULT_TYPE)
    given = _given_loops(scenario, network, file.loops, kinds, default)
    stopping = [
        replace(v, stops=tuple(s.at(begins_s(scenario)) for s in file.stops.get(v.loop.id, ())))
        for v in given
    ]
    return stopping, file.left_out_of_routes, file


def _given_loops(
    scenario: Scenario,
    network: RoadNetwork,
    loops: Sequence[Loop],
    kinds: Mapping[str, VehicleType],
    default: VehicleType,
) -> list[_Vehicle]:
    """Give loops to the vehicles: in turn, or so many to each that its vehicles come as often as others'."""
    number = scenario.vehicles or len(loops)
    if scenario.starts == "even":
        shares = zip(loops, allot(laps_s(network, loops), number), strict=True)
        chosen = [loop for loop, share in shares for _ in range(share)]
    else:
        chosen = [loops[i % len(loops)] for i in range(number)]
    return [_Vehicle(f"v{i + 1}", loop, kinds.get(loop.id, default)) for i, loop in enumerate(chosen)]


def _evenly_round(network: RoadNetwork, vehicles: Sequence[_Vehicle]) -> list[_Vehicle]:
    """Start the vehicles of each loop evenly round it, in time at the speeds allowed."""
    numbers = Counter(vehicle.loop.id for vehicle in vehicles)
    loops = {vehicle.loop.id: vehicle.loop for vehicle in vehicles}
    starts = {name: iter(even_starts_m(network, loop, numbers[name])) for name, loop in loops.items()}
    return [replace(vehicle, depart_m=next(starts[vehicle.loop.id])) for vehicle in vehicles]


def _abstraction(
    scenario: Scenario, network: RoadNetwork, vehicles: Sequence[_Vehicle], later: Sequence[_Vehicle]
) -> Abstraction:
    loops = [vehicle.loop for vehicle in vehicles]
    given = {v.id: v.depart_m for v in vehicles if v.depart_m is not None}
    if scenario.abstraction == "queues":
        return make_queues(
            network,
            loops,
            [vehicle.type for vehicle in vehicles],
            seed=scenario.seed,
            names=[vehicle.id for vehicle in vehicles],
            starts_m=given,
            later=[(vehicle.loop, vehicle.type) for vehicle in later],
        )
    unique = len({loop.id for loop in loops})
    if unique < len(loops):
        msg = (
            f"abstraction segments: {len(loops)} vehicles on {unique} loops, but a path has one robot only "
            f"(assumption 3): take at most {unique} vehicles, more loops, or --abstraction queues"
        )
        raise ScenarioError(msg)
    return make_segments(
        loops,
        rho_m=scenario.rho_m,
        vehicle_length_m=max(vehicle.type.length_m for vehicle in vehicles),
        min_gap_m=max(vehicle.type.min_gap_m for vehicle in vehicles),
        piece_m=scenario.piece_m,
        seed=scenario.seed,
        names=[vehicle.id for vehicle in vehicles],
        starts_m=given,
    )
