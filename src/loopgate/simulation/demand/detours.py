"""Loops that lead round streets on which something stands, found before the run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise

import networkx as nx

from loopgate.abstraction.track import pivot
from loopgate.errors import RefusedLoopError, RouteError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, make_loop
from loopgate.network.incidents import Incidents
from loopgate.network.stops import Stop
from loopgate.reading import counted, listed
from loopgate.simulation.demand.once import find_unfit

LONG_STOP_S = 300.0
"""A vehicle that stands on the road at a stop for longer is led round [s]."""

_U_TURN_S = 60.0
"""A turn on the spot counts as so much time [s]: another way is better, if it is not much longer."""


_SKIPPED = 3.0
"""The part of a loop that is left out counts so many times as long as the way round it."""


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
        """Return how long an edge takes at the speed that is allowed [s]."""
        lanes = self._network.edges[edge].lanes
        return lanes[0].length_m / max(lane.speed_mps for lane in lanes)

    def around(self, loop: Loop, avoided: AbstractSet[str]) -> Loop | None:
        """Return a loop that avoids some edges and keeps as much of a loop as possible.

        It leaves the loop at the last junction before them from where a way leads round. It comes back to the
        loop where the way there and the part of the loop that is left out take the least time together. Where
        there is a choice it keeps to the lanes of the loop: a vehicle that waits on one cannot change.

        Returns
        -------
        Loop or None
            None if it does not use them, no way leads round, or the way passes every edge more than once.
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
        One of no name on each of them, for each type.
    own
        By the name of each the name of the loop that it is a detour of.
    """

    vehicles: tuple[VehicleDemand, ...] = ()
    own: Mapping[str, str] = field(default_factory=dict)


def find_detours(
    network: RoadNetwork,
    vehicles: Sequence[VehicleDemand],
    incidents: Incidents,
    beside: Sequence[VehicleDemand] = (),
) -> FoundDetours:
    """Return the detours that may be needed while a road is blocked and that work as queues.

    Needed are loops round each closed edge, round all that are closed at once, round each edge of the loop
    of a vehicle that breaks down and the junction before it, with what is closed then, and round each edge on
    which a vehicle stands long at a stop on the road.

    Parameters
    ----------
    vehicles
        Those on loops, with their stops.
    beside
        All others that are laid out with them.

    Raises
    ------
    RefusedLoopError
        If a loop of the vehicles themselves does not work as queues.
    """
    return find_detours_round(network, vehicles, _avoided(network, vehicles, incidents), beside)


def _single_lap(edges: tuple[str, ...]) -> tuple[str, ...]:
    """Return one lap of edges that are several equal laps: what is left of a loop that passes edges twice."""
    count = len(edges)
    laps = (lap for lap in range(1, count) if count % lap == 0 and edges[:lap] * (count // lap) == edges)
    return edges[: next(laps, count)]


def find_detours_round(
    network: RoadNetwork,
    vehicles: Sequence[VehicleDemand],
    each: Iterable[AbstractSet[str]],
    beside: Sequence[VehicleDemand] = (),
) -> FoundDetours:
    """Return the loops round each set of edges, without loops that do not work as queues.

    Parameters
    ----------
    vehicles
        One at least on each loop, of each type.
    each
        The sets of edges to be avoided.
    beside
        All others that are laid out with them.

    Raises
    ------
    RefusedLoopError
        If a loop of the vehicles themselves does not work as queues.
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
    """Yield the sets of edges that something may stand on at the same time.

    A vehicle that breaks down may stand on the junction before an edge: then all edges into that are avoided.
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
    """Return whether vehicles are led round a stop: it is on the road, and long or of unknown end."""
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
                f"{v.id} is to stand {_span(stop)} on edge {stop.edge}: nobody is let in behind it "
                f"there until it goes on; {counted(len(through), 'other loop')} through that edge{led}"
            )
    return tuple(lines.values())
