"""Contains what stands still: nobody is let in behind it, and loops through it are led another way."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from loopgate.drive.changing import ChangingEngine
from loopgate.drive.driver import Driver
from loopgate.drive.track import Track, continues
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.demand.detours import stands_long
from loopgate.simulation.fleet.stops import Stops
from loopgate.simulation.rerouting import TurnOff
from loopgate.traffic.base import Traffic

_EVERY_S = 1.0
"""Vehicles are looked at so often [s], to be led another way."""

_SAME_M = 0.1

CLOSED, BROKEN, STOPS = "closed", "breakdown", "stop"


@dataclass(slots=True)
class Blocked:
    """A place that nobody enters for a time: since when, why, behind which vehicle, and until when [s]."""

    place: str
    why: str
    vehicle: str
    from_s: float
    to_s: float | None = None

    def figures(self) -> dict[str, Any]:
        """Return it for ``summary.json``."""
        return {
            "place": self.place,
            "why": self.why,
            "vehicle": self.vehicle,
            "from_s": self.from_s,
            "to_s": self.to_s,
        }


class Containment:
    """Shuts the places in which something stands, and leads vehicles on loops through them round it.

    A place is blocked while its edge or lane is closed, and while a vehicle stands in it that has broken
    down or is at a long stop on the road. Where no vehicle waits for a blocked place everyone else goes on,
    since whether everyone can go on depends on where vehicles are only by circles of full places, and on
    their loops only by (S) (see `loopgate.gates.certified.crowding`). So a vehicle is led to another loop
    only if no circle of full places closes by it and (S) holds with it. When a place is free again vehicles
    go back to their own loops by the same rule.

    Parameters
    ----------
    assembly, stops
        The vehicles, their stops, what happens to them, and the loops round.
    waits
        Whether vehicles wait behind one that stands; what is closed is shut all the same.
    gated
        Whether a gate rules: without one vehicles break down, and that is all.
    """

    def __init__(
        self,
        assembly: Assembly,
        traffic: Traffic,
        engine: ChangingEngine,
        recorder: Recorder,
        stops: Stops,
        *,
        waits: bool = False,
        gated: bool = True,
    ) -> None:
        self._incidents, self._traffic, self._engine = assembly.incidents, traffic, engine
        self._recorder = recorder
        self.broken: set[str] = set()
        """The vehicles that have broken down."""
        self._stops, self._waits, self._gated = stops, waits, gated
        self._fixed = dict.fromkeys(assembly.stops)
        """Vehicles with stops stay on their loops: their stops are places of these."""
        self._ways = self._find_ways(assembly)
        self._edges: dict[str, set[str]] = defaultdict(set)
        self._lanes: dict[str, set[str]] = defaultdict(set)
        for tracks in self._ways.values():
            for track in tracks:
                self._take(track)
        self._next_s = 0.0
        self.blocked: dict[str, Blocked] = {}
        """The places that are blocked now."""
        self.past: list[Blocked] = []
        """Those that were."""
        self.turns: defaultdict[str, list[TurnOff]] = defaultdict(list)
        """The turns that vehicles took, by name."""
        self._no_way: dict[str, None] = {}
        """Loops that no way led round what stood."""

    @staticmethod
    def _find_ways(assembly: Assembly) -> dict[str, list[Track]]:
        """Return the loop and its detours, by the name of each of these."""
        every = [*assembly.tracks, *(d.track for d in assembly.departures if d.track is not None)]
        tracks = {track.loop: [track] for track in every if track.rounds}
        for one in assembly.other_ways:
            if one.track is not None and one.track.loop in assembly.detours:
                tracks[assembly.detours[one.track.loop]].append(one.track)
        return tracks | {detour: tracks[own] for detour, own in assembly.detours.items()}

    def _take(self, track: Track) -> None:
        """Take note of the edges and lanes on which each place of a way lies."""
        begins = [begin_m for begin_m, _ in track.edges]
        for leg in track.legs:
            self._lanes[f"{leg.line.edge}_{leg.line.lane}"].add(leg.state)
            self._edges[leg.line.edge].add(leg.state)
            for (begin_m, edge), end_m in zip(track.edges, [*begins[1:], track.lap_m], strict=True):
                if min(end_m, leg.end_m) - max(begin_m, leg.begin_m) > _SAME_M:
                    self._edges[edge].add(leg.state)

    def look(self) -> None:
        """Stop what breaks down, shut what is blocked, and lead vehicles round it; call in each step."""
        now = self._traffic.now_s
        self._break_down(now)
        if not self._gated:
            return
        if now >= self._next_s:
            self._next_s = now + _EVERY_S
            self._note(dict(self._find_blocked(now)), now)
            self._lead()
        for place in self.blocked:
            self._engine.shut(place)

    def _break_down(self, now: float) -> None:
        before = frozenset(self.broken)
        self.broken.clear()
        self.broken.update(one.vehicle for one in self._incidents.broken_at(now))
        for vehicle in sorted((before | self.broken) & self._engine.driver_of.keys()):
            self._traffic.keep_to(vehicle, 0.0 if vehicle in self.broken else None)

    def _find_blocked(self, now: float) -> Iterator[tuple[str, tuple[str, str]]]:
        """Yield the places that are blocked, each with why and by which vehicle."""
        for closure in self._incidents.closed_at(now):
            places = self._lanes[closure.lane] if closure.lane else self._edges[closure.edge]
            for place in sorted(places):
                yield place, (CLOSED, "")
        if self._waits:
            return
        standing = [(vehicle, BROKEN) for vehicle in sorted(self.broken)]
        standing += [(vehicle, STOPS) for vehicle in self._fixed if self._at_long_stop(vehicle)]
        for vehicle, why in standing:
            driver = self._engine.driver_of.get(vehicle)
            if driver is not None and vehicle not in self._engine.beside:
                for leg in range(int(driver.row["tail"]), driver.granted + 1):
                    yield driver.leg(leg).state, (why, vehicle)

    def _at_long_stop(self, vehicle: str) -> bool:
        stop = self._stops.making(vehicle)
        return stop is not None and stands_long(stop)

    def _note(self, found: Mapping[str, tuple[str, str]], now: float) -> None:
        for place in [place for place in self.blocked if place not in found]:
            over = self.blocked.pop(place)
            over.to_s = now
            self.past.append(over)
            self._recorder.note(now, over.vehicle, Event.FREE, place, over.why)
        for place, (why, vehicle) in found.items():
            if place not in self.blocked:
                self.blocked[place] = Blocked(place, why, vehicle, now)
                self._recorder.note(now, vehicle, Event.BLOCK, place, why)

    def _lead(self) -> None:
        """Lead vehicles on by the ways on which nothing is blocked, or is farthest."""
        if not self.blocked and not self.turns:
            return
        for vehicle in sorted(self._engine.driver_of):
            driver = self._engine.driver_of[vehicle]
            tracks = self._ways.get(driver.track.loop, ())
            if not tracks or not driver.settled or self.why(vehicle):
                continue
            here = driver.leg(driver.granted)
            now = self._free_legs(driver.track, driver.granted)
            best, track, position = now, driver.track, 0
            for other in tracks[:1] if vehicle in self._fixed else tracks:
                for at in (n for n, leg in enumerate(other.legs) if continues(here, leg)):
                    free = self._free_legs(other, at)
                    back = free == inf and other is tracks[0] and driver.track.loop != other.loop
                    if free > best or (back and track.loop != other.loop):
                        best, track, position = free, other, at
            if track.loop != driver.track.loop:
                self._turn(driver, track, position)
            elif best == 0:
                self._no_way[tracks[0].loop] = None

    def _free_legs(self, track: Track, position: int) -> float:
        """Return how many places behind one on a way are free before the first that is blocked."""
        count = len(track.legs)
        states = (track.legs[(position + ahead) % count].state for ahead in range(1, count))
        return next((n for n, state in enumerate(states) if state in self.blocked), inf)

    def _turn(self, driver: Driver, track: Track, position: int) -> None:
        """Lead a vehicle on by another way from its place, if everyone can go on then."""
        before = driver.granted
        if self._everyone_goes_on(driver, track) and self._engine.turn_off(driver, track, position):
            self.turns[driver.id].append(TurnOff(before, track.loop, position))

    def _everyone_goes_on(self, driver: Driver, track: Track) -> bool:
        """Return whether (S) holds with a vehicle on another way."""
        keeper, engine = self._engine.keeper, self._engine
        tracks = [other.track if other is not driver else track for other in engine.drivers]
        loops = [[keeper.number(leg.state) for leg in one.legs] for one in tracks if one.rounds]
        known = [[state for state in loop if state is not None] for loop in loops]
        most = [max(SPARE, keeper.slots(state)) for state in range(1 + max(map(max, known)))]
        return find_crowd(known, most) is None

    def why(self, vehicle: str) -> str:
        """Return why a vehicle stands, if it has broken down or is at a long stop; else an empty text."""
        if vehicle in self.broken:
            return BROKEN
        return STOPS if vehicle in self._fixed and self._at_long_stop(vehicle) else ""

    def reason(self, vehicle: str) -> str:
        """Return why a vehicle stands, or why the place is blocked that it waits for; else an empty text."""
        driver = self._engine.driver_of.get(vehicle)
        ahead = self.blocked.get(driver.leg(driver.granted + 1).state) if driver is not None else None
        return self.why(vehicle) or (ahead.why if ahead is not None else "")

    def report(self) -> dict[str, Any]:
        """Return what ``summary.json`` says of it."""
        led = [len(turns) for turns in self.turns.values() if turns]
        every = [*self.past, *self.blocked.values()]
        return {
            "standing": {
                "blocked": [one.figures() for one in sorted(every, key=lambda one: (one.from_s, one.place))],
                "led_round": len(led),
                "turns": sum(led),
                "no_way_round": sorted(self._no_way),
            }
        }
