"""Shares parallel lanes among vehicles before a run: among trips, and among loops."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from loopgate.abstraction.movements import least_apart_m, least_change_m
from loopgate.network import Loop, RoadNetwork, VehicleDemand, VehicleType
from loopgate.network.route_lanes import LaneWishes, Load, RouteChoices, Shortest, change_on
from loopgate.network.stops import lanes_of_stops, on_loop

_METRES_AN_HOUR: Final = 30_000.0
"""How far a vehicle on a loop gets in an hour among others [m]. It loads each lane once a round; a trip loads
it once."""


def share_lanes(
    network: RoadNetwork, vehicles: Sequence[VehicleDemand], keeping: Collection[str] | None = ()
) -> list[VehicleDemand]:
    """Choose lanes so that parallel lanes share the traffic: for loops, then for trips by their departures.

    Each loop and each trip gets its lanes twice; the second time, the lanes of all others are known. All
    vehicles on a loop drive on the same lanes. Trips over the same lanes share one path.

    Parameters
    ----------
    keeping
        Names of the loops that keep their lanes; None for all.
    """
    load, choices = Load(), RouteChoices(network)
    loops = _share_among_loops(network, vehicles, keeping, load, choices)
    found = {
        v.id: led_over(v, way) if (way := loops.get(v.loop.id, v.loop)) is not v.loop else v for v in vehicles
    }
    ways: dict[tuple[object, ...], Loop] = {}
    for name, way in _share_among_trips(network, vehicles, load, choices).items():
        key = way.edges, tuple((span.lane_in, span.lane) for span in way.roads)
        found[name] = led_over(found[name], ways.setdefault(key, replace(way, id=f"way{len(ways)}")))
    return list(found.values())


def _share_among_loops(
    network: RoadNetwork,
    vehicles: Sequence[VehicleDemand],
    keeping: Collection[str] | None,
    load: Load,
    choices: RouteChoices,
) -> dict[str, Loop]:
    """Return the loops over chosen lanes, by name."""
    users: defaultdict[str, list[VehicleDemand]] = defaultdict(list)
    for v in vehicles:
        if v.loop.closed:
            users[v.loop.id].append(v)
    found = {name: some[0].loop for name, some in users.items()}
    times = {
        name: len(some) * max(1, round(_METRES_AN_HOUR / found[name].length_m))
        for name, some in users.items()
    }
    used: dict[str, tuple[str, ...]] = {}
    for name in 2 * list(users):
        loop, some = found[name], users[name]
        load.take(used.get(name, ()), times[name])
        of_one_class = len({v.type.vclass for v in some}) == 1  # some lanes may be closed to others
        keeps = keeping is None or name in keeping or not of_one_class
        if not keeps and _has_choice(network, loop):
            longest = max((v.type for v in some), key=lambda kind: kind.needed_m)
            stops = [stop for v in some for stop in v.stops]
            way = choices.make(
                name,
                loop.edges,
                vclass=some[0].type.vclass,
                load=load,
                shortest=shortest_of(longest),
                wishes=LaneWishes(stop=lanes_of_stops(stops)),
                closed=True,
            )
            found[name] = replace(way, stops_on=loop.stops_on)
        used[name] = tuple(_counted(found[name]))
        load.add(used[name], times[name])
    return found


def _has_choice(network: RoadNetwork, loop: Loop) -> bool:
    return any(len(network.edges[edge].lanes) > 1 for edge in loop.edges)


def _share_among_trips(
    network: RoadNetwork, vehicles: Sequence[VehicleDemand], load: Load, choices: RouteChoices
) -> dict[str, Loop]:
    """Return the routes of trips over chosen lanes, by name of the vehicle."""
    led = {v.id: v.loop for v in vehicles if not v.loop.closed}
    used: dict[str, tuple[str, ...]] = {}
    alone: dict[tuple[tuple[str, ...], str], Loop] = {}  # where there are no lanes to choose between
    for vehicle in 2 * sorted((v for v in vehicles if v.id in led), key=lambda v: v.depart_s):
        kind, said = vehicle.type, vehicle.attributes
        edges = vehicle.loop.edges
        load.take(used.get(vehicle.id, ()))
        way = alone.get((edges, kind.vclass)) or choices.make(
            vehicle.loop.id,
            edges,
            vclass=kind.vclass,
            load=load,
            shortest=shortest_of(kind),
            wishes=LaneWishes(
                wanted_lane(vehicle), _index(said.get("arrivalLane")), lanes_of_stops(vehicle.stops)
            ),
        )
        if not _has_choice(network, vehicle.loop):
            alone[edges, kind.vclass] = way
        led[vehicle.id], used[vehicle.id] = way, tuple(_counted(way))
        load.add(used[vehicle.id])
    return led


def wanted_lane(vehicle: VehicleDemand) -> int | None:
    """Return the index of the lane on which its file wants a vehicle to depart; None for any."""
    return _index(vehicle.attributes.get("departLane"))


def led_over(vehicle: VehicleDemand, way: Loop) -> VehicleDemand:
    """Return a vehicle that drives its edges on other lanes."""
    begin_m, before_m = (one.roads[vehicle.edge].begin_m for one in (way, vehicle.loop))
    depart_m = None if vehicle.depart_m is None else vehicle.depart_m - before_m + begin_m
    return replace(vehicle, loop=way, depart_m=depart_m, stops=on_loop(way, vehicle.stops, vehicle.id))


def _counted(way: Loop) -> Iterator[str]:
    """Yield what a vehicle loads: the lanes that it leaves, its movements from them, its changes of lanes."""
    for span in way.roads:
        yield span.lane_id
        if span.lane_in != span.lane:
            yield change_on(span.edge)
    for span, after in pairwise(way.roads):
        yield f"{span.lane_id}>{after.edge}"


def shortest_of(kind: VehicleType) -> Shortest:
    """Return the shortest edges on which vehicles of a type change lanes."""
    return Shortest(least_change_m(kind.needed_m), least_apart_m(kind.needed_m))


def _index(text: str | None) -> int | None:
    return int(text) if text and text.isdecimal() else None
