"""Separates gated vehicles from vehicles that no gate can drive.

A vehicle that no gate can drive becomes ordinary traffic. A type on a loop that no gate can drive is refused.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from random import Random

from loopgate.abstraction.itinerary import Abstraction, Itinerary
from loopgate.abstraction.movements import narrow_lanes, reach_m
from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.abstraction.stopping import fit_stops, move_stops
from loopgate.errors import LoopRefusal, NobodyGatedError, RefusedLoopError, RouteError, ScenarioError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, VehicleType
from loopgate.network.route_lanes import LaneWishes, RouteChoices, make_route
from loopgate.network.stops import Stop, on_loop
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.trips import ways_between
from loopgate.network.ungated import UngatedFleet, by_kind
from loopgate.network.vehicle_demand import RoutesFile
from loopgate.reading import counted, is_file, listed, read_words, refusing, shown
from loopgate.simulation.demand.allotment import by_departure, evenly_round
from loopgate.simulation.demand.shared_lanes import shortest_of
from loopgate.simulation.drivers import type_name
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.settings import highest_limits, why_ignoring, why_unsafe
from loopgate.simulation.sumo.devices import ReroutingPolicy, led_anew, led_off

_MOST_SHOWN, _MOST_NAMED = 5, 3


def choose_gated(
    scenario: Scenario, vehicles: Sequence[VehicleDemand]
) -> tuple[list[VehicleDemand], list[VehicleDemand], tuple[str, ...]]:
    """Return the gated and the ordinary vehicles, and what to warn of; a vehicle on a loop is always gated.

    Raises
    ------
    ScenarioError
        If the scenario names neither a type of these vehicles nor a file with names of them.
    """
    who = scenario.rule_for_gated
    once = [v for v in vehicles if not v.loop.closed]
    if who == "all" or not once:
        return list(vehicles), [], ()
    names: Collection[str] = ()
    lines: tuple[str, ...] = ()
    if who != "loops":
        names = {v.id for v in once if type_name(v.type) == who}
        if not names:
            names, lines = _named(who, once)
    mine = [v for v in vehicles if v.loop.closed or v.id in names]
    gated = {v.id for v in mine}
    return mine, [v for v in once if v.id not in gated], lines


def _named(who: str, vehicles: Sequence[VehicleDemand]) -> tuple[Collection[str], tuple[str, ...]]:
    """Return the names of vehicles in a file, and a warning if some of them are of no vehicle of the run."""
    kinds = list(dict.fromkeys(type_name(v.type) for v in vehicles))
    if not is_file(who):
        msg = (
            f"gated: {shown(who)} is neither all nor loops, nor a type of the vehicles that drive once "
            f"({listed(kinds, _MOST_SHOWN)}), nor a file with their names"
        )
        raise ScenarioError(msg)
    with refusing(Path(who), "file of names", ScenarioError):
        lines = read_words(who).splitlines()
    known = {v.id for v in vehicles}
    asked = dict.fromkeys(name for line in lines if (name := line.partition("#")[0].strip()))
    unknown = [name for name in asked if name not in known]
    nobody = "no vehicle that drives once and departs during the run"
    if len(unknown) == len(asked):
        what = f"{shown(unknown[0])} is {nobody}" if unknown else "it has no names"
        msg = f"gated: {who}: {what}; expected one name in each line"
        raise ScenarioError(msg)
    if not unknown:
        return asked, ()
    # Those that depart after the end of a short run are not read, so they look like names that are wrong.
    some = f"{len(unknown)} of {counted(len(asked), 'name')}"
    return asked, (f"gated: {who}: {some} stand for {nobody}: {listed(unknown, _MOST_NAMED)}",)


_SOONER = 0.8
"""No vehicle drives an edge in less than this share of the time at the speed limit: speed factors vary."""


def going_on(
    network: RoadNetwork, vehicles: Sequence[VehicleDemand], end_s: float, seed: int
) -> list[VehicleDemand]:
    """Write out the ways that rerouters prolong or draw, as far as a vehicle may get in a run.

    `end_s`: when the run ends [s].
    """
    if not any(v.led.goes_on for v in vehicles):
        return list(vehicles)
    times_s = {
        name: _SOONER * edge.length_m / max(0.1, *(lane.speed_mps for lane in edge.lanes))
        for name, edge in network.edges.items()
    }
    choices = RouteChoices(network)
    found = []
    for v in vehicles:
        if v.led.goes_on and v.led.course is not None:
            edges = v.led.course.drawn(Random(f"{seed} course {v.id}"), end_s - v.depart_s, times_s)
            way = choices.make(v.id, edges, vclass=v.type.vclass)
            begin_m, before_m = (one.roads[v.edge].begin_m for one in (way, v.loop))
            depart_m = None if v.depart_m is None else v.depart_m - before_m + begin_m
            v = replace(v, loop=way, depart_m=depart_m, stops=on_loop(way, v.stops, v.id))  # noqa: PLW2901
        found.append(v)
    return found


def _find_other_ways(network: RoadNetwork, vehicles: Sequence[VehicleDemand]) -> list[VehicleDemand]:
    """Return a nameless vehicle on each further path between the ends of trips that may be rerouted.

    The path begins on the lane on which the trip begins.
    """
    asked = {v.id: (v.loop.edges[0], v.loop.edges[-1], v.type.vclass) for v in vehicles}
    ways = ways_between(network, list(dict.fromkeys(asked.values())))
    known = {(v.loop.edges, v.loop.spans[0].lane, v.type) for v in vehicles}
    found: list[VehicleDemand] = []
    for v in vehicles:
        lane, shortest = v.loop.spans[0].lane, shortest_of(v.type)
        for edges in ways[asked[v.id]]:
            if (edges, lane, v.type) in known:
                continue
            known.add((edges, lane, v.type))
            with suppress(RouteError):  # no lanes lead there
                name, wishes = f"other way{len(found)}", LaneWishes(depart=lane)
                way = make_route(network, name, edges, vclass=v.type.vclass, shortest=shortest, wishes=wishes)
                found.append(VehicleDemand("", way, v.type))
    return found


def fit_in(
    network: RoadNetwork, vehicles: Sequence[VehicleDemand], led: Collection[str]
) -> tuple[dict[str, list[VehicleDemand]], list[VehicleDemand]]:
    """Return the trips that cannot be gated, by reason, and the other paths that can be used.

    Parameters
    ----------
    vehicles
        All vehicles that shall be gated.
    led
        Names of the trips that may be rerouted.
    """
    closed, once = ([v for v in vehicles if v.loop.closed is closes] for closes in (True, False))
    others = _find_other_ways(network, [v for v in once if v.id in led])
    found = find_unfit(network, closed, [*once, *others])
    no_way = {(v.loop.id, v.type) for some in found.values() for v in some}
    unfit = {why: those for why, some in found.items() if (those := [v for v in some if v.id])}
    return unfit, [v for v in others if (v.loop.id, v.type) not in no_way]


def left_out(unfit: Mapping[str, Sequence[VehicleDemand]]) -> Iterator[str]:
    """Yield a warning for each reason why vehicles cannot be gated."""
    for reason, some in unfit.items():
        count, first = len(some), some[0]
        yield (
            f"{counted(count, 'vehicle')} in ordinary traffic, first {first.id}: "
            f"its way from {first.loop.edges[0]} to {first.loop.edges[-1]} {reason}"
        )


def find_unfit(
    network: RoadNetwork, staying: Sequence[VehicleDemand], asked: Sequence[VehicleDemand]
) -> dict[str, list[VehicleDemand]]:
    """Return, by reason, the vehicles of `asked` whose paths cannot be cut into queues with all others.

    Raises
    ------
    RefusedLoopError
        If the loop of a vehicle of `staying` cannot be cut.
    """
    unfit: dict[str, list[VehicleDemand]] = {}
    alone: dict[tuple[Loop, VehicleType], LoopRefusal | None] = {(v.loop, v.type): None for v in asked}
    edges = dict.fromkeys(span.edge for loop, _ in alone for span in loop.roads)
    lanes = [lane.id for edge in edges for lane in network.edges[edge].lanes]
    near = {
        width_m: narrow_lanes(network, lanes, reach_m=reach_m((width_m,)))
        for width_m in dict.fromkeys(kind.width_m for _, kind in alone)
    }
    for loop, kind in alone:  # first, since it is quick: vehicles that are too long make the rest slow
        alone[loop, kind] = why_not(network, loop, kind, near[kind.width_m])
    for v in asked:
        if refusal := alone[v.loop, v.type]:
            unfit.setdefault(refusal.reason, []).append(v)
    fit = [v for v in asked if not alone[v.loop, v.type]]
    while fit:
        try:
            lay_out_queues(network, [(v.loop, v.type) for v in (*staying, *fit)])
        except RefusedLoopError as error:
            refused: Mapping[str, LoopRefusal] = error.refused
            if any(v.loop.id in refused for v in staying):
                raise
            for vehicle in fit:
                if vehicle.loop.id in refused:
                    unfit.setdefault(refused[vehicle.loop.id].reason, []).append(vehicle)
            fit = [v for v in fit if v.loop.id not in refused]
        else:
            break
    return unfit


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
        """Turn each named vehicle into ordinary traffic."""
        self.apart |= whys
        self.let_go({v.id: v for v in (*self.vehicles, *self.later) if v.id in whys})

    def let_go(self, those: Mapping[str, VehicleDemand]) -> None:
        """Make vehicles ordinary traffic."""
        self.ordinary += those.values()
        self.vehicles, self.later, self.everybody = (
            [v for v in some if v.id not in those] for some in (self.vehicles, self.later, self.everybody)
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
    mine, ordinary, lines = choose_gated(scenario, everybody) if scenario.gated else (list(everybody), [], ())
    vehicles, later, moved = by_departure(scenario, mine, file)
    ungated = file.ungated if file and not scenario.counts_vehicles else UngatedFleet()
    found = SortedOut(mine, ordinary, vehicles, later, moved, ungated)
    found.lines = lines
    found.apart = {one.id: one.why for one in ungated.vehicles}  # without a gate too: no figure counts them
    if scenario.gated:
        own = scenario.abstraction == "queues" and not scenario.counts_vehicles
        asked = [v for v in (*vehicles, *later) if own or not v.loop.closed]
        found.put_apart(
            of_no_safe_type(network, asked, scenario.step_s, obeys=scenario.rule_for_lights == "obey")
        )
        found.put_apart(led_off(files_beside(scenario, file), found.later))
        found.anew = led_anew(scenario, found.later)
    if scenario.rule_for_starts == "even":
        found.vehicles = evenly_round(network, found.vehicles)
    if scenario.gated and any(not v.loop.closed for v in found.later):
        unfit, found.others = fit_in(network, [*found.vehicles, *found.later], found.anew)
        found.let_go({v.id: v for some in unfit.values() for v in some})
        found.lines += tuple(left_out(unfit))
    if not found.everybody:
        nobody = (
            f"--gated {scenario.rule_for_gated} leaves none"
            if ordinary
            else "no vehicle departs during the run"
        )
        raise nobody_gated(scenario.routes or scenario.network, found, nobody)
    return found


def nobody_gated(source: str, found: SortedOut, otherwise: str = "") -> NobodyGatedError:
    """Return the error that no vehicle is gated, with each kind of reason and how many it concerns."""
    whys = [
        f"{counted(len(names), 'vehicle')}, first {names[0]}: {why}" for why, names in by_kind(found.apart)
    ]
    told = "; ".join([*found.lines, *whys]) or otherwise
    return NobodyGatedError(f"{source}: none of its vehicles is gated: {told}; or --gate open")


def files_beside(scenario: Scenario, file: RoutesFile | None) -> list[Path]:
    """Return the additional files that SUMO gets with the vehicles."""
    files = [*scenario.stop_files, *(file.stop_files if file else ())]
    for name in dict.fromkeys((scenario.network, scenario.traffic)):
        files += read_sumo_config(name).additional_files if is_sumo_config(name) else ()
    return list(dict.fromkeys(files))


def of_no_safe_type(
    network: RoadNetwork, vehicles: Sequence[VehicleDemand], step_s: float, *, obeys: bool
) -> dict[str, str]:
    """Return the vehicles whose type or parameters no gate can drive with, with the reason, by name.

    `obeys`: whether traffic lights are obeyed.
    """
    limits = highest_limits(network, [(v.loop, v.type) for v in vehicles])
    whys = {kind: why_unsafe(kind, step_s, limit, obeys=obeys) for kind, limit in limits.items()}
    found = {v.id: f"vType {v.type.id}: {whys[v.type]}" for v in vehicles if whys[v.type]}
    return found | {
        v.id: why for v in vehicles if (why := why_ignoring({**v.type.parameters, **v.parameters}))
    }


def cannot_stop(
    scenario: Scenario, vehicles: Sequence[VehicleDemand], abstraction: Abstraction
) -> dict[str, str]:
    """Return the vehicles with a stop that no gate can handle, with the reason, by name.

    Where the scenario itself puts vehicles on loops, these are not among them: they are refused.
    """
    own = scenario.abstraction == "queues" and not scenario.counts_vehicles
    ways = {way.loop.id: way for way in (*(abstraction.itineraries if own else ()), *abstraction.later)}
    found = {}
    for vehicle in (v for v in vehicles if v.stops and (own or not v.loop.closed) and v.loop.id in ways):
        try:
            fit_stops(ways[vehicle.loop.id], vehicle.type, vehicle.stops, what="")
        except ScenarioError as error:
            found[vehicle.id] = str(error).removeprefix(": ")
    return found


def moved_stops(
    groups: Sequence[Sequence[VehicleDemand]], ways: Iterable[Itinerary]
) -> tuple[list[list[VehicleDemand]], tuple[str, ...]]:
    """Return groups of vehicles with their stops moved to where they can be made, and a line about that.

    How far a stop moves differs by vehicle: by its length, and by the lanes of its way.
    """
    by_loop = {way.loop.id: way for way in ways}
    every: dict[str, dict[str, list[str]]] = {}
    found: list[list[VehicleDemand]] = []
    for group in groups:
        found.append([])
        for v in group:
            stops, by_m = v.stops, dict[str, float]()
            if v.stops and v.loop.id in by_loop:
                stops, by_m = move_stops(by_loop[v.loop.id], v.type, v.stops)
            for name, m in by_m.items():
                every.setdefault(name, {}).setdefault(f"{m:+.1f} m", []).append(v.id)
            found[-1].append(replace(v, stops=stops) if by_m else v)
    told = "; ".join(
        f"{name} " + ", ".join(f"by {m} for {listed(who, _MOST_NAMED)}" for m, who in moves.items())
        for name, moves in list(every.items())[:_MOST_SHOWN]
    )
    more = f"; and {len(every) - _MOST_SHOWN} more" if len(every) > _MOST_SHOWN else ""
    return found, (f"{counted(len(every), 'stop')} moved, onto the lane: {told}{more}",) if every else ()


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
