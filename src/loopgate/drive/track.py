"""A vehicle's way: its loop in arc length, with what the simulation watches along it."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple

from loopgate.abstraction.itinerary import Leg

__all__ = ["Round", "StopLine", "Track"]


_ROUNDING_M = 1e-6


@dataclass(frozen=True, slots=True)
class StopLine:
    """Where a vehicle that is refused comes to rest: a position [m] on a lane."""

    edge: str
    lane_index: int
    position_m: float


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
    stop_lines
        Where to hold the vehicle at the end of each leg.
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
    stop_lines: tuple[StopLine, ...] = ()
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

    @property
    def first_edge(self) -> str:
        """The edge on which the front stands at the beginning."""
        begins = [begin for begin, _ in self.edges]
        return self.edges[bisect_right(begins, self.start_m % self.lap_m) - 1][1]
