"""Start positions of vehicles that no abstraction places, and positions of later departures."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from random import Random

from loopgate.abstraction.itinerary import Itinerary, Track
from loopgate.control.start import VehicleStart
from loopgate.errors import ScenarioError
from loopgate.network import Loop, VehicleDemand, VehicleType
from loopgate.network.vehicle_demand import RoutesFile
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo_options import begins_s

_CLEAR_M = 0.5
"""Space between the beginning of a place and the rear of a vehicle that departs in it [m]."""

_LEAST_M = 0.5
"""Space between the front of a vehicle that departs and its stop line [m]."""

_TRY_EVERY_M = 2.5
"""Distance between positions on a loop that are tried one after the other [m]."""


def spread(vehicles: Sequence[VehicleDemand], rng: Random) -> list[float]:
    """Place vehicles on their loops so that each is on one lane and no two overlap.

    Parameters
    ----------
    vehicles
        Each with the position that it wants, if any (`depart_m`).
    rng
        Draws a position for the other vehicles. Each vehicle takes the next free position from there.

    Returns
    -------
    list of float
        Arc length of each vehicle's front [m].

    Raises
    ------
    ScenarioError
        If a loop has no free position left; the text names the vehicle's number and the loop.
    """
    taken: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    fronts: list[float] = []
    for number, vehicle in enumerate(vehicles):
        loop = vehicle.loop
        drawn = rng.uniform(0.0, loop.length_m)
        wish = drawn if vehicle.depart_m is None else vehicle.depart_m
        front = _next_free(loop, vehicle.type, wish, taken)
        if front is None:
            msg = (
                f"vehicle {number + 1} of {len(vehicles)}: no free place left on loop {loop.id}; "
                f"take fewer vehicles or more loops"
            )
            raise ScenarioError(msg)
        fronts.append(front)
    return fronts


def _next_free(
    loop: Loop, kind: VehicleType, wish: float, taken: defaultdict[str, list[tuple[float, float]]]
) -> float | None:
    needed = kind.needed_m
    for step in range(int(loop.length_m / _TRY_EVERY_M) + 1):
        arc = (wish + step * _TRY_EVERY_M) % loop.length_m
        span = loop.span_at(arc)
        front = arc - span.begin_m
        if span.internal or front < needed or front > span.length_m - 1.0:
            continue
        used = taken[span.lane_id]
        if all(front <= low or front - needed >= high for low, high in used):
            used.append((front - needed, front))
            return arc
    return None


def by_departure(
    scenario: Scenario, vehicles: Sequence[VehicleDemand], file: RoutesFile | None
) -> tuple[list[VehicleDemand], list[VehicleDemand], tuple[str, ...]]:
    """Return the vehicles there from the beginning, the later departures in order of time, and warnings."""
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


def departs_at_edge(vehicle: VehicleDemand, track: Track) -> VehicleStart:
    """Return the start of an ungated vehicle: where its file says, or as far back as possible.

    `track`: a path on its loop.
    """
    least_m = vehicle.loop.roads[vehicle.edge].begin_m + vehicle.type.length_m
    front_m = least_m if vehicle.depart_m is None else vehicle.depart_m
    track = replace(track, vehicle=vehicle.id, start_m=front_m)
    return VehicleStart(vehicle, track, depart_s=vehicle.depart_s)


def _arrival(vehicle: VehicleDemand, way: Itinerary) -> dict[str, str]:
    """Return the arrival position: where the file wants it, but not beyond the vehicle's last stop line."""
    last = vehicle.loop.roads[-1]
    most_m = way.legs[-1].begin_m - last.begin_m
    try:
        wish_m = float(vehicle.attributes.get("arrivalPos", ""))
    except ValueError:
        wish_m = most_m  # the end; or "random" and the like, which SUMO would draw
    wish_m += last.length_m if wish_m < 0.0 else 0.0
    return {"arrivalPos": f"{max(0.1, min(wish_m, most_m)):.2f}"}


def _roomiest(loop: Loop, way: Itinerary, first: int) -> int:
    """Return the longest place on the edge of place `first`, from `first` on."""
    end_m = loop.span_at(way.legs[first].begin_m).end_m
    own = [k for k in range(first, len(way.legs) - 1) if way.legs[k].end_m <= end_m]
    return max(own, key=lambda k: (way.legs[k].end_m - way.legs[k].begin_m, -k), default=first)


def departs_in_place(vehicle: VehicleDemand, way: Itinerary, track: Track) -> VehicleStart:
    """Return the start of a gated vehicle: with its full length in the place where its file wants it.

    `way`, `track`: the places on its path, and a path over them.
    """
    wish_m = vehicle.loop.roads[vehicle.edge].begin_m if vehicle.depart_m is None else vehicle.depart_m
    lap_m = way.loop.lap_m
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
    track = replace(track, vehicle=vehicle.id, start_m=front_m, position=position)
    return VehicleStart(vehicle, track, leg.line.lane, vehicle.depart_s)
