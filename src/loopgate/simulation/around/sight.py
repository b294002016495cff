"""Where ordinary vehicles are, and where their routes lead: read from the simulation, once a step."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from itertools import pairwise
from typing import NamedTuple

from loopgate.drive.driver import Driver
from loopgate.drive.sense import STANDING_MPS
from loopgate.network import RoadNetwork
from loopgate.simulation.around.crossing_ways import Movement, Place
from loopgate.traffic.base import Dynamics, Traffic

__all__ = ["BEYOND_M", "Seen", "Sight"]

_Route = tuple[tuple[str, ...], int]
"""The edges of a vehicle's route, and the number of the one that it is on or has just left."""

BEYOND_M = 0.3
"""How far past the end of a place vehicles may stand that are in it [m]."""

_GAP_M = 2.5
"""Room that a vehicle keeps free before it when it stands: SUMO's default [m]."""

_AGAIN_S = 5.0
"""So long a route is taken to be as it was [s]: SUMO may lead vehicles another way."""


class Seen(NamedTuple):
    """A vehicle, the lane and the position of its front on it [m], its length [m], and its speed [m/s]."""

    vehicle: str
    lane: str
    position_m: float
    length_m: float
    speed_mps: float


class _Rear(NamedTuple):
    """A vehicle whose front has left a lane, and where on that its rear is [m]; below 0 before it."""

    seen: Seen
    rear_m: float


class Sight:
    """The vehicles on the road, not beside it, under no gate. O(vehicles) in a step in which it is asked.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    drivers
        Of all vehicles under the gate.
    """

    def __init__(self, network: RoadNetwork, traffic: Traffic, drivers: Sequence[Driver]) -> None:
        self._network, self._traffic, self._drivers = network, traffic, drivers
        self._behind: dict[str | tuple[str, str], str] = {}
        """The lane behind one inside a junction; and behind one outside, for those who come from an edge."""
        for movement in network.connections:
            way = (f"{movement.from_edge}_{movement.from_lane}", *movement.via)
            self._behind |= {lane: behind for behind, lane in pairwise(way)}
            self._behind[movement.from_edge, f"{movement.to_edge}_{movement.to_lane}"] = way[-1]
        self.on: Mapping[str, Sequence[Seen]] = {}
        """By the lane on which their fronts are."""
        self._over: Mapping[str, Sequence[_Rear]] = {}
        """By the lanes behind that, on which the rest of them is."""
        self.seen: Sequence[Seen] = ()
        """All of them, lane by lane."""
        self.turned: Sequence[Seen] = ()
        """Vehicles whose routes were not known at the last look, or not for long enough, or for that lane."""
        self.led: dict[str, tuple[str, ...]] = {}
        """Routes that have been read, and were not so before, until somebody has taken note."""
        self.busy: AbstractSet[str] = frozenset()
        """The lanes on which they are with some part."""
        self.kinds: Mapping[str, Dynamics] = {}
        """Their dynamics."""
        self._names: set[str] = set()
        """Vehicles seen so far; not one that was about to come under the gate."""
        self._seen_s = -math.inf
        self._routes: dict[str, tuple[_Route, float, str]] = {}
        """Routes, until when they are taken to be so [s], and the lane of the vehicle then."""

    @property
    def count(self) -> int:
        """How many have been seen so far."""
        return len(self._names)

    def look(self) -> bool:
        """See where they are now; return whether that is news."""
        traffic = self._traffic
        if self._seen_s == traffic.now_s:
            return False
        self._seen_s = traffic.now_s
        gated = {driver.id for driver in self._drivers}
        self._names -= gated
        on: dict[str, list[Seen]] = {}
        turned: list[Seen] = []
        kinds: dict[str, Dynamics] = {}
        for vehicle, lane, position_m, speed_mps in zip(*traffic.whereabouts(), strict=True):
            if vehicle in gated:
                continue
            kind = self.kinds.get(vehicle)
            if kind is None:
                kind = traffic.dynamics(vehicle)
                self._names.add(vehicle)
            kinds[vehicle] = kind
            if speed_mps <= STANDING_MPS and traffic.parks(vehicle):
                continue
            one = Seen(vehicle, lane, position_m, kind.length_m, speed_mps)
            on.setdefault(lane, []).append(one)
            known = self._routes.get(vehicle)
            if known is None or known[1] <= self._seen_s or known[2] != lane:
                turned.append(one)
        for vehicle in self._routes.keys() - kinds.keys():
            del self._routes[vehicle]
        self.kinds, self.on, self.turned = kinds, on, turned
        self.seen = [one for lane in on.values() for one in lane]
        self._over = self._rears()
        self.busy = on.keys() | self._over.keys()
        return True

    def _rears(self) -> dict[str, list[_Rear]]:
        over: dict[str, list[_Rear]] = {}
        for one in self.seen:
            if one.length_m > one.position_m:
                for lane, rear_m in self._lanes_behind(one):
                    over.setdefault(lane, []).append(_Rear(one, rear_m))
        return over

    def _lanes_behind(self, one: Seen) -> Iterator[tuple[str, float]]:
        """Yield the lanes on which a vehicle is that its front has left, and where its rear is [m]."""
        lane, left_m = one.lane, one.length_m - one.position_m
        edges, at = self.route(one)
        while left_m > 0:
            edge = lane.rpartition("_")[0]
            if not lane.startswith(":"):
                at = at if edges[at] == edge else at - 1
                behind = self._behind.get((edges[at - 1], lane)) if at > 0 else None
            else:
                behind = self._behind.get(lane)
            if behind is None:
                return
            lane = behind
            rear_m = self._network.lanes[lane].length_m - left_m
            yield lane, rear_m
            left_m = -rear_m

    def upon(self, lane: str, past_m: float = math.inf) -> Sequence[Seen]:
        """Return those whose fronts are on a lane, or have left it with some part still before `past_m`."""
        rears = (one.seen for one in self._over.get(lane, ()) if one.rear_m < past_m)
        return (*self.on.get(lane, ()), *rears)

    def across(self, movement: Movement, lanes: Iterable[str] | None = None) -> list[Seen]:
        """Return those inside the junction who are in the way of a movement; on `lanes` if given."""
        among = movement.across if lanes is None else lanes
        if self.busy.isdisjoint(among):
            return []
        return [seen for lane in among for seen in self.upon(lane, movement.past_m.get(lane, math.inf))]

    def inside(self, place: Place) -> list[Seen]:
        """Return those in a place, and those about to drive into it."""
        here = self.on.get(place.lane, ())
        if not here and self.on.keys().isdisjoint(place.into):
            return []
        inside = [s for s in here if place.begin_m <= s.position_m <= place.end_m + BEYOND_M]
        for lane in place.into:
            if lane in self.on:
                inside += self.on[lane]
        return inside

    def fit(self, place: Place, robots: Sequence[int], length_m: float) -> float:
        """Return how many more vehicles of a length fit into a place beside those and these robots.

        That is infinite where there is no ordinary vehicle: then it is for the gate to say. Its slots are as
        long as the longest vehicle needs; where there are ordinary ones, each takes what it is long.
        """
        inside = self.inside(place)
        if not inside:
            return math.inf
        lengths = [s.length_m for s in inside] + [self._drivers[robot].length_m for robot in robots]
        left_m = place.end_m - place.begin_m - sum(lengths) - _GAP_M * len(lengths)
        return max(0, math.floor(left_m / (length_m + _GAP_M)))

    def route(self, one: Seen) -> _Route:
        """Return the edges of its route, and the number of the one that it is on or has just left."""
        now, lane = self._seen_s, one.lane
        known = self._routes.get(one.vehicle)
        if known is not None and now < known[1]:
            route, until_s, was = known
            if lane == was:
                return route
            edges, at = route
            edge = lane.rpartition("_")[0]
            if not lane.startswith(":") and edges[at] != edge:
                at += 1
            if lane.startswith(":") or (at < len(edges) and edges[at] == edge):
                self._routes[one.vehicle] = (edges, at), until_s, lane
                return edges, at
        read, at = self._traffic.route(one.vehicle)
        edges = tuple(read)
        if known is None or known[0][0] != edges:
            self.led[one.vehicle] = edges
        there = lane.startswith(":") or (at < len(edges) and edges[at] == lane.rpartition("_")[0])
        self._routes[one.vehicle] = (edges, at), now + _AGAIN_S, lane if there else ""
        return edges, at
