"""When ordinary vehicles get to the junctions on their routes."""

from __future__ import annotations

import math
from typing import NamedTuple

from loopgate.drive.motion import time_s
from loopgate.network import RoadNetwork
from loopgate.network.records import Lane
from loopgate.simulation.sight import Seen, Sight

__all__ = ["Arrival", "Coming"]

_HORIZON_S = 20.0
"""Nobody looks farther ahead [s]: by then who sets out now is over any junction."""

_STANDING_MPS = 0.1

_REACTS_S = 1.0
"""SUMO's drivers brake so late [s]."""

_AT_LINE_M = 30.0
"""So far before a junction a vehicle may stand that is the first at its line [m], or in the queue behind."""


class Arrival(NamedTuple):
    """When a vehicle gets to a junction, from now on [s]: gaining speed as it can, or as fast as now.

    One that stands at its line, or near it, may set out, or never: then `stands` is its name. One that is
    `near` cannot stop before the junction any more.
    """

    first_s: float
    last_s: float
    stands: str = ""
    near: bool = False


class Coming:
    """The junctions that ordinary vehicles come to within some time, by their routes.

    Of vehicles that stand, those that are not near the line of a junction are left out: they may wait for
    anything. O(vehicles) in a step in which it is asked.

    Parameters
    ----------
    network, sight
        The roads, and where the ordinary vehicles are.
    """

    def __init__(self, network: RoadNetwork, sight: Sight) -> None:
        self._network, self._sight = network, sight
        self._through_m = {
            (c.from_edge, c.to_edge): sum(network.lanes[lane].length_m for lane in c.via)
            for c in network.connections
        }

    def arrivals(self) -> dict[tuple[str, str], list[Arrival]]:
        """Return who comes, by the edges before and behind a junction."""
        found: dict[tuple[str, str], list[Arrival]] = {}
        for one in (seen for lane in self._sight.on.values() for seen in lane):
            speed = self._sight.speed(one)
            left_m = self._network.lanes[one.lane].length_m - one.position_m
            if speed <= _STANDING_MPS:
                if left_m <= _AT_LINE_M and not one.lane.startswith(":"):
                    self._note_standing(one, left_m, found)
                continue
            edges, at = self._sight.route(one)
            if one.lane.startswith(":"):
                at += 1
                left_m += self._edge_m(edges[at]) if at < len(edges) else math.inf
            kind = self._sight.kinds[one.vehicle]
            accel, stops_m = kind.accel_mps2, _REACTS_S * speed + speed**2 / (2 * kind.decel_mps2)
            while at + 1 < len(edges):
                top = max((lane.speed_mps for lane in self._lanes(edges[at])), default=speed)
                first_s = time_s(left_m, speed, accel, max(speed, top))
                if first_s > _HORIZON_S:
                    break
                pair = edges[at], edges[at + 1]
                found.setdefault(pair, []).append(Arrival(first_s, left_m / speed, near=left_m < stops_m))
                left_m += self._through_m.get(pair, 0.0) + self._edge_m(edges[at + 1])
                at += 1
        return found

    def _note_standing(self, one: Seen, left_m: float, found: dict[tuple[str, str], list[Arrival]]) -> None:
        edges, at = self._sight.route(one)
        if at + 1 < len(edges):
            top = self._network.lanes[one.lane].speed_mps
            first_s = time_s(left_m, 0.0, self._sight.kinds[one.vehicle].accel_mps2, top)
            arrival = Arrival(first_s, math.inf, one.vehicle)
            found.setdefault((edges[at], edges[at + 1]), []).append(arrival)

    def _edge_m(self, edge: str) -> float:
        return max((lane.length_m for lane in self._lanes(edge)), default=math.inf)

    def _lanes(self, edge: str) -> tuple[Lane, ...]:
        """Return the lanes of a road; none of what is no road, as a connector: nobody looks beyond it."""
        return self._network.edges[edge].lanes if edge in self._network.edges else ()
