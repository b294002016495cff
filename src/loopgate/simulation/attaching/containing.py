"""Contains standing vehicles and closed roads in a simulation that its owner steps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from math import inf, isfinite
from typing import Any

from loopgate.abstraction.itinerary import Track, round_routes
from loopgate.control.diary import Diary
from loopgate.errors import ScenarioError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, VehicleType
from loopgate.network.incidents import Breakdown, Closure, Incidents
from loopgate.reading import meant
from loopgate.results.recorder import Recorder
from loopgate.simulation.attaching.joining_queue import JoiningQueue
from loopgate.simulation.containment import Containment
from loopgate.simulation.demand.detours import LONG_STOP_S, edges_into, find_detours_round
from loopgate.simulation.ways_round import WaysRound
from loopgate.traffic.running import RunningSumo

_EVERY_S = 1.0
"""The stops that the owner sets are checked in this interval [s]."""


class OwnersStanding:
    """The standing vehicles and closed roads of an owner's simulation."""

    brakes = False
    """The owner stops a vehicle that breaks down."""

    def __init__(self, sumo: RunningSumo, queue: JoiningQueue) -> None:
        self._traffic, self._queue = sumo.traffic, queue
        self._at_stops: dict[str, None] = {}
        self.incidents = Incidents()
        """The closures and breakdowns that the owner has named."""

    def at_long_stop(self) -> list[str]:
        """Return the vehicles that stand on the road at a stop that is long or has no known end."""
        held = [v for v in self._queue.fleet.diaries if self._stops(v) and self._traffic.at_own_stop(v)]
        stops = {vehicle: self._traffic.stays_s(vehicle) for vehicle in held}
        self._at_stops = {
            vehicle: None
            for vehicle, left_s in stops.items()
            if left_s > LONG_STOP_S or (left_s > 0.0 and vehicle in self._at_stops)
        }
        return list(self._at_stops)

    def vehicles(self) -> list[str]:
        """Return the vehicles that the owner has named, and the vehicles at long stops."""
        return [*(one.vehicle for one in self.incidents.breakdowns), *self.at_long_stop()]

    def may_take(self, vehicle: str, track: Track) -> bool:
        """Return whether a vehicle may change to a path: not while the owner has set a stop for it."""
        return not self._stops(vehicle) or track.loop == self._queue.fleet.diaries[vehicle].track.loop

    def _stops(self, vehicle: str) -> bool:
        return isfinite(self._queue.fleet.diaries[vehicle].vehicle.stop_m)


class OwnersContainment:
    """Closes the places of standing vehicles, and leads other vehicles round them.

    Parameters
    ----------
    sumo, network, recorder
        The running simulation, its roads, and the recorder of events.
    queue
        The vehicles under the gate, and the plan of their loops.
    standing
        As in `loopgate.attach`.
    """

    def __init__(
        self,
        sumo: RunningSumo,
        network: RoadNetwork,
        recorder: Recorder,
        queue: JoiningQueue,
        *,
        standing: str = "contain",
    ) -> None:
        self._sumo, self._network, self._queue = sumo, network, queue
        self._standing = OwnersStanding(sumo, queue)
        self._own: dict[str, str] = {}
        """By name of a detour, the name of the loop that it replaces."""
        self._avoided: set[AbstractSet[str]] = set()
        """The sets of edges round which ways have been searched."""
        self._unlaid: set[AbstractSet[str]] = set()
        """The sets of edges whose detours could not be used while a standing vehicle held two places."""
        self._into = edges_into(network)
        self._plan = queue.plan
        self._next_s = 0.0
        ways = WaysRound(network.edges, (), {})
        self._waits = standing == "wait"
        self._contained = Containment(
            self._standing,
            ways,
            sumo.traffic,
            queue.fleet.leads,
            recorder,
            waits=self._waits,
        )

    def block(self, names: Iterable[str]) -> None:
        """Record vehicles that stand, and closed edges and lanes.

        Raises
        ------
        ScenarioError
            If a name is neither a vehicle under the gate nor a road; then nothing is recorded.
        """
        now, known = self._sumo.traffic.now_s, self._standing.incidents
        closures, breakdowns = list(known.closures), list(known.breakdowns)
        for name in dict.fromkeys(names):
            edge = name.rpartition("_")[0]
            if name in self._queue.fleet.diaries or name in self._queue.newcomers:
                breakdowns.append(Breakdown(name, now, inf))
            elif name in self._network.edges:
                closures.append(Closure(name, "", now, inf))
            elif name in self._network.lanes and edge in self._network.edges:
                closures.append(Closure(edge, name, now, inf))
            else:
                every = (*self._queue.fleet.diaries, *self._network.edges)
                msg = f"{name}: no vehicle under the gate, edge or lane has that name{meant(name, every)}"
                raise ScenarioError(msg)
        self._standing.incidents = Incidents(
            tuple({(one.edge, one.lane): one for one in reversed(closures)}.values()),
            tuple({one.vehicle: one for one in reversed(breakdowns)}.values()),
        )

    def free(self, names: Iterable[str]) -> None:
        """Record that vehicles no longer stand, and that edges or lanes are open again.

        Raises
        ------
        ScenarioError
            If a name was not blocked; then nothing is freed.
        """
        known, over = self._standing.incidents, set(names)
        blocked = {one.lane or one.edge for one in known.closures} | {one.vehicle for one in known.breakdowns}
        for name in sorted(over - blocked):
            msg = f"{name}: it is not blocked{meant(name, blocked)}"
            raise ScenarioError(msg)
        self._standing.incidents = Incidents(
            tuple(one for one in known.closures if (one.lane or one.edge) not in over),
            tuple(one for one in known.breakdowns if one.vehicle not in over),
        )

    def look(self) -> None:
        """Close blocked places, and lead vehicles round them; call in each step before vehicles ask."""
        now = self._sumo.traffic.now_s
        self._queue.fleet.open_up()
        if now >= self._next_s:
            self._next_s = now + _EVERY_S
            self._drop_gone()
            if not self._waits:
                self._find_ways()
        if self._plan is not self._queue.plan:
            self._plan = self._queue.plan
            tracks = [replace(track, renews=True) for track in self._plan.tracks]
            self._contained.go_by(WaysRound(self._network.edges, tracks, self._own))
        self._contained.look()

    def _drop_gone(self) -> None:
        there, known = (self._queue.fleet.diaries, self._queue.newcomers), self._standing.incidents
        left = tuple(one for one in known.breakdowns if any(one.vehicle in some for some in there))
        if len(left) < len(known.breakdowns):
            self._standing.incidents = replace(known, breakdowns=left)

    def _find_ways(self) -> None:
        """Find detours round the vehicles that have come to stand since the last call, and lay them."""
        members = self._queue.fleet.diaries
        settle = all(
            members[vehicle].vehicle.is_settled()
            for vehicle in self._standing.vehicles()
            if vehicle in members
        )
        if settle:
            self._avoided -= self._unlaid
            self._unlaid.clear()
        fresh = [edges for edges in dict.fromkeys(self._stand_on()) if edges not in self._avoided]
        if not fresh:
            return
        self._avoided.update(fresh)
        users = [VehicleDemand("", loop, kind) for loop, kind in (self._queue.coming or self._plan).users]
        loops = [user for user in users if user.loop.id not in self._own]
        found = find_detours_round(
            self._network, loops, fresh, [user for user in users if user.loop.id in self._own]
        )
        known = {(self._own[user.loop.id], user.loop.edges) for user in users if user.loop.id in self._own}
        routes = self._sumo.route_names()
        laid: list[tuple[Loop, VehicleType]] = []
        own: dict[str, str] = {}
        for one in found.vehicles:
            of = found.own[one.loop.id]
            if (of, one.loop.edges) in known:
                continue
            loop = one.loop
            while f"round@{loop.id}" in routes:
                loop = replace(loop, id=f"{loop.id}~")
            laid.append((loop, one.type))
            own[loop.id] = of
        if not laid:
            return
        if not self._queue.lay(laid, all_settle=settle):
            self._unlaid.update(fresh)
            return
        self._own |= own
        for route, edges in (pair for loop, _ in laid for pair in round_routes(loop).items()):
            if route not in routes:
                self._sumo.traffic.add_route(route, edges)
                routes.add(route)

    def _stand_on(self) -> Iterator[AbstractSet[str]]:
        """Yield the edges of each closure and each standing vehicle as a set, then all edges as one set."""
        closed = {closure.edge for closure in self._standing.incidents.closures}
        each: list[AbstractSet[str]] = [frozenset((edge,)) for edge in sorted(closed)]
        for vehicle in self._standing.vehicles():
            diary = self._queue.fleet.diaries.get(vehicle)
            if diary is not None:
                each += self._around(diary)
        yield from each
        if len(each) > 1:
            yield frozenset(closed.union(*each))

    def _around(self, diary: Diary) -> Sequence[AbstractSet[str]]:
        """Return the edges of the places that a vehicle holds, and the edges into its junction."""
        held = [diary.drawn(leg).line.edge for leg in diary.vehicle.holds()]
        sets: list[AbstractSet[str]] = [frozenset((edge,)) for edge in dict.fromkeys(held)]
        crossed = {edge: self._into[self._network.edges[edge].from_junction] for edge in held[1:]}
        return [*sets, *(frozenset((edge, *into)) for edge, into in crossed.items())]

    def why(self, vehicle: str) -> str:
        """Return why a vehicle stands, if the owner has named it or set a long stop; else an empty text."""
        return self._contained.why(vehicle)

    def reason(self, vehicle: str) -> str:
        """Return why a vehicle stands, or why the place is blocked that it waits for; else an empty text."""
        return self._contained.reason(vehicle)

    def report(self) -> dict[str, Any]:
        """Return the figures for the summary."""
        return self._contained.report()
