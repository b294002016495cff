"""Makes the objects of ordinary traffic (`loopgate.control.roads`) from a network."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from loopgate.abstraction.itinerary import DrawnLeg
from loopgate.control.lamps import Lamp
from loopgate.control.ordinary import lets_return
from loopgate.control.places import Leg, Vehicle
from loopgate.control.roads import Across, Approach, Lookout, RoadEdge, RoadLane, RoadStretch, RoadTurn
from loopgate.control.sight import Map, Sight
from loopgate.control.slack import Slack
from loopgate.network import RoadNetwork
from loopgate.network.loop import LanePosition
from loopgate.simulation.surroundings.crossing_ways import CrossingWays, WayOver
from loopgate.traffic.base import Traffic

__all__ = ["PROMISE", "LaidRoads"]

PROMISE = (
    "The gate rules gated vehicles only: no grant closes a circle of gated vehicles, and they leave slots "
    "free in each circle for ordinary vehicles. If there are more ordinary vehicles, they can block gated "
    "vehicles for good. Between the two kinds only SUMO's right of way rules."
)
"""The promise of the gate where there is ordinary traffic, for ``summary.json``."""


class _Path(NamedTuple):
    legs: Sequence[DrawnLeg]


class _Behind(NamedTuple):
    """The lanes between the junctions of a leg's crossing, and its lookouts by number of the pass."""

    between: list[RoadLane]
    lookouts: dict[int, Lookout]


class LaidRoads:
    """The roads of a network, the ordinary vehicles on them, and what gated vehicles look out for.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    lamp
        Returns a light by name.
    everywhere
        Whether a share of each place is kept for ordinary vehicles, wherever they are.
    """

    def __init__(
        self,
        network: RoadNetwork,
        traffic: Traffic,
        lamp: Callable[[str], Lamp],
        *,
        everywhere: bool = False,
    ) -> None:
        self._find, self._lamp, self._step_s = CrossingWays(network), lamp, traffic.step_s
        self.map = map_of(network)
        self.sight = Sight(self.map, traffic)
        self.slack = Slack(everywhere=everywhere)
        self._known: dict[tuple[LanePosition, tuple[str, ...]], _Behind] = {}

    def add(self, path: Sequence[Leg], way: Sequence[DrawnLeg]) -> None:
        """Add positions on the road, and the checks before each crossing, to the legs of a path."""
        drawn = _Path(way)
        for position, leg in enumerate(path):
            place = self._find.place(drawn, position)
            behind = self._behind(drawn, position)
            if place.lane in self.map.lanes:
                leg.stretch = RoadStretch(
                    self.map.lanes[place.lane],
                    float(place.begin_m),
                    float(place.end_m),
                    [self.map.lanes[lane] for lane in place.into],
                    behind.between,
                    is_away=way[position].away,
                )
            for number, lookout in behind.lookouts.items():
                leg.passes[number].lookout = lookout
        self.slack.know(path)

    def has_room(self, vehicle: Vehicle) -> bool:
        """Return whether ordinary vehicles leave a parked vehicle space to return, and can brake for it."""
        if not self.sight.others:
            return True
        return self.slack.has_room(vehicle) and lets_return(vehicle, self._step_s)

    def report(self) -> dict[str, Any]:
        """Return the figures of ordinary traffic for ``summary.json``."""
        return {"others": {"vehicles": self.sight.met, "promise": PROMISE}}

    def _behind(self, way: _Path, position: int) -> _Behind:
        """Return the lanes and lookouts after a leg; legs that end before the same crossing share them."""
        leg = way.legs[position]
        key = leg.line, tuple(crossing.id for crossing in leg.crossings)
        if key not in self._known:
            found = self._find.way(way, position)
            known = [number for number, c in enumerate(leg.crossings) if self._find.knows(c.id)]
            lookouts = {
                number: self._lookout(movement, first=number == known[0])
                for number, movement in zip(known, found.movements, strict=True)
            }
            self._known[key] = _Behind([self.map.lanes[lane] for lane in found.between], lookouts)
        return self._known[key]

    def _lookout(self, movement: WayOver, *, first: bool) -> Lookout:
        lanes, turns = self.map.lanes, self.map.turns
        across = [
            Across(lanes[lane], float(movement.past_m.get(lane, math.inf)), unseen=lane in movement.unseen)
            for lane in movement.across
        ]
        approaches = []
        for one in movement.approaches:
            turn, light = turns[one.from_edge, one.to_edge], one.signal
            approaches.append(Approach(turn, self._lamp(light[0]), light[1]) if light else Approach(turn))
        return Lookout(
            across,
            approaches,
            float(movement.from_m),
            float(movement.length_m),
            float(movement.speed_mps),
            float(movement.wait_m),
            waits_in_way=movement.waits_in_way,
            first=first,
        )


def map_of(network: RoadNetwork) -> Map:
    """Return the roads of a network as objects."""
    edges = {
        name: RoadEdge(max(one.length_m for one in edge.lanes), max(one.speed_mps for one in edge.lanes))
        for name, edge in network.edges.items()
    }
    turns: dict[tuple[str, str], RoadTurn] = {}
    for c in network.connections:
        through_m = sum(network.lanes[lane].length_m for lane in c.via)
        turns[c.from_edge, c.to_edge] = RoadTurn(float(through_m))
    found = Map({}, edges, turns)
    lanes = found.lanes
    for name, drawn in network.lanes.items():
        edge = edges.get(drawn.edge, found.nowhere)
        lanes[name] = RoadLane(name, edge, drawn.length_m, drawn.speed_mps, inside=drawn.internal)
    for c in network.connections:
        way = [lanes[f"{c.from_edge}_{c.from_lane}"], *(lanes[lane] for lane in c.via)]
        end = lanes[f"{c.to_edge}_{c.to_lane}"]
        for lane in way:
            lane.ahead[edges[c.to_edge]] = end
        for before, lane in pairwise(way):
            lane.behind[None] = before
        end.behind[edges[c.from_edge]] = way[-1]
    return found
