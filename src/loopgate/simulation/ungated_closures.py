"""Closes streets under SUMO's own rules, and leads vehicles on loops round them."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from loopgate.abstraction.itinerary import Track, round_routes
from loopgate.control.diary import Diary
from loopgate.control.driving import Driving
from loopgate.errors import TrafficError
from loopgate.network import Loop, RoadNetwork
from loopgate.network.incidents import Closure, Incidents
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.containment import CLOSED, Blocked
from loopgate.traffic.base import Traffic

_BEFORE_END_M = 0.5


class UngatedClosures:
    """Closes streets to all vehicles between two times; a vehicle turns at the last edge before.

    SUMO's closing rerouter would lead a vehicle to the end of its route, past the rest of its loop. So
    vehicles on loops take the detours that they take under a gate: a vehicle leaves its loop where the detour
    does, and is back on its loop behind the street. A vehicle without a detour
    on which it can make its stops stands before the street.

    Parameters
    ----------
    incidents
        The closures.
    detours
        The detours, and the path on each.
    own
        By name of a detour, the name of the loop that it replaces.
    """

    def __init__(
        self,
        incidents: Incidents,
        network: RoadNetwork,
        traffic: Traffic,
        driving: Driving,
        recorder: Recorder,
        detours: Sequence[tuple[Loop, Track]],
        own: Mapping[str, str],
    ) -> None:
        self._incidents, self._network, self._traffic = incidents, network, traffic
        self._driving, self._recorder, self._own = driving, recorder, own
        self._ways: defaultdict[str, list[Track]] = defaultdict(list)
        """By name of a loop, the path on it, if it is known, and on its detours."""
        for loop, track in detours:
            self._ways[own[loop.id]].append(track)
            for route, edges in round_routes(loop).items():
                traffic.add_route(route, edges)
        self._loops: dict[str, Track] = {}
        self._closed: dict[Closure, Blocked] = {}
        self._past: list[Blocked] = []
        self._led: Counter[str] = Counter()
        self._waiting: dict[str, str] = {}
        """The closed street before which each vehicle stands that has no detour."""

    def look(self) -> None:
        """Close and open streets, and lead vehicles that are about to come to one; call it in each step."""
        now = self._traffic.now_s
        for closure in self._incidents.closures:
            name, is_closed = closure.lane or closure.edge, closure.from_s <= now < closure.to_s
            if is_closed == (closure in self._closed):
                continue
            if not self._is_whole(closure):
                self._traffic.close_lanes([closure.lane], closed=is_closed)
            self._recorder.note(now, "", Event.BLOCK if is_closed else Event.FREE, name, CLOSED)
            if is_closed:
                self._closed[closure] = Blocked(name, CLOSED, "", now)
            else:
                over = self._closed.pop(closure)
                over.to_s = now
                self._past.append(over)
        closed = self._edges()
        if closed or self._led or self._waiting:
            for diary in self._driving.diaries:
                self._lead(diary, closed)

    def _is_whole(self, closure: Closure) -> bool:
        """Return whether the whole edge is closed; from a single lane SUMO leads vehicles to others."""
        lanes = (lane for lane in self._network.lanes if lane.rpartition("_")[0] == closure.edge)
        return not closure.lane or all(lane == closure.lane for lane in lanes)

    def _edges(self) -> frozenset[str]:
        return frozenset(closure.edge for closure in self._closed if self._is_whole(closure))

    def _lead(self, diary: Diary, closed: frozenset[str]) -> None:
        """Lead a vehicle to another path where that leaves the present one, or back to its loop."""
        track, name = diary.track, diary.vehicle.name
        if self._waits(name, closed):
            return
        if not track.rounds:
            return
        loop = self._own.get(track.loop, track.loop)
        if track.loop == loop:
            self._loops.setdefault(loop, track)
        passes = not closed.isdisjoint(edge for _, edge in track.edges)
        if not passes and track.loop == loop:
            return
        here = self._index(diary)
        if here is None:
            return
        for other in (*self._known(loop), *self._ways[loop]):
            if not self._driving.stops.may_take(name, other):
                continue
            if other.loop == track.loop or not closed.isdisjoint(edge for _, edge in other.edges):
                continue
            there = self._leaves(track, here, other, closed) if passes else self._meets(track, here, other)
            if there is not None and (passes or other.loop == loop):
                self._turn(diary, other, here, there)
                return
        self._keep_out(diary, here, closed)

    def _waits(self, vehicle: str, closed: frozenset[str]) -> bool:
        """Return whether a vehicle stands before a closed street; let it go if the street is open again."""
        if self._waiting.get(vehicle) in closed:
            return True
        if self._waiting.pop(vehicle, None) is not None:
            self._traffic.release(vehicle)
        return False

    def _known(self, loop: str) -> tuple[Track, ...]:
        return (self._loops[loop],) if loop in self._loops else ()

    def _keep_out(self, diary: Diary, here: int, closed: frozenset[str]) -> None:
        """Let a vehicle stand at the end of the edge before a closed street."""
        name, after = diary.vehicle.name, diary.track.edges[(here + 1) % len(diary.track.edges)][1]
        if after not in closed:
            return
        lane = self._traffic.lane(name)[0]
        edge, _, index = lane.rpartition("_")
        with suppress(TrafficError):  # it can no longer brake, and drives in
            end_m = self._network.lanes[lane].length_m - _BEFORE_END_M
            if self._traffic.hold(name, edge, int(index), end_m):
                self._waiting[name] = after

    def _index(self, diary: Diary) -> int | None:
        """Return the index of the edge that a vehicle is on; None inside a junction."""
        lane = self._traffic.lane(diary.vehicle.name)[0]
        at_m = diary.vehicle.front_m % diary.vehicle.lap_m
        index = max(n for n, (begin_m, _) in enumerate(diary.track.edges) if n == 0 or begin_m <= at_m)
        return index if lane.rpartition("_")[0] == diary.track.edges[index][1] else None

    @staticmethod
    def _meets(track: Track, here: int, other: Track) -> int | None:
        """Return the index of an edge of a path on another path, if both lead on to the same edge."""
        edge, after = track.edges[here][1], track.edges[(here + 1) % len(track.edges)][1]
        for index, (_, name) in enumerate(other.edges):
            if name == edge and other.edges[(index + 1) % len(other.edges)][1] == after:
                return index
        return None

    @staticmethod
    def _leaves(track: Track, here: int, other: Track, closed: frozenset[str]) -> int | None:
        """Return the index of an edge on another path that leaves the first path before a closed street."""
        edge, after = track.edges[here][1], track.edges[(here + 1) % len(track.edges)][1]
        ways = {name for _, name in other.edges}
        for step in range(1, len(track.edges)):
            name = track.edges[(here + step) % len(track.edges)][1]
            if name in closed:
                break
            if step > 1 and name in ways:
                return None  # the two paths meet again before
        for index, (_, name) in enumerate(other.edges):
            if name == edge and other.edges[(index + 1) % len(other.edges)][1] != after:
                return index
        return None

    def _turn(self, diary: Diary, track: Track, here: int, there: int) -> None:
        vehicle = diary.vehicle
        self._driving.stops.takes_back(vehicle)
        self._traffic.lead(vehicle.name, track.onward(there))
        at_m = vehicle.front_m % vehicle.lap_m
        by_m = track.edges[there][0] + at_m - diary.track.edges[here][0] - vehicle.front_m
        vehicle.lap_m, vehicle.laps_m = track.lap_m, 0.0
        vehicle.front_m += by_m
        self._driving.fronts.shift(vehicle, by_m)
        diary.turns_off(track, diary.path, by_m)
        self._driving.stops.turned_off(vehicle, track)
        self._led[vehicle.name] += 1
        edge = track.edges[there][1]
        self._recorder.note(self._traffic.now_s, vehicle.name, Event.REROUTE, edge, track.loop)

    def report(self) -> dict[str, Any]:
        """Return the figures for ``summary.json``."""
        now, every = self._traffic.now_s, [*self._past, *self._closed.values()]
        return {
            "closures": sum(one.from_s < now for one in self._incidents.closures),
            "blocked": [one.figures() for one in sorted(every, key=lambda one: (one.from_s, one.place))],
            "led_round": len(self._led),
            "turns": self._led.total(),
        }
