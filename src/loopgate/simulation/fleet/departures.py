"""Vehicles that depart during a run: they enter when their place and the gate have room."""

from bisect import insort
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.track import Track, make_track
from loopgate.drive.changing import ChangingEngine
from loopgate.drive.codes import NOBODY
from loopgate.errors import TrafficError
from loopgate.network import RoadNetwork
from loopgate.simulation.demand.placing import Departure
from loopgate.simulation.fleet.crowds import Crowds
from loopgate.simulation.fleet.fleet import Fleet
from loopgate.traffic.base import Traffic

_ARRIVED = "arrived"
"""Why a vehicle is under the gate no longer."""

_AGAIN_S = 1.0
"""Time after which a vehicle that the gate refused is looked at again [s]."""

_AT_LEAST = 0.05
"""Share of all slots up to which those who drive once are let in however crowded their ways are by loops."""

_LONG_S = 120.0
_IN_TURN = 20
"""Of so many who are let in one is who has waited longest, if that long [s], however crowded its way is: with
half more trips than a grid can take the worst waits a third less, and as many arrive."""

_PATIENCE_S = 20.0
"""A vehicle that has waited so long for others to drive into its place keeps them out for as long, now and
then [s]."""


@dataclass(frozen=True, slots=True)
class Arrived:
    """The facts about a vehicle that has arrived.

    Attributes
    ----------
    at_s
        When it did [s].
    distance_m, hold_s, stood_s, longest_wait_s
        How far it drove, how long it stood at gates and in all, and waited for one grant at most.
    odometer_m, top_mps
        What its odometer read a step before [m], and how fast it can drive [m/s].
    """

    at_s: float
    distance_m: float
    hold_s: float
    stood_s: float
    longest_wait_s: float
    odometer_m: float
    top_mps: float


class Departures:
    """The planned and the real departure times of vehicles.

    Parameters
    ----------
    departures
        In the order in which they want to.
    """

    def __init__(self, departures: Sequence[Departure]) -> None:
        self._coming = deque(departures)
        self.wanted_s = {one.start.vehicle: one.at_s for one in departures}
        """When vehicles wanted to depart [s]."""
        self.departed_s: dict[str, float] = {}
        """When vehicles departed [s]."""
        self.arrived: dict[str, Arrived] = {}
        """The vehicles that have driven their routes to the end."""

    @property
    def over(self) -> bool:
        """Whether every vehicle has departed."""
        return not self._coming

    def look(self) -> None:
        """Let vehicles depart that are due after a step."""

    def delay_s(self, vehicle: str, now_s: float) -> float:
        """Return the time that a vehicle waited to depart, or has waited so far [s]."""
        wanted_s = self.wanted_s.get(vehicle, now_s)
        return max(0.0, self.departed_s.get(vehicle, now_s) - wanted_s) if vehicle in self.wanted_s else 0.0

    def report(self, now_s: float) -> dict[str, Any]:
        """Return the figures of departures for ``summary.json``; empty if no vehicle departs later."""
        due = [vehicle for vehicle, at_s in self.wanted_s.items() if at_s <= now_s]
        if not self.wanted_s:
            return {}
        delays = [self.delay_s(vehicle, now_s) for vehicle in due]
        return {
            "departed": len(self.departed_s),
            "waiting_to_depart": len(due) - len(self.departed_s),
            "mean_depart_delay_s": round(sum(delays) / len(delays), 3) if delays else 0.0,
            "max_depart_delay_s": round(max(delays, default=0.0), 3),
        }


class OpenDepartures(Departures):
    """Records the departures of vehicles that SUMO inserts itself.

    Parameters
    ----------
    departures
        In the order in which they want to.
    """

    def __init__(
        self, departures: Sequence[Departure], network: RoadNetwork, traffic: Traffic, engine: ChangingEngine
    ) -> None:
        super().__init__(departures)
        self._network, self._traffic, self._engine = network, traffic, engine
        self._starts = {one.start.vehicle: one.start for one in departures}
        ways = [make_track(network, Itinerary(start.loop)) for start in self._starts.values()]
        engine.lay([*(driver.track for driver in engine.drivers), *ways], {})

    def look(self) -> None:
        """Record the vehicles that SUMO has inserted."""
        if len(self.departed_s) == len(self._starts):
            return
        tracks = []
        for vehicle in self._traffic.departed():
            start = self._starts.get(vehicle)
            if start is None or vehicle in self.departed_s:
                continue
            self.departed_s[vehicle] = self._traffic.now_s - self._traffic.step_s
            at_m = start.loop.roads[start.edge].begin_m + self._traffic.lane(vehicle)[1]
            way = Itinerary(start.loop)
            tracks.append(make_track(self._network, way, vehicle=vehicle, front_m=at_m))
        if tracks:
            self._engine.join(tracks)


class _Outside:
    """The vehicles that wait to depart, by place, in order of their departure times."""

    def __init__(self, departures: Sequence[Departure]) -> None:
        self._turn = {one.start.vehicle: turn for turn, one in enumerate(departures)}
        self._at: dict[tuple[str, bool], list[Departure]] = {}
        self.before_junctions: Counter[str] = Counter()
        """How many wait for each place up to the next junction."""

    def __bool__(self) -> bool:
        return any(self._at.values())

    def _turn_of(self, one: Departure) -> int:
        return self._turn[one.start.vehicle]

    def add(self, one: Departure) -> None:
        """Let one wait."""
        insort(self._at.setdefault((_place(one), one.start.loop.closed), []), one, key=self._turn_of)
        self.before_junctions.update(_queues_at(one))

    def remove(self, one: Departure) -> None:
        """Let the first at a place wait no longer."""
        self._at[_place(one), one.start.loop.closed].remove(one)
        for place in _queues_at(one):
            self.before_junctions[place] -= 1
            if not self.before_junctions[place]:
                del self.before_junctions[place]

    def first(self) -> list[Departure]:
        """Return the first vehicle waiting at each place, of loops and of trips."""
        return sorted((queue[0] for queue in self._at.values() if queue), key=self._turn_of)


class GatedDepartures(Departures):
    """Puts vehicles into their places, and under the gate in the same step.

    One departs when its place has a slot that the gate lets it have, and nobody stands or drives behind its
    front there; nobody else gets into the place in that step. Where others keep driving into it, it is closed
    to them for a while, now and then. A vehicle that drives once waits as long as its way is crowded, unless
    the network has lights that are obeyed.

    Parameters
    ----------
    departures
        In the order in which they want to.
    network, traffic, fleet
        The run's; the fleet has begun.
    """

    def __init__(
        self, departures: Sequence[Departure], network: RoadNetwork, traffic: Traffic, fleet: Fleet
    ) -> None:
        super().__init__(departures)
        self._traffic, self._fleet = traffic, fleet
        self._outside = _Outside(departures)
        self._entering: list[Departure] = []
        self._tried_s: dict[str, float] = {}
        self._how = {one.start.vehicle: one.start.insertion for one in departures}
        self._others = 0
        """How many were let in since it was the turn of who has waited longest."""
        self._crowds = Crowds(network)
        loops = any(one.start.loop.closed for one in departures) or bool(fleet.members)
        self._least = max(1.0, _AT_LEAST * fleet.slots * loops)
        """With fewer on the road who drive once, nobody waits for others to go."""

    @property
    def over(self) -> bool:
        """Whether all vehicles have departed and arrived."""
        return not (self._coming or self._outside or self._entering or self._fleet.members)

    def look(self) -> None:
        """Release arrived vehicles, take in inserted vehicles, and insert the next."""
        now, engine, changes = self._traffic.now_s, self._fleet.engine, self._fleet.changes
        if engine.arrived:
            for vehicle in engine.arrived:
                driver = self._fleet.members[vehicle]
                self.arrived[vehicle] = Arrived(
                    now,
                    driver.distance_m,
                    driver.total_hold_s(now),
                    driver.stood_s,
                    driver.worst_wait_s(now),
                    driver.odometer_m,
                    driver.top_mps,
                )
            self._fleet.let_go(engine.arrived, _ARRIVED)
        if self._entering:
            self._take_in()
        if self._fleet.changes != changes:
            engine.answer()
        if not (self._outside or self._coming):
            return
        while self._coming and self._coming[0].at_s <= now:
            self._outside.add(self._coming.popleft())
        places: set[str] = set()
        on_road = np.count_nonzero(engine.vehicles["pivot"] == NOBODY)
        engine.wait_outside(self._outside.before_junctions)
        first = self._outside.first()
        longest = first[0] if first and self._others >= _IN_TURN and now >= first[0].at_s + _LONG_S else None
        for one in first:
            goes_on = one is longest or one.start.loop.closed
            few = on_road + len(self._entering) < self._least
            place = _place(one)
            if place in places or not (goes_on or few or not self._is_crowded(engine, one)):
                continue
            places.add(place)
            entering = len(self._entering)
            self._try(engine, one, place)
            if len(self._entering) > entering:
                self._others = 0 if one is longest else self._others + 1

    def _is_crowded(self, engine: ChangingEngine, one: Departure) -> bool:
        """Return whether one more vehicle would reduce the traffic on the way."""
        return one.track is not None and self._crowds.hinder(one.track, engine, self._traffic.now_s)

    def _try(self, engine: ChangingEngine, one: Departure, place: str) -> None:
        """Put a vehicle in if there is room for it."""
        now, vehicle = self._traffic.now_s, one.start.vehicle
        if not self._is_clear(one, place):
            if (now - one.at_s) % (2 * _PATIENCE_S) >= _PATIENCE_S:
                engine.shut(place)
            return
        if now < self._tried_s.get(vehicle, now - _AGAIN_S) + _AGAIN_S:
            return
        self._tried_s[vehicle] = now
        if one.track is None or not self._fleet.admits(one.track):
            return
        engine.shut(place)
        how = self._how[vehicle]
        self._traffic.put_in(vehicle, how)
        if how.rolling and not self._holds(one):  # SUMO puts it in no faster than it can brake for that
            self._traffic.take_out(vehicle)
            return
        self._outside.remove(one)
        self._entering.append(one)

    def _is_clear(self, one: Departure, place: str) -> bool:
        """Return whether all in a place stand or drive before the vehicle, and it has a slot."""
        inside = self._fleet.engine.holding(place)
        begin_m = one.track.legs[one.track.start_position].begin_m if one.track else 0.0
        front_m = one.start.front_m - begin_m + one.start.type.min_gap_m
        return len(inside) < self._fleet.room[place] and all(
            driver.inside_m(place) - driver.length_m >= front_m and not driver.parks_here for driver in inside
        )

    def _take_in(self) -> None:
        """Accept the vehicles that SUMO has inserted, and take the others back."""
        present = set(self._traffic.departed())
        entering, self._entering = self._entering, []
        here = [
            one
            for one in entering
            if one.start.vehicle in present and (self._how[one.start.vehicle].rolling or self._holds(one))
        ]
        names = {one.start.vehicle for one in here}
        together = bool(here) and not self._fleet.keeper.in_place and self._fleet.take_in(self._tracks(here))
        for one in entering:
            vehicle = one.start.vehicle
            if vehicle in names and (together or self._fleet.take_in(self._tracks([one]))):
                self.departed_s[vehicle] = self._traffic.now_s - self._traffic.step_s
            else:
                self._traffic.take_out(vehicle)
                self._outside.add(one)

    def _holds(self, one: Departure) -> bool:
        """Hold a vehicle at the end of its place, where it is or is to be; return whether it is held."""
        if one.track is None:
            return False
        line = one.track.legs[one.track.start_position].line
        try:
            return self._traffic.hold(one.start.vehicle, line.edge, line.lane, line.position_m)
        except TrafficError:
            return False

    @staticmethod
    def _tracks(some: Sequence[Departure]) -> list[Track]:
        return [one.track for one in some if one.track is not None]


def _queues_at(one: Departure) -> Iterator[str]:
    """Yield the places up to the next junction from where it is to depart."""
    track = one.track
    for leg in track.legs[track.start_position :] if track else ():
        yield leg.state
        if leg.crossings:
            return


def _place(one: Departure) -> str:
    return one.track.legs[one.track.start_position].state if one.track else ""
