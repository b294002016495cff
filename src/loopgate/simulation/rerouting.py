"""Reroutes trips during a run when another path has become quicker."""

from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from loopgate.abstraction.itinerary import Track, continues
from loopgate.arrays import Floats, Ints
from loopgate.control.diary import Diary
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.leading import Leading
from loopgate.simulation.ways_round import TurnOff
from loopgate.traffic.base import Traffic

_SAMPLE_EVERY_S = 10.0
_SAMPLES = 18
"""Travel times follow from mean speeds over this many samples, three minutes as in SUMO's rerouting device.
"""

_LEAST_MPS = 0.1
_MOST_TURNS = 20
"""A vehicle is rerouted at most this often, so that every vehicle arrives."""


@dataclass(frozen=True, slots=True)
class _Onward:
    """A path from a place: the path, the index of the place on it, and the numbers of the edges after it."""

    track: Track
    position: int
    edges: Ints


class Rerouting:
    """Leads a vehicle that is due to the quickest known path from its place to its destination.

    Known are the paths of all vehicles of its type, and the paths found before the run. The time of an edge
    is its length over the mean speed on it in the last three minutes.
    """

    def __init__(self, assembly: Assembly, traffic: Traffic, leading: Leading) -> None:
        self._traffic, self._leading, self._anew = traffic, leading, assembly.anew
        self._kinds = {one.vehicle: one.type.id for one in assembly.departures}
        self._onward: defaultdict[tuple[str, str], dict[int, _Onward]] = defaultdict(dict)
        """For each type and place, the paths from there, one for each sequence of places."""
        self._edges: dict[str, int] = {}
        for one in (*assembly.departures, *assembly.other_ways):
            if not one.loop.closed:
                self._take(one.type.id, one.track)
        lanes = [assembly.network.edges[edge].lanes for edge in self._edges]
        self._length_m = np.array([some[0].length_m for some in lanes])
        self._allowed_mps = np.array([max(lane.speed_mps for lane in some) for some in lanes])
        self._seen: deque[Floats] = deque(maxlen=_SAMPLES)
        self._times_s = self._length_m / self._allowed_mps
        self._next_sample_s = 0.0
        self._due_s: dict[str, float] = {}
        self._waiting = set(self._anew)
        """The vehicles that have not departed."""
        self._changes = -1
        self.turns: defaultdict[str, list[TurnOff]] = defaultdict(list)
        """The changes to other paths, by name of the vehicle."""

    def _take(self, kind: str, track: Track) -> None:
        begins = [begin_m for begin_m, _ in track.edges]
        numbers = np.array(
            [self._edges.setdefault(name, len(self._edges)) for _, name in track.edges], dtype=np.int64
        )
        states = tuple(leg.state for leg in track.legs)
        for position, leg in enumerate(track.legs[:-1]):
            known = self._onward[kind, leg.state]
            key = hash(states[position:])
            if key not in known:
                known[key] = _Onward(track, position, numbers[bisect_left(begins, leg.end_m) :])

    def look(self) -> None:
        """Sample the speeds if due, and reroute the vehicles that are due; call it after each step."""
        now = self._traffic.now_s
        if now >= self._next_sample_s:
            self._next_sample_s = now + _SAMPLE_EVERY_S
            self._sample()
        if self._changes != self._leading.changes:
            self._changes = self._leading.changes
            there = self._leading.diaries
            departed = [vehicle for vehicle in self._waiting if vehicle in there]
            self._waiting.difference_update(departed)
            self._due_s = {v: at_s for v, at_s in self._due_s.items() if v in there}
            self._due_s |= dict.fromkeys(sorted(departed), now)
        for vehicle in [vehicle for vehicle, at_s in self._due_s.items() if at_s <= now]:
            diary = self._leading.diaries.get(vehicle)
            if diary is None:
                del self._due_s[vehicle]
            elif diary.vehicle.is_settled():
                self._lead(diary)
                self._due_s[vehicle] = now + self._anew[vehicle].every_s

    def _sample(self) -> None:
        speeds = np.array([self._traffic.mean_speed(edge) for edge in self._edges])
        self._seen.append(np.where(speeds < 0.0, self._allowed_mps, speeds))
        self._times_s = self._length_m / np.maximum(np.mean(self._seen, axis=0), _LEAST_MPS)

    def _lead(self, diary: Diary) -> None:
        """Lead a vehicle to the quickest path from its place, if it is quicker than its own."""
        vehicle, leg = diary.vehicle.name, diary.vehicle.granted
        if (
            len(self.turns[vehicle]) >= _MOST_TURNS
            or diary.vehicle.stops_here()
            or leg >= len(diary.track.legs) - 1
        ):
            return
        ways = list(self._ways(diary, leg))
        times_s = [float(self._times_s[way.edges].sum()) for way in ways]
        best, said = min(range(len(ways)), key=lambda k: times_s[k], default=None), self._anew[vehicle]
        if best is None or times_s[best] * said.factor + said.least_s >= self._own(diary, leg):
            return
        way = ways[best]
        if self._leading.turn_off(vehicle, way.track, way.position):
            self.turns[vehicle].append(TurnOff(leg, way.track.loop, way.position))

    def _own(self, diary: Diary, leg: int) -> float:
        """Return the time that the rest of its own path takes [s]."""
        track = diary.track
        here = bisect_left([begin_m for begin_m, _ in track.edges], track.legs[leg].end_m)
        numbers = [self._edges[name] for _, name in track.edges[here:]]
        return float(self._times_s[numbers].sum())

    def _ways(self, diary: Diary, leg: int) -> Iterator[_Onward]:
        """Yield the other paths from a vehicle's place to its destination."""
        track = diary.track
        here, end = track.legs[leg], track.legs[-1].state
        for way in self._onward.get((self._kinds[diary.vehicle.name], here.state), {}).values():
            other = way.track
            if other.legs[-1].state != end or other.loop == track.loop or not self._leading.knows(other):
                continue
            if continues(here, other.legs[way.position]):
                yield way

    def report(self) -> dict[str, Any]:
        """Return the figures of rerouting for ``summary.json``."""
        led = [len(turns) for turns in self.turns.values() if turns]
        return {"rerouting": {"vehicles": len(self._anew), "rerouted": len(led), "times": sum(led)}}
