"""When ordinary vehicles get to the junctions on their routes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from loopgate.drive.motion import time_s
from loopgate.network import RoadNetwork
from loopgate.simulation.sight import Seen, Sight

__all__ = ["Arrival", "Coming"]

_HORIZON_S = 20.0
"""Nobody looks farther ahead [s]: by then who sets out now is over any junction."""

_STANDING_MPS = 0.1

_REACTS_S = 1.0
"""SUMO's drivers brake so late [s]."""

_AT_LINE_M = 30.0
"""So far before a junction a vehicle may stand that is the first at its line [m], or in the queue behind."""

_NO_ROAD = math.inf, 0.0

_Between = tuple[str, str]
"""The edges before and behind a junction."""


class Arrival(NamedTuple):
    """When a vehicle gets to a junction, from now on [s]: gaining speed as it can, or as fast as now.

    One that stands at its line, or near it, may set out, or never: then `stands` is its name. One that is
    `near` cannot stop before the junction any more.
    """

    first_s: float
    last_s: float
    stands: str = ""
    near: bool = False


class _Comer(NamedTuple):
    """A vehicle that may come to a junction, the how manieth it was seen, and its route."""

    number: int
    seen: Seen
    edges: tuple[str, ...]
    at: int


class Coming:
    """The junctions that ordinary vehicles come to within some time, by their routes.

    Of vehicles that stand, those that are not near the line of a junction are left out: they may wait for
    anything. O(vehicles) in a step in which it is asked; times are worked out where somebody asks for them.

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
        self._roads = {
            edge.id: (max(lane.length_m for lane in edge.lanes), max(lane.speed_mps for lane in edge.lanes))
            for edge in network.edges.values()
        }
        """Length [m] and speed limit [m/s]; there are none of what is no road: nobody looks beyond it."""
        self._routes: dict[str, tuple[str, ...]] = {}
        self._over: dict[_Between, set[str]] = {}
        """Whose routes lead over a junction, passed or not."""
        self._comers: dict[str, _Comer] = {}
        self._arrivals: dict[str, list[tuple[_Between, Arrival]]] = {}
        """Of those asked for in this step."""

    def look(self) -> None:
        """See who drives, or is near a line; once a step, before it is asked."""
        comers: dict[str, _Comer] = {}
        for number, one in enumerate(self._sight.seen):
            if one.speed_mps > _STANDING_MPS or self._is_at_line(one):
                edges, at = self._sight.route(one)
                comers[one.vehicle] = _Comer(number, one, edges, at)
                if self._routes.get(one.vehicle) is not edges:
                    self._forget(one.vehicle)
                    self._note(one.vehicle, edges)
        for vehicle in self._routes.keys() - self._sight.kinds.keys():
            self._forget(vehicle)
        self._comers = comers
        self._arrivals.clear()

    def arrivals(self, from_edge: str, to_edge: str) -> Sequence[Arrival]:
        """Return who comes to a junction, by the edges before and behind it."""
        between = from_edge, to_edge
        over = self._over.get(between)
        if not over:
            return ()
        found = [
            (comer.number, arrival)
            for vehicle in over
            if (comer := self._comers.get(vehicle)) is not None
            for passes, arrival in self._of(comer)
            if passes == between
        ]
        return [arrival for _, arrival in sorted(found, key=lambda one: one[0])]

    def _note(self, vehicle: str, edges: tuple[str, ...]) -> None:
        self._routes[vehicle] = edges
        for between in pairwise(edges):
            self._over.setdefault(between, set()).add(vehicle)

    def _forget(self, vehicle: str) -> None:
        for between in pairwise(self._routes.pop(vehicle, ())):
            self._over[between].discard(vehicle)

    def _is_at_line(self, one: Seen) -> bool:
        return self._left_m(one) <= _AT_LINE_M and not one.lane.startswith(":")

    def _left_m(self, one: Seen) -> float:
        return self._network.lanes[one.lane].length_m - one.position_m

    def _of(self, comer: _Comer) -> Sequence[tuple[_Between, Arrival]]:
        """Return when a vehicle comes to which junctions."""
        vehicle = comer.seen.vehicle
        if vehicle not in self._arrivals:
            stands = comer.seen.speed_mps <= _STANDING_MPS
            self._arrivals[vehicle] = [*(self._standing(comer) if stands else self._driving(comer))]
        return self._arrivals[vehicle]

    def _driving(self, comer: _Comer) -> Iterator[tuple[_Between, Arrival]]:
        _, one, edges, at = comer
        speed, left_m, kind = one.speed_mps, self._left_m(one), self._sight.kinds[one.vehicle]
        if one.lane.startswith(":"):
            at += 1
            left_m += self._roads.get(edges[at], _NO_ROAD)[0] if at < len(edges) else math.inf
        accel, stops_m = kind.accel_mps2, _REACTS_S * speed + speed**2 / (2 * kind.decel_mps2)
        for between in pairwise(edges[at:]):
            top = self._roads.get(between[0], _NO_ROAD)[1]
            first_s = time_s(left_m, speed, accel, max(speed, top))
            if first_s > _HORIZON_S:
                return
            yield between, Arrival(first_s, left_m / speed, near=left_m < stops_m)
            left_m += self._through_m.get(between, 0.0) + self._roads.get(between[1], _NO_ROAD)[0]

    def _standing(self, comer: _Comer) -> Iterator[tuple[_Between, Arrival]]:
        _, one, edges, at = comer
        if at + 1 < len(edges):
            top = self._network.lanes[one.lane].speed_mps
            first_s = time_s(self._left_m(one), 0.0, self._sight.kinds[one.vehicle].accel_mps2, top)
            yield (edges[at], edges[at + 1]), Arrival(first_s, math.inf, one.vehicle)
