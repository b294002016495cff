"""Lets trips choose among lanes during a run: when they depart, and in each place on their way.

Before the run each trip gets lanes by the load of the whole demand. In a burst, or where a queue grows, other
lanes are better. A trip may then drive on the lanes of any trip of its type over the same edges.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from loopgate.abstraction.itinerary import Track, continues
from loopgate.control.diary import Diary
from loopgate.control.driving import Paths
from loopgate.control.places import Leg, Place
from loopgate.control.start import VehicleStart
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.departures import limits_of
from loopgate.simulation.leading import Leading
from loopgate.simulation.ways_round import TurnOff
from loopgate.traffic.base import Traffic

_HEADWAY_S: Final = 2.0
"""What a vehicle that stands ahead costs those behind [s]: the headway of a queue that discharges."""

_CHANGE_S: Final = 4.0
"""What a change of lanes costs, as much as two vehicles that stand ahead [s]."""

_PLACES_AHEAD: Final = 6
"""Vehicles that stand farther ahead have gone by the time that it takes to get there."""

_OWN_S, _GAINS_S = 0.5, 2.0
"""A trip keeps its own lanes unless it gains more than that: at its departure, and on its way [s]."""

_AGAIN_S: Final = 5.0
"""A vehicle chooses in each place, and again after this time [s]."""


@dataclass(frozen=True, slots=True)
class _Way:
    """A path for trips, from leg `position` on."""

    track: Track
    path: Sequence[Leg]
    position: int


_Road = tuple[str, str, int]
"""A type, a place, and the number of the edges ahead of it."""


class LaneChoice:
    """Lets trips choose the lanes on which they would lose the least time.

    It is estimated from the vehicles that stand in the next places, and from the changes of lanes.

    Parameters
    ----------
    assembly, traffic
        The parts of the run, and the simulation.
    paths
        All paths.
    leading
        Leads vehicles to other paths.
    """

    def __init__(self, assembly: Assembly, traffic: Traffic, paths: Paths, leading: Leading) -> None:
        self._traffic, self._paths, self._leading = traffic, paths, leading
        self._other_lanes = assembly.other_lanes
        trips = [one for one in assembly.departures if one.vehicle in self._other_lanes]
        self._limits = limits_of(assembly.network, trips)
        self._types = {one.vehicle: one.type.id for one in trips}
        self._edges: dict[tuple[str, int], int] = {}
        self._ahead: dict[int, list[int]] = {}
        """For each leg of a path, the number of the edges ahead of it, by identity of the drawn legs."""
        self._ways = self._find_ways(trips)
        self._next_s: dict[str, tuple[int, float]] = {}
        """The leg on which each vehicle has chosen, and when it chooses again there [s]."""
        self.started: dict[str, VehicleStart] = {}
        """The starts of the vehicles that departed on other lanes, by name."""
        self.turns: defaultdict[str, list[TurnOff]] = defaultdict(list)
        """The changes to other lanes on the way, by name of the vehicle."""

    def _find_ways(self, trips: Sequence[VehicleStart]) -> dict[_Road, list[_Way]]:
        """Return the paths from each place where there are several over the same edges."""
        found: defaultdict[_Road, dict[int, _Way]] = defaultdict(dict)
        states: dict[tuple[str, int], int] = {}
        known: set[tuple[str, str]] = set()
        for one in trips:
            track = one.track
            if (one.loop.id, one.type.id) in known:
                continue
            known.add((one.loop.id, one.type.id))
            path, ahead = self._paths.of(track), self._edges_ahead(track)
            tails = _tails([leg.state for leg in track.legs], states)
            for position, leg in enumerate(track.legs[:-1]):
                road = one.type.id, str(leg.state), ahead[position]
                found[road].setdefault(tails[position], _Way(track, path, position))
        return {road: list(ways.values()) for road, ways in found.items() if len(ways) > 1}

    def _edges_ahead(self, track: Track) -> list[int]:
        key = id(track.legs)
        if key not in self._ahead:
            begins = [begin_m for begin_m, _ in track.edges]
            tails = _tails([name for _, name in track.edges], self._edges)
            self._ahead[key] = [tails[bisect_left(begins, leg.end_m) - 1] for leg in track.legs[:-1]]
        return self._ahead[key]

    def at_departure(self, one: VehicleStart, waiting: Callable[[str], int]) -> VehicleStart:
        """Return a vehicle that wants to depart on the lanes that are best for it now.

        `waiting`: returns how many wait outside to depart in a place.
        """
        others = self._other_lanes.starts(one.vehicle)
        if not others:
            return one

        def loses_s(start: VehicleStart) -> float:
            track = start.track
            queue_s = _HEADWAY_S * waiting(start.place)
            return queue_s + self._loses_s(self._paths.of(track), track.position, here=True)

        own_s, best = loses_s(one) - _OWN_S, min(others, key=loses_s)
        if loses_s(best) >= own_s:
            return one
        self.started[one.vehicle] = best
        return best

    def look(self) -> None:
        """Lead vehicles to better lanes; call it after each step."""
        now_s, next_s = self._traffic.now_s, self._next_s
        for name, diary in list(self._leading.diaries.items()):
            vehicle = diary.vehicle
            leg, again_s = next_s.get(name, (-1, 0.0))
            if leg == vehicle.granted and now_s < again_s:
                continue
            if name in self._types and vehicle.is_settled() and not (vehicle.steered or vehicle.asks):
                next_s[name] = vehicle.granted, now_s + _AGAIN_S
                self._choose(name, diary)

    def _choose(self, name: str, diary: Diary) -> None:
        track, leg = diary.track, diary.vehicle.granted
        if leg >= len(track.legs) - 1:
            return
        here = track.legs[leg]
        road = self._types[name], str(here.state), self._edges_ahead(track)[leg]
        ways = [one for one in self._ways.get(road, ()) if continues(here, one.track.legs[one.position])]
        own_s = self._loses_s(self._paths.of(track), leg, here=False)
        times_s = [self._loses_s(one.path, one.position, here=False) for one in ways]
        best = min(range(len(ways)), key=times_s.__getitem__, default=None)
        if best is None or times_s[best] + _GAINS_S > own_s:
            return
        way = ways[best]
        if self._leading.turn_off(name, way.track, way.position):
            self.turns[name].append(TurnOff(leg, way.track.loop, way.position))

    def _loses_s(self, path: Sequence[Leg], position: int, *, here: bool) -> float:
        """Return an estimate of the time that a vehicle loses on a path from a place on [s].

        `here`: whether the vehicles in that place count too.
        """
        lost_s = 0.0
        for leg in path[position : position + _PLACES_AHEAD]:
            if here:
                lost_s += _HEADWAY_S * self._standing(leg.place)
            if leg.guided:
                lost_s += _CHANGE_S
            here = True
        return lost_s

    def _standing(self, place: Place) -> float:
        """Return how many vehicles stand in a place; a slow one counts in part."""
        limit = self._limits.get(place.name)
        return sum(max(0.0, 1.0 - one.speed / limit) for one in place.line) if limit else 0.0

    def report(self) -> dict[str, Any]:
        """Return the figures of the choice for ``summary.json``."""
        on_the_way = sum(map(len, self.turns.values()))
        return {"lane_choice": {"at_departure": len(self.started), "on_the_way": on_the_way}}


def _tails(names: Sequence[str], known: dict[tuple[str, int], int]) -> list[int]:
    """Return the number of each tail of a sequence: equal tails have the same number."""
    numbers, behind = list[int](), -1
    for name in reversed(names):
        behind = known.setdefault((name, behind), len(known))
        numbers.append(behind)
    return numbers[::-1]
