"""Room in circles of places for ordinary vehicles, which take it without asking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.sense import STANDING_MPS
from loopgate.network import RoadNetwork
from loopgate.simulation.around.crossing_ways import Place, Way
from loopgate.simulation.around.sight import Seen, Sight

__all__ = ["Circles"]

_SHARE = 5
"""One slot in so many of a place is for ordinary vehicles, one at least where there are three."""

_AHEAD = 5
"""Whoever has a place among so many of the next edges on its route is about to come to it."""


class Circles:
    """Tells which moves leave too little room in a circle of places, each of whose first wants the next.

    The chain rule of a gate leaves a slot free in each circle, so that it can go round. An ordinary vehicle
    takes that slot without asking. So here ordinary vehicles count as vehicles in places, in whose line they
    may be first; and who would come into a circle from elsewhere leaves it a slot more, and one for each
    ordinary vehicle that is about to come there. Within a circle everyone may go on, so somebody can. Who
    must move next (`loopgate.drive.service`) need not leave more than the one slot.

    Parameters
    ----------
    network
        The roads.
    keeper, drivers
        Know what the gated vehicles hold, and where they are.
    ways
        What lies before them, by loop, then position.
    sight
        Where the ordinary vehicles are.
    """

    def __init__(
        self,
        network: RoadNetwork,
        keeper: Gatekeeper,
        drivers: Sequence[Driver],
        ways: Mapping[str, Sequence[Way]],
        sight: Sight,
    ) -> None:
        self._keeper, self._drivers, self._ways, self._sight = keeper, drivers, ways, sight
        self._leads_to: Mapping[tuple[str | None, str], str] = {
            (lane, c.to_edge): f"{c.to_edge}_{c.to_lane}"
            for c in network.connections
            for lane in (f"{c.from_edge}_{c.from_lane}", *c.via)
        }
        self._places: Mapping[str, Place] = {}
        self._first_on: dict[str, str] = {}
        """The first state on a lane."""
        self.asked: Sequence[str] = ()
        """The states that the last answer rests on: where vehicles are in line, and where the first goes."""

    def plan(self, places: Mapping[str, Place]) -> None:
        """Take over where the states are, by name."""
        self._places = places
        backwards = sorted(places.items(), key=lambda item: item[1].begin_m, reverse=True)
        self._first_on = {place.lane: state for state, place in backwards}

    def too_tight(self, robot: int, *, back: bool = False) -> bool:
        """Return whether the move of a robot would leave too little room for ordinary vehicles.

        It is the move into its next state, or `back` into its own, from beside the road.
        """
        driver = self._drivers[robot]
        granted = driver.granted
        leg = granted if back else granted + 1
        here = "" if back else str(driver.leg(granted).state)
        target = str(driver.leg(leg).state)
        self.asked = circle = list[str]()
        if driver.leg(leg).away:
            return False  # who arrives leaves room
        must_move = bool(driver.row["mover"])
        comer: Driver | Seen = driver
        state, holes, crowded = target, 0.0, False
        while state != here and state not in circle:
            number = self._keeper.number(state)
            if number is None:
                return crowded
            line, slots, place = self._keeper.line(number), self._keeper.slots(number), self._places[state]
            others = self._sight.inside(place)
            free: float = slots - len(line)
            if others:
                free = min(free, self._sight.fit(place, line, comer.length_m))
            if state == target:
                free -= 1
                crowded = not must_move and free < (slots + 2) // _SHARE
            holes += max(0, free)
            circle.append(state)
            if line:
                head = self._drivers[line[0]]
                following = self._following(place, others, head, head.granted)
            else:
                following = self._following(place, others, driver if state == target else None, leg)
            if following is None:
                return crowded
            state, comer = following
        if state == here:
            return False
        if state != target:
            return crowded
        return crowded or holes < (1 if must_move else 2 + self._coming(circle))

    def _following(
        self, place: Place, others: Sequence[Seen], head: Driver | None, leg: int
    ) -> tuple[str, Driver | Seen] | None:
        """Return where the first in a state wants to go, and who that is; None if it comes to no place.

        The first is the gated vehicle that is, in a leg of its way, or one of the `others` inside before
        that: in the state, or standing on the crossing behind it.
        """
        here = [seen for seen in others if seen.lane == place.lane] if others else ()
        other = max(here, key=lambda seen: seen.position_m) if here else None
        if head is not None and (
            other is None or head.end_m(leg) - head.front_m <= place.end_m - other.position_m
        ):
            ways = self._ways[head.track.loop]
            other = self._in_the_way(ways[leg % len(ways)])
            if other is None:
                return str(head.leg(leg + 1).state), head
        state = None if other is None else self._sought(other)
        return None if other is None or state is None else (state, other)

    def _in_the_way(self, way: Way) -> Seen | None:
        """Return an ordinary vehicle that stands on a crossing, in the way of who is before it."""
        if self._sight.busy.isdisjoint(way.across):
            return None
        across = (lane for movement in way.movements for lane in movement.across)
        there = (seen for lane in (*way.between, *across) for seen in self._sight.on.get(lane, ()))
        return next((seen for seen in there if seen.speed_mps < STANDING_MPS), None)

    def _sought(self, other: Seen) -> str | None:
        """Return the next state on the route of an ordinary vehicle; None for none."""
        edges, at = self._sight.route(other)
        lane: str | None = other.lane
        for edge in edges[at + 1 : at + 1 + _AHEAD]:
            lane = self._leads_to.get((lane, edge)) if lane is not None else None
            if lane is not None and lane in self._first_on:
                return self._first_on[lane]
        return None

    def _coming(self, circle: Sequence[str]) -> int:
        """Return how many ordinary vehicles are about to come into a circle, and are not in it yet."""
        places = [self._places[state] for state in circle]
        edges = {place.lane.rpartition("_")[0] for place in places}
        inside = {seen.vehicle for place in places for seen in self._sight.inside(place)}
        count = 0
        for seen in self._sight.seen:
            if seen.vehicle not in inside:
                route, at = self._sight.route(seen)
                count += not edges.isdisjoint(route[at + 1 : at + 1 + _AHEAD])
        return count
