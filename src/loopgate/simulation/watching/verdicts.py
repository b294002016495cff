"""Judges which vehicle erred in a collision of a gated with an ordinary vehicle."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any, NamedTuple

from loopgate.network import RoadNetwork
from loopgate.network.road import Connection
from loopgate.simulation.drive import Drive
from loopgate.simulation.watching.trails import Trails
from loopgate.traffic.base import Collision, Traffic, Whereabouts

__all__ = ["CollisionVerdict", "Verdicts"]

_REMEMBERED_S = 20.0

_TOLD_S = 5.0
"""A verdict has the positions of both vehicles this long before the collision [s]."""

_DECEL_MPS2 = 4.5
"""Deceleration of SUMO's cars when they have to brake [m/s2]."""

_ENTERED = 8
"""Number of junctions whose lights are remembered for each vehicle; a body lies over fewer."""

_RED = frozenset("ru")


@dataclass(frozen=True, slots=True)
class CollisionVerdict:
    """A judgement on a collision: the vehicle that erred, and the rule that it broke.

    Attributes
    ----------
    at_s, lane
        Time [s] and lane of the collision as SUMO reports it.
    gated, ordinary
        The gated and the ordinary vehicle.
    erred
        ``gated`` or ``ordinary``.
    why
        The rule that the vehicle broke, in words.
    before
        Lane, position [m] and speed [m/s] of each vehicle five seconds earlier.
    """

    at_s: float
    lane: str
    gated: str
    ordinary: str
    erred: str
    why: str
    before: Mapping[str, tuple[str, float, float]]

    def figures(self) -> dict[str, Any]:
        """Return the judgement as an entry for ``summary.json``."""
        return asdict(self)


class _Moment(NamedTuple):
    lane: str
    position_m: float
    speed_mps: float


class _Entry(NamedTuple):
    """A vehicle's entry into a junction: time [s], movement, and the letter of its light; empty for none.

    `past_s`: when the vehicle passed its waiting point inside the junction [s]; infinite if it has not.
    """

    at_s: float
    movement: Connection
    letter: str
    past_s: float


class Verdicts:
    """Keeps the positions of all vehicles for some seconds, and judges collisions by them.

    The first rule that applies decides which vehicle erred:

    1. a gated vehicle without a grant for its place, or that hits a person;
    2. on one lane, or on two ways out of one lane: the vehicle that came there from beside the other's body,
       else the vehicle behind;
    3. the vehicle that entered the junction at red;
    4. the vehicle A that must yield by the junction's request matrix. But the other vehicle B erred if A was
       already past its waiting point inside while B could still stop before the junction; or if A could no
       longer stop when B was inserted;
    5. if neither or both must yield: the vehicle that came later.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    drive
        Drives the vehicles under the gate.
    """

    def __init__(self, network: RoadNetwork, traffic: Traffic, drive: Drive) -> None:
        self.trails = Trails(drive)
        """The lanes that vehicles came over."""
        self._network, self._traffic, self._drive = network, traffic, drive
        self._moments: deque[tuple[float, Whereabouts]] = deque()
        self._letters: dict[str, deque[tuple[Connection, str]]] = {}
        """By vehicle, the last movements that it entered, and the letters of their lights; empty for none."""
        self._lit = any(movement.signal is not None for movement in network.connections)
        self._inside = {lane: movement for movement in network.connections for lane in movement.via}
        self._between = {(m.from_edge, m.to_edge): m for m in network.connections}

    def look(self) -> None:
        """Record the positions of all vehicles; call once a step. O(vehicles)."""
        now, here = self._traffic.now_s, self._traffic.whereabouts()
        self.trails.look(now, here)
        if self._lit:
            moved, gone = self.trails.catch_up()
            for vehicle, was, lane in moved:
                movement = self._driven_onto(was, lane)
                if movement is not None:
                    entered = self._letters.setdefault(vehicle, deque(maxlen=_ENTERED))
                    entered.appendleft((movement, self._letter(movement)))
            for vehicle in gone:
                self._letters.pop(vehicle, None)
        self._moments.append((now, here))
        while now - self._moments[0][0] > _REMEMBERED_S:
            self._moments.popleft()

    def _driven_onto(self, was: str, lane: str) -> Connection | None:
        """Return the movement that a vehicle enters when it comes from one lane to another."""
        movement = self._inside.get(lane) or self._between.get((_edge(was), _edge(lane)))
        return None if not was or movement is None or was in movement.via else movement

    def _entry(self, vehicle: str, lane: str) -> _Entry | None:
        """Return a vehicle's entry into the junction of a lane, if it is remembered.

        If the lane is outside junctions, into the last junction on the vehicle's path. Its front may have
        come to the next junction meanwhile.
        """
        there = self._inside.get(lane)
        after: list[tuple[float, str]] = []
        for (at_s, onto), (_, was) in pairwise(self.trails.back(vehicle)):
            after.append((at_s, onto))
            movement = self._driven_onto(was, onto)
            if movement is not None and (there is None or movement.junction == there.junction):
                past_s = (now for now, here in reversed(after) if here not in movement.via[:-1])
                letter = next((shown for one, shown in self._letters.get(vehicle, ()) if one is movement), "")
                return _Entry(at_s, movement, letter, next(past_s, math.inf))
        return None

    def _letter(self, movement: Connection) -> str:
        if movement.signal is None:
            return ""
        light, link = movement.signal
        return self._traffic.light(light).state[link]

    def judge(self, collision: Collision) -> CollisionVerdict | None:
        """Return the judgement on a collision; None unless exactly one of the two vehicles is gated."""
        pair = collision.collider, collision.victim
        own = [vehicle for vehicle in pair if vehicle in self._drive.records]
        if len(own) != 1:
            return None
        gated = own[0]
        ordinary = pair[1] if gated == pair[0] else pair[0]
        erred, why = self._erred(gated, ordinary, collision)
        return CollisionVerdict(
            at_s=self._traffic.now_s,
            lane=collision.lane,
            gated=gated,
            ordinary=ordinary,
            erred="gated" if erred == gated else "ordinary",
            why=why,
            before={vehicle: self._before(vehicle) for vehicle in (gated, ordinary)},
        )

    def _erred(self, gated: str, ordinary: str, collision: Collision) -> tuple[str, str]:
        if self._drive.trespasses_now(gated):
            return gated, f"{gated} was in a place without a grant"
        if ordinary not in self._moments[-1][1].vehicles:
            return gated, f"{ordinary} is on foot"
        one, other = self._entry(gated, collision.lane), self._entry(ordinary, collision.lane)
        if one is None or other is None or _from(one) == _from(other) or not self._near(one, other):
            lane = collision.lane if one is None else one.movement.from_id
            if aside := self._cut_in((gated, ordinary), lane):
                return aside, f"{aside} changed lanes beside the other"
            return collision.collider, f"{collision.collider} ran into {collision.victim} from behind"
        return self._erred_at_junction((gated, ordinary), (one, other))

    def _cut_in(self, names: tuple[str, str], lane: str) -> str:
        """Return which vehicle was last beside the other's body, on another lane than `lane`; or ""."""
        for now, here in reversed(self._moments):
            one, other = (_moment(here, vehicle) for vehicle in names)
            if now < self._traffic.now_s - _TOLD_S or one is None or other is None:
                break
            inside = one.lane in self._inside
            if inside or one.lane == other.lane or _edge(one.lane) != _edge(other.lane):
                continue
            first = 0 if one.position_m >= other.position_m else 1
            rear_m = max(one.position_m, other.position_m) - self._traffic.size(names[first])[0]
            if rear_m >= min(one.position_m, other.position_m):
                return ""
            return {one.lane: names[1], other.lane: names[0]}.get(lane, "")
        return ""

    def _erred_at_junction(self, names: tuple[str, str], came: tuple[_Entry, _Entry]) -> tuple[str, str]:
        for vehicle, entry in zip(names, came, strict=True):
            if entry.letter and entry.letter in _RED:
                return vehicle, f"{vehicle} drove in at red"
        one, other = came
        yields = self._yields(one.movement, other.movement), self._yields(other.movement, one.movement)
        first = 0 if one.at_s <= other.at_s else 1
        later = 1 - first
        said = f"{names[first]} was inside {came[later].at_s - came[first].at_s:g} s before"
        if yields[0] == yields[1]:
            return names[later], f"{said}, and neither had the right of way"
        must = 0 if yields[0] else 1
        departed_s = self._departed_s(names[1 - must])
        if departed_s is not None and not self._could_stop(names[must], came[must], departed_s):
            return names[1 - must], f"{names[1 - must]} departed when {names[must]} could not stop any more"
        past_s, other_s = came[must].past_s, came[1 - must].at_s
        if past_s <= other_s and self._could_stop(names[1 - must], came[1 - must], past_s):
            said = f"{names[must]} was on its way across {other_s - past_s:g} s before {names[1 - must]}"
            return names[1 - must], f"{said}, which could have stopped then"
        if math.isinf(past_s):
            said = f"it waited inside, in the way of {names[1 - must]}"
        elif must == first:
            said = f"{names[later]} could not stop any more"
        return names[must], f"{names[must]} had to yield; {said}"

    def _near(self, one: _Entry, other: _Entry) -> bool:
        """Return whether both entries belong to the collision, not to junctions passed long before."""
        lately = self._traffic.now_s - _REMEMBERED_S
        return one.movement.junction == other.movement.junction and max(one.at_s, other.at_s) > lately

    def _yields(self, movement: Connection, other: Connection) -> bool:
        rows = self._network.junctions[movement.junction].yields_to
        return 0 <= movement.link < len(rows) and other.link in rows[movement.link]

    def _could_stop(self, vehicle: str, entry: _Entry, at_s: float) -> bool:
        """Return whether a vehicle could still have stopped at `at_s` before the junction of its entry."""
        if entry.at_s <= at_s:
            return False
        then = next((_moment(here, vehicle) for now, here in self._moments if now >= at_s), None)
        if then is None or _edge(then.lane) != entry.movement.from_edge:
            return True  # it was farther from the junction
        left_m = self._network.lanes[then.lane].length_m - then.position_m
        return then.speed_mps**2 / (2 * _DECEL_MPS2) + then.speed_mps * self._traffic.step_s < left_m

    def _departed_s(self, vehicle: str) -> float | None:
        """Return when a vehicle came onto the road [s]; None if it was there before the remembered time."""
        there = [(now, vehicle in here.vehicles) for now, here in self._moments]
        return None if there[0][1] else next((now for now, is_there in there if is_there), None)

    def _before(self, vehicle: str) -> tuple[str, float, float]:
        now = self._traffic.now_s
        seen = (_moment(here, vehicle) for at, here in self._moments if at >= now - _TOLD_S)
        lane, position_m, speed_mps = next(filter(None, seen), _Moment("", 0.0, 0.0))
        return lane, round(position_m, 2), round(speed_mps, 2)


def _moment(here: Whereabouts, vehicle: str) -> _Moment | None:
    if vehicle not in here.vehicles:
        return None
    at = here.vehicles.index(vehicle)
    return _Moment(here.lanes[at], float(here.positions_m[at]), float(here.speeds_mps[at]))


def _edge(lane: str) -> str:
    return lane.rpartition("_")[0]


def _from(entry: _Entry) -> tuple[str, int]:
    return entry.movement.from_edge, entry.movement.from_lane
