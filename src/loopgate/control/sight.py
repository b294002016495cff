"""Reads where ordinary vehicles are after each step: lane, front and rear, and the turns they come to.

A vehicle is listed anew when it comes to another lane. The rules compute when it gets to a turn.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from math import inf
from typing import Final

from loopgate.control.places import STANDING_MPS
from loopgate.control.roads import Coming, Other, Rear, RoadEdge, RoadLane, RoadTurn
from loopgate.traffic.base import Traffic

HORIZON_S: Final = 20.0
"""The rules look no farther ahead [s]: a vehicle that sets out now is over any junction by then."""

AHEAD: Final = 5
"""An ordinary vehicle is about to come to an edge that is among this many next edges of its route."""

_AGAIN_S: Final = 5.0
"""A route is read again after this time, since SUMO may reroute vehicles [s]."""


class Map:
    """The roads by name: lanes, edges, and turns by the edges before and after them.

    `nowhere`: stands for every edge that is no road, such as a connector; nothing beyond it is looked at.
    """

    def __init__(
        self, lanes: dict[str, RoadLane], edges: dict[str, RoadEdge], turns: dict[tuple[str, str], RoadTurn]
    ) -> None:
        self.lanes: Final = lanes
        self.edges: Final = edges
        self.turns: Final = turns
        self.nowhere: Final = RoadEdge(inf, 0.0)


class Sight:
    """All ordinary vehicles on the road, as they were after the last step."""

    def __init__(self, roads: Map, traffic: Traffic) -> None:
        self.roads: Final = roads
        self._traffic: Final = traffic
        self.others: dict[str, Other] = {}
        """The ordinary vehicles on the road, by name."""
        self.met = 0
        """Number of ordinary vehicles seen so far."""
        self._reads_all = False
        self._everybody: Sequence[str] = ()
        self._gated = -1
        self._in_order: list[Other] = []
        self._names: list[str] = []
        self._rows: list[int] = []
        """Index of each ordinary vehicle among the vehicles that are read."""
        self._used: list[RoadLane] = []
        """Lanes with rears on them."""

    def read_everybody(self) -> None:
        """Read gated vehicles too from now on, in one call, since an observer asks for all positions."""
        self._reads_all, self._gated = True, -1

    def look(self, gated: Container[str], changes: int) -> None:
        """Read where the ordinary vehicles are now.

        `gated`: the names of the gated vehicles. `changes`: how often these have changed so far.
        """
        traffic = self._traffic
        here = traffic.whereabouts() if self._reads_all else None
        everybody = traffic.vehicles() if here is None else here.vehicles
        if changes != self._gated or everybody != self._everybody:
            rows = [row for row, name in enumerate(everybody) if name not in gated]
            self._find([everybody[row] for row in rows])
            self._everybody, self._gated = everybody, changes
            self._rows = list(range(len(rows))) if here is None else rows
        for lane in self._used:
            lane.rears.clear()
        self._used.clear()
        if self._in_order:
            if here is None:
                here = traffic.whereabouts_of(self._names)
            self._move(here.lanes, here.positions_m.tolist(), here.speeds_mps.tolist(), traffic.now_s)

    def _find(self, names: list[str]) -> None:
        """Add the ordinary vehicles that have come, and drop the ones that are gone."""
        for name in self.others.keys() - set(names):
            other = self.others.pop(name)
            self._leave_lane(other)
            _forget_ways(other, self._traffic.now_s)
        for name in names:
            if name not in self.others:
                like = self._traffic.dynamics(name)
                haste = max(1.0, like.speed_factor)
                self.others[name] = Other(name, like.length_m, like.accel_mps2, like.decel_mps2, haste)
                self.met += 1
        self._names = names
        self._in_order = [self.others[name] for name in names]

    def _move(
        self, lanes: Sequence[str], positions_m: list[float], speeds: list[float], now_s: float
    ) -> None:
        """Set lane, position and speed of each ordinary vehicle."""
        for number, other in enumerate(self._in_order):
            row = self._rows[number]
            lane_name = lanes[row]
            other.position_m = positions_m[row]
            speed = speeds[row]
            other.speed = speed
            if lane_name != other.lane_name or other.parks or speed <= STANDING_MPS:
                self._place(other, lane_name)
                if other.parks:
                    continue
            if other.on is not other.lane or now_s >= other.until_s:
                self._follow(other, now_s)
            if other.position_m < other.length_m:
                self._list_rears(other)

    def _place(self, other: Other, lane_name: str) -> None:
        """Put a vehicle on its lane, unless it is on no lane or stands beside one."""
        other.lane_name = lane_name
        lane = self.roads.lanes.get(lane_name)
        parks = lane is None or (other.speed <= STANDING_MPS and self._traffic.parks(other.name))
        if parks == other.parks and lane is other.lane:
            return
        self._leave_lane(other)
        other.lane, other.on, other.parks = lane, None, parks
        if parks:
            _forget_ways(other, self._traffic.now_s)
        elif lane is not None:
            lane.fronts.append(other)

    def _leave_lane(self, other: Other) -> None:
        if other.lane is not None and not other.parks:
            other.lane.fronts.remove(other)

    def _follow(self, other: Other, now_s: float) -> None:
        """Find how far a vehicle is on its route; read the route again if it has changed."""
        lane = other.lane
        if lane is None:
            return
        edges, known = other.edges, other.on is lane
        if not known and edges:
            after = edges[other.at + 1] if other.at + 1 < len(edges) else None
            if edges[other.at] is lane.edge or (lane.inside and after in lane.ahead):
                other.on = lane
            elif after is lane.edge:
                other.at += 1
                other.on = lane
        if known or other.on is not lane:
            other.until_s = now_s + _AGAIN_S
            if known and self._traffic.route_id(other.name) == other.route_name:
                return
            self._read_route(other, lane)
        self._list_ways(other, lane)

    def _read_route(self, other: Other, lane: RoadLane) -> None:
        names, at = self._traffic.route(other.name)
        route, roads = self._traffic.route_id(other.name), self.roads
        if route != other.route_name or not other.edges:
            other.route_name = route
            other.edges = [roads.edges.get(name, roads.nowhere) for name in names]
            behind = [*names[1:], ""]
            other.turns = [roads.turns.get((name, to)) for name, to in zip(names, behind, strict=True)]
        other.at = at
        there = lane.inside or (at < len(other.edges) and other.edges[at] is lane.edge)
        other.on = lane if there else None

    def _list_ways(self, other: Other, lane: RoadLane) -> None:
        """List a vehicle at the turns that it may come to from its lane, and at its next edges."""
        _forget_ways(other, self._traffic.now_s)
        edges, turns, at = other.edges, other.turns, other.at
        for edge in edges[at + 1 : at + 1 + AHEAD]:
            edge.coming[other] = None
            other.coming_to.append(edge)
        to_m, first = lane.length_m, True
        if lane.inside:
            at += 1
            if at < len(edges):
                to_m += edges[at].length_m
            first = False
        fastest = lane.limit
        while at + 1 < len(edges):
            edge, turn = edges[at], turns[at]
            fastest = max(fastest, edge.limit)
            if to_m - lane.length_m > HORIZON_S * fastest * other.haste:
                break
            if turn is not None:
                coming = Coming(other, turn, to_m, edge.limit, first=first)
                turn.coming.append(coming)
                other.entries.append(coming)
                to_m += turn.through_m
            first = False
            at += 1
            to_m += edges[at].length_m

    def _list_rears(self, other: Other) -> None:
        """List the rear of a vehicle on the lanes that its front has left."""
        lane, at, left_m = other.lane, other.at, other.length_m - other.position_m
        edges = other.edges
        while lane is not None and left_m > 0.0 and edges:
            edge: RoadEdge | None = None
            if not lane.inside:
                at = at if edges[at] is lane.edge else at - 1
                if at <= 0:
                    break
                edge = edges[at - 1]
            lane = lane.from_edge(edge)
            if lane is None:
                break
            rear_m = lane.length_m - left_m
            left_m = -rear_m
            lane.rears.append(Rear(other, rear_m))
            self._used.append(lane)


def _forget_ways(other: Other, now_s: float) -> None:
    for coming in other.entries:
        coming.turn.coming.remove(coming)
        coming.turn.came_s = now_s
    other.entries = []
    for edge in other.coming_to:
        edge.coming.pop(other, None)
    other.coming_to = []
