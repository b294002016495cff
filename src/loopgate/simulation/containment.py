"""Contains vehicles that stand: closes places behind them, and leads other vehicles round them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple, Protocol

from loopgate.abstraction.itinerary import Track
from loopgate.control.diary import Diary
from loopgate.gates.base import Reason
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.network.incidents import Incidents
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.leading import Leading
from loopgate.simulation.ways_round import TurnOff, WaysRound
from loopgate.traffic.base import Traffic

_EVERY_S = 1.0
"""Vehicles are led to other paths in this interval [s]."""

_TRAPPED_S = 60.0
"""A vehicle that has stood this long on a crossing behind a vehicle that stands for good is trapped [s]."""

_STILL_MPS = 0.1

CLOSED, BROKEN, STOPS, TRAPPED = "closed", "breakdown", "stop", "trapped"


@dataclass(slots=True)
class Blocked:
    """A blocked place: since when [s], why, because of which vehicle, and until when [s]."""

    place: str
    why: str
    vehicle: str
    from_s: float
    to_s: float | None = None
    until_s: float | None = None
    """The planned end, if it is known [s]."""

    def figures(self) -> dict[str, Any]:
        """Return these facts for ``summary.json``."""
        return {
            "place": self.place,
            "why": self.why,
            "vehicle": self.vehicle,
            "from_s": self.from_s,
            "to_s": self.to_s,
            "until_s": self.until_s,
        }


class _Why(NamedTuple):
    """Why a place is blocked, because of which vehicle, and until when, if that is known [s]."""

    why: str
    vehicle: str = ""
    until_s: float | None = None

    @property
    def reason(self) -> str:
        """The reason of refusals."""
        return str(Reason.BLOCKED if self.vehicle else Reason.CLOSED)

    def cause(self, place: str = "") -> str:
        """Return what blocks the place, and until when."""
        until = "" if self.until_s is None else f", until {self.until_s:g} s"
        return f"{self.vehicle} ({self.why}){until}" if self.vehicle else f"{place}{until}"


def _end(to_s: float) -> float | None:
    return to_s if to_s < inf else None


class Standing(Protocol):
    """Tells which streets are closed, and which vehicles have broken down or stand at long stops."""

    @property
    def incidents(self) -> Incidents:
        """The closures and breakdowns."""

    @property
    def brakes(self) -> bool:
        """Whether a vehicle that breaks down has to be told to stand."""

    def at_long_stop(self) -> list[str]:
        """Return the vehicles that stand on the road at a stop that is long or has no known end."""

    def may_take(self, vehicle: str, track: Track) -> bool:
        """Return whether a vehicle can make its own stops on a path."""


class Containment:
    """Shuts the places in which vehicles stand, and leads vehicles on loops round them.

    A place is blocked while its edge or lane is closed, and while a vehicle stands in it that has broken
    down, is at a long stop on the road, or is trapped on a crossing behind such a vehicle. A place is lost
    while its first vehicle waits for a blocked place and has no other path.

    Where no vehicle waits for a blocked place, every other vehicle can go on. Whether it can depends on the
    positions of vehicles only through circles of full places, and on their loops only through condition (S)
    of `loopgate.gates.certified.crowding`. So a vehicle is led to another loop only if this closes no circle
    of full places and (S) holds. When a place is free again, vehicles return to their own loops by the same
    rule.

    Parameters
    ----------
    standing
        Tells which vehicles stand, and which streets are closed.
    ways
        The loops, and the detours round vehicles that may stand on them.
    waits
        Whether vehicles wait behind a vehicle that stands; closed roads are shut in any case.
    gated
        Whether a gate rules. Without a gate, vehicles break down and nothing else happens.
    """

    def __init__(
        self,
        standing: Standing,
        ways: WaysRound,
        traffic: Traffic,
        leading: Leading,
        recorder: Recorder,
        *,
        waits: bool = False,
        gated: bool = True,
    ) -> None:
        self._standing, self._traffic, self._leading = standing, traffic, leading
        self._recorder = recorder
        self.broken: set[str] = set()
        """The vehicles that have broken down."""
        self._at_stops: frozenset[str] = frozenset()
        """The vehicles at long stops."""
        self._waits, self._gated = waits, gated
        self._ways = ways
        self._still_s: dict[str, float] = {}
        """Since when vehicles that are in more than one place stand [s]."""
        self._stuck: set[str] = set()
        """The junctions across which a vehicle stands."""
        self._stand: set[str] = set()
        """The vehicles that stand on the road for long."""
        self._cut_offs: set[str] = set()
        """The first vehicles of lost places."""
        self._lost: dict[str, None] = {}
        """The lost places: no path leads their first vehicle round the blocked places."""
        self._next_s = 0.0
        self._found: Mapping[str, _Why] = {}
        """The blocked places with their causes."""
        self.blocked: dict[str, Blocked] = {}
        """The places that are blocked now."""
        self.past: list[Blocked] = []
        """The places that were blocked before."""
        self.turns: defaultdict[str, list[TurnOff]] = defaultdict(list)
        """The changes to other paths, by name of the vehicle."""
        self.also: Callable[[], Mapping[str, Any]] = dict
        """Returns more figures, in place of those here."""
        self._no_way: dict[str, None] = {}
        """The loops of vehicles that found no path round what stood."""

    def go_by(self, ways: WaysRound) -> None:
        """Use other detours from now on."""
        self._ways = ways

    def look(self) -> None:
        """Stop vehicles that break down, shut blocked places, and lead vehicles round them.

        Call it in each step.
        """
        now = self._traffic.now_s
        self._break_down(now)
        if not self._gated:
            return
        if now >= self._next_s:
            self._next_s = now + _EVERY_S
            self._stuck, self._stand = set(), set()
            self._note(dict(self._find_blocked(now)), now)
            self._lead()
        self._withhold()
        for place, one in self._found.items():
            self._leading.close(place, one.reason, one.cause(place))

    def _break_down(self, now: float) -> None:
        before = frozenset(self.broken)
        self.broken.clear()
        self.broken.update(one.vehicle for one in self._standing.incidents.broken_at(now))
        for vehicle in sorted((before | self.broken) & self._leading.diaries.keys()):
            if self._standing.brakes:
                self._traffic.keep_to(vehicle, 0.0 if vehicle in self.broken else None)

    def _withhold(self) -> None:
        """Grant nothing to a vehicle that is cut off or broken down: it would stand on the next crossing."""
        found = dict.fromkeys(self._cut_offs, str(Reason.BLOCKED)) | dict.fromkeys(
            self.broken, str(Reason.STOP)
        )
        known = self._leading.diaries
        self._leading.withhold({name: why for name, why in found.items() if name in known})

    def _find_blocked(self, now: float) -> Iterator[tuple[str, _Why]]:
        """Yield the blocked places, each with the reason."""
        for closure in self._standing.incidents.closed_at(now):
            places = self._ways.on_lane[closure.lane] if closure.lane else self._ways.on_edge[closure.edge]
            for place in sorted(places):
                yield place, _Why(CLOSED, until_s=_end(closure.to_s))
        at_stops = self._standing.at_long_stop()
        self._at_stops = frozenset(at_stops)
        ends = {one.vehicle: one.to_s for one in self._standing.incidents.broken_at(now)}
        standing = [_Why(BROKEN, vehicle, _end(ends[vehicle])) for vehicle in sorted(self.broken)]
        standing += [_Why(STOPS, vehicle) for vehicle in at_stops]
        known = {one.vehicle for one in standing}
        trapped = self._trapped(now, any_stands=bool(standing))
        standing += [_Why(TRAPPED, vehicle) for vehicle in trapped if vehicle not in known]
        self._leading.stand({one.vehicle: one.cause() for one in standing})
        if self._waits:
            return
        for one in standing:
            diary = self._leading.diaries.get(one.vehicle)
            if diary is not None and one.vehicle not in self._leading.beside:
                self._stand.add(one.vehicle)
                self._stuck.update(self._ways.junction(diary.drawn(leg)) for leg in diary.vehicle.crosses())
                yield from ((diary.drawn(leg).state, one) for leg in diary.vehicle.holds())

    def _trapped(self, now: float, *, any_stands: bool) -> list[str]:
        """Return the vehicles that have stood on a crossing for a minute behind a standing vehicle."""
        still = [
            diary.vehicle.name
            for diary in self._leading.diaries.values()
            if any_stands and diary.vehicle.speed < _STILL_MPS and diary.vehicle.crosses()
        ]
        self._still_s = {vehicle: self._still_s.get(vehicle, now) for vehicle in sorted(still)}
        return [vehicle for vehicle, since_s in self._still_s.items() if now - since_s >= _TRAPPED_S]

    def _note(self, found: Mapping[str, _Why], now: float) -> None:
        for place in [place for place, one in self._found.items() if found.get(place) != one]:
            over = self.blocked.pop(place)
            over.to_s = now
            self.past.append(over)
            self._recorder.note(now, over.vehicle, Event.FREE, place, over.why)
            if place not in found:
                self._leading.close(place, "", "")
        for place, one in found.items():
            if place not in self.blocked:
                self.blocked[place] = Blocked(place, one.why, one.vehicle, now, until_s=one.until_s)
                self._recorder.note(now, one.vehicle, Event.BLOCK, place, one.why)
        self._found = found

    def _find_lost(self) -> dict[str, None]:
        """Return the places whose first vehicle waits for a blocked place and has no other path.

        Vehicles that have another path keep out of these places; a vehicle without another path may wait
        there.
        """
        lost: dict[str, None] = {}
        firsts: dict[str, Diary] = {}
        for diary in self._leading.diaries.values():
            place = diary.drawn(diary.vehicle.granted).state
            if diary.vehicle.is_settled() and place not in firsts and diary in self._leading.line(place)[:1]:
                firsts[place] = diary
        while True:
            avoided = self.blocked.keys() | lost.keys()
            self._ways.avoid(avoided, self._stuck)
            more = [
                place
                for place, diary in firsts.items()
                if place not in avoided and self._cut_off(diary, lost) and not self._has_way(diary)
            ]
            if not more:
                self._cut_offs = {firsts[place].vehicle.name for place in lost}
                return lost
            lost |= dict.fromkeys(sorted(more))

    def _cut_off(self, diary: Diary, lost: Container[str]) -> bool:
        """Return whether the first vehicle of a place cannot go on along its path."""
        place = diary.drawn(diary.vehicle.granted + 1).state
        if place in self.blocked or (place in lost and self._is_full(place)):
            return True
        if self._ways.junction(diary.drawn(diary.vehicle.granted)) not in self._stuck:
            return False
        return not self._stand.isdisjoint(self._leading.waits_behind(diary.vehicle.name))

    def _is_full(self, place: str) -> bool:
        """Return whether a place has as many vehicles in line as slots."""
        return len(self._leading.line(place)) >= self._leading.slots(place)

    def _has_way(self, diary: Diary) -> bool:
        """Return whether a vehicle can go on along another path."""
        ways = self._ways.others(diary)
        return any(
            self._ways.free_legs(track, at) > 0 and self._standing.may_take(diary.vehicle.name, track)
            for track, at in ways
        )

    def _lead(self) -> None:
        """Lead vehicles to the paths on which nothing is blocked, or the blocked place is farthest away."""
        self._cut_offs = set()
        if not self.blocked and not self.turns:
            return
        self._lost = self._find_lost()
        for vehicle in sorted(self._leading.diaries):
            diary = self._leading.diaries[vehicle]
            own = self._ways.own(diary.track)
            if own is None or not diary.vehicle.is_settled() or self.why(vehicle):
                continue
            now = self._ways.free_legs(diary.track, diary.vehicle.granted)
            if now == inf and diary.track.loop == own.loop:
                continue
            best, track, position = now, diary.track, 0
            for other, at in self._ways.others(diary):
                if not self._standing.may_take(vehicle, other):
                    continue
                free = self._ways.free_legs(other, at)
                back = free == inf and other is own and diary.track.loop != other.loop
                if free > best or (back and track.loop != other.loop):
                    best, track, position = free, other, at
            if track.loop != diary.track.loop:
                self._turn(diary, track, position)
            elif best == 0 and self._cut_off(diary, self._lost):
                self._no_way[own.loop] = None

    def _turn(self, diary: Diary, track: Track, position: int) -> None:
        """Lead a vehicle to another path from its place, if every vehicle can still go on."""
        before = diary.vehicle.granted
        if self._everyone_goes_on(diary, track) and self._leading.turn_off(
            diary.vehicle.name, track, position
        ):
            self.turns[diary.vehicle.name].append(TurnOff(before, track.loop, position))

    def _everyone_goes_on(self, diary: Diary, track: Track) -> bool:
        """Return whether condition (S) holds with a vehicle on another path."""
        every = self._leading.diaries.values()
        tracks = [other.track if other is not diary else track for other in every]
        number: dict[str, int] = {}
        loops = [
            [number.setdefault(leg.state, len(number)) for leg in one.legs] for one in tracks if one.rounds
        ]
        return find_crowd(loops, [max(SPARE, self._leading.least_slots(place)) for place in number]) is None

    def why(self, vehicle: str) -> str:
        """Return the reason if a vehicle has broken down or is at a long stop; else an empty text."""
        if vehicle in self.broken:
            return BROKEN
        return STOPS if vehicle in self._at_stops else ""

    def reason(self, vehicle: str) -> str:
        """Return why a vehicle stands, or why the place that it waits for is blocked; else an empty text."""
        diary = self._leading.diaries.get(vehicle)
        ahead = self.blocked.get(diary.drawn(diary.vehicle.granted + 1).state) if diary is not None else None
        return self.why(vehicle) or (ahead.why if ahead is not None else "")

    def report(self) -> dict[str, Any]:
        """Return the figures for ``summary.json``."""
        led = [len(turns) for turns in self.turns.values() if turns]
        every = [*self.past, *self.blocked.values()]
        begun, now = self._standing.incidents, self._traffic.now_s
        return {
            "standing": {
                "closures": sum(one.from_s < now for one in begun.closures),
                "breakdowns": sum(one.from_s < now for one in begun.breakdowns),
                "blocked": [one.figures() for one in sorted(every, key=lambda one: (one.from_s, one.place))],
                "led_round": len(led),
                "turns": sum(led),
                "no_way_round": sorted(self._no_way),
                **self.also(),
            }
        }
