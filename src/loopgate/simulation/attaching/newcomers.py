"""Vehicles that wait to join the gate, and are held on the road where they can join."""

import math
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Track, rounds_from
from loopgate.control.places import braking_m
from loopgate.errors import TrafficError
from loopgate.network import Loop, VehicleType
from loopgate.simulation.attaching.plan import Plan
from loopgate.traffic.base import Traffic

_SAME_M = 0.5
"""A vehicle held at the end of a state may stand this far beyond it [m]."""


_REACHED_M = 0.05
"""SUMO still holds a vehicle at a line that is this much nearer than its braking distance [m].

If the line is nearer, SUMO lets the vehicle drive on, without an error."""


@dataclass(slots=True, eq=False)
class Newcomer:
    """A vehicle that waits to join the gate, and drives by SUMO's rules until then.

    It is told to stop at the end of the first place of its loop before which it can still brake. It can join
    as soon as it is in that place with its full length: it then holds nothing else.

    Attributes
    ----------
    vehicle, loop, kind
        Its name, its loop and its type.
    since_s
        Since when it waits [s].
    seen
        Whether it has been on the road.
    arc_m
        Arc length of its front on the loop [m]; NaN while it is not on the loop.
    position
        Index on its loop of the place at whose end it is held; None if it is not held.
    left_m
        Distance to the end of that place [m].
    inside
        Whether it is in that place with its full length.
    tried_s
        When it was last refused [s].
    """

    vehicle: str
    loop: Loop
    kind: VehicleType
    since_s: float
    seen: bool = False
    arc_m: float = math.nan
    position: int | None = None
    left_m: float = math.inf
    inside: bool = False
    tried_s: float = -math.inf

    def look(self, traffic: Traffic, plan: Plan) -> None:
        """Find the vehicle's position, and hold the vehicle if possible."""
        self.inside = False
        lane, at_m = traffic.lane(self.vehicle)
        self.arc_m = self._arc_m(traffic, lane, at_m)
        if math.isnan(self.arc_m):
            self.let_go(traffic)
            return
        track = plan.track(self.vehicle, self.loop.id, front_m=self.arc_m, position=0)
        if self.position is not None:
            before_m, self.left_m = self.left_m, self._left_m(track, self.position)
            if self.left_m > before_m + _SAME_M:  # it has passed the end of that place
                self.let_go(traffic)
        if self.position is None and not lane.startswith(":"):
            self._hold(traffic, track)
        if self.position is not None:
            leg = track.legs[self.position]
            whole = self.left_m <= leg.end_m - leg.begin_m - self.kind.length_m
            self.inside = whole and lane == f"{leg.line.edge}_{leg.line.lane}"

    def let_go(self, traffic: Traffic) -> None:
        """Release the vehicle if it is held."""
        if self.position is not None:
            self.position, self.left_m, self.inside = None, math.inf, False
            traffic.release(self.vehicle)

    def _arc_m(self, traffic: Traffic, lane: str, at_m: float) -> float:
        edge = lane.rpartition("_")[0]
        arcs = [s.begin_m + min(at_m, s.length_m) for s in self.loop.spans if s.edge == edge]
        if not arcs:
            return math.nan
        if math.isnan(self.arc_m):
            if lane.startswith(":"):
                return math.nan  # the next road will tell where on the loop it is
            number = self._edge_number(traffic, edge)
            return self.loop.roads[number].begin_m + at_m
        lap_m = self.loop.length_m
        return min(arcs, key=lambda arc: abs((arc - self.arc_m + lap_m / 2) % lap_m - lap_m / 2))

    def _edge_number(self, traffic: Traffic, edge: str) -> int:
        """Return the index of an edge on the loop; if the loop has it twice, by the edge that follows."""
        edges = self.loop.edges
        numbers = [number for number, name in enumerate(edges) if name == edge]
        route, at = traffic.route(self.vehicle)
        following = route[at + 1] if at + 1 < len(route) else ""
        return next((n for n in numbers if edges[(n + 1) % len(edges)] == following), numbers[0])

    def _left_m(self, track: Track, position: int) -> float:
        """Return the distance along the loop to the end of a place [m]; slightly negative just behind it."""
        lap_m = self.loop.length_m
        return (track.legs[position].end_m - self.arc_m + _SAME_M) % lap_m - _SAME_M

    def _hold(self, traffic: Traffic, track: Track) -> None:
        """Give the vehicle a route for the next rounds, and a stop at the first line where it can stop."""
        begins = [span.begin_m for span in self.loop.roads]
        here = max(n for n, begin in enumerate(begins) if n == 0 or begin <= self.arc_m)
        left = {position: self._left_m(track, position) for position in range(len(track.legs))}
        decel = traffic.dynamics(self.vehicle).decel_mps2
        needed_m = braking_m(traffic.speed(self.vehicle), decel, traffic.step_s)
        try:
            traffic.lead(self.vehicle, rounds_from(self.loop, here))
        except TrafficError:
            return  # no route from here
        for position in sorted(left, key=lambda p: left[p]):
            line = track.legs[position].line
            if left[position] < needed_m - _REACHED_M:
                continue  # SUMO itself checks this on the vehicle's own edge only, and not behind the line
            try:
                held = traffic.hold(self.vehicle, line.edge, line.lane, line.position_m)
            except TrafficError:
                continue
            if held:
                self.position, self.left_m = position, left[position]
                return
