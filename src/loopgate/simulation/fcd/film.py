"""Plays the frames of a finished simulation: positions and distances."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf, nan
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.control.places import STANDING_MPS
from loopgate.network import Connection, RoadNetwork
from loopgate.network.xml_file import open_xml
from loopgate.simulation.fcd.frames import Frame, SeenVehicle, read_frames
from loopgate.simulation.watching.ahead import CREEPS_MPS, Ahead, Future

_LENGTH_M, _GAP_M = 5.0, 2.5
"""Length and minimum gap of SUMO's default car [m]: FCD output has neither."""

_GAINS_MPS2 = 5.0
"""A vehicle that came farther than with this acceleration was moved by SUMO [m/s2]."""

_MOST_SKIPPED = 3
"""A vehicle may pass at most this many short edges between two frames."""


_LOOKS_S = 5.0
"""Whether vehicles move is seen at this interval [s]."""

_CYCLE_S = 120.0
"""Cycle of a light without a program in the network file [s]."""


@dataclass(slots=True)
class FilmedVehicle:
    """The mileage of a vehicle so far.

    Attributes
    ----------
    first_s, last_s
        When it was first and last seen [s].
    driven_m, stood_s
        How far it drove [m], and how long it was slower than 0.1 m/s [s].
    since_s, longest_s
        Since when it stands, and how long at most it has stood at once [s].
    before, edge
        The edge that it is on, or came from if it is inside a junction, and the edge before that one.
    after
        The edge that it took last after each edge.
    """

    first_s: float
    last_s: float
    driven_m: float = 0.0
    stood_s: float = 0.0
    since_s: float = 0.0
    longest_s: float = 0.0
    before: str = ""
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

    knows_sizes = False

    def __init__(self, network: RoadNetwork, step_s: float) -> None:
        self._network, self.step_s = network, step_s
        self.now_s = 0.0
        """When the frame ends [s]."""
        self.courses: dict[str, FilmedVehicle] = {}
        self.stood_on = defaultdict[str, float](float)
        """How long vehicles stood on each edge [s]."""
        self._seen: dict[str, SeenVehicle] = {}
        self._cycles_s: dict[str, float] | None = None
        self._ways: dict[tuple[str, str], list[str]] = {}
        self._gaps_m: dict[tuple[str, str], float] = {}
        self._over: dict[str, list[Connection]] = defaultdict(list)
        for connection in network.connections:
            for lane in connection.via:
                self._over[lane].append(connection)

    def show(self, time_s: float, vehicles: Iterable[SeenVehicle]) -> list[tuple[str, str]]:
        """Show the next frame; return each vehicle that has entered an edge, with the edge.

        In the first frame no vehicle enters: all are there already.
        """
        first = not self.courses
        self.now_s = time_s + self.step_s
        before, self._seen = self._seen, {one.vehicle: one for one in vehicles}
        for vehicle in before.keys() - self._seen.keys():
            self.courses[vehicle].driven_m += self._went_m(before[vehicle])
        entered = []
        for vehicle, one in self._seen.items():
            course = self.courses.get(vehicle)
            if course is None:
                course = self.courses[vehicle] = FilmedVehicle(time_s, self.now_s, since_s=time_s)
            course.last_s = self.now_s
            if not first:
                course.driven_m += self._came_m(before.get(vehicle), one)
            edge = one.lane.rpartition("_")[0]
            inside = edge.startswith(":")
            if edge != course.edge and not inside:
                for passed in self._passed(course.edge, edge):
                    if course.edge:
                        course.after[course.edge] = passed
                    course.before, course.edge = course.edge, passed
                    if not first:
                        entered.append((vehicle, passed))
            if one.speed_mps < STANDING_MPS:
                course.stood_s += self.step_s
                self.stood_on[course.edge] += self.step_s
                course.longest_s = max(course.longest_s, self.now_s - course.since_s)
            else:
                course.since_s = self.now_s
        return entered

    def _came_m(self, before: SeenVehicle | None, one: SeenVehicle) -> float:
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

    def _went_m(self, last: SeenVehicle) -> float:
        """Return how far a vehicle came after its last frame: by default to the end of its lane [m]."""
        lane = self._network.lanes.get(last.lane)
        rest_m = 0.0 if lane is None or lane.internal else lane.length_m - last.pos_m
        return max(0.0, min(rest_m, self._could_m(last)))

    def _could_m(self, one: SeenVehicle) -> float:
        """Return how far a vehicle can come between two frames [m]."""
        lane = self._network.lanes.get(one.lane)
        return self.step_s * max(one.speed_mps, 0.0 if lane is None else lane.speed_mps)

    def _along(self, one: SeenVehicle) -> tuple[str, float]:
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

    def odometers(self, vehicles: Sequence[str]) -> list[float]:
        """Return how far `vehicles` have driven [m]."""
        return [self.courses[vehicle].driven_m for vehicle in vehicles]

    def lane(self, vehicle: str) -> tuple[str, float]:
        """Return the lane of a vehicle, and the position of its front on the lane [m]."""
        one = self._seen[vehicle]
        return one.lane, one.pos_m

    def position(self, vehicle: str) -> tuple[float, float] | None:
        """Return the position of a vehicle's front [m]; None if the vehicle is not on the road."""
        one = self._seen.get(vehicle)
        return None if one is None else (one.x_m, one.y_m)

    def on_lanes(self) -> Iterator[tuple[str, str, float]]:
        """Yield each vehicle with the lane and the position of its front [m]."""
        for one in self._seen.values():
            yield one.vehicle, one.lane, one.pos_m

    def size(self, vehicle: str) -> tuple[float, float]:
        """Return length and minimum gap of SUMO's default car [m]."""
        del vehicle
        return _LENGTH_M, _GAP_M

    def edges_around(self, vehicle: str) -> tuple[str, Sequence[str] | None]:
        """Return the edges before and after the one that a vehicle is on, or came from if it is inside.

        The edge after is known if the vehicle has been on this edge before.
        """
        course = self.courses[vehicle]
        after = course.after.get(course.edge)
        return course.before, [after] if after else None

    def lanes_for(self, vehicle: str) -> None:
        """Return None: FCD output does not tell."""
        del vehicle

    def lane_wish(self, vehicle: str) -> tuple[int, bool]:  # noqa: ARG002  the protocol's
        """Return none: a film does not know it."""
        return 0, False

    def faces_red(self, vehicle: str) -> bool:
        """Return False: FCD output has no lights."""
        del vehicle
        return False

    def cycle_s(self, light: str) -> float:
        """Return the time in which a light of the network file shows all its phases [s]."""
        if self._cycles_s is None:
            self._cycles_s = _read_cycles_s(self._network.file)
        return self._cycles_s.get(light, _CYCLE_S)

    def at_own_stop(self, vehicle: str) -> bool:
        """Return False: FCD output has no stops."""
        del vehicle
        return False

    def awaits_lot(self, vehicle: str) -> bool:
        """Return False: as above."""
        del vehicle
        return False


class FilmAhead(Ahead):
    """Knows what comes: reads on to the end of FCD output, once it is asked.

    Parameters
    ----------
    file
        The file, which can be read.
    """

    def __init__(self, file: Path) -> None:
        super().__init__()
        self._file = file

    def look(self, *, ends: bool) -> None:  # noqa: ARG002  the film is what it is
        """Read the file, unless that has been done."""
        if self.future.until_s < 0.0:
            self.future = _moves(read_frames(self._file))


def _moves(frames: Iterable[Frame]) -> Future:
    """Return when each vehicle moves last, or is gone."""
    moves_s, before, then_s = dict[str, float](), dict[str, SeenVehicle](), -inf
    now = then_s
    for now, vehicles in frames:
        if now - then_s < _LOOKS_S:
            continue
        here, least_m = {one.vehicle: one for one in vehicles}, CREEPS_MPS * (now - then_s)
        stay = (
            name
            for name, one in here.items()
            if (was := before.get(name)) and was.lane == one.lane and one.pos_m - was.pos_m <= least_m
        )
        moves_s |= dict.fromkeys((here.keys() | before.keys()) - set(stay), now)
        before, then_s = here, now
    return Future(now, moves_s)


def _read_cycles_s(file: Path) -> dict[str, float]:
    """Return the longest cycle of each light in a network file [s]."""
    cycles: dict[str, float] = {}
    with open_xml(file) as stream:
        for _, element in ET.iterparse(stream):  # noqa: S314  it has been read as a network
            if element.tag == "tlLogic":
                phases = (phase.get("maxDur", phase.get("duration", "0")) for phase in element.iter("phase"))
                name = element.get("id", "")
                cycles[name] = max(cycles.get(name, 0.0), sum(map(float, phases)))
            if element.tag not in {"phase", "param"}:
                element.clear()
    return cycles
