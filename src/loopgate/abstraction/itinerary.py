"""Paths over states: the states as parts of a loop, and the path of one vehicle with its start."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

from loopgate.errors import RouteError
from loopgate.model import StateId, System
from loopgate.network.loop import LanePosition, Loop
from loopgate.network.road import RoadNetwork

CLEARANCE_M = 1.0
"""Length of a state beyond the vehicles and gaps in it [m]: vehicles stop centimetres off a line, and a rear
leaves a state between two simulation steps."""


Overlap = tuple[float, float]
"""Position of a front from which a vehicle can touch a foe, and of its rear beyond which it cannot [m]."""


@dataclass(frozen=True, slots=True)
class SizedOverlaps:
    """The overlaps of a crossing with one foe by the lengths of the two vehicles.

    `sizes`: lengths, ascending [m]; a vehicle counts as the next longer one. `among`: by the vehicle's own
    length, then by the foe's; None where the two never touch.
    """

    sizes: tuple[float, ...]
    among: tuple[tuple[Overlap | None, ...], ...]

    def shifted(self, by_m: float) -> SizedOverlaps:
        """Return the overlaps with positions that are larger by `by_m`."""
        return SizedOverlaps(
            self.sizes,
            tuple(tuple(o and (o[0] + by_m, o[1] + by_m) for o in row) for row in self.among),
        )


@dataclass(frozen=True, slots=True)
class Crossing:
    """A stretch between two states in which a vehicle never waits (a movement over a junction)."""

    id: str
    """The movement's name; vehicles on the same movement follow each other."""
    foes: frozenset[str]
    """Movements that must not be under way at the same time. Symmetric."""
    overlaps: Mapping[str, Overlap] = field(default_factory=dict, hash=False)
    """For a foe, positions after the ``end_m`` of the leg before [m]: of the front from which a vehicle on
    this crossing can touch a vehicle on the foe, and of the rear beyond which it no longer can. A foe
    without an entry is in the way all along."""
    speed_mps: float = math.inf
    """Lowest speed limit on the crossing."""
    ahead_m: float = 0.0
    """Distance from the ``end_m`` of the leg before to its beginning [m]."""
    wait_m: float = -math.inf
    """The last position, after that ``end_m``, at which SUMO may let a vehicle wait for a vehicle with the
    right of way: inside the junction, or at its beginning; minus infinity if there is none [m]."""
    limits: tuple[tuple[float, float], ...] = ()
    """The speed limits before and on it: position after that ``end_m`` from which each holds [m], and limit
    [m/s]."""
    from_lane: str = ""
    to_lane: str = ""
    """`from_lane` and `to_lane`: the lanes before and after the crossing."""
    sized: Mapping[str, SizedOverlaps] = field(default_factory=dict, hash=False)
    """For a foe whose `overlaps` depend on the lengths of the two vehicles, the overlaps by these."""
    stretch: str = ""
    """The edge, if vehicles change lanes on it."""

    def soonest(self, to_m: float) -> tuple[float, float]:
        """Return the least time from the ``end_m`` of the leg before [s], and the lowest limit [m/s]."""
        time_s, least_mps = 0.0, self.speed_mps
        for (begin_m, limit_mps), (end_m, _) in pairwise((*self.limits, (math.inf, 0.0))):
            if begin_m < to_m:
                time_s += (min(end_m, to_m) - begin_m) / limit_mps
                least_mps = min(least_mps, limit_mps)
        return time_s, least_mps


@dataclass(frozen=True, slots=True)
class Guide:
    """A stop that makes a vehicle take the lanes of its loop.

    A vehicle with a stop on a lane drives to that lane. The stop is removed, usually before the vehicle has
    to brake for it, once the vehicle is on the lane, or has changed to another.
    """

    edge: str
    lane: int
    position_m: float
    """`edge`, `lane` and `position_m`: the stop."""
    from_m: float
    """Position after the ``end_m`` of the leg before [m]. Without `to_lane`, the stop is removed when the
    front is there; otherwise the vehicle may change lanes when its rear is there."""
    to_lane: int | None = None
    """The lane to change to, beside `lane`."""
    stop_m: float = math.inf
    """Position of the stop, after the ``end_m`` of the leg before [m]."""


NOWHERE = LanePosition("", 0, 0.0)
"""End of legs that are on no road."""


@dataclass(frozen=True, slots=True)
class DrawnLeg:
    """A state on a vehicle's loop, in arc length from the beginning of the loop."""

    state: StateId
    begin_m: float
    end_m: float
    """The part of the loop that is this state [m]; a refused vehicle stops with its front before ``end_m``.
    ``begin_m`` may be negative, or ``end_m`` beyond the loop's length, if the state lies across the loop's
    beginning. ``end_m`` lies on a normal lane, never inside a junction, where SUMO cannot hold a vehicle
    reliably, and at least 0.1 m before the lane's end. Moving it upstream only lengthens the state behind
    it."""
    crossings: tuple[Crossing, ...] = ()
    """The crossings between ``end_m`` and the next leg's ``begin_m``; empty where states touch."""
    line: LanePosition = NOWHERE
    """Position of ``end_m`` on the road, where a refused vehicle stops."""
    guides: tuple[Guide, ...] = ()
    """Stops that keep the vehicle on the lanes of its loop between ``end_m`` and the next leg, in order."""
    slot_m: float = 0.0
    """Length that the longest visitor takes with its gap [m]; 0 if vehicles do not queue here."""
    away: bool = False
    """Whether the leg is beyond the end of an open route: not on the road, and never full."""


@dataclass(frozen=True, slots=True)
class Itinerary:
    """A loop with its legs in driving order; leg ``k`` is position ``k`` of its robots' paths."""

    loop: Loop
    legs: tuple[DrawnLeg, ...] = ()
    """The legs in ascending order of ``begin_m``; none for vehicles without a gate."""
    keeps_lane: bool = False
    """Whether vehicles change lanes only where a `Guide` says so, and are on one lane in each state."""


class PlaceRoom(NamedTuple):
    """A place whose slots depend on the lengths of the vehicles that come.

    `length_m`: its length for vehicles with their gaps [m]. `slot_m`: the length of a slot [m]; longer
    vehicles take a slot, and keep the metres that they need beyond it. `most_kept_m`: how many may be kept at
    once [m]; infinite where two of the longest vehicles fit. `overhang_m`: the length before it on which its
    vehicles may stand while nobody wants to change lanes there [m]; `stretch`: the edge of that stretch.
    """

    length_m: float
    slot_m: float
    most_kept_m: float = math.inf
    overhang_m: float = 0.0
    stretch: str = ""


@dataclass(frozen=True, slots=True)
class Abstraction:
    """A system, and the path of each of its robots on the road."""

    name: str
    """``segments`` or ``queues``."""
    system: System
    """Robots (vehicles), states and capacities, with the start positions."""
    itineraries: tuple[Itinerary, ...]
    """One itinerary per robot, in the system's order; robots on one loop share an itinerary."""
    starts_m: tuple[float, ...]
    """Start position of each robot's front, as arc length on its loop [m]. The whole vehicle is on one normal
    lane, within the leg of the robot's start position."""
    warnings: tuple[str, ...] = field(default=())
    """Warnings for the user about a network that does not suit this abstraction."""
    later: tuple[Itinerary, ...] = ()
    """The itineraries of vehicles that join later."""
    room: Mapping[str, int] = field(default_factory=dict, hash=False)
    """Capacity of each state that a robot or vehicle visits, by name; empty on segments."""
    rooms: Mapping[str, PlaceRoom] = field(default_factory=dict, hash=False)
    """The states that hold more than their capacity while few long vehicles come, by name."""


_ROUNDING_M = 1e-6
_SAME_M = 0.1


class Round(NamedTuple):
    """An edge, the name of the route that begins with it, and the name of the route of that edge alone."""

    edge: str
    route: str
    alone: str


@dataclass(frozen=True, slots=True)
class Track:
    """The path of one vehicle.

    Attributes
    ----------
    vehicle, loop
        Names of the vehicle and of its loop.
    lap_m
        Length of the loop [m]; very long for a route that is driven once.
    start_m
        Arc length of the front at the beginning [m].
    top_speed_mps
        Highest speed limit on the loop [m/s].
    rounds
        The edge on which the vehicle's route is renewed, and the edge after it, with their routes; empty
        if the vehicle drives once.
    edges
        Arc length at which each edge begins [m], ascending, and its name.
    legs
        The states in driving order, as the abstraction draws them; empty without a gate.
    position
        Index of the state in which the vehicle starts.
    keeps_lane
        Whether the vehicle changes lanes only where a guide says so.
    renews
        Whether loopgate renews the route of a loop, because SUMO does not.
    foreseen
        Whether the time at which the vehicle clears a crossing can be predicted.
    brakes_late
        Whether the vehicle's car-following model may brake later than SUMO's default.
    """

    vehicle: str
    loop: str
    lap_m: float
    start_m: float
    top_speed_mps: float
    rounds: tuple[Round, ...]
    edges: tuple[tuple[float, str], ...]
    legs: tuple[DrawnLeg, ...] = ()
    position: int = 0
    keeps_lane: bool = False
    renews: bool = False
    foreseen: bool = True
    brakes_late: bool = False

    @property
    def front_m(self) -> float:
        """The arc length of the front at the beginning, in the lap of its first leg [m]."""
        front_m = float(self.start_m)
        if self.legs:
            leg = self.legs[self.position]
            while front_m > leg.end_m + _ROUNDING_M:
                front_m -= self.lap_m
            while front_m < leg.begin_m - _ROUNDING_M:
                front_m += self.lap_m
        return front_m

    @property
    def renewed_on(self) -> str:
        """The edge on which the vehicle's route is renewed; empty if it drives once."""
        return self.rounds[0].edge if self.rounds else ""

    def near(self, edge: str, position_m: float, arc_m: float) -> float:
        """Return the arc length of a position on an edge, in the lap that is nearest to `arc_m` [m]."""
        arcs = [begin + position_m for begin, name in self.edges if name == edge]
        return min(
            (a + round((arc_m - a) / self.lap_m) * self.lap_m for a in arcs), key=lambda a: abs(a - arc_m)
        )

    def ahead(self, edge: str, position_m: float, arc_m: float) -> float:
        """Return the first arc length of a position on an edge at or after `arc_m` [m]."""
        arcs = (begin + position_m for begin, name in self.edges if name == edge)
        return min((arc_m + (a - arc_m) % self.lap_m for a in arcs), default=math.inf)

    def onward(self, edge: int) -> tuple[str, ...]:
        """Return the edges from index `edge` on: to the end, or to the route's renewal two rounds later."""
        names = tuple(name for _, name in self.edges)
        if not self.rounds:
            return names[edge:]
        return names[edge:] + names * 2 + names[: names.index(self.renewed_on) + 1]


def continues(leg: DrawnLeg, other: DrawnLeg) -> bool:
    """Return whether a vehicle on one leg can change to another path at `other`.

    Both legs must be the same place with the same stop line.
    """
    line, there = leg.line, other.line
    same = (line.edge, line.lane) == (there.edge, there.lane)
    return other.state == leg.state and same and abs(there.position_m - line.position_m) < _SAME_M


def make_track(
    network: RoadNetwork, way: Itinerary, *, vehicle: str = "", front_m: float = 0.0, position: int = 0
) -> Track:
    """Return the path of a vehicle.

    Parameters
    ----------
    way
        Its loop, and the states on it.
    front_m
        Arc length of its front at the beginning [m].
    position
        Index of the state in which it starts.
    """
    loop = way.loop
    return Track(
        vehicle=vehicle,
        loop=loop.id,
        lap_m=float(loop.lap_m),
        start_m=front_m,
        top_speed_mps=float(max(network.lanes[span.lane_id].speed_mps for span in loop.spans)),
        rounds=rounds(loop) if loop.closed else (),
        edges=tuple((span.begin_m, span.edge) for span in loop.roads),
        legs=way.legs,
        position=position,
        keeps_lane=way.keeps_lane,
    )


def rounds(loop: Loop) -> tuple[Round, Round]:
    """Return the edge where a loop's route is renewed and the edge after it, each with its routes."""
    here = pivot(loop)
    following = loop.edges[(here + 1) % len(loop.edges)]
    return (
        Round(loop.edges[here], f"round@{loop.id}", f"first@{loop.id}"),
        Round(following, f"onward@{loop.id}", f"second@{loop.id}"),
    )


def round_routes(loop: Loop) -> dict[str, tuple[str, ...]]:
    """Return the edges of the routes that `rounds` names."""
    here = pivot(loop)
    once = loop.edges[here:] + loop.edges[:here]
    first, second = rounds(loop)
    return {
        first.route: (*once, *once, once[0]),
        second.route: (*once[1:], *once, once[0]),
        first.alone: (first.edge,),
        second.alone: (second.edge,),
    }


def pivot(loop: Loop) -> int:
    """Return the index of the edge where a loop's route is renewed; the loop passes this edge once.

    An edge without stops is preferred: SUMO would put off a stop just ahead by one round.

    Raises
    ------
    RouteError
        If the loop passes every edge more than once.
    """
    times = Counter(loop.edges)
    once = [number for number, edge in enumerate(loop.edges) if times[edge] == 1]
    if not once:
        msg = f"loop {loop.id}: it passes every edge more than once; split it into simpler loops"
        raise RouteError(msg)
    return next((number for number in once if loop.edges[number] not in loop.stops_on), once[0])


def rounds_from(loop: Loop, edge: int) -> tuple[str, ...]:
    """Return the edges of a route that starts on edge `edge` and ends at the pivot two rounds later."""
    return loop.edges[edge:] + loop.edges * 2 + loop.edges[: pivot(loop) + 1]
