"""A vehicle's way: its loop in arc length, with what the simulation watches along it."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

from loopgate.abstraction.itinerary import Itinerary, Leg
from loopgate.errors import RouteError
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork

__all__ = ["Round", "Track", "continues", "make_track", "pivot", "round_routes", "rounds", "rounds_from"]


_ROUNDING_M = 1e-6
_SAME_M = 0.1


class Round(NamedTuple):
    """An edge, the name of the route that begins with it, and of the one that is that edge alone."""

    edge: str
    route: str
    alone: str


@dataclass(frozen=True, slots=True)
class Track:
    """One vehicle on its loop.

    Attributes
    ----------
    vehicle, loop
        Names.
    lap_m
        Length of the loop [m]; more than anybody drives where there is but one lap.
    start_m
        Arc length of the front at the beginning [m].
    top_speed_mps
        Highest speed limit on the loop [m/s].
    rounds
        From the edge on which SUMO renews the vehicle's route, and from the edge after it; none where the
        route is driven once.
    edges
        Arc length at which each edge begins [m], ascending, and its name.
    legs
        Its states by position, as the abstraction has them; none for vehicles under no gate.
    start_position
        Position of the state it starts in.
    keeps_lane
        Whether it changes lanes only where a guide says so.
    renews
        Whether its route is to be renewed by the drive, since the simulator does not do so by itself.
    """

    vehicle: str
    loop: str
    lap_m: float
    start_m: float
    top_speed_mps: float
    rounds: tuple[Round, ...]
    edges: tuple[tuple[float, str], ...]
    legs: tuple[Leg, ...] = ()
    start_position: int = 0
    keeps_lane: bool = False
    renews: bool = False

    @property
    def front_m(self) -> float:
        """Where the front is at the beginning, in arc length of the lap in which its first leg lies [m]."""
        front_m = self.start_m
        if self.legs:
            leg = self.legs[self.start_position]
            while front_m > leg.end_m + _ROUNDING_M:
                front_m -= self.lap_m
            while front_m < leg.begin_m - _ROUNDING_M:
                front_m += self.lap_m
        return front_m

    @property
    def rerouted_on(self) -> str:
        """The edge on which SUMO renews the vehicle's route; empty where it is driven once."""
        return self.rounds[0].edge if self.rounds else ""

    def near(self, edge: str, position_m: float, arc_m: float) -> float:
        """Return the arc length of a position on an edge, of all laps that nearest to another arc [m]."""
        arcs = [begin + position_m for begin, name in self.edges if name == edge]
        return min(
            (a + round((arc_m - a) / self.lap_m) * self.lap_m for a in arcs), key=lambda a: abs(a - arc_m)
        )

    def ahead(self, edge: str, position_m: float, arc_m: float) -> float:
        """Return the first arc length of a position on an edge that is not before another arc [m]."""
        arcs = (begin + position_m for begin, name in self.edges if name == edge)
        return min((arc_m + (a - arc_m) % self.lap_m for a in arcs), default=math.inf)

    def onward(self, edge: int) -> tuple[str, ...]:
        """Return the edges from one on, by number: to the end, or to the renewal two rounds later."""
        names = tuple(name for _, name in self.edges)
        if not self.rounds:
            return names[edge:]
        return names[edge:] + names * 2 + names[: names.index(self.rerouted_on) + 1]

    @property
    def first_edge(self) -> str:
        """The edge on which the front stands at the beginning."""
        begins = [begin for begin, _ in self.edges]
        return self.edges[bisect_right(begins, self.start_m % self.lap_m) - 1][1]


def continues(leg: Leg, other: Leg) -> bool:
    """Return whether a vehicle in the place of a leg can go on by a way on which another leg is its place.

    It is the same place, with the same stop line.
    """
    line, there = leg.line, other.line
    same = (line.edge, line.lane) == (there.edge, there.lane)
    return other.state == leg.state and same and abs(there.position_m - line.position_m) < _SAME_M


def make_track(
    network: RoadNetwork, way: Itinerary, *, vehicle: str = "", front_m: float = 0.0, position: int = 0
) -> Track:
    """Return the track of a vehicle.

    Parameters
    ----------
    way
        Its loop, and its states there.
    front_m
        Arc length of its front at the beginning [m].
    position
        The position on the way in which it starts.
    """
    loop = way.loop
    return Track(
        vehicle=vehicle,
        loop=loop.id,
        lap_m=loop.lap_m,
        start_m=front_m,
        top_speed_mps=max(network.lanes[span.lane_id].speed_mps for span in loop.spans),
        rounds=rounds(loop) if loop.closed else (),
        edges=tuple((span.begin_m, span.edge) for span in loop.roads),
        legs=way.legs,
        start_position=position,
        keeps_lane=way.keeps_lane,
    )


def rounds(loop: Loop) -> tuple[Round, Round]:
    """Return the two rounds from the pivot, and what is left of them from the edge after it."""
    here = pivot(loop)
    following = loop.edges[(here + 1) % len(loop.edges)]
    return (
        Round(loop.edges[here], f"round@{loop.id}", f"first@{loop.id}"),
        Round(following, f"onward@{loop.id}", f"second@{loop.id}"),
    )


def round_routes(loop: Loop) -> dict[str, tuple[str, ...]]:
    """Return the edges of the routes of `rounds`, by name."""
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
    """Return the number of the edge where a loop's route is renewed: one that it passes only once.

    If there is a choice nobody stops there: SUMO puts a stop off for a round that lies just ahead then.

    Raises
    ------
    RouteError
        If there is none.
    """
    times = Counter(loop.edges)
    once = [number for number, edge in enumerate(loop.edges) if times[edge] == 1]
    if not once:
        msg = f"loop {loop.id}: it passes every edge more than once; split it into simpler loops"
        raise RouteError(msg)
    return next((number for number in once if loop.edges[number] not in loop.stops_on), once[0])


def rounds_from(loop: Loop, edge: int) -> tuple[str, ...]:
    """Return the edges of the route of who begins on an edge, by number: to the pivot, two rounds later."""
    return loop.edges[edge:] + loop.edges * 2 + loop.edges[: pivot(loop) + 1]
