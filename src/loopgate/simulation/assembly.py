"""Reads the parts of a run and fits them together before SUMO starts."""

from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from random import Random
from xml.etree import ElementTree as ET

from loopgate.abstraction.itinerary import Abstraction, Itinerary, Track, make_track
from loopgate.abstraction.queues import make_queues
from loopgate.abstraction.segments import make_segments
from loopgate.cache import without_collection
from loopgate.control.start import VehicleStart
from loopgate.errors import LoopgateError, RefusedLoopError, RouteError, ScenarioError, TooManyVehiclesError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, read_loops
from loopgate.network.cover.wishes import read_districts, read_weights
from loopgate.network.incidents import Incidents, read_incidents
from loopgate.network.stops import Stop
from loopgate.network.sumo_config import is_sumo_config
from loopgate.network.ungated import UngatedFleet, in_ordinary_traffic
from loopgate.network.vehicle_demand import RoutesFile, scaled
from loopgate.reading import counted
from loopgate.simulation.demand.allotment import (
    begins_further_on,
    check_names,
    check_number,
    departs_at_edge,
    departs_in_place,
    give_loops,
    random_loops,
    spread,
)
from loopgate.simulation.demand.apart import (
    cannot_stop,
    files_beside,
    fitted_stops,
    going_on,
    moved_stops,
    nobody_gated,
    sort_out,
)
from loopgate.simulation.demand.detours import (
    FoundDetours,
    find_detours,
    name_closed_stops,
    name_incidents_outside,
    name_long_stops,
)
from loopgate.simulation.demand.other_lanes import OtherLanes
from loopgate.simulation.demand.shared_lanes import share_lanes, wanted_lane
from loopgate.simulation.drivers import advised_type, driven_by_machines
from loopgate.simulation.scenario import Scenario, option_name
from loopgate.simulation.settings import (
    brakes_late,
    check_types,
    highest_limits,
    unforeseen,
    with_defaults,
)
from loopgate.simulation.sumo.devices import ReroutingPolicy, closures_of, leading_devices, without_devices
from loopgate.simulation.sumo_options import all_options, begins_s, option_of
from loopgate.simulation.unused import without_effect

_MOST_LOOPS = 40


@dataclass(frozen=True, slots=True)
class Wishes:
    """Weights of streets, and the streets of each district, as the user gives them."""

    weights: Mapping[str, float] = field(default_factory=dict)
    districts: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Assembly:
    """The parts of a run before SUMO starts.

    Attributes
    ----------
    network
        The roads.
    loops
        All loops that vehicles drive.
    starts
        The vehicles that are there from the beginning.
    abstraction
        The states; None where vehicles drive under no gate and no abstraction placed them.
    warnings
        Warnings for the user about the vehicles and their loops.
    wishes
        Weights of streets, and districts.
    departures
        Vehicles that depart later, in the order of time.
    stops
        For each vehicle, its stops in a round, in the order of its loop.
    stop_files
        Additional files with the stopping places.
    vehicle_files
        Additional files with some of the vehicles.
    begin_s
        When the simulation begins [s].
    persons
        Persons and containers of the route file, with their types, for SUMO.
    ordinary, ungated
        Vehicles of the route file that are not under the gate; `ungated` is written as the file has them.
    anew
        For each trip that may be rerouted, the policy.
    other_ways
        One nameless vehicle on each further path for these trips, and on each detour.
    other_lanes
        The lanes on which trips that are not rerouted may drive too.
    incidents
        Closed streets and vehicles that break down.
    detours
        By name of a detour, the name of the loop that it replaces.
    ungated_detours
        Without a gate, the detours with their paths.
    """

    network: RoadNetwork
    loops: tuple[Loop, ...]
    starts: tuple[VehicleStart, ...]
    abstraction: Abstraction | None
    warnings: tuple[str, ...] = ()
    wishes: Wishes = Wishes()
    departures: tuple[VehicleStart, ...] = ()
    stops: Mapping[str, tuple[Stop, ...]] = field(default_factory=dict)
    stop_files: tuple[Path, ...] = ()
    vehicle_files: tuple[Path, ...] = ()
    begin_s: float = 0.0
    persons: tuple[ET.Element, ...] = field(default=(), hash=False)
    ordinary: tuple[VehicleDemand, ...] = ()
    ungated: UngatedFleet = field(default_factory=UngatedFleet)
    anew: Mapping[str, ReroutingPolicy] = field(default_factory=dict)
    other_ways: tuple[VehicleStart, ...] = ()
    other_lanes: OtherLanes = field(default_factory=OtherLanes)
    incidents: Incidents = field(default_factory=Incidents)
    detours: Mapping[str, str] = field(default_factory=dict)
    ungated_detours: tuple[tuple[Loop, Track], ...] = ()

    @property
    def contains(self) -> bool:
        """Whether streets may be closed or vehicles stand for long, so that others must be led round."""
        return bool(self.incidents.closures or self.incidents.breakdowns or self.detours)

    @cached_property
    def trips(self) -> frozenset[str]:
        """The vehicles that drive their route once."""
        return frozenset(start.vehicle for start in self.everybody if not start.loop.closed)

    @property
    def others(self) -> tuple[str, ...]:
        """The vehicles, trips and flows of the route file that drive in ordinary traffic, by name."""
        return (*(one.id for one in self.ordinary), *(one.id for one in self.ungated.vehicles))

    @cached_property
    def tracks(self) -> tuple[Track, ...]:
        """The paths of the vehicles that are there from the beginning."""
        return tuple(start.track for start in self.starts)

    @cached_property
    def later_tracks(self) -> tuple[Track, ...]:
        """The paths of the vehicles that depart later, the other paths, and the detours."""
        return tuple(start.track for start in (*self.departures, *self.other_ways))

    @cached_property
    def everybody(self) -> tuple[VehicleStart, ...]:
        """All vehicles, later departures included."""
        return (*self.starts, *self.departures)

    def departed_on(self, starts: Mapping[str, VehicleStart]) -> "Assembly":
        """Return the same parts with other starts of some vehicles that depart later, by name."""
        return replace(self, departures=tuple(starts.get(one.vehicle, one) for one in self.departures))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of all vehicles."""
        return tuple(start.vehicle for start in self.everybody)


@without_collection()
def assemble(scenario: Scenario) -> Assembly:
    """Read the network and the vehicles, build the abstraction, and place the vehicles.

    The loops and starting places depend on the loops' seed and the seed, not on the gate, so that gates are
    compared on the same vehicles. Under ``open`` there may be more vehicles than the abstraction allows; they
    are then spread over the loops without it.

    Raises
    ------
    LoopgateError
        If any part does not fit; the text says which.
    """
    network, keeping = RoadNetwork.open(scenario.network), set[str]()
    while True:
        try:
            return _assemble(scenario, network, keeping)
        except RefusedLoopError as error:  # perhaps only over the lanes that were chosen
            refused = error.refused.keys() - keeping
            if keeping and not refused:
                return _assemble(scenario, network, None)
            keeping |= refused


def _assemble(scenario: Scenario, network: RoadNetwork, keeping: Collection[str] | None) -> Assembly:
    """Return the parts of a run; `keeping`: see `read_vehicles`."""
    everybody, warnings, file = read_vehicles(scenario, network, keeping)
    sorted_out = sort_out(scenario, network, everybody, file)
    everybody, ordinary, others = sorted_out.everybody, sorted_out.ordinary, sorted_out.others
    vehicles, later, anew, apart = sorted_out.vehicles, sorted_out.later, sorted_out.anew, sorted_out.apart
    warnings = (*warnings, *sorted_out.lines)
    closed = [v for v in [*vehicles, *later] if v.loop.closed]
    incidents, detours = _incidents(scenario, network, closed, file), FoundDetours()
    if scenario.gated and scenario.abstraction == "queues" and scenario.standing != "wait":
        once = [v for v in [*later, *others] if not v.loop.closed]
        detours = find_detours(network, closed, incidents, once)
        others += detours.vehicles
        warnings = (*warnings, *name_long_stops(closed, detours))
    elif not scenario.gated and incidents.closures:
        detours = find_detours(network, closed, Incidents(incidents.closures))
    begin_s, end_s = _lasts_s(scenario, file)
    outside = name_incidents_outside(incidents, begin_s, end_s)
    warnings = (*warnings, *name_closed_stops([*vehicles, *later], incidents), *outside)
    peculiar = _peculiar(scenario, network, everybody) if scenario.gated else {}
    abstraction = None
    distinct = len({vehicle.loop.id for vehicle in vehicles}) == len(vehicles)
    if scenario.gated or scenario.abstraction != "segments" or distinct:
        if scenario.gated and file is not None and not scenario.counts_vehicles:
            vehicles, later = _as_fit(scenario, network, vehicles, later)
        # The first later vehicle shows the states; no vehicle stands in them yet.
        abstraction = _abstraction(scenario, network, vehicles or later[:1], [*later, *others])
    if scenario.gated and abstraction is not None:
        if scenario.move_stops:
            ways_of_all = (*abstraction.itineraries, *abstraction.later)
            (vehicles, later), told = moved_stops([vehicles, later], ways_of_all)
            warnings = (*warnings, *told)
        unstopping = cannot_stop(scenario, [*vehicles, *later], abstraction)
        apart |= unstopping
        ordinary += [v for v in (*vehicles, *later) if v.id in unstopping]
        everybody, vehicles, later = (
            [v for v in some if v.id not in unstopping] for some in (everybody, vehicles, later)
        )
        if not everybody:
            raise nobody_gated(scenario.routes or scenario.network, sorted_out)
        if unstopping:
            abstraction = _abstraction(scenario, network, vehicles or later[:1], [*later, *others])
    devices, bereft = leading_devices(scenario, everybody) if scenario.gated else ((), ())
    vehicles, later = ([_driven(scenario, v, devices) for v in some] for some in (vehicles, later))
    # Where there are detours, vehicles may change to loops that their types in SUMO do not know.
    tracks = _Tracks(network, peculiar, renews=bool(detours.own))
    starts = _place(scenario, vehicles, abstraction, tracks)
    other_lanes = OtherLanes()
    if abstraction is None or not scenario.gated:
        departures = [departs_at_edge(v, tracks.on(v, Itinerary(v.loop))) for v in later]
    else:
        ways = [
            (v, way, tracks.on(v, way)) for v, way in zip([*later, *others], abstraction.later, strict=True)
        ]
        departures = [departs_in_place(*one) for one in ways]
        other_lanes = OtherLanes(one for one in ways[: len(later)] if one[0].id not in anew)
    source = scenario.routes or scenario.network
    return Assembly(
        network,
        tuple({vehicle.loop.id: vehicle.loop for vehicle in everybody if vehicle.loop.closed}.values()),
        tuple(starts),
        abstraction,
        warnings=(
            *(*warnings, *in_ordinary_traffic(source, apart), *sorted_out.moved, *peculiar.values(), *bereft),
            *_alone(scenario, [v.loop for v in everybody]),
            *_without_effect(scenario, end_s, file, everybody),
            *(begins_further_on(departures[: len(later)]) if scenario.gated else ()),
        ),
        wishes=_wishes(scenario, network, sorted({vehicle.type.vclass for vehicle in everybody})),
        departures=tuple(departures[: len(later)]),
        stops=fitted_stops(scenario, [*vehicles, *later], abstraction),
        stop_files=file.stop_files if file else (),
        vehicle_files=file.vehicle_files if file else (),
        persons=file.persons if file and not scenario.counts_vehicles else (),
        begin_s=begin_s,
        ordinary=tuple(ordinary),
        ungated=sorted_out.ungated,
        anew=anew,
        other_ways=tuple(departures[len(later) :]),
        other_lanes=other_lanes,
        incidents=incidents,
        detours=detours.own,
        ungated_detours=()
        if scenario.gated
        else tuple((v.loop, tracks.on(v, Itinerary(v.loop))) for v in detours.vehicles),
    )


def _lasts_s(scenario: Scenario, file: RoutesFile | None) -> tuple[float, float]:
    """Return when the run begins and when it ends [s]."""
    begin_s = begins_s(scenario, file)
    return begin_s, begin_s + scenario.warmup_s + scenario.duration_s


def _without_effect(
    scenario: Scenario, end_s: float, file: RoutesFile | None, vehicles: Sequence[VehicleDemand]
) -> tuple[str, ...]:
    closed = {v.loop.closed for v in vehicles}
    kinds = {"from_file": file is not None, "closed": True in closed, "once": False in closed}
    return without_effect(scenario, end_s, **kinds)


def _incidents(
    scenario: Scenario, network: RoadNetwork, vehicles: Sequence[VehicleDemand], file: RoutesFile | None
) -> Incidents:
    """Return the incidents of the scenario's file, and under a gate the roads that rerouters close."""
    found = Incidents()
    if scenario.incidents:
        found = read_incidents(network, scenario.incidents, {v.id for v in vehicles})
    if scenario.gated and scenario.abstraction == "queues" and scenario.by_messages is None:
        closed = closures_of(files_beside(scenario, file), vehicles, scenario.step_s)
        found = replace(found, closures=(*found.closures, *closed))
    return found


def read_vehicles(
    scenario: Scenario, network: RoadNetwork, keeping: Collection[str] | None = ()
) -> tuple[list[VehicleDemand], tuple[str, ...], RoutesFile | None]:
    """Return the vehicles, warnings, and the route file if there is one.

    If the scenario asks for a number of vehicles, the file only gives their loops.

    `keeping`: loops that do not share lanes with others, by name; None for all.
    """
    vehicles, warnings, file = _read_vehicles(scenario, network)
    vehicles = share_lanes(network, vehicles, keeping if scenario.abstraction == "queues" else None)
    if scenario.drivers == "machine":
        vehicles = driven_by_machines(vehicles, scenario.step_s)
    return vehicles, warnings, file


def _read_vehicles(
    scenario: Scenario, network: RoadNetwork
) -> tuple[list[VehicleDemand], tuple[str, ...], RoutesFile | None]:
    own = is_sumo_config(scenario.network) and scenario.traffic != scenario.network
    if not scenario.routes and not own:
        count = scenario.loops or min(scenario.vehicles, _MOST_LOOPS)
        if not count:
            msg = "no loops: give a route file (routes), a number of random loops (loops), or vehicles"
            raise ScenarioError(msg)
        found = random_loops(scenario, network, count)
        warnings = (f"{found.shortfall}; going on with these",) if found.shortfall else ()
        drawn = RoutesFile(Path(scenario.network), tuple(found.loops), (), {})
        return give_loops(scenario, network, drawn), warnings, None
    source, counts = scenario.routes or scenario.network, scenario.counts_vehicles
    try:
        file = read_loops(network, source, stops=scenario.stop_files, once=not counts)
    except RouteError as error:
        _refuse_counted_trips(scenario, network, error)
        raise
    if file.vehicles and not counts:
        begin_s, end_s = _lasts_s(scenario, file)
        if scenario.gated:
            demand = scaled(file.vehicles, option_of(scenario, "scale", 1.0))
            file = replace(file, vehicles=tuple(as_by_default(demand, all_options(scenario))))
        check_number(file, begin_s, end_s)
        mine = [one for vehicle in file.vehicles for one in vehicle.each(begin_s, end_s, scenario.seed)]
        check_names(mine, source)
        mine = going_on(network, mine, end_s, scenario.seed)
        told = (
            *file.left_out,
            *_outside(scenario, file, begin_s, end_s),
            *_no_such_lane(network, file, mine),
        )
        return mine, told, file
    stopping = [
        replace(v, stops=tuple(s.at(begins_s(scenario)) for s in file.stops.get(v.loop.id, ())))
        for v in give_loops(scenario, network, file)
    ]
    return stopping, file.left_out_of_routes, file


def _refuse_counted_trips(scenario: Scenario, network: RoadNetwork, error: RouteError) -> None:
    """Raise `ScenarioError` if a file has no loops for the vehicles of the scenario, but drives by itself."""
    source = scenario.routes or scenario.network
    counting = ("vehicles", "vehicles_per_km", "on_loops", "types")
    options = [f"--{option_name(field)}" for field in counting if getattr(scenario, field)]
    once = False
    with suppress(LoopgateError):
        file = read_loops(network, source, stops=scenario.stop_files, once=True)
        once = any(vehicle.once for vehicle in file.vehicles)
    if once and options:
        msg = (
            f"{source}: its vehicles drive their routes once, so there are no loops for "
            f"{' and '.join(options)}; leave {'it' if len(options) == 1 else 'them'} away"
        )
        raise ScenarioError(msg) from error


def as_by_default(vehicles: Iterable[VehicleDemand], options: Mapping[str, str]) -> Iterator[VehicleDemand]:
    """Yield vehicles whose types have what SUMO's options say of types that say nothing themselves."""
    for v in vehicles:
        types = tuple((with_defaults(kind, options), share) for kind, share in v.types)
        ways = tuple((one, share) for (way, share) in v.ways for one in as_by_default([way], options))
        yield replace(v, type=with_defaults(v.type, options), types=types, ways=ways)


def _no_such_lane(
    network: RoadNetwork, file: RoutesFile, vehicles: Sequence[VehicleDemand]
) -> tuple[str, ...]:
    """Warn about the trips that ask to depart on a lane which their first edge does not have."""
    wrong = []
    for v in vehicles:
        lane, edge = wanted_lane(v), network.edges[v.loop.edges[v.edge]]
        if not v.loop.closed and lane is not None and lane >= len(edge.lanes):
            last = len(edge.lanes) - 1
            there = f"edge {edge.id} has " + (f"lanes 0 to {last}" if last else "lane 0 only")
            wrong.append(f"{v.id}: departLane {lane}, but {there}")
    if not wrong:
        return ()
    return (
        f"{file.file}: {counted(len(wrong), 'vehicle')} on another lane than asked for, first {wrong[0]}",
    )


def _outside(scenario: Scenario, file: RoutesFile, begin_s: float, end_s: float) -> tuple[str, ...]:
    """Warn about the trips that depart outside the time of the run."""
    late = [v for v in file.vehicles if v.once and not v.flow and not begin_s <= v.depart_s < end_s]
    if not late:
        return ()
    what = (
        f"{scenario.routes or scenario.network}: {counted(len(late), 'vehicle')} left out, first {late[0].id}"
    )
    return (f"{what}: departing before {begin_s:g} s or after {end_s:g} s, when the run is over",)


class _Tracks:
    """The paths of vehicles, made once for each loop.

    `peculiar`: types that cannot be foreseen. `renews`: whether loopgate renews the routes of loops.
    """

    def __init__(self, network: RoadNetwork, peculiar: Container[str], *, renews: bool) -> None:
        self._network, self._peculiar, self._renews = network, peculiar, renews
        self._made: dict[tuple[str, bool, bool, bool], Track] = {}

    def on(self, vehicle: VehicleDemand, way: Itinerary) -> Track:
        """Return the path of a vehicle over states, from the beginning of its loop."""
        foreseen = vehicle.type.id not in self._peculiar
        late = brakes_late(vehicle.type)
        key = way.loop.id, bool(way.legs), foreseen, late
        if key not in self._made:
            track = make_track(self._network, way)
            self._made[key] = replace(track, foreseen=foreseen, brakes_late=late, renews=self._renews)
        return self._made[key]


def _place(
    scenario: Scenario,
    vehicles: Sequence[VehicleDemand],
    abstraction: Abstraction | None,
    tracks: _Tracks,
) -> list[VehicleStart]:
    """Return the starts of the vehicles that are there from the beginning.

    Without a gate, their paths have no states.
    """
    starts = []
    fronts_m = abstraction.starts_m if abstraction else spread(vehicles, Random(scenario.seed))
    for number, (vehicle, front_m) in enumerate(zip(vehicles, fronts_m, strict=False)):
        way, position = Itinerary(vehicle.loop), 0
        if abstraction is not None:
            way, position = abstraction.itineraries[number], abstraction.system.robots[number].start
        lane = way.legs[position].line.lane if way.keeps_lane else None
        if not scenario.gated:
            way, position = Itinerary(vehicle.loop), 0
        track = replace(tracks.on(vehicle, way), vehicle=vehicle.id, start_m=front_m, position=position)
        starts.append(VehicleStart(vehicle, track, lane))
    return starts


def _driven(scenario: Scenario, vehicle: VehicleDemand, devices: Collection[str]) -> VehicleDemand:
    """Return a vehicle without `devices`, and with a type for speed advice if the scenario advises speeds."""
    bare = without_devices(vehicle, devices) if devices else vehicle
    return replace(bare, type=advised_type(bare.type)) if scenario.rule_for_spacing == "advice" else bare


def _alone(scenario: Scenario, loops: Sequence[Loop]) -> tuple[str, ...]:
    if not scenario.spacing.replace("none", "") or len({loop.id for loop in loops}) < len(loops):
        return ()
    return (f"spacing {scenario.spacing}: no loop has two vehicles, so there is nothing to space",)


def _wishes(scenario: Scenario, network: RoadNetwork, classes: Sequence[str]) -> Wishes:
    """Read weights and districts; an edge belongs to a district only if some vehicle may drive on it."""
    return Wishes(
        read_weights(network, scenario.weights) if scenario.weights else {},
        read_districts(network, scenario.districts, classes) if scenario.districts else {},
    )


def _peculiar(scenario: Scenario, network: RoadNetwork, vehicles: Sequence[VehicleDemand]) -> dict[str, str]:
    """Refuse types that no gate can drive; return, by name, the types that cannot be foreseen and why."""
    users = [(vehicle.loop, vehicle.type) for vehicle in vehicles]
    limits = highest_limits(network, users)
    obeys = scenario.rule_for_lights == "obey"
    check_types(limits, step_s=scenario.step_s, obeys=obeys, source=scenario.routes or scenario.network)
    if scenario.abstraction != "queues":
        return {}  # on segments there are no crossings to clear
    return unforeseen(network, users, obeys=obeys)


def _as_fit(
    scenario: Scenario, network: RoadNetwork, vehicles: list[VehicleDemand], later: list[VehicleDemand]
) -> tuple[list[VehicleDemand], list[VehicleDemand]]:
    """Return the vehicles that find a place at the beginning, and those that wait to depart."""
    most = len(vehicles)
    if limit := option_of(scenario, "max-num-vehicles", 0.0):
        most = min(most, int(limit))
    if scenario.abstraction == "queues" and vehicles:
        try:
            _abstraction(scenario, network, vehicles[:most], [])
        except TooManyVehiclesError as error:
            most = error.fitting
    begin_s = begins_s(scenario)
    waiting = [replace(v, depart_s=max(begin_s, v.depart_s)) for v in vehicles[most:]]
    return vehicles[:most], sorted([*waiting, *later], key=lambda v: v.depart_s)


def _abstraction(
    scenario: Scenario,
    network: RoadNetwork,
    vehicles: Sequence[VehicleDemand],
    later: Sequence[VehicleDemand],
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
            own_lengths=scenario.gate == "certified" and scenario.by_messages is None,
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
