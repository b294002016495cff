"""Lets vehicles depart during a run, when their place has a free slot and their lane is clear.

A vehicle departs when the gate lets it have a slot of its place, and no vehicle in the place stands or drives
behind its front. No other vehicle enters the place in that step. Where other vehicles keep driving into the
place, it is closed to them from time to time.
"""

from __future__ import annotations

from bisect import insort
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.credits import visits
from loopgate.control.driving import Driving
from loopgate.control.places import Leg, Place
from loopgate.control.start import VehicleStart
from loopgate.gates.base import Reason
from loopgate.traffic.base import Traffic

_AGAIN_S: Final = 1.0
"""A vehicle that could not depart is tried again after this time [s].

The time doubles, up to `_PATIENCE_S`, each time that SUMO does not insert it: its place is shut while it is
tried, and SUMO may refuse it for good as long as a vehicle waits close behind the place to come in."""

_AT_LEAST: Final = 0.05
"""While fewer vehicles than this share of all slots drive once, crowded paths stop no departure."""

_LONG_S: Final = 120.0
_IN_TURN: Final = 20
"""After so many departures, the vehicle that has waited longest may depart onto a crowded path, if it has
waited `_LONG_S` [s].

With 1.5 times as many trips as a grid can take, this cuts the longest wait by a third, and as many trips
arrive."""

_PATIENCE_S: Final = 20.0
"""A vehicle whose place never clears alternates: it waits this long, then keeps other vehicles out this long
[s]."""


@dataclass(frozen=True, slots=True)
class Crowding:
    """When a path is crowded: more than the share `taken` of its slots is taken, and more than `lost` lost.

    A vehicle that stands loses one slot; a vehicle at the speed limit loses none. So a dense stream that
    rolls is not crowded, nor is a queue at a red light.
    """

    taken: float
    lost: float


WITHOUT_LIGHTS: Final = Crowding(0.2, 0.09)
"""Where no vehicle waits for a light.

With three times as many trips as a grid of one-lane roads can take, most arrive within an hour with 0.2: 3 %
fewer with 0.15 or 0.25, and 18 % fewer with a share of all slots in the network. With 0.07 lost, vehicles
that follow one another every three seconds wait to depart; with 0.11, trips on the grid take 5 % longer."""

AT_LIGHTS: Final = Crowding(0.4, 0.25)
"""Where vehicles obey lights, and queues are usual.

On a grid of avenues with as many trips as SUMO's lights can take, 1165 of 1800 arrive in 25 minutes, and 660
if crowded paths stop no departure. With the shares above, 1349 arrive, but in a town 5 to 10 % fewer."""


def on_own_lanes(one: VehicleStart, _waiting: Callable[[str], int]) -> VehicleStart:
    """Return a vehicle on the lanes that it has."""
    return one


@dataclass(frozen=True, slots=True)
class Manner:
    """What decides beside places and gate when vehicles depart, and on which lanes.

    Attributes
    ----------
    crowding
        When a path is crowded.
    most
        Most vehicles on the road, ordinary ones too; 0 for any number.
    lanes
        Takes a vehicle that wants to depart, and a function that returns how many wait to depart in a place;
        returns the vehicle on the lanes on which it shall depart.
    """

    crowding: Crowding = WITHOUT_LIGHTS
    most: int = 0
    lanes: Callable[[VehicleStart, Callable[[str], int]], VehicleStart] = on_own_lanes


_USUAL: Final = Manner()


class DepartureRules:
    """Lets vehicles depart, one at a time in each place; call `look` after each step.

    A vehicle that drives once waits while its path is crowded.

    Parameters
    ----------
    due
        The vehicles, in the order in which they want to depart.
    slots
        Number of slots of all places.
    limits
        The speed limit of each place on the road, by name [m/s].
    admits
        Returns whether every vehicle can still go on for ever with one more on a path.
    manner
        What else decides.
    """

    def __init__(
        self,
        traffic: Traffic,
        driving: Driving,
        due: Sequence[VehicleStart],
        slots: int,
        limits: Mapping[str, float],
        admits: Callable[[Track], bool] = lambda _: True,
        *,
        manner: Manner = _USUAL,
    ) -> None:
        self._crowding, self._most, self._lanes = manner.crowding, manner.most, manner.lanes
        self._traffic, self._driving, self._admits = traffic, driving, admits
        self._coming, self._limits = deque(due), limits
        self._by_name = {one.vehicle: one for one in due}
        self._turn = {one.vehicle: number for number, one in enumerate(due)}
        self._outside: dict[tuple[str, bool], list[VehicleStart]] = {}
        self._tried_s: dict[str, float] = {}
        self._missed: dict[str, int] = {}
        """How often SUMO has not inserted a vehicle that was let in."""
        self._ahead: dict[str, dict[Place, float]] = {}
        """The places ahead of each vehicle that is tried, with their speed limits [m/s]."""
        self._collector: VehicleStart | None = None
        """The long vehicle for which room ahead is kept already."""
        self._collected: dict[Place, float] = {}
        """What is kept for it, by place [m]."""
        self._others = 0
        """Departures since a vehicle departed because it had waited longest."""
        loops = any(one.loop.closed for one in due) or bool(driving.ledger.vehicles)
        self._least = max(1.0, _AT_LEAST * slots * loops)
        """While fewer vehicles that drive once are on the road, crowded paths stop no departure."""

    def look(self) -> None:
        """Let the vehicles depart that want to by now, as far as places, gate and crowding allow."""
        now_s, driving = self._traffic.now_s, self._driving
        for track in driving.arrivals.missed:
            self._missed[track.vehicle] = self._missed.get(track.vehicle, 0) + 1
            self._wait(self._by_name[track.vehicle])
        while self._coming and self._coming[0].demand.depart_s <= now_s:
            one = self._lanes(self._coming.popleft(), self._waiting)
            self._by_name[one.vehicle] = one
            self._wait(one)
        first = sorted((line[0] for line in self._outside.values() if line), key=self._turn_of)
        longest = None
        if first and self._others >= _IN_TURN and now_s >= first[0].demand.depart_s + _LONG_S:
            longest = first[0]
        tried: set[str] = set()
        few = driving.once + len(driving.arrivals.coming) < self._least
        for one in first:
            if self._most and len(self._traffic.vehicles()) + len(driving.arrivals.coming) >= self._most:
                break
            goes_on = one is longest or one.loop.closed or few or one.demand.led.goes_on
            if one.place in tried:
                continue
            if not goes_on and self._is_crowded(one):
                self._give_up(one)
                continue
            tried.add(one.place)
            if self._let_in(one, now_s):
                self._others = 0 if one is longest else self._others + 1
                few = driving.once + len(driving.arrivals.coming) < self._least

    def _wait(self, one: VehicleStart) -> None:
        insort(self._outside.setdefault((one.place, one.loop.closed), []), one, key=self._turn_of)

    def _waiting(self, place: str) -> int:
        """Return how many vehicles that drive once wait to depart in a place."""
        return len(self._outside.get((place, False), ()))

    def _turn_of(self, one: VehicleStart) -> int:
        return self._turn[one.vehicle]

    def _is_crowded(self, one: VehicleStart) -> bool:
        """Return whether one more vehicle would reduce the traffic on its path."""
        limits = self._ahead.get(one.vehicle)
        if limits is None:
            ahead, known = self._driving.paths.of(one.track)[one.track.position :], self._limits
            limits = {leg.place: known[leg.place.name] for leg in ahead if leg.place.name in known}
            self._ahead[one.vehicle] = limits
        return is_crowded(limits, self._crowding)

    def _let_in(self, one: VehicleStart, now_s: float) -> bool:
        """Let a vehicle depart in the next step if there is space for it; return whether it does."""
        driving, track = self._driving, one.track
        leg: Leg = driving.paths.of(track)[track.position]
        if one is self._collector:
            self._collect(one, leg, now_s)
        if not driving.arrivals.is_clear(track, float(one.type.min_gap_m)):
            if _closes(one, now_s):
                driving.ledger.shut(leg.place)
            return False
        again_s = min(_PATIENCE_S, _AGAIN_S * 2.0 ** (self._missed.get(track.vehicle, 1) - 1))
        if now_s < self._tried_s.get(track.vehicle, now_s - again_s) + again_s:
            return False
        self._tried_s[track.vehicle] = now_s
        held = self._collected if one is self._collector else {}
        if not driving.ledger.fits(leg, one.type.needed_m, held):
            if one is not self._collector:
                self._collect(one, leg, now_s)
            return False
        if not self._admits(track):
            return False
        self._give_up(one)
        driving.ledger.shut(leg.place)
        if not driving.arrivals.let_in(track, one.insertion, one.type.needed_m):
            return False
        self._outside[one.place, one.loop.closed].remove(one)
        self._ahead.pop(one.vehicle, None)
        return True

    def _collect(self, one: VehicleStart, leg: Leg, now_s: float) -> None:
        """Keep room ahead for a long vehicle that has waited `_LONG_S`, unless another collects room.

        Places ahead with too many vehicles take in nobody meanwhile, else another vehicle comes in as soon as
        one leaves, and the long vehicle waits for ever. While they are not full, vehicles ahead may wait for
        those that want to come in, so they are closed every other `_PATIENCE_S` only.
        """
        needed_m = one.type.needed_m
        is_long = any(place.extra_m(needed_m) > 0.0 for place in visits(leg))
        if self._collector is None and is_long and now_s >= one.demand.depart_s + _LONG_S:
            self._collector = one
        if one is not self._collector:
            return
        closes = _closes(one, now_s)
        for place in self._driving.ledger.collect(leg, needed_m, self._collected):
            if closes or place.is_full():
                self._driving.ledger.shut(place)

    def _give_up(self, one: VehicleStart) -> None:
        """Keep no longer what was collected for a vehicle."""
        if one is self._collector:
            self._driving.ledger.release(self._collected)
            self._collector, self._collected = None, {}


def _closes(one: VehicleStart, now_s: float) -> bool:
    """Return whether a vehicle that waits may keep others out of places now: every other `_PATIENCE_S`."""
    return (now_s - one.demand.depart_s) % (2.0 * _PATIENCE_S) >= _PATIENCE_S


def is_crowded(limits: dict[Place, float], crowding: Crowding = WITHOUT_LIGHTS) -> bool:
    """Return whether places are crowded together: many slots are taken, and slow vehicles lose many slots.

    `limits`: the places, each with its speed limit [m/s].
    """
    slots = sum(place.slots for place in limits)
    if sum(len(place.line) for place in limits) <= crowding.taken * slots:
        return False
    lost = 0.0
    for place, limit in limits.items():
        if place.line and place.line[0].asks and place.line[0].reason == Reason.RED:
            continue
        lost += max(0.0, len(place.line) - sum(vehicle.speed for vehicle in place.line) / limit)
    return lost > crowding.lost * slots
