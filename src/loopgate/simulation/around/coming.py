"""When ordinary vehicles get to the junctions on their routes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

from loopgate.drive.motion import time_s
from loopgate.drive.sense import STANDING_MPS
from loopgate.network import RoadNetwork
from loopgate.simulation.around.sight import Seen, Sight

__all__ = ["Arrival", "Coming"]

_HORIZON_S = 20.0
"""Nobody looks farther ahead [s]: by then who sets out now is over any junction."""

_REACTS_S = 1.0
"""SUMO's drivers brake so late [s]."""

_AT_LINE_M = 30.0
"""So far before a junction a vehicle may stand that is the first at its line [m], or in the queue behind."""

_NO_ROAD = math.inf, 0.0
"""Of what is no road, as a connector, length [m] and speed limit [m/s]: nobody looks beyond it."""

_ROUNDING_M = 1.0

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
        """Length [m] and speed limit [m/s]."""
        self._routes: dict[str, tuple[tuple[str, ...], Sequence[float]]] = {}
        """Edges, and where they end on the way from the first [m]."""
        self._over: dict[_Between, set[tuple[str, int]]] = {}
        """Vehicles whose routes lead over a junction, passed or not, and behind which of their edges."""
        self._seen: dict[str, tuple[int, Seen]] = {}
        """All vehicles by name, each with its number."""
        self._arrivals: dict[str, Sequence[Arrival]] = {}
        """Of those asked for in this step, at the junctions before them, one by one."""

    def look(self) -> None:
        """See where they are; once a step, before it is asked who comes."""
        self._seen = {one.vehicle: (number, one) for number, one in enumerate(self._sight.seen)}
        self._arrivals.clear()
        for one in self._sight.turned:
            if self._comes(one):
                self._sight.route(one)
        for vehicle, edges in self._sight.led.items():
            self._forget(vehicle)
            self._note(vehicle, edges)
        self._sight.led.clear()
        for vehicle in self._routes.keys() - self._sight.kinds.keys():
            self._forget(vehicle)

    def arrivals(self, from_edge: str, to_edge: str) -> Sequence[Arrival]:
        """Return who comes to a junction, by the edges before and behind it."""
        over = self._over.get((from_edge, to_edge))
        if not over:
            return ()
        top = self._roads.get(from_edge, _NO_ROAD)[1]
        found = []
        for vehicle, edge in over:
            number, one = self._seen.get(vehicle, (0, None))
            if one is not None and self._comes(one):
                at = self._sight.route(one)[1] + one.lane.startswith(":")
                if edge >= at and self._is_near(one, at, edge, top):
                    found += [(number, edge, arrival) for arrival in self._of(one, at)[edge - at :][:1]]
        return [arrival for _, _, arrival in sorted(found)]

    def _comes(self, one: Seen) -> bool:
        """Return whether a vehicle drives, or stands near its line."""
        if one.speed_mps > STANDING_MPS:
            return True
        return not one.lane.startswith(":") and self._left_m(one) <= _AT_LINE_M

    def _note(self, vehicle: str, edges: tuple[str, ...]) -> None:
        self._routes[vehicle] = edges, [*accumulate(map(self._behind_m, edges, edges[1:]), initial=0.0)]
        for number, between in enumerate(pairwise(edges)):
            self._over.setdefault(between, set()).add((vehicle, number))

    def _forget(self, vehicle: str) -> None:
        edges, _ = self._routes.pop(vehicle, ((), ()))
        for number, between in enumerate(pairwise(edges)):
            self._over[between].discard((vehicle, number))

    def _behind_m(self, from_edge: str, to_edge: str) -> float:
        """Return how far it is from the end of an edge to that of the next [m]."""
        return self._through_m.get((from_edge, to_edge), 0.0) + self._roads.get(to_edge, _NO_ROAD)[0]

    def _is_near(self, one: Seen, at: int, edge: int, top_mps: float) -> bool:
        """Return whether an edge may end within the horizon, at the top speed there; it comes from `at`."""
        ends_m = self._routes[one.vehicle][1]
        far_m = _HORIZON_S * max(one.speed_mps, top_mps) + _ROUNDING_M
        return not ends_m[edge] - ends_m[at] > far_m  # which is no number behind what is no road

    def _left_m(self, one: Seen) -> float:
        return self._network.lanes[one.lane].length_m - one.position_m

    def _of(self, one: Seen, at: int) -> Sequence[Arrival]:
        """Return when a vehicle comes to the junctions before it: behind that edge of its route, and on."""
        if one.vehicle not in self._arrivals:
            stands = one.speed_mps <= STANDING_MPS
            self._arrivals[one.vehicle] = (self._standing(one),) if stands else [*self._driving(one, at)]
        return self._arrivals[one.vehicle]

    def _driving(self, one: Seen, at: int) -> Iterator[Arrival]:
        edges = self._sight.route(one)[0]
        speed, left_m, kind = one.speed_mps, self._left_m(one), self._sight.kinds[one.vehicle]
        if one.lane.startswith(":"):
            left_m += self._roads.get(edges[at], _NO_ROAD)[0] if at < len(edges) else math.inf
        accel, stops_m = kind.accel_mps2, _REACTS_S * speed + speed**2 / (2 * kind.decel_mps2)
        for between in pairwise(edges[at:]):
            top = self._roads.get(between[0], _NO_ROAD)[1]
            first_s = time_s(left_m, speed, accel, max(speed, top))
            if first_s > _HORIZON_S:
                return
            yield Arrival(first_s, left_m / speed, near=left_m < stops_m)
            left_m += self._behind_m(*between)

    def _standing(self, one: Seen) -> Arrival:
        top = self._network.lanes[one.lane].speed_mps
        first_s = time_s(self._left_m(one), 0.0, self._sight.kinds[one.vehicle].accel_mps2, top)
        return Arrival(first_s, math.inf, one.vehicle)
