"""Vehicles on the road that wait to join the gate, and are held where they can join."""

import math
from dataclasses import dataclass

from loopgate.abstraction.track import Track, rounds_from
from loopgate.control.motion import braking_m
from loopgate.errors import TrafficError
from loopgate.network import Loop, VehicleType
from loopgate.simulation.attaching.plan import Plan
from loopgate.traffic.base import Traffic

_SAME_M = 0.5
"""How far past the end of its state a vehicle may stand that is held there [m]."""


_REACHED_M = 0.05
"""So far behind a line a vehicle can be held there that stands, or that cannot brake but for so much [m].

Farther, SUMO lets it drive on, without a word.
"""


@dataclass(slots=True, eq=False)
class Newcomer:
    """A vehicle that waits to join the gate, and drives by SUMO's rules until then.

    It is told to stop at the end of the first place of its loop before which it can still brake. It can be
    taken in as soon as it is in that place as a whole: then there is nothing that it holds besides.

    Attributes
    ----------
    vehicle, loop, kind
        Its name, its loop and its type.
    since_s
        Since when it waits [s].
    seen
        Whether it has been on the road.
    arc_m
        Where its front is on the loop [m]; not a number while it is not on it.
    position
        The position on its loop's itinerary at whose end it is held; None while it cannot be.
    left_m
        How far it is from there [m].
    inside
        Whether it is in that place as a whole.
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
            if self.left_m > before_m + _SAME_M:  # it is past it
                self.let_go(traffic)
        if self.position is None and not lane.startswith(":"):
            self._hold(traffic, track)
        if self.position is not None:
            leg = track.legs[self.position]
            whole = self.left_m <= leg.end_m - leg.begin_m - self.kind.length_m
            self.inside = whole and lane == f"{leg.line.edge}_{leg.line.lane}"

    def let_go(self, traffic: Traffic) -> None:
        """Release the hold."""
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
                return math.nan  # where it goes on is told by the next road
            number = self._edge_number(traffic, edge)
            return self.loop.roads[number].begin_m + at_m
        lap_m = self.loop.length_m
        return min(arcs, key=lambda arc: abs((arc - self.arc_m + lap_m / 2) % lap_m - lap_m / 2))

    def _edge_number(self, traffic: Traffic, edge: str) -> int:
        """Return the index of an edge on the loop; of two, the index with the same next edge."""
        edges = self.loop.edges
        numbers = [number for number, name in enumerate(edges) if name == edge]
        route, at = traffic.route(self.vehicle)
        following = route[at + 1] if at + 1 < len(route) else ""
        return next((n for n in numbers if edges[(n + 1) % len(edges)] == following), numbers[0])

    def _left_m(self, track: Track, position: int) -> float:
        """Return how far it is to the end of a place, going round [m]; a little below 0 just behind it."""
        lap_m = self.loop.length_m
        return (track.legs[position].end_m - self.arc_m + _SAME_M) % lap_m - _SAME_M

    def _hold(self, traffic: Traffic, track: Track) -> None:
        """Give it a route for the next rounds, and a stop at the end of the first place where it can be."""
        begins = [span.begin_m for span in self.loop.roads]
        here = max(n for n, begin in enumerate(begins) if n == 0 or begin <= self.arc_m)
        left = {position: self._left_m(track, position) for position in range(len(track.legs))}
        decel = traffic.dynamics(self.vehicle).decel_mps2
        needed_m = braking_m(traffic.speed(self.vehicle), decel, traffic.step_s)
        try:
            traffic.lead(self.vehicle, rounds_from(self.loop, here))
        except TrafficError:
            return  # not from here
        for position in sorted(left, key=lambda p: left[p]):
            line = track.legs[position].line
            if left[position] < needed_m - _REACHED_M:
                continue  # SUMO looks at that where both are on one edge only, and never behind a line
            try:
                held = traffic.hold(self.vehicle, line.edge, line.lane, line.position_m)
            except TrafficError:
                continue
            if held:
                self.position, self.left_m = position, left[position]
                return
