"""The vehicles of a run: which they are, when they depart, and where."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.stretches import least_change_m
from loopgate.drive.track import Track, make_track
from loopgate.errors import RouteError, ScenarioError
from loopgate.network import Loop, LoopVehicle, RoadNetwork, VehicleType, read_loops
from loopgate.network.cover.watch import even_starts_m
from loopgate.network.route_lanes import LaneWishes, make_route
from loopgate.network.routes_file import RoutesFile
from loopgate.network.stops import lanes_of_stops, on_loop
from loopgate.network.sumo_config import is_sumo_config
from loopgate.network.trips import ways_between
from loopgate.reading import counted
from loopgate.simulation.demand.allotment import allot_loops, mixed_types
from loopgate.simulation.demand.random_loops import random_loops
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.input import Start
from loopgate.simulation.sumo_options import begins_s

_MOST_LOOPS = 40

_CLEAR_M = 0.5
"""Room behind a vehicle that departs, to the beginning of its place [m]."""

_LEAST_M = 0.5
"""Room before it, to its line [m]."""


@dataclass(frozen=True, slots=True)
class Departure:
    """A vehicle that departs later: where, on which track under a gate, and when at the earliest [s]."""

    start: Start
    track: Track | None
    at_s: float


def read_vehicles(
    scenario: Scenario, network: RoadNetwork
) -> tuple[list[LoopVehicle], tuple[str, ...], RoutesFile | None]:
    """Return the vehicles: the route file's, unless a number of them is asked for; warnings; the file."""
    own = is_sumo_config(scenario.network) and scenario.traffic != scenario.network
    if not scenario.routes and not own:
        count = scenario.loops or min(scenario.vehicles, _MOST_LOOPS)
        if not count:
            msg = "no loops: give a route file (routes), a number of random loops (loops), or vehicles"
            raise ScenarioError(msg)
        found = random_loops(scenario, network, count)
        warnings = (f"{found.shortfall}; going on with these",) if found.shortfall else ()
        drawn = RoutesFile(Path(scenario.network), tuple(found.loops), (), {})
        return _given_loops(scenario, network, drawn, {}), warnings, None
    source, counts = scenario.routes or scenario.network, scenario.counts_vehicles
    file = read_loops(network, source, stops=scenario.stop_files, once=not counts)
    if file.vehicles and not counts:
        begin_s = begins_s(scenario, file)
        end_s = begin_s + scenario.warmup_s + scenario.duration_s
        mine = [one for vehicle in file.vehicles for one in vehicle.each(begin_s, end_s, scenario.seed)]
        return share_lanes(network, mine), (*file.left_out, *_outside(scenario, file, begin_s, end_s)), file
    kinds: dict[str, VehicleType] = {}
    for vehicle in file.vehicles:
        for way in (vehicle, *(one for one, _ in vehicle.ways)):
            kinds.setdefault(way.loop.id, way.type)
    given = _given_loops(scenario, network, file, kinds)
    stopping = [
        replace(v, stops=tuple(s.at(begins_s(scenario)) for s in file.stops.get(v.loop.id, ())))
        for v in given
    ]
    return stopping, file.left_out_of_routes, file


def _outside(scenario: Scenario, file: RoutesFile, begin_s: float, end_s: float) -> tuple[str, ...]:
    """Say how many of those who drive once depart at no time of the run."""
    late = [v for v in file.vehicles if v.once and not v.flow and not begin_s <= v.depart_s < end_s]
    if not late:
        return ()
    what = (
        f"{scenario.routes or scenario.network}: {counted(len(late), 'vehicle')} left out, first {late[0].id}"
    )
    return (f"{what}: departing before {begin_s:g} s or after {end_s:g} s, when the run is over",)


def share_lanes(network: RoadNetwork, vehicles: Sequence[LoopVehicle]) -> list[LoopVehicle]:
    """Lead those who drive once over lanes so that parallel ones share the traffic, in order of departure.

    Each is led twice, the second time knowing how all others are. Who drives over the same lanes has the same
    way from then on.
    """
    load: Counter[str] = Counter()
    led = {v.id: v.loop for v in vehicles if not v.loop.closed}
    used: dict[str, tuple[str, ...]] = {}
    alone: dict[tuple[tuple[str, ...], str], Loop] = {}  # where there are no lanes to choose between
    for vehicle in 2 * sorted((v for v in vehicles if v.id in led), key=lambda v: v.depart_s):
        kind, said = vehicle.type, vehicle.attributes
        edges = vehicle.loop.edges
        load.subtract(used.get(vehicle.id, ()))
        way = alone.get((edges, kind.vclass)) or make_route(
            network,
            vehicle.loop.id,
            edges,
            vclass=kind.vclass,
            load=load,
            change_m=least_change_m(kind.length_m + kind.min_gap_m),
            wishes=LaneWishes(
                _index(said.get("departLane")), _index(said.get("arrivalLane")), lanes_of_stops(vehicle.stops)
            ),
        )
        if all(len(network.edges[edge].lanes) == 1 for edge in edges):
            alone[edges, kind.vclass] = way
        led[vehicle.id], used[vehicle.id] = way, tuple(_counted(way))
        load.update(used[vehicle.id])
    ways: dict[tuple[object, ...], Loop] = {}
    found = {vehicle.id: vehicle for vehicle in vehicles}
    for name, way in led.items():
        key = way.edges, tuple((span.lane_in, span.lane) for span in way.roads)
        found[name] = _led(found[name], ways.setdefault(key, replace(way, id=f"way{len(ways)}")))
    return list(found.values())


def _led(vehicle: LoopVehicle, way: Loop) -> LoopVehicle:
    """Return a vehicle led over other lanes of its edges, inside junctions longer or shorter ones."""
    begin_m, before_m = (one.roads[vehicle.edge].begin_m for one in (way, vehicle.loop))
    depart_m = None if vehicle.depart_m is None else vehicle.depart_m - before_m + begin_m
    return replace(vehicle, loop=way, depart_m=depart_m, stops=on_loop(way, vehicle.stops, vehicle.id))


def _counted(way: Loop) -> Iterator[str]:
    """Yield what a vehicle adds to the load: its lanes, and where it goes from them."""
    for span in way.roads:
        yield span.lane_id
    for span, after in pairwise(way.roads):
        yield f"{span.lane_id}>{after.edge}"


def find_other_ways(network: RoadNetwork, vehicles: Sequence[LoopVehicle]) -> list[LoopVehicle]:
    """Return one of no name on each further way between the ends of vehicles that may be led another way.

    It begins on the lane on which they do.
    """
    asked = {v.id: (v.loop.edges[0], v.loop.edges[-1], v.type.vclass) for v in vehicles}
    ways = ways_between(network, list(dict.fromkeys(asked.values())))
    known = {(v.loop.edges, v.loop.spans[0].lane, v.type) for v in vehicles}
    found: list[LoopVehicle] = []
    for v in vehicles:
        lane, change_m = v.loop.spans[0].lane, least_change_m(v.type.length_m + v.type.min_gap_m)
        for edges in ways[asked[v.id]]:
            if (edges, lane, v.type) in known:
                continue
            known.add((edges, lane, v.type))
            with suppress(RouteError):  # no lanes lead there
                name, wishes = f"other way{len(found)}", LaneWishes(depart=lane)
                way = make_route(network, name, edges, vclass=v.type.vclass, change_m=change_m, wishes=wishes)
                found.append(LoopVehicle("", way, v.type))
    return found


def _index(text: str | None) -> int | None:
    return int(text) if text and text.isdecimal() else None


def _given_loops(
    scenario: Scenario,
    network: RoadNetwork,
    file: RoutesFile,
    on_loop: Mapping[str, VehicleType],
) -> list[LoopVehicle]:
    """Give loops and types to the vehicles: types as the scenario says, or those that drive on the loop."""
    chosen = allot_loops(scenario, network, file.loops)
    kinds = mixed_types(scenario, file.types, len(chosen))
    kinds = kinds or [on_loop.get(loop.id, file.default) for loop in chosen]
    return [
        LoopVehicle(f"v{i}", loop, kind) for i, (loop, kind) in enumerate(zip(chosen, kinds, strict=True), 1)
    ]


def evenly_round(network: RoadNetwork, vehicles: Sequence[LoopVehicle]) -> list[LoopVehicle]:
    """Start the vehicles of each loop evenly round it, in time at the speeds allowed."""
    numbers = Counter(vehicle.loop.id for vehicle in vehicles)
    loops = {vehicle.loop.id: vehicle.loop for vehicle in vehicles}
    starts = {name: iter(even_starts_m(network, loop, numbers[name])) for name, loop in loops.items()}
    return [replace(vehicle, depart_m=next(starts[vehicle.loop.id])) for vehicle in vehicles]


def by_departure(
    scenario: Scenario, vehicles: Sequence[LoopVehicle], file: RoutesFile | None
) -> tuple[list[LoopVehicle], list[LoopVehicle], tuple[str, ...]]:
    """Return those who are there from the beginning, those who depart later, in order, and warnings."""
    twice = next((name for name, times in Counter(v.id for v in vehicles).items() if times > 1), None)
    if twice is not None:
        msg = f"{scenario.routes or scenario.network}: two vehicles are called {twice}; rename one"
        raise ScenarioError(msg)
    begin_s = begins_s(scenario, file)
    later = sorted(
        (v for v in vehicles if v.depart_s > begin_s or not v.loop.closed), key=lambda v: v.depart_s
    )
    once = next((v for v in later if not v.loop.closed), None)
    if once is not None and scenario.abstraction != "queues":
        msg = (
            f"{scenario.routes or scenario.network}: vehicle {once.id} drives its route once: it works on "
            f"--abstraction queues, or --gate open; on segments all routes have to close"
        )
        raise ScenarioError(msg)
    if later and scenario.gated and scenario.abstraction != "queues":
        msg = (
            f"{scenario.routes or scenario.network}: {len(later)} vehicles depart later, first {later[0].id} "
            f"at {later[0].depart_s:g} s: on segments all start at once; it works on --abstraction queues"
        )
        return list(vehicles), [], (msg,)
    gone = {v.id for v in later}
    return [v for v in vehicles if v.id not in gone], later, ()


def _start(vehicle: LoopVehicle, front_m: float, lane: int | None) -> Start:
    """Return the start of a vehicle that departs later."""
    said = vehicle.attributes, vehicle.parameters
    return Start(vehicle.id, vehicle.loop, front_m, vehicle.type, lane, *said, vehicle.depart_s)


def departs_at_edge(vehicle: LoopVehicle) -> Departure:
    """Return where SUMO is to put a vehicle by itself: where its file says, or else as far back as it can."""
    least_m = vehicle.loop.roads[vehicle.edge].begin_m + vehicle.type.length_m
    front_m = least_m if vehicle.depart_m is None else vehicle.depart_m
    return Departure(_start(vehicle, front_m, None), None, vehicle.depart_s)


def _arrival(vehicle: LoopVehicle, way: Itinerary) -> dict[str, str]:
    """Return where a vehicle goes off the road: where its file wants it, but not beyond its last line."""
    last = vehicle.loop.roads[-1]
    most_m = way.legs[-1].begin_m - last.begin_m
    try:
        wish_m = float(vehicle.attributes.get("arrivalPos", ""))
    except ValueError:
        wish_m = most_m  # the end; or "random" and the like, which SUMO would draw
    wish_m += last.length_m if wish_m < 0.0 else 0.0
    return {"arrivalPos": f"{max(0.1, min(wish_m, most_m)):.2f}"}


def _roomiest(loop: Loop, way: Itinerary, first: int) -> int:
    """Return the longest place on the road of the first one: there may be one before lanes are changed."""
    end_m = loop.span_at(way.legs[first].begin_m).end_m
    own = [k for k in range(first, len(way.legs) - 1) if way.legs[k].end_m <= end_m]
    return max(own, key=lambda k: (way.legs[k].end_m - way.legs[k].begin_m, -k), default=first)


def departs_in_place(network: RoadNetwork, vehicle: LoopVehicle, way: Itinerary) -> Departure:
    """Return where a vehicle departs under a gate: as a whole within the place where its file wants it."""
    wish_m = vehicle.loop.roads[vehicle.edge].begin_m if vehicle.depart_m is None else vehicle.depart_m
    lap_m = way.length_m
    places = len(way.legs) - (0 if vehicle.loop.closed else 1)
    position = min(range(places), key=lambda k: (way.legs[k].end_m - _LEAST_M - wish_m) % lap_m)
    if not vehicle.loop.closed and vehicle.depart_m is None:
        position = _roomiest(vehicle.loop, way, position)
        wish_m = max(wish_m, way.legs[position].begin_m)
    leg = way.legs[position]
    first_m, last_m = leg.begin_m + vehicle.type.length_m + _CLEAR_M, leg.end_m - _LEAST_M
    near_m = wish_m + round((first_m - wish_m) / lap_m) * lap_m
    front_m = max(first_m, min(near_m, last_m))
    if not vehicle.loop.closed:
        vehicle = replace(vehicle, attributes={**vehicle.attributes, **_arrival(vehicle, way)})
    start = _start(vehicle, front_m, leg.line.lane)
    track = make_track(network, vehicle.loop, way, vehicle=vehicle.id, front_m=front_m, position=position)
    return Departure(start, track, vehicle.depart_s)
