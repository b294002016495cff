"""Finds whom a standing vehicle waits for on the road, from positions and the network alone."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from heapq import heappop, heappush
from itertools import islice, product
from math import inf, nan
from typing import NamedTuple, Protocol

from shapely import LineString
from shapely.ops import substring

from loopgate.control.places import STANDING_MPS
from loopgate.network import Connection, RoadNetwork
from loopgate.network.road import Lane
from loopgate.traffic.base import Traffic

__all__ = ["Occupant", "Road", "RoadWaits", "SimulatedRoad"]

IMPATIENT_S = 180.0
"""SUMO's ``time-to-impatience``: after so much waiting a driver no longer heeds who else may come [s]."""

_SURELY_S = 20.0
"""A vehicle that nothing keeps back any more has moved after this time [s]."""

_TOUCHING_M, _CLOSE_M = 3.0, 1.0
"""A vehicle stands because of its leader if the gap is at most the minimum gap and the first, when it creeps
or the leader's length is not known; else at most the second: with more space it may still close up [m]."""

_CREEP_M, _CLEARS_M, _CLEARS_SLOWLY_M, _ROUNDING_M = 3.0, 10.0, 0.5, 0.005
"""A driver may creep so far up to the leader, some millimetres a second; so far over a junction; and so far
if it is so slow that only many looks show it. What is less than the last is no move [m]."""

_ALL_BUT_M = 0.5
"""A rear with so little left on a lane inside a junction is in nobody's way [m]."""

_AT_JUNCTION_M = 15.0
"""A vehicle nearer than this to the end of its lane may stand there because of the junction [m]."""

_TURN_LANE_M = 200.0
"""No driver changes to a lane that leads on for less than this, if it is not the best for the route and does
not lead to where the road ends (LC2013, ``stayOnBest``) [m]."""

_BEHIND_M, _AHEAD_M, _APPROACH_M = 20.0, 30.0, 100.0
"""What can matter to a standing driver: vehicles beside within the first two distances, and the next vehicle
on a lane within the third [m]."""

_LONGEST_M = 20.0
"""No vehicle is longer, where lengths are not known [m]."""

_LEVEL_M, _FOLLOWS_M, _LETS_IN_M = 0.05, 1.2, 0.09
"""Two vehicles are level whose fronts differ by less than the first. Who must change lanes follows the next
vehicle on the other lane at most the second beyond the minimum gap behind it, and stops 1 m behind that.
Who is nearer than the third behind another cannot let it in before itself any more [m]."""

_MOST_SETS = 4
"""So many sets of vehicles are kept for each way of several."""

_APART_M = 3.0
"""A vehicle cannot pass nearer than this to the middle of another's body where their ways part or merge [m].

Where they cross, SUMO lets it pass once the other's rear is off its lane: half a lane's width away."""


class Occupant(NamedTuple):
    """A vehicle on a lane: where its front and its rear are on it [m].

    The front is beyond the lane's end if only the rear is on the lane.
    """

    vehicle: str
    front_m: float
    rear_m: float


class LeadsOn(NamedTuple):
    """A lane and those to which it leads along a route, their length [m], and lanes to the best one."""

    lanes: Sequence[str]
    far_m: float
    to_best: int


class Road(Protocol):
    """The interface of a running or played-back simulation that `RoadWaits` needs.

    `knows_sizes`: whether `size` is that of each vehicle.
    """

    knows_sizes: bool

    def on_lanes(self) -> Iterable[tuple[str, str, float]]:
        """Yield each vehicle on the road with the lane and the position of its front [m]."""

    def size(self, vehicle: str) -> tuple[float, float]:
        """Return the length and the minimum gap of a vehicle [m]."""

    def edges_around(self, vehicle: str) -> tuple[str, Sequence[str] | None]:
        """Return the edge before the one that a vehicle is on, and the edges after it; None if not known."""

    def lanes_for(self, vehicle: str) -> Sequence[LeadsOn] | None:
        """Return how the lanes of its edge lead on along the route of a vehicle; None if not known."""

    def lane_wish(self, vehicle: str) -> tuple[int, bool]:
        """Return to which side a vehicle must change lanes and cannot, and whether it lets another do so.

        The side is 1 to the left, -1 to the right, 0 if there is none.
        """

    def faces_red(self, vehicle: str) -> bool:
        """Return whether the next light is red for a vehicle."""

    def cycle_s(self, light: str) -> float:
        """Return the time in which a light shows all its phases [s]."""


class RoadWaits:
    """The vehicles that a standing vehicle waits for, as sets: of each, some vehicle must move first.

    Two arguments give sets.

    - *Bodies.* A vehicle cannot drive through another. So it waits for its leader, if that is near; before a
      junction, for whoever leaves no space beyond it, is inside on a way that crosses its own, or joins it
      first by right of way; inside, for whoever stands on the rest of its way. If it can change lanes or
      choose a movement, all of these must be blocked, so a set takes one vehicle from each.
    - *Nothing changes.* What a driver does depends on what is around. If a vehicle has stood while all around
      it stood, it stands until one of them moves. So everybody around is a set. Two things change by
      themselves: lights, and the patience of drivers. So this set counts only when the vehicle has stood
      for a cycle of the light, or until it is impatient. Who only has to leave a junction yields to those
      inside alone, patient or not. A vehicle that
      creeps, with no body in its way, changes what is around it.

    Parameters
    ----------
    network
        The network.
    road
        The vehicles.
    impatient_s
        SUMO's ``time-to-impatience`` [s].
    """

    def __init__(self, network: RoadNetwork, road: Road, *, impatient_s: float = IMPATIENT_S) -> None:
        self._network, self._road, self._impatient_s = network, road, impatient_s
        self._from: dict[str, list[Connection]] = defaultdict(list)
        self._to: dict[str, list[Connection]] = defaultdict(list)
        self._over: dict[str, list[Connection]] = defaultdict(list)
        self._at: dict[str, list[Connection]] = defaultdict(list)
        """The movements by the lane before, the lane behind, internal lane and junction."""
        for one in network.connections:
            self._from[one.from_id].append(one)
            self._to[one.to_id].append(one)
            self._at[one.junction].append(one)
            for lane in one.via:
                self._over[lane].append(one)
        self._curves: dict[tuple[str, ...], LineString] = {}
        self._fronts: dict[str, list[Occupant]] = {}
        self._bodies: dict[str, list[Occupant]] = {}
        """The vehicles by the lane of their fronts, and by each lane that they stand on, from the rear on."""
        self._lane: dict[str, tuple[str, float]] = {}
        self._creeping: set[str] = set()
        """The vehicles that have moved at all since the last look."""
        self._lasting: AbstractSet[str] = frozenset()
        self._jams_last = False
        self._restless: AbstractSet[str] = frozenset()
        self._drifting: dict[str, bool] = {}
        """Whether vehicles that creep have no body in their way, as far as it was asked for."""
        self._unsettled = False
        """Whether a body is in the way of the vehicle looked at that creeps, and so may come past it."""

    def look(self, standing: Collection[str] = (), restless: AbstractSet[str] = frozenset()) -> None:
        """Take in where all vehicles are now, which stand for long, and which of them creep nevertheless."""
        self._lasting, self._restless, self._drifting = frozenset(standing), restless, {}
        self._jams_last = False
        fronts, bodies = defaultdict(list), defaultdict(list)
        before, self._lane, self._creeping = self._lane, {}, set()
        for vehicle, lane, front_m in self._road.on_lanes():
            if lane not in self._network.lanes:
                continue
            self._lane[vehicle] = lane, front_m
            was_on, was_m = before.get(vehicle, ("", 0.0))
            if was_on == lane and front_m - was_m > _ROUNDING_M:
                self._creeping.add(vehicle)
            length_m, _ = self._road.size(vehicle)
            here = Occupant(vehicle, front_m, front_m - length_m)
            fronts[lane].append(here)
            bodies[lane].append(here)
            for behind, end_m in self._behind(vehicle, lane, length_m - front_m):
                bodies[behind].append(Occupant(vehicle, end_m + front_m, end_m + front_m - length_m))
        for some in (*fronts.values(), *bodies.values()):
            some.sort(key=lambda one: one.front_m)
        self._fronts, self._bodies = dict(fronts), dict(bodies)

    def suppose(self, lasting: AbstractSet[str] | None) -> None:
        """Suppose that these vehicles may stand for good, so jams are of them; or that each jam lasts (None).

        A jam lasts if enough of it stands, whoever that is. So who stands for good is found in two goes.
        """
        self._jams_last, self._drifting = lasting is None, {}
        self._lasting = self._lasting if lasting is None else lasting

    def of(self, vehicle: str, stood_s: float) -> list[list[str]]:
        """Return the sets of a vehicle that has stood for some time [s]; none if it waits for no vehicle.

        After infinite time neither patience nor creeping counts: whoever may be a cause is in a set.
        """
        lane, front_m = self._lane.get(vehicle, ("", 0.0))
        if not lane:
            return []
        at_end = self._network.lanes[lane].internal or self._left_m(lane, front_m) <= _AT_JUNCTION_M
        ways = self._ways(vehicle, lane) if at_end else []
        self._unsettled = False
        sets = self._by_bodies(vehicle, lane, front_m)
        if not at_end and len(sets) == 1 and len(sets[0]) == 1:
            return sets  # it stands in a queue
        for_good = stood_s == inf
        if (for_good or not self._unsettled) and stood_s >= self._until_sure_s(vehicle, lane, ways):
            around = self._around(vehicle, lane, front_m, at_end=at_end) - {vehicle}
            restless = frozenset() if for_good else self._restless & {vehicle, *around}
            if self._is_leaving(lane, ways) and any(self._clears(one, lane, front_m) for one in restless):
                return sets  # it yields to those inside, and one of them creeps out of its way
            if around and not any(map(self._drifts, restless)):
                sets += [sorted(around)] if sorted(around) not in sets else []
        return sets

    def by_each_way(self, vehicle: str) -> list[list[str]]:
        """Return the sets of each single movement of a vehicle of which it is not known where it goes.

        It waits for one of them, if it has stood before all of them for long.
        """
        lane, front_m = self._lane.get(vehicle, ("", 0.0))
        if not lane or self._road.edges_around(vehicle)[1] is not None:
            return []
        ways = self._ways(vehicle, lane)
        if len(ways) < 2 or self._leader(vehicle, lane, front_m):  # noqa: PLR2004
            return []
        return [some for way in ways for some in self._over_junction(vehicle, lane, front_m, way)]

    def _drifts(self, vehicle: str) -> bool:
        """Return whether a vehicle creeps without a body in its way, at which it would come to rest."""
        if vehicle not in self._drifting:
            unsettled = self._unsettled
            self._drifting[vehicle] = not self._by_bodies(vehicle, *self._lane[vehicle])
            self._unsettled = unsettled
        return self._drifting[vehicle]

    def cause(self, vehicle: str) -> str:
        """Return why a vehicle stands that no vehicle keeps back for good.

        It must change lanes, or lets another do so; a light; the right of way; or unknown.
        """
        lane, front_m = self._lane.get(vehicle, ("", 0.0))
        if lane and not self._network.lanes[lane].internal:
            if any(self._road.lane_wish(vehicle)):
                return "lane change"
            if self._road.faces_red(vehicle):
                return "light"
        if lane and (self._network.lanes[lane].internal or self._left_m(lane, front_m) <= _AT_JUNCTION_M):
            return "right of way"
        return "no reason known"

    def _left_m(self, lane: str, front_m: float) -> float:
        return self._network.lanes[lane].length_m - front_m

    def _ways(self, vehicle: str, lane: str) -> list[Connection]:
        """Return the movements that a vehicle may take from a lane, or is on."""
        if self._network.lanes[lane].internal:
            return self._over.get(lane, [])
        _, after = self._road.edges_around(vehicle)
        ways = [way for way in self._from.get(lane, []) if after is None or after[:1] == [way.to_edge]]
        if len(ways) > 1 and (known := self._road.lanes_for(vehicle)):  # drivers take the best lane beyond
            onto = [one.lanes[1] for one in known if one.lanes[0] == lane and len(one.lanes) > 1]
            return [way for way in ways if way.to_id in onto] or ways
        return ways

    def _is_leaving(self, lane: str, ways: Sequence[Connection]) -> bool:
        """Return whether a lane is the last inside a junction: on it drivers yield to those inside alone.

        Patience is for those who yield to others that come. An exit without space for a vehicle is of the
        next junction.
        """
        lanes = self._network.lanes
        return lanes[lane].internal and all(
            way.via[-1] == lane and lanes[way.to_id].length_m > _AT_JUNCTION_M for way in ways
        )

    def _until_sure_s(self, vehicle: str, lane: str, ways: Sequence[Connection]) -> float:
        """Return how long a vehicle must have stood until nothing changes by itself any more [s]."""
        if not ways or self._is_leaving(lane, ways):
            return 0.0
        until_s = self._impatient_s + _SURELY_S
        lights = {way.signal[0] for way in ways if way.signal}
        if not lights or self._network.lanes[lane].internal:
            return until_s
        if self._road.faces_red(vehicle):
            return nan  # no time is enough
        return until_s + max(map(self._road.cycle_s, lights))

    def _by_bodies(self, vehicle: str, lane: str, front_m: float) -> list[list[str]]:
        """Return the sets of vehicles whose bodies keep a vehicle from going on, on each lane it can take."""
        if self._network.lanes[lane].internal:
            return self._ahead(vehicle, lane, front_m)
        sets = [some for some in _of_all([*self._on_each_lane(vehicle, lane, front_m)]) if some]
        return sets + [some for some in self._for_changes(vehicle, lane, front_m) if some not in sets]

    def _for_changes(self, vehicle: str, lane: str, front_m: float) -> Iterator[list[str]]:
        """Yield sets of vehicles for which a vehicle stands with space ahead, so that lanes can be changed.

        SUMO's rules (LC2013). Who must change lanes and cannot follows the next vehicle on the other lane
        (`informLeader`); where its own lane leads on it may drive past instead. Others let such a vehicle in
        before them (`slowDownForBlocked`). Who creeps with space ahead comes to rest somewhere else.
        """
        of, (_, gap_m) = self._network.lanes[lane], self._road.size(vehicle)
        lanes = [one.id for one in self._network.edges[of.edge].lanes]
        if len(lanes) == 1 or (vehicle in self._creeping and not self._leader(vehicle, lane, front_m)):
            return
        side, lets_in = self._road.lane_wish(vehicle)
        leads_on = any(one.lanes[0] == lane and len(one.lanes) > 1 for one in self._leads(vehicle))
        if side and 0 <= of.index + side < len(lanes) and not leads_on:
            bodies = [one for one in self._bodies.get(lanes[of.index + side], ()) if one.vehicle != vehicle]
            near = [one for one in bodies if one.front_m > front_m - _LEVEL_M]
            near = near[: 2 if near and near[0].front_m < front_m + _LEVEL_M else 1]
            if near and near[-1].rear_m - front_m - gap_m <= _FOLLOWS_M:
                names = [one.vehicle for one in near]
                ahead = self._next_on((lane,), front_m)  # once this one drives, it may try to overtake
                yield sorted({*names, *ahead, *self._kept_by(vehicle, lane, front_m)})
        if lets_in:
            beside = (
                (one.rear_m - front_m - gap_m, one, lanes[of.index + to])
                for to in (-1, 1)
                if 0 <= of.index + to < len(lanes)
                for one in self._fronts.get(lanes[of.index + to], ())
                if one.front_m > front_m and self._road.lane_wish(one.vehicle)[0] == -to
            )
            let_in = (some for some in beside if _LETS_IN_M <= some[0] <= _TOUCHING_M)
            if first := min(let_in, key=lambda some: some[0], default=None):
                _, ahead_of, other = first
                # If nobody stands behind that one, somebody may come and be the next beside this one instead.
                behind = [one.vehicle for one in self._bodies[other] if one.front_m <= front_m][-1:]
                if behind:
                    kept = self._kept_by(ahead_of.vehicle, *self._lane[ahead_of.vehicle])
                    yield sorted({ahead_of.vehicle, *behind, *kept})

    def _leads(self, vehicle: str) -> Sequence[LeadsOn]:
        return self._road.lanes_for(vehicle) or ()

    def _kept_by(self, vehicle: str, lane: str, front_m: float) -> list[str]:
        """Return vehicles on its best lanes without which a driver who stands need not change lanes yet.

        SUMO's rule (LC2013, `currentDistDisallows`): the way on its own lane, less the lengths of all on the
        best lanes, is below two of its own lengths for each lane to change.
        """
        known = {one.lanes[0]: one for one in self._leads(vehicle)}
        here, of = known.get(lane), self._network.lanes[lane]
        if here is None:
            return []
        needs_m = here.far_m - front_m - 2.0 * sum(self._road.size(vehicle)) * abs(here.to_best)
        best = known.get(self._network.edges[of.edge].lanes[of.index + here.to_best].id, here)
        if needs_m <= 0.0:
            return []
        jam = self._filling(best.lanes, front_m, needs_m)
        return self._ahead_on(best.lanes, front_m) if jam is None else jam

    def _ahead_on(self, lanes: Sequence[str], front_m: float) -> list[str]:
        """Return the vehicles on some lanes, of the first lane those beyond a position only."""
        first, *others = ([*self._fronts.get(lane, ())] for lane in lanes)
        ahead = [one for one in first if one.front_m > front_m]
        return [one.vehicle for some in (ahead, *others) for one in some]

    def _filling(self, lanes: Sequence[str], front_m: float, needs_m: float) -> list[str] | None:
        """Return so many of the vehicles ahead on lanes that they fill a length [m]; None if all do not.

        It is empty if those that stand do, and jams are supposed to last. SUMO, too, counts those ahead only.
        """
        jam = self._ahead_on(lanes, front_m)
        found: list[str] = []
        for one in sorted(jam, key=lambda one: one not in self._lasting):
            found.append(one)
            needs_m -= sum(self._road.size(one))
            if needs_m <= 0.0:
                return [] if self._jams_last and self._lasting >= set(found) else found
        return None

    def _on_each_lane(self, vehicle: str, lane: str, front_m: float) -> Iterator[list[list[str]]]:
        """Yield for each lane that a vehicle may take the sets of vehicles that keep it from going on there.

        It goes on in a worse lane that leads on too, if that is where it is.
        """
        known = self._road.lanes_for(vehicle)
        if known is None:
            yield self._ahead(vehicle, lane, front_m)
            return
        wanted = {
            one.lanes[0]: one
            for one in known
            if not one.to_best
            or one.far_m >= _TURN_LANE_M
            or (one.lanes[0] != lane and not self._from.get(one.lanes[-1]))
        }
        of, leader = self._network.lanes[lane], self._leader(vehicle, lane, front_m)
        if lane in wanted or self._ways(vehicle, lane) or leader:
            yield self._ahead(vehicle, lane, front_m)
        free = not leader and self._left_m(lane, front_m) > self._road.size(vehicle)[1] + _TOUCHING_M
        lanes = [one.id for one in self._network.edges[of.edge].lanes]
        for way in lanes[of.index + 1 :], lanes[of.index - 1 :: -1] if of.index else ():
            last = max((number for number, one in enumerate(way) if one in wanted), default=-1)
            yield from self._sideways(vehicle, lane, front_m, way[: last + 1], wanted, free=free)

    def _sideways(
        self,
        vehicle: str,
        lane: str,
        front_m: float,
        way: Sequence[str],
        wanted: Mapping[str, LeadsOn],
        *,
        free: bool,
    ) -> Iterator[list[list[str]]]:
        """Yield the sets of vehicles that keep a vehicle from the lanes to one side, up to the first body."""
        for other in way:
            beside = self._beside(vehicle, other, front_m)
            sets = [[one] for one in beside]
            if (
                beside and free
            ):  # it does not stand at the end of its way, but so that others can change lanes
                sets = [[*beside, *self._next_on((lane, other), front_m)]]
            leads = wanted.get(other)
            if leads or beside:
                jam = self._jam(vehicle, lane, front_m, leads) if leads else None
                yield sets if jam is None else [jam, *sets]  # without any it moves sideways, and makes space
            if beside:
                return

    def _jam(self, vehicle: str, lane: str, front_m: float, other: LeadsOn) -> list[str] | None:
        """Return vehicles whose jam keeps a driver from a lane away from the best, if there is such a jam.

        SUMO's rule (LC2013, `currentDistDisallows`) for a driver who stands: the way on the other lane has to
        be longer than the jam on either lane by two lengths, and by two more for each lane to change until it
        is on the best again. It is empty if the way is too short without a jam.
        """
        known = self._road.lanes_for(vehicle) or ()
        here = next((one for one in known if one.lanes[0] == lane), LeadsOn((lane,), 0.0, 0))
        index = self._network.lanes[lane].index
        if not other.to_best or here.to_best * (self._network.lanes[other.lanes[0]].index - index) > 0:
            return None
        own_m = sum(self._road.size(vehicle))
        needs_m = other.far_m - front_m - 2.0 * own_m * (abs(here.to_best) + 2)
        if needs_m <= 0.0:
            return []
        jams = [self._filling(one.lanes, front_m, needs_m) for one in (here, other)]
        found = [jam for jam in jams if jam is not None]
        return min(found, key=lambda jam: not self._lasting >= set(jam), default=None)

    def _beside(
        self, vehicle: str, lane: str, front_m: float, behind_m: float = -0.1, ahead_m: float = -0.1
    ) -> list[str]:
        """Return the vehicles on a lane beside a vehicle, from so far behind it to so far ahead of it [m]."""
        length_m, gap_m = self._road.size(vehicle)
        return [
            one.vehicle
            for one in self._bodies.get(lane, ())
            if one.vehicle != vehicle
            and one.rear_m < front_m + gap_m + ahead_m
            and one.front_m > front_m - length_m - gap_m - behind_m
        ]

    def _next_on(self, lanes: Sequence[str], front_m: float) -> Iterator[str]:
        """Yield the first vehicle ahead on each of some lanes of an edge."""
        for lane in lanes:
            yield from islice((one.vehicle for one in self._fronts.get(lane, ()) if one.front_m > front_m), 1)

    def _leader(self, vehicle: str, lane: str, front_m: float) -> str:
        """Return the next vehicle in a lane, if a vehicle stands because of it; else an empty text."""
        _, gap_m = self._road.size(vehicle)
        ahead = (
            one for one in self._bodies.get(lane, ()) if one.front_m > front_m and one.vehicle != vehicle
        )
        leader = next(ahead, None)
        near = leader is not None and leader.rear_m - front_m <= gap_m + self._closes_up_m(vehicle)
        return leader.vehicle if leader and near else ""

    def _closes_up_m(self, vehicle: str) -> float:
        """Return how much more than its gap is before a vehicle at most that its leader stops [m]."""
        rests = self._road.knows_sizes and vehicle not in self._restless
        return _CLOSE_M if rests else _TOUCHING_M

    def _ahead(self, vehicle: str, lane: str, front_m: float) -> list[list[str]]:
        """Return the sets of vehicles that keep a vehicle from going on in a lane."""
        if leader := self._leader(vehicle, lane, front_m):
            if self._clears_line(leader, lane) and self._left_m(lane, front_m) > _CLOSE_M:
                self._unsettled = True
                return []
            return [[leader]]
        if not self._network.lanes[lane].internal and self._left_m(lane, front_m) > _AT_JUNCTION_M:
            return []
        return _of_all(
            [self._over_junction(vehicle, lane, front_m, way) for way in self._ways(vehicle, lane)]
        )

    def _clears_line(self, leader: str, lane: str) -> bool:
        """Return whether a leader inside a junction may creep off the lane before it.

        So it may if it has a metre left, or no body across its way within its gap beyond that.
        """
        on, at_m = self._lane[leader]
        line = self._line((on,))
        if (
            leader not in self._restless
            or self._network.lanes[lane].internal
            or on not in self._over
            or not line
        ):
            return False
        way, (length_m, gap_m) = self._over[on][0], self._road.size(leader)
        left_m = length_m - at_m - self._way_m(way, on)
        if self._may_creep_m(leader, left_m, unseen_m=left_m) < left_m:
            return False
        if left_m <= _CLOSE_M:
            return True
        of_m = self._network.lanes[on].length_m
        rest = _part(line, at_m * line.length / max(1e-6, of_m), line.length)
        return not self._across(leader, way, _part(rest, 0.0, gap_m + left_m), of_m - at_m, rest)

    def _over_junction(self, vehicle: str, lane: str, front_m: float, way: Connection) -> list[list[str]]:
        """Return the vehicles that keep a vehicle from a movement, each as a set."""
        inside = lane in way.via
        via = way.via[way.via.index(lane) :] if inside else way.via
        length_m, gap_m = self._road.size(vehicle)
        over_m = sum(self._network.lanes[one].length_m for one in via) - front_m if inside else 0.0
        if inside:
            beyond = self._beyond(vehicle, way, gap_m + self._closes_up_m(vehicle) - over_m)
            found = [one.vehicle for one, _ in islice(beyond, 1)]
        else:
            found = self._without_space(vehicle, way, gap_m + length_m)
        path = self._line(via if inside or len(via) == 1 else via[:-1])  # it can wait before the last lane
        if path is not None:
            begin_m = front_m * path.length / max(1e-6, over_m + front_m) if inside else 0.0
            # A driver drives up to a body across its way, also into a junction.
            # From half way over it, or if it creeps up to something, it looks at all that is left.
            far = inside and (len(via) > 1 or vehicle in self._restless)
            ahead_m = path.length if far else gap_m + _CREEP_M / 2
            rest = _part(path, begin_m, path.length) if inside else None
            path = _part(path, begin_m, begin_m + ahead_m)
            left_m = over_m if inside else self._way_m(way) + self._left_m(lane, front_m)
            found += self._across(vehicle, way, path, left_m, rest)
            if not inside and way.signal is None:
                found += self._joins_first(vehicle, way, left_m)
        return [[one] for one in dict.fromkeys(found) if one != vehicle]

    def _without_space(self, vehicle: str, way: Connection, needs_m: float) -> list[str]:
        """Return the vehicles that stand nearer than `needs_m` beyond a movement [m] for good.

        A driver comes in once one that creeps has left the space.
        """
        found = []
        for number, (one, lacks_m) in enumerate(self._beyond(vehicle, way, needs_m)):
            if one.vehicle in self._creeping and lacks_m <= self._may_creep_m(one.vehicle, _CREEP_M):
                self._unsettled |= not number
            else:
                found.append(one.vehicle)
        return found

    def _beyond(self, vehicle: str, way: Connection, needs_m: float) -> Iterator[tuple[Occupant, float]]:
        """Yield the vehicles beyond a movement that are nearer than `needs_m`, and what lacks by each [m].

        The nearest comes first.
        """
        _, after = self._road.edges_around(vehicle)
        lanes, edges = [way.to_id], list(after or ())[1:]
        for lane in lanes:
            bodies = (one for one in self._bodies.get(lane, ()) if one.vehicle != vehicle)
            near = [(one, needs_m - one.rear_m) for one in bodies if one.rear_m < needs_m]
            yield from sorted(near, key=lambda one: -one[1])
            needs_m -= self._network.lanes[lane].length_m
            if needs_m <= 0.0:
                break
            if not self._network.lanes[lane].internal:
                ways = self._from.get(lane, [])
                ways = [one for one in ways if one.to_edge == edges[0]] if edges else ways
                if len(ways) == 1:
                    lanes += [*ways[0].via, ways[0].to_id]
                    edges = edges[1:]

    def _creeps_on_m(self, vehicle: str) -> float:
        """Return how far a vehicle that stands may creep on over a junction [m]."""
        if vehicle in self._creeping:
            return self._may_creep_m(vehicle, _CLEARS_M)
        return self._may_creep_m(vehicle, _CLEARS_SLOWLY_M) if vehicle in self._restless else 0.0

    def _clears(self, vehicle: str, lane: str, front_m: float) -> bool:
        """Return whether a vehicle creeps that is in or beside the way of another on its last lane inside."""
        line = self._line((lane,))
        if line is None or self._creeps_on_m(vehicle) <= _ROUNDING_M:
            return line is None
        of = self._network.lanes[lane]
        rest = _part(line, front_m * line.length / max(1e-6, of.length_m), line.length)
        on = {one for other in self._at[self._over[lane][0].junction] for one in (*other.via, other.to_id)}
        bodies = ((one, body) for one in on for body in self._bodies.get(one, ()) if body.vehicle == vehicle)
        return any(self._distance_m(body, one, rest) < _APART_M for one, body in bodies)

    def _may_creep_m(self, vehicle: str, most_m: float, unseen_m: float = _CREEP_M / 2) -> float:
        """Return how far a vehicle can creep on until those before it have closed up [m], or `most_m`.

        Inside a junction with nobody before it: `unseen_m`; bodies across its way are not looked at. Those in
        a circle come round a little, although there is no space.
        """
        on_m, seen = 0.0, set[str]()
        while on_m < most_m:
            if vehicle in seen:
                return min(most_m, max(on_m, _CLOSE_M))
            seen.add(vehicle)
            lane, front_m = self._lane[vehicle]
            left_m, (_, gap_m) = self._left_m(lane, front_m), self._road.size(vehicle)
            ahead = next(((one, one.rear_m) for one in self._bodies[lane] if one.front_m > front_m), None)
            if ahead is None and not self._network.lanes[lane].internal:
                return min(most_m, on_m + left_m)
            if ahead is None:
                way = self._over[lane][0]
                left_m += self._way_m(way) - self._way_m(way, lane) - self._network.lanes[lane].length_m
                beyond = self._beyond(vehicle, way, most_m)
                ahead = next(((one, front_m + left_m + most_m - by_m) for one, by_m in beyond), None)
            if ahead is None:
                return min(most_m, on_m + unseen_m)
            on_m += max(0.0, ahead[1] - front_m - gap_m)
            vehicle = ahead[0].vehicle
        return most_m

    def _way_m(self, way: Connection, before: str = "") -> float:
        """Return the length of a movement over its junction [m], or of its part before a lane."""
        via = way.via[: way.via.index(before)] if before in way.via else way.via
        return sum(self._network.lanes[lane].length_m for lane in via)

    def _behind_m(self, way: Connection, lane: str, one: Occupant) -> float:
        """Return how far the rear of a vehicle is along a movement [m]."""
        return self._way_m(way, lane) + one.rear_m

    def _left_over(self, way: Connection, lane: str, one: Occupant) -> float:
        """Return how far it is from a vehicle inside a junction to the end of a movement [m]."""
        return self._way_m(way) - self._way_m(way, lane) - one.front_m

    def _across(
        self, vehicle: str, way: Connection, path: LineString, left_m: float, rest: LineString | None
    ) -> list[str]:
        """Return the vehicles whose bodies cross a path for good.

        Who came from the same lane is followed as on a lane, until the ways are apart. `rest` is what is
        left of its way, if it is inside: beside it stands whoever is on a lane that its front has crossed.
        """
        found, half_m = [], self._network.lanes[way.via[0]].width_m / 2.0
        follows_m = self._way_m(way) - left_m + self._road.size(vehicle)[1] + _CREEP_M / 2
        for other in self._at[way.junction]:
            merges = other is not way and way.to_id == other.to_id
            for lane in (*other.via, other.to_id):
                on_exit = lane == other.to_id
                crosses = not (merges or on_exit or way.from_id == other.from_id)
                if rest and crosses and not rest.intersects(self._line((lane,)) or rest):
                    continue
                apart_m = _APART_M if way.from_id == other.from_id or (merges and not on_exit) else half_m
                for one in self._bodies.get(lane, ()):
                    if one.vehicle in found or one.vehicle == vehicle or self._is_past(one, lane, on_exit):
                        continue
                    if merges and rest and not on_exit and self._left_over(other, lane, one) >= left_m:
                        continue  # it comes after
                    if self._distance_m(one, lane, path) >= apart_m:
                        continue
                    if way.from_id == other.from_id and self._behind_m(other, lane, one) > follows_m:
                        continue
                    on_m = self._creeps_on_m(one.vehicle)
                    ahead = Occupant(one.vehicle, one.front_m + on_m, one.rear_m + on_m)
                    if on_m and self._distance_m(ahead, lane, path) >= apart_m:
                        self._unsettled = True
                    else:
                        found.append(one.vehicle)
        return found

    def _joins_first(self, vehicle: str, way: Connection, left_m: float) -> Iterator[str]:
        """Yield the vehicles inside that join the way of a vehicle before it, so near that it cannot go on.

        They have the right of way. `left_m`: how far it is from the vehicle to the end of its movement [m].
        """
        yields_to = self._network.junctions[
            way.junction
        ].yields_to  # nothing at junctions without right of way
        goes_first = yields_to[way.link] if 0 <= way.link < len(yields_to) else frozenset()
        gap_m = self._road.size(vehicle)[1] + _TOUCHING_M
        for other in self._at[way.junction]:
            if other.link in goes_first and other.to_id == way.to_id and other.from_id != way.from_id:
                for lane in other.via:
                    for one in self._fronts.get(lane, ()):
                        front_m = self._left_over(other, lane, one)
                        if front_m <= left_m <= front_m + one.front_m - one.rear_m + gap_m:
                            yield one.vehicle

    def _is_past(self, one: Occupant, lane: str, on_exit: bool) -> bool:  # noqa: FBT001  of the lane
        """Return whether a vehicle is with its rear on the exit of a junction, or all but there."""
        return one.rear_m >= (0.0 if on_exit else self._network.lanes[lane].length_m - _ALL_BUT_M)

    def _distance_m(self, one: Occupant, lane: str, path: LineString) -> float:
        """Return the distance between a path and the part of a body that is on a lane [m]."""
        line = self._line((lane,))
        length_m = self._network.lanes[lane].length_m
        if line is None or one.rear_m >= length_m:
            return inf
        scale = line.length / max(1e-6, length_m)
        return float(_part(line, one.rear_m * scale, one.front_m * scale).distance(path))

    def _behind(self, vehicle: str, lane: str, over_m: float) -> Iterator[tuple[str, float]]:
        """Yield the lanes behind a lane that so much of a vehicle is still on, and their lengths [m].

        The second value is how far the end of `lane`'s beginning is along each.
        """
        end_m = 0.0
        while over_m > end_m:
            of = self._network.lanes[lane]
            if of.internal:
                ways = self._over.get(lane, [])
                if not ways:
                    return
                at = ways[0].via.index(lane)
                lane = ways[0].via[at - 1] if at else ways[0].from_id
            else:
                onto = [way for one in self._network.edges[of.edge].lanes for way in self._to.get(one.id, ())]
                before, _ = self._road.edges_around(vehicle)
                onto = [way for way in onto if way.from_edge == before]
                ways = [way for way in onto if way.to_id == lane] or onto  # it may have changed lanes
                if not ways or end_m:
                    return
                lane = ways[0].via[-1] if ways[0].via else ways[0].from_id
            end_m += self._network.lanes[lane].length_m
            yield lane, end_m

    def _line(self, lanes: tuple[str, ...]) -> LineString | None:
        """Return the line along lanes; None in a network without lanes inside junctions."""
        if lanes not in self._curves:
            points = [point for lane in lanes for point in self._network.lanes[lane].shape]
            self._curves[lanes] = LineString(points if len(points) > 1 else ())
        line = self._curves[lanes]
        return None if line.is_empty else line

    def _around(self, vehicle: str, lane: str, front_m: float, *, at_end: bool) -> set[str]:
        """Return everybody on whom it can depend that a vehicle stands."""
        of, found = self._network.lanes[lane], set[str]()
        if not of.internal:
            found.update(self._on_edge(vehicle, of, front_m))
        if not at_end:
            return found
        ways = self._over.get(lane, []) if of.internal else self._from.get(lane, [])
        leaving = self._is_leaving(lane, ways)
        for junction in dict.fromkeys(way.junction for way in ways):
            for way in self._at[junction]:
                for inside in way.via:
                    found.update(one.vehicle for one in self._bodies.get(inside, ()))
                if leaving:
                    found.update(self._maybe_inside(way.to_edge))
                    continue
                if of.internal and not any(way is one or self._network.are_foes(one, way) for one in ways):
                    continue  # it yields to those alone whose ways cross or join its own
                found.update(one.vehicle for one in self._bodies.get(way.to_id, ())[:1])
                found.update(self._next_from(way.from_id, _APPROACH_M))
        found -= {one.vehicle for one in self._bodies.get(lane, ()) if one.front_m < front_m}
        for way in self._ways(vehicle, lane):
            beyond = self._beyond(vehicle, way, sum(self._road.size(vehicle)) + _AHEAD_M)
            found.update(one.vehicle for one, _ in islice(beyond, 1))
        return found

    def _maybe_inside(self, exit_edge: str) -> Iterator[str]:
        """Yield the vehicles whose rears may still be inside the junction before an edge, by any way."""
        if not self._road.knows_sizes:
            for lane in self._network.edges[exit_edge].lanes:
                first = self._bodies.get(lane.id, ())[:1]
                yield from (one.vehicle for one in first if one.front_m < _LONGEST_M)

    def _on_edge(self, vehicle: str, lane: Lane, front_m: float) -> Iterator[str]:
        """Yield the vehicles on its edge and on the lanes after it on which the choice of a lane depends."""
        for other in self._network.edges[lane.edge].lanes:
            if abs(other.index - lane.index) == 1:
                yield from self._beside(vehicle, other.id, front_m, _BEHIND_M, _AHEAD_M)
                behind = [one.vehicle for one in self._fronts.get(other.id, ()) if one.front_m <= front_m]
                yield from behind[-1:] or self._next_onto(other.id)
            if abs(other.index - lane.index) <= 1:
                ahead = (one for one in self._bodies.get(other.id, ()) if one.front_m > front_m)
                yield from (one.vehicle for one in islice(ahead, 1))
        for lanes, _, _ in self._road.lanes_for(vehicle) or ():
            yield from (one.vehicle for other in lanes[1:] for one in self._bodies.get(other, ()))

    def _next_onto(self, lane: str) -> Iterator[str]:
        """Yield the vehicles that come next onto a lane."""
        for way in self._to.get(lane, ()):
            yield from (one.vehicle for over in way.via for one in self._bodies.get(over, ()))
            yield from self._next_from(way.from_id, _APPROACH_M)

    def _next_from(self, lane: str, within_m: float) -> Iterator[str]:
        """Yield the vehicles that come next to the end of a lane, within a distance of it [m]."""
        ahead, seen = [(0.0, lane)], {lane}
        while ahead:
            before_m, lane = heappop(ahead)
            if some := self._fronts.get(lane):
                yield some[-1].vehicle
                continue
            before_m += self._network.lanes[lane].length_m
            if before_m >= within_m:
                continue
            for way in self._to.get(lane, ()):
                inside = [one.vehicle for over in way.via for one in self._fronts.get(over, ())]
                yield from inside
                if not inside and way.from_id not in seen:
                    seen.add(way.from_id)
                    heappush(ahead, (before_m, way.from_id))


class SimulatedRoad:
    """The vehicles of a running simulation, for `RoadWaits`.

    `gated` are the vehicles that change lanes only where their routes demand it.
    """

    knows_sizes = True

    def __init__(self, traffic: Traffic, gated: Container[str] = ()) -> None:
        self._traffic, self._gated = traffic, gated
        self._sizes: dict[str, tuple[float, float]] = {}
        self._routes: dict[str, tuple[str, list[str]]] = {}
        self._leads: dict[str, Sequence[LeadsOn]] = {}
        self._wishes: dict[str, tuple[int, bool]] = {}
        """What has been read since all vehicles were read last."""

    def on_lanes(self) -> Iterator[tuple[str, str, float]]:
        """Yield each vehicle on the road with the lane and the position of its front [m]."""
        here = self._traffic.whereabouts()
        sizes = {
            vehicle: self._sizes.get(vehicle) or self._traffic.size(vehicle) for vehicle in here.vehicles
        }
        self._sizes, self._routes, self._leads, self._wishes = sizes, {}, {}, {}
        still = (here.speeds_mps < STANDING_MPS).tolist()
        for vehicle, lane, front_m, stands in zip(
            here.vehicles, here.lanes, here.positions_m.tolist(), still, strict=True
        ):
            if not (stands and self._traffic.parks(vehicle)):
                yield vehicle, lane, front_m

    def size(self, vehicle: str) -> tuple[float, float]:
        """Return the length and the minimum gap of a vehicle [m]."""
        return self._sizes[vehicle]

    def edges_around(self, vehicle: str) -> tuple[str, Sequence[str]]:
        """Return the edges before and after the one that a vehicle is on, or came from if it is inside."""
        if vehicle not in self._routes:
            route, at = self._traffic.route(vehicle)
            self._routes[vehicle] = route[at - 1] if at > 0 else "", list(route[at + 1 :])
        return self._routes[vehicle]

    def lanes_for(self, vehicle: str) -> Sequence[LeadsOn]:
        """Return how the lanes of its edge lead on; a gated vehicle stays on its lane if it is a best one."""
        if vehicle not in self._leads:
            lanes = [LeadsOn(*one) for one in self._traffic.goes_on(vehicle)]
            if vehicle in self._gated:
                best = [one for one in lanes if not one.to_best]
                here, _ = self._traffic.lane(vehicle)
                lanes = [one for one in best if one.lanes[0] == here] or best
            self._leads[vehicle] = lanes
        return self._leads[vehicle]

    def lane_wish(self, vehicle: str) -> tuple[int, bool]:
        """Return to which side a vehicle must change lanes and cannot, and whether it lets another do so."""
        if vehicle not in self._wishes:
            self._wishes[vehicle] = self._traffic.lane_wish(vehicle)
        return self._wishes[vehicle]

    def faces_red(self, vehicle: str) -> bool:
        """Return whether the next light is red for a vehicle."""
        return self._traffic.faces_red(vehicle)

    def cycle_s(self, light: str) -> float:
        """Return the time in which a light shows all its phases [s]."""
        return sum(phase.longest_s for phase in self._traffic.light_program(light).phases)


def _part(line: LineString, from_m: float, to_m: float) -> LineString:
    """Return a part of a line; a point as a line without length."""
    part = substring(line, max(0.0, from_m), max(0.0, to_m))
    return part if isinstance(part, LineString) else LineString([part, part])


def _of_all(every: Sequence[Sequence[Sequence[str]]]) -> list[list[str]]:
    """Return the sets of a vehicle with several ways to go on, from the sets of each way.

    It can go on as soon as one way is free, so each set takes one set of every way. Of many sets some are
    left out: then the vehicle only seems more free than it is.
    """
    if not every or not all(every):
        return []
    if len(every) == 1:
        return [list(some) for some in every[0]]
    few = _MOST_SETS if len(every) <= _MOST_SETS else 2
    return [sorted({one for some in chosen for one in some}) for chosen in product(*(s[:few] for s in every))]
