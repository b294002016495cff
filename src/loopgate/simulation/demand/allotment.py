"""Random loops, and which vehicles of which types stand where on the loops, if no file says it."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from math import inf
from random import Random
from typing import Unpack

from loopgate.abstraction.itinerary import Itinerary, Track
from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.abstraction.sharing import SharingBound
from loopgate.cache import Cache
from loopgate.control.start import VehicleStart
from loopgate.errors import LoopgateError, LoopRefusal, RefusedLoopError, ScenarioError
from loopgate.network import FoundLoops, Loop, RoadNetwork, VehicleDemand, VehicleType, find_loops
from loopgate.network.cover.watch import allot, even_starts_m, laps_s
from loopgate.network.generate import LoopOptions, LoopSearch
from loopgate.network.vehicle_demand import RoutesFile
from loopgate.network.vehicle_type import DEFAULT_TYPE, type_of_class
from loopgate.reading import counted
from loopgate.simulation.scenario import Scenario, parse_amounts
from loopgate.simulation.sumo_options import begins_s

_FAR_M = 100.0
"""A trip that departs this much further on than its file says is told [m]."""

MOST_VEHICLES = 100_000
"""Most vehicles that depart in one run; they take about a gigabyte of memory."""


def check_number(file: RoutesFile, begin_s: float, end_s: float) -> None:
    """Raise an error if more than `MOST_VEHICLES` vehicles of a route file would depart in a run.

    Raises
    ------
    ScenarioError
        The text names the vehicle or flow that makes most of them.
    """

    def number(vehicle: VehicleDemand) -> float:
        return vehicle.number(begin_s, end_s)

    total = sum(map(number, file.vehicles))
    if total > MOST_VEHICLES:
        first = max(file.vehicles, key=number)
        msg = (
            f"{file.file}: about {total:.0f} vehicles depart from {begin_s:g} to {end_s:g} s, "
            f"{number(first):.0f} of them of {first.id}; expected at most {MOST_VEHICLES}: lower number or "
            f"rate, shorten the run (--duration), or give ordinary vehicles by --traffic"
        )
        raise ScenarioError(msg)


def check_names(vehicles: Sequence[VehicleDemand], source: str) -> None:
    """Raise `ScenarioError` if two vehicles that depart in a run have one name; the text names it.

    Flows without end, and copies by the option ``scale``, may make names that other vehicles have.
    """
    twice = next((name for name, times in Counter(v.id for v in vehicles).items() if times > 1), None)
    if twice is not None:
        msg = f"{source}: two vehicles are called {twice}; rename one, or the flow that makes it"
        raise ScenarioError(msg)


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
    begin_s = begins_s(scenario, file)
    # Times of a timetable count from where the route begins, so such a vehicle departs there.
    timed = {
        v.id: replace(v, depart_s=max(v.depart_s, begin_s))
        for v in vehicles
        if scenario.abstraction == "queues" and any(stop.until_s is not None for stop in v.stops)
    }
    later = sorted(
        (timed.get(v.id, v) for v in vehicles if v.depart_s > begin_s or not v.loop.closed or v.id in timed),
        key=lambda v: v.depart_s,
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


def begins_further_on(starts: Iterable[VehicleStart]) -> tuple[str, ...]:
    """Return a warning about trips that depart far from where their file says, if there are some.

    As where the first road has no place: a single track, or one on which no vehicle may wait.
    """
    far = []
    for start in starts:
        said, roads = start.demand.edge, start.loop.roads
        skipped_m = roads[start.edge].begin_m - roads[said].begin_m
        if not start.loop.closed and start.edge > said and skipped_m >= _FAR_M:
            far.append((start, roads[said].edge, skipped_m))
    if not far:
        return ()
    start, asked, skipped_m = far[0]
    verb = "departs" if len(far) == 1 else "depart"
    msg = (
        f"{counted(len(far), 'vehicle')} {verb} on a later road than the file says, as the gate has no place "
        f"before it, first {start.vehicle} on {start.loop.roads[start.edge].edge} and not on {asked}: "
        f"distance and time leave out the way between, {skipped_m:.0f} m"
    )
    return (msg,)


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


def _roomiest(loop: Loop, way: Itinerary, first: int, stop_m: float) -> int:
    """Return the longest place on the edge of place `first`, from `first` on and up to the first stop."""
    end_m, legs = loop.span_at(way.legs[first].begin_m).end_m, way.legs
    behind = range(first + 1, len(legs) - 1)
    own = [first, *(k for k in behind if legs[k].end_m <= end_m and legs[k].begin_m < stop_m)]
    return max(own, key=lambda k: (legs[k].end_m - legs[k].begin_m, -k))


def departs_in_place(vehicle: VehicleDemand, way: Itinerary, track: Track) -> VehicleStart:
    """Return the start of a gated vehicle: with its full length in the place where its file wants it.

    A trip starts before its first stop; if the stop is in the same place, from rest: it may be too near to
    brake for.

    `way`, `track`: the places on its path, and a path over them.
    """
    wish_m = vehicle.loop.roads[vehicle.edge].begin_m if vehicle.depart_m is None else vehicle.depart_m
    stop_m = vehicle.stops[0].arc_m if vehicle.stops and not vehicle.loop.closed else inf
    wish_m = min(wish_m, stop_m)
    lap_m = way.loop.lap_m
    places = len(way.legs) - (0 if vehicle.loop.closed else 1)
    position = min(range(places), key=lambda k: (way.legs[k].end_m - _LEAST_M - wish_m) % lap_m)
    if not vehicle.loop.closed and vehicle.depart_m is None:
        position = _roomiest(vehicle.loop, way, position, stop_m)
        wish_m = max(wish_m, way.legs[position].begin_m)
    leg = way.legs[position]
    first_m, last_m = leg.begin_m + vehicle.type.length_m + _CLEAR_M, leg.end_m - _LEAST_M
    near_m = wish_m + round((first_m - wish_m) / lap_m) * lap_m
    front_m = max(first_m, min(near_m, last_m, stop_m))
    if not vehicle.loop.closed:
        rest = {"departSpeed": "0"} if stop_m <= leg.end_m else {}
        vehicle = replace(vehicle, attributes={**vehicle.attributes, **rest, **_arrival(vehicle, way)})
    track = replace(track, vehicle=vehicle.id, start_m=front_m, position=position)
    return VehicleStart(vehicle, track, leg.line.lane, vehicle.depart_s)


def random_loops(scenario: Scenario, network: RoadNetwork, count: int) -> FoundLoops:
    """Find `count` random loops for a scenario; with queues, only loops that can all be cut together.

    Raises
    ------
    RouteError
        If there is not a single loop; the text says why.
    """
    if not network.content:
        return _random_loops(scenario, network, count)
    wanted = (scenario.abstraction, scenario.loop_length_m, scenario.loops_seed, scenario.u_turns)
    bound = (scenario.max_shared, scenario.rho_m, scenario.types)
    # Messages name the network as it was asked for.
    key = (network.content, network.name, count, *wanted, *bound)
    return _KEPT.get(key, lambda: _random_loops(scenario, network, count))


_KEPT: Cache[FoundLoops] = Cache(8)


def _random_loops(scenario: Scenario, network: RoadNetwork, count: int) -> FoundLoops:
    if scenario.abstraction == "queues":
        return loops_for_queues(
            network,
            count,
            length_m=scenario.loop_length_m,
            seed=scenario.loops_seed,
            u_turns=scenario.u_turns,
            kinds=tuple(_kinds(scenario, {}).values()) or (DEFAULT_TYPE,),
        )
    sharing = SharingBound(network, scenario.max_shared, rho_m=scenario.rho_m)
    return find_loops(
        network,
        count,
        length_m=scenario.loop_length_m,
        seed=scenario.loops_seed,
        u_turns=scenario.u_turns,
        admits=sharing.admits if scenario.max_shared < 1.0 else None,
    )


def loops_for_queues(
    network: RoadNetwork,
    count: int,
    *,
    kinds: Sequence[VehicleType] = (DEFAULT_TYPE,),
    progress: Callable[[int], None] | None = None,
    **options: Unpack[LoopOptions],
) -> FoundLoops:
    """Find `count` loops that can be cut into queues for vehicles of some types; together, for the longest.

    Raises
    ------
    RouteError
        If there is not a single loop; the text says why.
    """
    refused: list[str] = []

    def works(loop: Loop) -> bool:
        try:
            refusal = next((no for kind in kinds if (no := why_not(network, loop, kind))), None)
        except LoopgateError as error:
            refusal = LoopRefusal(f"cannot be laid out: {error}")
        if refusal:
            refused.append(refusal.reason)
        return not refusal

    longest = max(kinds, key=lambda kind: kind.needed_m)
    wishes: LoopOptions = {**options, "admits": works}
    search = LoopSearch(network, count, **wishes)
    loops: list[Loop] = []
    for loop in islice(search, count):
        loops.append(loop)
        if progress:
            progress(len(loops))
    spare = count
    while (error := _not_together(network, loops, longest)) is not None:
        refused.append(error.refused[error.loop].reason)
        loops = [loop for loop in loops if loop.id != error.loop]
        # Each new loop can make other loops fail in turn, so the number of tries is limited.
        if spare:
            spare -= 1
            loops += islice(search, 1)
    return search.result(loops, count, dropped=_dropped(refused))


def _dropped(reasons: Sequence[str]) -> str:
    if len(reasons) > 1:
        return f"{len(reasons)} that do not work as queues, the last of which {reasons[-1]}"
    return f"1 that does not work as queues: it {reasons[0]}" if reasons else ""


def _not_together(network: RoadNetwork, loops: Sequence[Loop], kind: VehicleType) -> RefusedLoopError | None:
    """Return the error for a loop that can be cut into queues alone, but not with the other loops.

    A loop that changes lanes, or uses the other lane of a narrow street, can take places from another loop.
    """
    if not loops:
        return None
    try:
        lay_out_queues(network, [(loop, kind) for loop in loops])
    except RefusedLoopError as error:
        return error
    return None


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
    shares, kinds = parse_amounts(scenario.types), _kinds(scenario, known)
    total = sum(shares.values())
    given = dict.fromkeys(shares, 0)
    chosen = []
    for count in range(1, number + 1 if shares else 0):
        name = max(shares, key=lambda name: shares[name] / total * count - given[name])
        given[name] += 1
        chosen.append(kinds[name])
    return chosen


def _kinds(scenario: Scenario, known: Mapping[str, VehicleType]) -> dict[str, VehicleType]:
    """Return the types that a scenario names: those `known` of a route file, or SUMO's classes."""
    return {name: known.get(name) or type_of_class(name, "types") for name in parse_amounts(scenario.types)}


def evenly_round(network: RoadNetwork, vehicles: Sequence[VehicleDemand]) -> list[VehicleDemand]:
    """Start the vehicles of each loop at even intervals, in time at the speed limits."""
    numbers = Counter(vehicle.loop.id for vehicle in vehicles)
    loops = {vehicle.loop.id: vehicle.loop for vehicle in vehicles}
    starts = {name: iter(even_starts_m(network, loop, numbers[name])) for name, loop in loops.items()}
    return [replace(vehicle, depart_m=next(starts[vehicle.loop.id])) for vehicle in vehicles]
