"""Finds detours: loops that lead round streets on which a vehicle stands."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from loopgate.abstraction.itinerary import pivot
from loopgate.errors import RefusedLoopError, RouteError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, make_loop
from loopgate.network.incidents import Breakdown, Closure, Incidents
from loopgate.network.stops import Stop
from loopgate.reading import counted, listed
from loopgate.simulation.demand.apart import find_unfit

if TYPE_CHECKING:
    import networkx as nx

LONG_STOP_S = 300.0
"""Vehicles are led round a vehicle that stops on the road for longer than this [s]."""

_U_TURN_S = 60.0
"""A U-turn counts as this much time, so that a path without one is chosen unless it is much longer [s]."""


_MOST_NAMED = 3

_SKIPPED = 3.0
"""The time of the loop's part that a detour leaves out counts this many times."""


class Detours:
    """Finds loops that avoid some edges.

    Parameters
    ----------
    network
        The roads.
    vclass
        SUMO's class of the vehicles.
    """

    def __init__(self, network: RoadNetwork, vclass: str) -> None:
        import networkx as nx  # noqa: PLC0415  most runs do without it

        self._network, self._vclass = network, vclass
        self._graph: nx.DiGraph[str] = nx.DiGraph()
        for c in network.connections:
            if network.allows(c, vclass):
                extra_s = _U_TURN_S if c.direction == "t" else 0.0
                taken_s = self._time_s(c.to_edge) + network.over_m(c) / 10.0 + extra_s
                known = self._graph.get_edge_data(c.from_edge, c.to_edge, {"weight": math.inf})
                if taken_s < known["weight"]:
                    self._graph.add_edge(c.from_edge, c.to_edge, weight=taken_s)

    def _time_s(self, edge: str) -> float:
        """Return the time for an edge at its speed limit [s]."""
        lanes = self._network.edges[edge].lanes
        return lanes[0].length_m / max(lane.speed_mps for lane in lanes)

    def around(self, loop: Loop, avoided: AbstractSet[str]) -> Loop | None:
        """Return a loop that avoids some edges and keeps as much of a loop as possible.

        It leaves the loop at the last junction before these edges from which a path leads round. It comes
        back where the path and the left-out part of the loop together take the least time. Where there is a
        choice, it stays on the lanes of the loop: a vehicle that waits on a lane cannot change.

        Returns
        -------
        Loop or None
            None if the loop does not use these edges, no path leads round, or the detour passes every
            edge more than once.
        """
        edges = self._edges_around(loop, avoided)
        if edges is None:
            return None
        name = f"{loop.id}~{'~'.join(edge for edge in loop.edges if edge in avoided)}"
        same = set(pairwise((*loop.edges, loop.edges[0])))
        kept = {here for before, here in pairwise((edges[-1], *edges)) if (before, here) in same}
        lanes = {c.from_edge: c.from_lane for c in loop.movements if c.from_edge in kept}
        with suppress(RouteError, RefusedLoopError):
            found = make_loop(self._network, name, edges, vclass=self._vclass, leave_on=lanes)
            pivot(found)  # raises RouteError where a vehicle's route could not be renewed
            return found
        return None

    def _edges_around(self, loop: Loop, avoided: AbstractSet[str]) -> tuple[str, ...] | None:
        edges: tuple[str, ...] | None = loop.edges
        if avoided.isdisjoint(loop.edges):
            return None
        roads = self._graph.subgraph(edge for edge in self._graph if edge not in avoided)
        while edges is not None and not avoided.isdisjoint(edges):
            edges = self._around_first(roads, edges, avoided)
        return None if edges is None else _single_lap(edges)

    def _around_first(
        self, roads: nx.DiGraph[str], edges: tuple[str, ...], avoided: AbstractSet[str]
    ) -> tuple[str, ...] | None:
        """Return the edges of a loop without the first of the edges to avoid."""
        import networkx as nx  # noqa: PLC0415  as above

        count = len(edges)
        after = (k for k in range(count) if edges[k] not in avoided and edges[k - 1] in avoided)
        first = next(after, None)
        if first is None:
            return None
        round_ = edges[first:] + edges[:first]
        last = max(k for k in range(count) if round_[k] not in avoided)
        for leaves in range(last, 0, -1):
            here = round_[leaves]
            if here in avoided or here not in roads:
                continue
            times_s = nx.single_source_dijkstra_path_length(roads, here)
            skipped_s, best = 0.0, (math.inf, 0)
            for meets in range(leaves):
                edge = round_[meets]
                if edge in times_s and edge != here:
                    best = min(best, (times_s[edge] + skipped_s, meets))
                skipped_s += _SKIPPED * self._time_s(edge)
            if best[0] < math.inf:
                way: list[str] = nx.dijkstra_path(roads, here, round_[best[1]])
                return (*round_[best[1] : leaves + 1], *way[1:-1])
        return None


@dataclass(frozen=True, slots=True)
class FoundDetours:
    """The detours found for the loops of a run.

    Attributes
    ----------
    vehicles
        One nameless vehicle on each detour, for each type.
    own
        By name of a detour, the name of the loop that it replaces.
    """

    vehicles: tuple[VehicleDemand, ...] = ()
    own: Mapping[str, str] = field(default_factory=dict)


def find_detours(
    network: RoadNetwork,
    vehicles: Sequence[VehicleDemand],
    incidents: Incidents,
    beside: Sequence[VehicleDemand] = (),
) -> FoundDetours:
    """Return the detours that a run may need and that can be cut into queues.

    A detour may be needed round each closed edge; round all edges that are closed at once; round each edge of
    the loop of a vehicle that breaks down, with the junction before it and what is closed then; and round
    each edge with a long stop on the road.

    Parameters
    ----------
    vehicles
        The vehicles on loops, with their stops.
    beside
        All other vehicles whose paths are cut together with these loops.

    Raises
    ------
    RefusedLoopError
        If a loop of the vehicles themselves cannot be cut into queues.
    """
    return find_detours_round(network, vehicles, _avoided(network, vehicles, incidents), beside)


def _single_lap(edges: tuple[str, ...]) -> tuple[str, ...]:
    """Return one lap of a sequence of edges that consists of equal laps."""
    count = len(edges)
    laps = (lap for lap in range(1, count) if count % lap == 0 and edges[:lap] * (count // lap) == edges)
    return edges[: next(laps, count)]


def find_detours_round(
    network: RoadNetwork,
    vehicles: Sequence[VehicleDemand],
    each: Iterable[AbstractSet[str]],
    beside: Sequence[VehicleDemand] = (),
) -> FoundDetours:
    """Return the detours round each set of edges that can be cut into queues.

    Parameters
    ----------
    vehicles
        At least one vehicle for each loop and type.
    each
        The sets of edges to avoid.
    beside
        All other vehicles whose paths are cut together with these loops.

    Raises
    ------
    RefusedLoopError
        If a loop of the vehicles themselves cannot be cut into queues.
    """
    finders: dict[str, Detours] = {}
    taken = {v.loop.id for v in (*vehicles, *beside)}
    found: dict[tuple[str, str], VehicleDemand] = {}
    own: dict[str, str] = {}
    names: dict[tuple[str, tuple[str, ...]], str] = {}
    users = {(v.loop.id, v.type.id): v for v in vehicles}.values()
    for avoided in each:
        for v in users:
            if avoided.isdisjoint(v.loop.edges):
                continue
            if v.type.vclass not in finders:
                finders[v.type.vclass] = Detours(network, v.type.vclass)
            loop = finders[v.type.vclass].around(v.loop, avoided)
            if loop is None:
                continue
            name = names.get((v.loop.id, loop.edges), loop.id)
            while (v.loop.id, loop.edges) not in names and name in taken:
                name = f"{name}~"
            names[v.loop.id, loop.edges] = name
            taken.add(name)
            found.setdefault((name, v.type.id), VehicleDemand("", replace(loop, id=name), v.type))
            own[name] = v.loop.id
    if not found:
        return FoundDetours()
    unfit = find_unfit(network, [*vehicles, *beside], list(found.values()))
    refused = {(v.loop.id, v.type.id) for some in unfit.values() for v in some}
    fit = tuple(v for key, v in found.items() if key not in refused)
    return FoundDetours(fit, {v.loop.id: own[v.loop.id] for v in fit})


def _avoided(
    network: RoadNetwork, vehicles: Iterable[VehicleDemand], incidents: Incidents
) -> Iterator[frozenset[str]]:
    """Yield each set of edges that may be closed, or have standing vehicles, at the same time.

    A vehicle that breaks down may stand on the junction before an edge; then all edges into that junction are
    avoided too.
    """
    into = edges_into(network)
    by_name: Mapping[str, VehicleDemand] = {v.id: v for v in vehicles}
    sets: dict[frozenset[str], None] = {frozenset((one.edge,)): None for one in incidents.closures}
    changes = {time for one in incidents.closures for time in (one.from_s, one.to_s)}
    changes |= {time for one in incidents.breakdowns for time in (one.from_s, one.to_s)}
    for now in sorted(changes):
        closed = frozenset(one.edge for one in incidents.closed_at(now))
        if closed:
            sets[closed] = None
        for breakdown in incidents.broken_at(now):
            for edge in by_name[breakdown.vehicle].loop.edges:
                on_edge = frozenset((edge,))
                for stands in (on_edge, on_edge | into[network.edges[edge].from_junction]):
                    sets[stands] = None
                    sets[closed | stands] = None
    for v in by_name.values():
        for stop in v.stops:
            if stands_long(stop):
                sets[frozenset((stop.edge,))] = None
    yield from sets


def edges_into(network: RoadNetwork) -> Mapping[str, AbstractSet[str]]:
    """Return the edges that lead into each junction."""
    into: dict[str, set[str]] = {}
    for road in network.edges.values():
        into.setdefault(road.to_junction, set()).add(road.id)
    return into


def stands_long(stop: Stop) -> bool:
    """Return whether vehicles are led round a stop: on the road, and long or without a known end."""
    return not stop.parks and (stop.duration_s > LONG_STOP_S or bool(stop.triggers))


def _span(stop: Stop) -> str:
    return f"until a {stop.triggers[0]} has come" if stop.triggers else f"for {stop.duration_s:g} s"


def name_long_stops(vehicles: Sequence[VehicleDemand], found: FoundDetours) -> tuple[str, ...]:
    """Return a line about each long stop: its place, and the loops that lead through it."""
    around: dict[str, list[AbstractSet[str]]] = {}
    for detour in found.vehicles:
        around.setdefault(found.own[detour.loop.id], []).append(frozenset(detour.loop.edges))
    loops = {v.loop.id: v.loop for v in vehicles}
    lines = {}
    for v in vehicles:
        for stop in (stop for stop in v.stops if stands_long(stop)):
            through = [name for name, loop in loops.items() if stop.edge in loop.edges and name != v.loop.id]
            bare = [name for name in through if all(stop.edge in edges for edges in around.get(name, ()))]
            led = f"; no way leads round it for {listed(bare)}" if bare else ""
            lines[v.id, stop.edge] = (
                f"{v.id} is to stand {_span(stop)} on edge {stop.edge}: no vehicle enters behind it "
                f"there until it goes on; {counted(len(through), 'other loop')} through that edge{led}"
            )
    return tuple(lines.values())


def name_closed_stops(vehicles: Iterable[VehicleDemand], incidents: Incidents) -> tuple[str, ...]:
    """Return a line about each stop on a road that is closed for a time, and whose stop it is.

    No stop is left out: as in SUMO, who has to stop there waits before the road until it opens.
    """
    whose: dict[tuple[str, Closure], dict[str, None]] = {}
    for v in vehicles:
        for stop in v.stops:
            for one in incidents.closures:
                if one.lane == stop.lane or (one.edge == stop.edge and not one.lane):
                    whose.setdefault((stop.name, one), {})[v.id] = None
    return tuple(
        f"stop {name} is on {one.lane or one.edge}, closed {_times(one)}: {listed(names, _MOST_NAMED)} may "
        f"have to wait before it, since no stop is left out"
        for (name, one), names in whose.items()
    )


def name_incidents_outside(incidents: Incidents, begin_s: float, end_s: float) -> tuple[str, ...]:
    """Return a line about each closure and breakdown that is over before a run begins, or begins after it."""
    named: list[tuple[str, Closure | Breakdown]] = [
        *((f"{one.lane or one.edge} is closed", one) for one in incidents.closures),
        *((f"{one.vehicle} is broken down", one) for one in incidents.breakdowns),
    ]
    return tuple(
        f"{what} {_times(one)}, outside of the run, which is from {begin_s:g} s to {end_s:g} s"
        for what, one in named
        if one.from_s >= end_s or one.to_s <= begin_s
    )


def _times(incident: Closure | Breakdown) -> str:
    until = f"to {incident.to_s:g} s" if incident.to_s < math.inf else "on"
    return f"from {incident.from_s:g} s {until}"
