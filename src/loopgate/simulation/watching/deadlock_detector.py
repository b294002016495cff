"""Detects deadlocks on any road: vehicles that can never move again, since they wait for each other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from math import inf
from typing import Protocol

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.gates.deadlocks import circular_wait, deadlocked
from loopgate.simulation.watching.ahead import CREEPS_MPS, Ahead
from loopgate.simulation.watching.road_waits import RoadWaits
from loopgate.simulation.watching.trails import Trails

__all__ = ["Deadlock", "DeadlockDetector", "Root", "ToldRefusal"]

_STIRS_M, _SETTLES_S, _RESTLESS_S = 0.015, 20.0, 100.0
"""A standing vehicle is restless for the last time after it has moved on by the first [m]; in the second time
after it stopped it only settles [s]."""

_LONG_S, _WITH_GRANT_S = 300.0, 60.0
"""A vehicle that has stood for so long may be the root of a standstill; the second: one that a gate lets go,
with no vehicle and no light before it [s]."""

WaitFor = Mapping[str, Sequence[Sequence[str]]]
"""For each standing vehicle, sets of vehicles: of *every* set, *some* vehicle must move before it can.

A vehicle that is no key moves, or stands for a reason that passes."""


@dataclass(frozen=True, slots=True)
class Deadlock:
    """A deadlock: vehicles that wait for each other in a circle.

    Attributes
    ----------
    closed_at_s, noticed_at_s
        First time when all stood that a deadlock needs (to within the time between two checks), and time when
        it was noticed [s].
    vehicles
        The circle: each vehicle waits for the next, the last for the first.
    places
        For each vehicle the state that it waits for; without a gate the lane on which it stands.
    held_up
        Number of vehicles that can never move again: in the circle, or behind it.
    by
        ``gated`` if gated vehicles alone block each other, ``ordinary`` if ordinary vehicles alone do,
        ``both`` otherwise; empty without ordinary traffic.
    last
        The vehicle that came last onto the lanes of the circle (a gated vehicle: by the time of its grant),
        the time [s], and whether it is gated. None if not recorded.
    again
        Whether it was reported before.
    """

    closed_at_s: float
    noticed_at_s: float
    vehicles: tuple[str, ...]
    places: tuple[str, ...]
    held_up: int
    by: str = ""
    last: tuple[str, float, bool] | None = None
    again: bool = False


@dataclass(frozen=True, slots=True)
class Root:
    """A vehicle that stands for a cause of its own, in no deadlock, and others that stand until it goes on.

    Attributes
    ----------
    vehicle, lane
        The vehicle, and the lane on which it stands.
    since_s
        When it was seen to move last [s].
    why
        ``breakdown``, ``stop``, ``gate``, ``light``, ``lane change``, ``right of way`` or ``no reason
        known``.
    behind
        Number of vehicles that cannot go on before it does.
    """

    vehicle: str
    lane: str
    since_s: float
    why: str
    behind: int


ToldRefusal = Callable[[], tuple[Sequence[Sequence[str]], str]]
"""Returns the blockers of a refused vehicle as sets of names, and the place that it wants."""


class Watched(Protocol):
    """The interface of a running or played-back simulation that `DeadlockDetector` needs."""

    @property
    def now_s(self) -> float:
        """Simulated time [s]."""

    def vehicles(self) -> Sequence[str]:
        """Return the vehicles on the road, in a fixed order."""

    def odometers(self, vehicles: Sequence[str]) -> list[float]:
        """Return the odometers [m] of `vehicles`, in their order."""

    def lane(self, vehicle: str) -> tuple[str, float]:
        """Return lane id and position of the front on that lane [m]."""

    def at_own_stop(self, vehicle: str) -> bool:
        """Return whether a vehicle is at a stop of its own, which ends."""

    def awaits_lot(self, vehicle: str) -> bool:
        """Return whether a vehicle waits for a lot of the car park where it stops next."""


class DeadlockDetector:
    """Checks the vehicles at intervals, and reports each deadlock once.

    A deadlock is a set of vehicles none of which can ever move again, by whatever they wait for in the set.
    For each vehicle that has stood for at least `after_s` the detector finds the vehicles that it waits for:
    at a gate from the gate's refusal, on the road from `RoadWaits`. The deadlock is the largest set in which
    each waits only for others in the set. A vehicle that waits for something with an end (a light, a stop, a
    closure, a repair), or has a recent grant, counts as able to go on, and so do vehicles that wait for it.

    Whom a driver on the road waits for is not known for certain. With `ahead` it need not be: if all that
    stand may wait for each other, those are in the deadlock that do not move in all the time to come that is
    known. Otherwise patience, lights and creeping are reckoned with, by the rules of `RoadWaits`.

    Parameters
    ----------
    traffic
        The running simulation.
    waits
        Returns whom vehicles wait for on the road.
    after_s
        Time of standing from which a vehicle can be part of a deadlock [s].
    at_gate
        Function that returns the vehicles that a vehicle waits for at its gate (of each set, some vehicle
        must move on), and the place; None for a vehicle that no gate refuses.
    own
        The gated vehicles; None if there is no ordinary traffic.
    trails
        The lanes that vehicles came over, if recorded.
    odometers
        Function that returns the vehicles on the road and their odometers [m], if read after the last step;
        otherwise the simulation is asked.
    halted
        The vehicles that have broken down.
    """

    again = False
    """Whether deadlocks that stand are returned at each check; `Deadlock.again` says which."""

    gated: Container[str] = ()
    """The vehicles under a gate."""

    ahead: Ahead | None = None
    """Tells what comes, if that can be known."""

    def __init__(
        self,
        traffic: Watched,
        waits: RoadWaits,
        *,
        after_s: float,
        at_gate: Callable[[str], ToldRefusal | None] | None = None,
        own: Container[str] | None = None,
        trails: Trails | None = None,
        odometers: Callable[[], tuple[Sequence[str], Floats]] | None = None,
        halted: Container[str] = (),
    ) -> None:
        self._own, self._trails, self._halted = own, trails, halted
        self._traffic, self._on_road = traffic, waits
        self._odometers = odometers or self._read
        self._after_s = after_s
        self._at_gate = at_gate
        self._vehicles: Sequence[str] = ()
        self._number: dict[str, int] = {}
        self._at_m = self._since_s = self._rest_m = self._stirred_s = np.zeros(0)
        """For each vehicle, its odometer at the last check [m], and the last check at which it moved [s]; the
        same of moves however slow, once they add up."""
        self._checked_s = traffic.now_s
        self._kept_at: dict[str, float] = {}
        self._known: set[str] = set()
        self._paused: set[str] = set()
        """The standing vehicles that wait for no vehicle, but for what ends by itself."""

    def check(self) -> Deadlock | None:
        """Return a deadlock not reported before, or None; call every few seconds."""
        now = self._traffic.now_s
        vehicles, at_m = self._odometers()
        still = {vehicles[n]: self._since_s[n] for n in self._look(vehicles, at_m, now).tolist()}
        self._paused.clear()
        standing = sorted(v for v in still if self._waits_long(v, now) and now - still[v] >= self._after_s)
        self._known.intersection_update(standing if self.ahead is None else still.keys() - self._paused)
        if not standing or (self._known.issuperset(standing) and not self.again):
            return None
        places: dict[str, str] = {}
        self._on_road.look(standing, self._restless(now))
        self._on_road.suppose(None)
        waits = self._foreseen(self.ahead, still, standing, places) if self.ahead is not None else None
        if waits is None:
            maybe = deadlocked({v: self._waits(v, places, now - still[v]) for v in standing})
            self._on_road.suppose(maybe)
            waits = {v: self._waits(v, places, now - still[v]) for v in sorted(maybe)}
        stuck = deadlocked(waits)
        new = deadlocked({v: waits[v] for v in stuck - self._known})
        self._known |= stuck
        told = not new  # no new deadlock: the others could go on if the known deadlocks were gone
        new = new or (stuck if self.again else new)
        if not new:
            return None
        let_go_s = {vehicle: at_s for vehicle, at_s in self._kept_at.items() if at_s < now}
        stopped_s = {v: float(max(still[v], let_go_s.get(v, still[v]))) for v in new}
        # Whoever stood for good before several ways has wanted one of them: from then on it was in.
        known = {v: [*self._on_road.by_each_way(v), *waits[v]] for v in new}
        closed_s, core = _first_closed(known, stopped_s)
        circle = circular_wait(known, core)
        wanted = tuple(places[v] for v in circle)
        lanes = {self._traffic.lane(vehicle)[0] for vehicle in circle}
        came = None
        if self._trails is not None and self._own is not None:
            vehicle, at_s = self._trails.last(stuck, lanes)
            came = vehicle, at_s, vehicle in self._own
        return Deadlock(closed_s, now, tuple(circle), wanted, len(stuck), self._by(waits, new), came, told)

    def _foreseen(
        self, ahead: Ahead, still: Collection[str], standing: Sequence[str], places: dict[str, str]
    ) -> dict[str, list[list[str]]] | None:
        """Return whom those wait for that do not move any more; None if too little of the future is known.

        Whoever moves again was not the one to wait for: the others have stood on.
        """
        now, here = self._traffic.now_s, {*standing, *self._paused}
        maybe = {v: self._waits(v, places, inf) for v in standing}
        if not deadlocked(_among(maybe, here)) - self._known:
            return {}
        if not ahead.knows(now):
            ahead.look(ends=bool(self._paused))
        if not ahead.knows(now):
            return None
        stay = {v for v in here if ahead.future.stays(v, now)}
        waits = {v: sets for v, sets in _among(maybe, stay).items() if v in stay}
        stuck = deadlocked(waits)
        if not deadlocked({v: waits[v] for v in stuck - self._known}):
            return waits
        rest = [v for v in still if ahead.future.stays(v, now)]
        every = {v: maybe.get(v) or self._waits(v, places, inf) for v in rest if v not in self._paused}
        core = stuck - self._known
        lasting = {*ahead.left_alone(rest, core), *self._known} & every.keys()
        return _among({v: every[v] for v in sorted(lasting)}, lasting | self._paused)

    def _read(self) -> tuple[Sequence[str], Floats]:
        vehicles = self._traffic.vehicles()
        return vehicles, np.array(self._traffic.odometers(vehicles))

    def _look(self, vehicles: Sequence[str], at_m: Floats, now: float) -> Ints:
        """Store which vehicles have moved; return the numbers of the others."""
        if vehicles != self._vehicles:
            before = np.array([self._number.get(vehicle, -1) for vehicle in vehicles], dtype=np.int64)
            columns = self._at_m, self._since_s, self._rest_m, self._stirred_s
            self._at_m, self._since_s, self._rest_m, self._stirred_s = (
                np.append(column, -np.inf)[before] for column in columns
            )
            self._vehicles, self._number = vehicles, {vehicle: n for n, vehicle in enumerate(vehicles)}
        moved = at_m - self._at_m > CREEPS_MPS * (now - self._checked_s)
        self._checked_s, self._at_m = now, np.array(at_m)
        self._since_s[moved] = now
        stirred = moved | (at_m - self._rest_m > _STIRS_M)
        self._rest_m[stirred], self._stirred_s[stirred] = at_m[stirred], now
        return np.flatnonzero(~moved)

    def _restless(self, now: float) -> set[str]:
        """Return the standing vehicles that creep: fractions of a millimetre a second add up."""
        settled_s = self._since_s + _SETTLES_S
        creep = (self._stirred_s > settled_s) & (now - self._stirred_s < _RESTLESS_S)
        return {self._vehicles[number] for number in np.flatnonzero(creep).tolist()}

    def _by(self, waits: WaitFor, stuck: AbstractSet[str]) -> str:
        """Return the kind of vehicles that cause a deadlock: without them no vehicle would be stuck."""
        own = self._own
        if own is None:
            return ""
        if deadlocked({v: waits[v] for v in stuck if v in own}):
            return "gated"
        return "ordinary" if deadlocked({v: waits[v] for v in stuck if v not in own}) else "both"

    def _waits_long(self, vehicle: str, now: float) -> bool:
        """Return whether a standing vehicle is refused, or has had time to move since something kept it.

        That is a refusal, a stop of its own, or a breakdown.
        """
        if vehicle in self._halted or self._stops(vehicle):
            self._kept_at[vehicle] = now
            self._paused.add(vehicle)
            return False  # it waits for no vehicle
        if self._at_gate is not None and self._at_gate(vehicle) is not None:
            self._kept_at[vehicle] = now
            return True
        return now - self._kept_at.get(vehicle, -self._after_s) >= self._after_s

    @property
    def held_up(self) -> frozenset[str]:
        """The vehicles known to be stuck: in a deadlock, or behind one."""
        return frozenset(self._known)

    def standing_s(self, vehicle: str) -> float:
        """Return the time for which a vehicle had stood at the last check [s]."""
        number = self._number.get(vehicle)
        return 0.0 if number is None else self._traffic.now_s - float(self._since_s[number])

    def roots(self) -> list[Root]:
        """Return the vehicles that stand for a cause of their own, with others behind them; most come first.

        What it says is of the last check. O(members of all sets * roots).
        """
        now, here = self._traffic.now_s, set(self._traffic.vehicles())
        stood_s = {
            vehicle: now - since
            for vehicle, since in zip(self._vehicles, self._since_s.tolist(), strict=True)
            if vehicle in here and now - since >= self._after_s
        }
        least_s = {v: _WITH_GRANT_S if v in self.gated else _LONG_S for v in stood_s.keys() - self._known}
        if not any(stood_s[vehicle] >= least for vehicle, least in least_s.items()):
            return []
        self._on_road.look(stood_s, self._restless(now))
        waits: dict[str, list[list[str]]] = {vehicle: [[]] for vehicle in self._known & here}
        paused = {v: self._pause(v) for v in sorted(stood_s.keys() - waits.keys())}
        waits |= {v: [] if why else self._waits(v, {}, stood_s[v]) for v, why in paused.items()}
        stuck = deadlocked(waits)
        long = {v: paused[v] for v in sorted(stood_s.keys() - stuck) if stood_s[v] >= _LONG_S}
        roots = {v: why or self._cause(v) for v, why in long.items() if not waits[v]}
        free = (v for v in sorted(stood_s.keys() - stuck) if v in self.gated and not (paused[v] or waits[v]))
        causes = {v: self._cause(v) for v in free if stood_s[v] >= _WITH_GRANT_S}
        roots |= {v: why for v, why in causes.items() if why not in {"gate", "light"}}
        behind = deadlocked(waits | {v: [[]] for v in roots})
        # The others wait for vehicles that drive: they have to give way for good.
        moves = (v for v in long.keys() - behind if not any(stood_s.keys() >= set(s) for s in waits[v]))
        roots |= {v: self._cause(v) for v in moves}
        found = [
            Root(
                vehicle,
                self._traffic.lane(vehicle)[0],
                now - stood_s[vehicle],
                why,
                len(deadlocked(waits | {vehicle: [[]]}) - stuck - {vehicle}),
            )
            for vehicle, why in sorted(roots.items())
        ]
        return sorted((root for root in found if root.behind), key=lambda root: -root.behind)

    def _pause(self, vehicle: str) -> str:
        """Return why a vehicle stands that waits for no vehicle; empty if it may wait for one."""
        if vehicle in self._halted:
            return "breakdown"
        return "stop" if self._stops(vehicle) else ""

    def _stops(self, vehicle: str) -> bool:
        """Return whether a vehicle is at a stop of its own, or before one without a free lot: both end."""
        return self._traffic.at_own_stop(vehicle) or self._traffic.awaits_lot(vehicle)

    def _cause(self, vehicle: str) -> str:
        """Return why a vehicle stands that no other vehicle keeps back for good."""
        if self._at_gate is not None and self._at_gate(vehicle) is not None:
            return "gate"
        return self._on_road.cause(vehicle)

    def _waits(self, vehicle: str, places: dict[str, str], stood_s: float) -> list[list[str]]:
        refused = self._at_gate(vehicle) if self._at_gate else None
        if refused is not None:
            sets, places[vehicle] = refused()
            return [list(some) for some in sets]
        places[vehicle] = self._traffic.lane(vehicle)[0]
        return self._on_road.of(vehicle, stood_s)


def _among(waits: WaitFor, some: AbstractSet[str]) -> dict[str, list[list[str]]]:
    """Return the sets without those that are not among some vehicles; empty ones are left out."""
    left = {v: [[one for one in several if one in some] for several in sets] for v, sets in waits.items()}
    return {v: [several for several in sets if several] for v, sets in left.items()}


def _first_closed(waits: WaitFor, stopped_s: Mapping[str, float]) -> tuple[float, set[str]]:
    """Return when a deadlock closed [s], and the vehicles that were in it then.

    `waits` are the vehicles in it now; `stopped_s` says when each has stopped. O(members of all sets * log
    vehicles).
    """
    times = sorted(set(stopped_s.values()))
    low, high = 0, len(times) - 1
    while low < high:
        middle = (low + high) // 2
        if deadlocked({v: sets for v, sets in waits.items() if stopped_s[v] <= times[middle]}):
            high = middle
        else:
            low = middle + 1
    return times[low], deadlocked({v: sets for v, sets in waits.items() if stopped_s[v] <= times[low]})
