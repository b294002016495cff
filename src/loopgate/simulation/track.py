"""A vehicle's way: its loop in arc length, with what the simulation watches along it."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple

from loopgate.abstraction.itinerary import Pin

__all__ = ["Round", "StopLine", "Track"]


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
        Length of the loop [m].
    start_m
        Arc length of the front at the beginning [m].
    top_speed_mps
        Highest speed limit on the loop [m/s].
    rounds
        From the edge on which SUMO renews the vehicle's route, and from the edge after it.
    edges
        Arc length at which each edge begins [m], ascending, and its name.
    states
        Names of the states by position; empty for vehicles under no gate.
    ends_m, begins_m
        Where each state ends and begins, in arc length [m]; see `loopgate.abstraction.itinerary.Leg`.
    stop_lines
        Where to hold the vehicle at the end of each state.
    pins
        What keeps the vehicle to its lanes behind each state; see `loopgate.simulation.steering`.
    start_position
        Position of the state it starts in.
    keeps_lane
        Whether it changes lanes only where a pin says so.
    """

    vehicle: str
    loop: str
    lap_m: float
    start_m: float
    top_speed_mps: float
    rounds: tuple[Round, Round]
    edges: tuple[tuple[float, str], ...]
    states: tuple[str, ...] = ()
    ends_m: tuple[float, ...] = ()
    begins_m: tuple[float, ...] = ()
    stop_lines: tuple[StopLine, ...] = ()
    pins: tuple[tuple[Pin, ...], ...] = ()
    start_position: int = 0
    keeps_lane: bool = False

    @property
    def rerouted_on(self) -> str:
        """The edge on which SUMO renews the vehicle's route."""
        return self.rounds[0].edge

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
