"""The path of one vehicle: its loop in arc length, its states, and its routes in SUMO."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

from loopgate.abstraction.itinerary import DrawnLeg, Itinerary
from loopgate.errors import RouteError
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork

__all__ = ["Round", "Track", "continues", "make_track", "pivot", "round_routes", "rounds", "rounds_from"]


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
