"""Plays the frames of a finished simulation: positions, distances, and which vehicles block which."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, nan, radians, sin

import numpy as np
from shapely import LineString, Point
from shapely.ops import substring

from loopgate.arrays import Floats
from loopgate.control.motion import STANDING_MPS
from loopgate.network import Connection, RoadNetwork
from loopgate.simulation.fcd.frames import Seen
from loopgate.simulation.watching.deadlock_detector import DeadlockDetector

_LENGTH_M, _GAP_M = 5.0, 2.5
"""Length and minimum gap of SUMO's default car [m]: FCD output has neither."""

_GAINS_MPS2 = 5.0
"""A vehicle that came farther than with this acceleration was moved by SUMO [m/s2]."""

_MOST_SKIPPED = 3
"""A vehicle may pass at most this many short edges between two frames."""

_WIDTH_M = 1.8
"""Width of a car: a vehicle cannot pass nearer than this to the middle of another's body [m]."""

_TOUCHING_M = 3.0
"""A vehicle that stands cannot go on if its leader is within the minimum gap plus this distance [m]."""

_AT_JUNCTION_M = 15.0
"""A vehicle nearer than this to the end of its lane may stand there because of the junction [m]."""


@dataclass(slots=True)
class Course:
    """The mileage of a vehicle so far.

    Attributes
    ----------
    first_s, last_s
        When it was first and last seen [s].
    driven_m, stood_s
        How far it drove [m], and how long it was slower than 0.1 m/s [s].
    since_s, longest_s
        Since when it stands, and how long at most it has stood at once [s].
    edge
        The edge that it is on, or came from if it is inside a junction.
    after
        The edge that it took last after each edge.
    """

    first_s: float
    last_s: float
    driven_m: float = 0.0
    stood_s: float = 0.0
    since_s: float = 0.0
    longest_s: float = 0.0
    edge: str = ""
    after: dict[str, str] = field(default_factory=dict)


class Film:
    """Shows frames to a deadlock detector like a running simulation.

    Parameters
    ----------
    network
        The network on which the vehicles drive.
    step_s
        Time between two frames [s].
    """

    def __init__(self, network: RoadNetwork, step_s: float) -> None:
        self._network, self.step_s = network, step_s
        self.now_s = 0.0
        """When the frame ends [s]."""
        self.courses: dict[str, Course] = {}
        self.stood_on = defaultdict[str, float](float)
        """How long vehicles stood on each edge [s]."""
        self._seen: dict[str, Seen] = {}
        self._on: dict[str, list[Seen]] | None = None
        self._ways: dict[tuple[str, str], list[str]] = {}
        self._gaps_m: dict[tuple[str, str], float] = {}
        self._by_lane: dict[str, list[Connection]] = defaultdict(list)
        self._over: dict[str, list[Connection]] = defaultdict(list)
        self._lanes_at: dict[str, set[str]] = defaultdict(set)
        """For each junction, its internal lanes and the lanes that lead out of it."""
        for connection in network.connections:
            self._by_lane[connection.from_id].append(connection)
            self._lanes_at[connection.junction].update((*connection.via, connection.to_id))
            for lane in connection.via:
                self._over[lane].append(connection)

    def show(self, time_s: float, vehicles: Iterable[Seen]) -> list[tuple[str, str]]:
        """Show the next frame; return each vehicle that has entered an edge, with the edge.

        In the first frame no vehicle enters: all are there already.
        """
        first = not self.courses
        self.now_s = time_s + self.step_s
        before, self._seen = self._seen, {one.vehicle: one for one in vehicles}
        for vehicle in before.keys() - self._seen.keys():
            self.courses[vehicle].driven_m += self._went_m(before[vehicle])
        self._on = None
        entered = []
        for vehicle, one in self._seen.items():
            course = self.courses.get(vehicle)
            if course is None:
                course = self.courses[vehicle] = Course(time_s, self.now_s, since_s=time_s)
            course.last_s = self.now_s
            if not first:
                course.driven_m += self._came_m(before.get(vehicle), one)
            edge = one.lane.rpartition("_")[0]
            inside = edge.startswith(":")
            if edge != course.edge and not inside:
                for passed in self._passed(course.edge, edge):
                    if course.edge:
                        course.after[course.edge] = passed
                    course.edge = passed
                    if not first:
                        entered.append((vehicle, passed))
            if one.speed_mps < STANDING_MPS:
                course.stood_s += self.step_s
                self.stood_on[course.edge] += self.step_s
                course.longest_s = max(course.longest_s, self.now_s - course.since_s)
            else:
                course.since_s = self.now_s
        return entered

    def _came_m(self, before: Seen | None, one: Seen) -> float:
        """Return how far a vehicle came since the last frame [m]."""
        if before is None:  # it departed in between, by SUMO's default with its rear where its lane begins
            return min(max(0.0, one.pos_m - _LENGTH_M), self._could_m(one))
        if before.lane == one.lane and one.pos_m >= before.pos_m:
            return one.pos_m - before.pos_m
        here, there = self._along(before), self._along(one)
        came_m = there[1] - here[1]
        if here[0] != there[0]:
            came_m += self._gap_m(here[0], there[0])
        fastest_mps = max(one.speed_mps, before.speed_mps) + _GAINS_MPS2 * self.step_s
        if 0.0 <= came_m <= fastest_mps * self.step_s:
            return came_m
        return (one.speed_mps + before.speed_mps) / 2.0 * self.step_s  # SUMO moved it, or it changed lanes

    def _went_m(self, last: Seen) -> float:
        """Return how far a vehicle came after its last frame: by default to the end of its lane [m]."""
        lane = self._network.lanes.get(last.lane)
        rest_m = 0.0 if lane is None or lane.internal else lane.length_m - last.pos_m
        return max(0.0, min(rest_m, self._could_m(last)))

    def _could_m(self, one: Seen) -> float:
        """Return how far a vehicle can come between two frames [m]."""
        lane = self._network.lanes.get(one.lane)
        return self.step_s * max(one.speed_mps, 0.0 if lane is None else lane.speed_mps)

    def _along(self, one: Seen) -> tuple[str, float]:
        """Return an edge, and how far the vehicle is from its begin [m]; beyond its end inside a junction."""
        edge, pos_m, lanes = one.lane.rpartition("_")[0], one.pos_m, self._network.lanes
        if edge.startswith(":") and (over := self._over.get(one.lane)):
            before = over[0].via[: over[0].via.index(one.lane)]
            return over[0].from_edge, pos_m + sum(lanes[name].length_m for name in (over[0].from_id, *before))
        return edge, pos_m

    def _gap_m(self, before: str, after: str) -> float:
        """Return how far it is from the begin of an edge to the begin of a later edge [m]; NaN if unknown."""
        if (before, after) not in self._gaps_m:
            network, metres = self._network, 0.0
            for edge, following in pairwise((before, *self._passed(before, after))):
                over = network.outgoing(edge) if edge in network.edges else ()
                way = next((way for way in over if way.to_edge == following), None)
                lanes = (way.from_id, *way.via) if way else ()
                metres += sum(network.lanes[lane].length_m for lane in lanes) if way else nan
            self._gaps_m[before, after] = metres
        return self._gaps_m[before, after]

    def _passed(self, before: str, after: str) -> list[str]:
        """Return the edges entered between two frames: short edges that no frame shows, then the new edge."""
        if (before, after) not in self._ways:
            found, ahead = [after], [[before]] if before in self._network.edges else []
            for _ in range(_MOST_SKIPPED + 1):
                ahead = [[*way, one.to_edge] for way in ahead for one in self._network.outgoing(way[-1])]
                if arrived := [way for way in ahead if way[-1] == after]:
                    found = arrived[0][1:]
                    break
            self._ways[before, after] = found
        return self._ways[before, after]

    def vehicles(self) -> Sequence[str]:
        """Return the vehicles on the road, in a fixed order."""
        return list(self._seen)

    def driven_m(self) -> float:
        """Return how far all vehicles have driven [m]."""
        return sum(course.driven_m for course in self.courses.values())

    def standing(self) -> int:
        """Return how many vehicles are slower than 0.1 m/s."""
        return sum(one.speed_mps < STANDING_MPS for one in self._seen.values())

    def odometers(self, vehicles: Sequence[str]) -> Floats:
        """Return how far `vehicles` have driven [m]."""
        return np.array([self.courses[vehicle].driven_m for vehicle in vehicles])

    def lane(self, vehicle: str) -> tuple[str, float]:
        """Return the lane of a vehicle, and the position of its front on the lane [m]."""
        one = self._seen[vehicle]
        return one.lane, one.pos_m

    def position(self, vehicle: str) -> tuple[float, float] | None:
        """Return the position of a vehicle's front [m]; None if the vehicle is not on the road."""
        one = self._seen.get(vehicle)
        return None if one is None else (one.x_m, one.y_m)

    def pauses(self, vehicle: str) -> bool:
        """Return False: FCD output has neither lights nor stops."""
        del vehicle
        return False

    def waits_for(self, vehicle: str, *, guess: bool) -> Sequence[str]:
        """Return the vehicles of which each alone blocks a standing vehicle."""
        return [some[0] for some in self.blocked_by(vehicle, guess=guess) if len(some) == 1]

    def blocked_by(self, vehicle: str, *, guess: bool) -> list[list[str]]:
        """Return sets of vehicles: in each set, some vehicle must move before this vehicle can.

        The blocker is the leader. At the end of a lane and inside a junction, blockers are the vehicles that
        leave no space after the junction, and the vehicles that stand inside it across the movement. The
        vehicle's movement is known if it has taken it here before. Otherwise it may be any movement from its
        lane. With `guess`, it is a blocked movement: the vehicle would not stand so long before a free one.
        """
        one = self._seen[vehicle]
        if (leader := self._leader(one)) is not None:
            return [[leader]]
        lane = self._network.lanes.get(one.lane)
        if lane is None:
            return []
        if not lane.internal and lane.length_m - one.pos_m > _AT_JUNCTION_M:
            return []
        ways = self._over[one.lane] if lane.internal else self._by_lane[one.lane]
        course = self.courses[vehicle]
        known = course.after.get(course.edge)
        ways = [way for way in ways if way.to_edge == known] or ways
        blocked = [self._blockers(one, way) for way in ways]
        blocked = [some for some in blocked if some] if guess else blocked
        if not blocked or not all(blocked):
            return []
        if len(blocked) == 1:
            return [[other] for other in blocked[0]]
        return [sorted({other for some in blocked for other in some})]

    def _leader(self, one: Seen) -> str | None:
        """Return the next vehicle ahead on the lane, if it stands too near to move up to it."""
        ahead = [other for other in self._standing_on(one.lane) if other.pos_m > one.pos_m]
        if not ahead:
            return None
        leader = min(ahead, key=lambda other: other.pos_m)
        near = leader.pos_m - one.pos_m <= _LENGTH_M + _GAP_M + _TOUCHING_M
        return leader.vehicle if near else None

    def _blockers(self, one: Seen, way: Connection) -> list[str]:
        """Return the vehicles that stand behind or inside a junction, in the way of a movement."""
        here = way.via.index(one.lane) if one.lane in way.via else -1
        path = self._path(one, way.via[here:] if here >= 0 else way.via)
        near = [other for lane in self._lanes_at[way.junction] for other in self._standing_on(lane)]
        found = {
            other.vehicle for other in near if path is not None and _body(other).distance(path) < _WIDTH_M
        }
        last = min(self._standing_on(way.to_id), key=lambda other: other.pos_m, default=None)
        # Inside a junction a vehicle goes on until it touches; before one it waits for space beyond it.
        over_m = path.length if here >= 0 and path is not None else 0.0
        room_m = _LENGTH_M + _GAP_M + (_TOUCHING_M if here >= 0 else _LENGTH_M)
        if last is not None and over_m + last.pos_m < room_m:
            found.add(last.vehicle)
        return sorted(found - {one.vehicle})

    def _path(self, one: Seen, lanes: Sequence[str]) -> LineString | None:
        """Return the line of a vehicle over the rest of a junction, along these internal lanes."""
        points = [point for lane in lanes for point in self._network.lanes[lane].shape]
        if len(points) < 2:  # noqa: PLR2004  a network without internal lanes
            return None
        line = LineString(points)
        if lanes[0] != one.lane:
            return line
        driven = line.project(Point(one.x_m, one.y_m))
        return LineString(substring(line, driven, line.length).coords)

    def _standing_on(self, lane: str) -> list[Seen]:
        if self._on is None:
            self._on = defaultdict(list)
            for one in self._seen.values():
                if one.speed_mps < STANDING_MPS:
                    self._on[one.lane].append(one)
        return self._on.get(lane, [])


def _body(one: Seen) -> LineString:
    """Return the middle line of a vehicle's body, from its front to its rear."""
    turn = radians(one.angle_deg)
    return LineString(
        [(one.x_m, one.y_m), (one.x_m - _LENGTH_M * sin(turn), one.y_m - _LENGTH_M * cos(turn))]
    )


class FilmDetector(DeadlockDetector):
    """Detects deadlocks in frames, where a vehicle may have several movements that are all blocked."""

    def __init__(self, film: Film, *, after_s: float) -> None:
        super().__init__(film, after_s=after_s)
        self._film = film

    def _blocked_by(self, vehicle: str, *, guess: bool) -> list[list[str]]:
        return self._film.blocked_by(vehicle, guess=guess)
