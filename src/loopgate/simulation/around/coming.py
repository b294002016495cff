"""When ordinary vehicles get to the junctions on their routes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
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
        self._fastest_mps = max((limit_mps for _, limit_mps in self._roads.values()), default=0.0)
        """Nobody has driven faster so far [m/s]."""
        self._ahead: dict[str, tuple[str, Sequence[_Between]]] = {}
        """On which lane vehicles were, and which junctions they may get to from there within the horizon."""
        self._over: dict[_Between, set[tuple[str, int]]] = {}
        """The vehicles that have a junction before them, and as which one of theirs."""
        self._numbers: dict[str, int] = {}
        """Where the vehicles are among those in sight, by name."""
        self._arrivals: dict[str, Sequence[Arrival]] = {}
        """Of those asked for in this step, at the junctions before them, one by one."""

    def look(self) -> None:
        """See where they are; once a step, before it is asked who comes."""
        seen = self._sight.seen
        for one in self._sight.turned:
            if self._comes(one):
                self._sight.route(one)
        gone = {*self._sight.led, *(self._ahead.keys() - self._sight.kinds.keys())}
        self._sight.led.clear()
        fastest_mps = max((one.speed_mps for one in seen), default=0.0)
        if fastest_mps > self._fastest_mps:
            self._fastest_mps = fastest_mps
            gone |= self._ahead.keys()
        for vehicle in gone:
            self._forget(vehicle)
        self._arrivals.clear()
        self._numbers = {one.vehicle: number for number, one in enumerate(seen)}
        for one in seen:
            known = self._ahead.get(one.vehicle)
            if (known is None or known[0] != one.lane) and self._comes(one):
                self._note(one)

    def expects(self, junctions: Iterable[_Between]) -> bool:
        """Return whether anybody may come to one of some junctions."""
        return not self._over.keys().isdisjoint(junctions)

    def arrivals(self, from_edge: str, to_edge: str) -> Sequence[Arrival]:
        """Return who comes to a junction, by the edges before and behind it."""
        over = self._over.get((from_edge, to_edge))
        if not over:
            return ()
        found = []
        for vehicle, which in over:
            number = self._numbers.get(vehicle)
            if number is not None and self._comes(one := self._sight.seen[number]):
                found += [(number, which, arrival) for arrival in self._of(one)[which : which + 1]]
        return [arrival for _, _, arrival in sorted(found)]

    def _comes(self, one: Seen) -> bool:
        """Return whether a vehicle drives, or stands near its line."""
        if one.speed_mps > STANDING_MPS:
            return True
        return not one.lane.startswith(":") and self._left_m(one) <= _AT_LINE_M

    def _note(self, one: Seen) -> None:
        """Take note of the junctions before a vehicle, as long as it is on its lane."""
        self._forget(one.vehicle)
        ahead: list[_Between] = []
        left_m = _HORIZON_S * self._fastest_mps
        for between in pairwise(self._way(one)):
            self._over.setdefault(between, set()).add((one.vehicle, len(ahead)))
            ahead.append(between)
            left_m -= self._behind_m(*between)
            if left_m < 0.0:
                break
        self._ahead[one.vehicle] = one.lane, ahead

    def _forget(self, vehicle: str) -> None:
        _, ahead = self._ahead.pop(vehicle, ("", ()))
        for which, between in enumerate(ahead):
            self._over[between].discard((vehicle, which))
            if not self._over[between]:
                del self._over[between]

    def _way(self, one: Seen) -> Sequence[str]:
        """Return the edges of a vehicle's route from the one on that it is on, or that is before it."""
        edges, at = self._sight.route(one)
        return edges[at + one.lane.startswith(":") :]

    def _behind_m(self, from_edge: str, to_edge: str) -> float:
        """Return how far it is from the end of an edge to that of the next [m]."""
        return self._through_m.get((from_edge, to_edge), 0.0) + self._roads.get(to_edge, _NO_ROAD)[0]

    def _left_m(self, one: Seen) -> float:
        return self._network.lanes[one.lane].length_m - one.position_m

    def _of(self, one: Seen) -> Sequence[Arrival]:
        """Return when a vehicle comes to the junctions before it, one by one."""
        if one.vehicle not in self._arrivals:
            stands = one.speed_mps <= STANDING_MPS
            self._arrivals[one.vehicle] = (self._standing(one),) if stands else [*self._driving(one)]
        return self._arrivals[one.vehicle]

    def _driving(self, one: Seen) -> Iterator[Arrival]:
        edges = self._way(one)
        speed, left_m, kind = one.speed_mps, self._left_m(one), self._sight.kinds[one.vehicle]
        if one.lane.startswith(":"):
            left_m += self._roads.get(edges[0], _NO_ROAD)[0] if edges else math.inf
        accel, stops_m = kind.accel_mps2, _REACTS_S * speed + speed**2 / (2 * kind.decel_mps2)
        for between in pairwise(edges):
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
