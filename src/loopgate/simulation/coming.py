"""When ordinary vehicles get to the junctions on their routes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from loopgate.drive.motion import time_s
from loopgate.network import RoadNetwork
from loopgate.network.records import Lane
from loopgate.traffic.base import Dynamics, Traffic

_Route = tuple[tuple[str, ...], int]
"""The edges of a vehicle's route, and the number of the one that it is on or has just left."""

_Known = tuple[tuple[str, ...], int, float]
"""The same, and until when it is taken to be so [s]."""

__all__ = ["Arrival", "Coming", "Seen"]

_HORIZON_S = 20.0
"""Nobody looks farther ahead [s]: by then who sets out now is over any junction."""

_STANDING_MPS = 0.1

_AGAIN_S = 5.0
"""So long a route is taken to be as it was [s]: SUMO may lead vehicles another way."""


class Seen(NamedTuple):
    """A vehicle, the lane and the position of its front on it [m], and its length [m]."""

    vehicle: str
    lane: str
    position_m: float
    length_m: float


class Arrival(NamedTuple):
    """When a vehicle gets to a junction, from now on [s]: gaining speed as it can, or as fast as now."""

    first_s: float
    last_s: float


class Coming:
    """The junctions that ordinary vehicles come to within some time, by their routes.

    Vehicles that stand are left out: they may wait for anything. O(vehicles) in a step in which it is asked.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    """

    def __init__(self, network: RoadNetwork, traffic: Traffic) -> None:
        self._network, self._traffic = network, traffic
        self._routes: dict[str, _Known] = {}
        self._through_m = {
            (c.from_edge, c.to_edge): sum(network.lanes[lane].length_m for lane in c.via)
            for c in network.connections
        }

    def arrivals(
        self, vehicles: Mapping[str, Dynamics], seen: Iterable[Seen]
    ) -> dict[tuple[str, str], list[Arrival]]:
        """Return who comes, by the edges before and behind a junction.

        Parameters
        ----------
        vehicles
            What they can do, by name.
        seen
            Where they are.
        """
        found: dict[tuple[str, str], list[Arrival]] = {}
        known, self._routes = self._routes, {}
        for one in seen:
            speed = self._traffic.speed(one.vehicle)
            if speed <= _STANDING_MPS:
                if one.vehicle in known:
                    self._routes[one.vehicle] = known[one.vehicle]
                continue
            edges, at = self._route(one, known.get(one.vehicle))
            left_m = self._network.lanes[one.lane].length_m - one.position_m
            if one.lane.startswith(":"):
                at += 1
                left_m += self._edge_m(edges[at]) if at < len(edges) else math.inf
            accel = vehicles[one.vehicle].accel_mps2
            while at + 1 < len(edges):
                top = max((lane.speed_mps for lane in self._lanes(edges[at])), default=speed)
                first_s = time_s(left_m, speed, accel, max(speed, top))
                if first_s > _HORIZON_S:
                    break
                pair = edges[at], edges[at + 1]
                found.setdefault(pair, []).append(Arrival(first_s, left_m / speed))
                left_m += self._through_m.get(pair, 0.0) + self._edge_m(edges[at + 1])
                at += 1
        return found

    def _edge_m(self, edge: str) -> float:
        return max((lane.length_m for lane in self._lanes(edge)), default=math.inf)

    def _lanes(self, edge: str) -> tuple[Lane, ...]:
        """Return the lanes of a road; none of what is no road, as a connector: nobody looks beyond it."""
        return self._network.edges[edge].lanes if edge in self._network.edges else ()

    def _route(self, one: Seen, known: _Known | None) -> _Route:
        now = self._traffic.now_s
        if known is not None and now < known[2]:
            edges, at, until_s = known
            edge = one.lane.rpartition("_")[0]
            if one.lane.startswith(":") or edges[at] == edge:
                self._routes[one.vehicle] = known
                return edges, at
            if at + 1 < len(edges) and edges[at + 1] == edge:
                self._routes[one.vehicle] = edges, at + 1, until_s
                return edges, at + 1
        route, at = self._traffic.route(one.vehicle)
        self._routes[one.vehicle] = tuple(route), at, now + _AGAIN_S
        return tuple(route), at
