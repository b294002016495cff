"""Drives the vehicles of a run through the ledger: steps SUMO, answers requests, holds and releases."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from math import inf
from time import perf_counter
from types import MappingProxyType
from typing import Final

import numpy as np

from loopgate.abstraction.itinerary import Track
from loopgate.arrays import Floats
from loopgate.control.courtesy import Courtesy
from loopgate.control.diary import Diary, Queue, Row, StepSeen, look, write_down
from loopgate.control.holds import Brakes, UsedStops
from loopgate.control.layout import Drawings, PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.lending import Lending
from loopgate.control.lights import Lights
from loopgate.control.ordinary import is_too_full
from loopgate.control.parking import Parking, put_in_order
from loopgate.control.part import Part
from loopgate.control.places import STANDING_MPS, Body, Leg, Make, Movement, Place, Vehicle
from loopgate.control.sight import Sight
from loopgate.control.spacing import Spacing
from loopgate.control.steering import Steering
from loopgate.control.stops import Stops
from loopgate.errors import ClosedLaneError, TrafficError
from loopgate.network.stops import Stop
from loopgate.results.columns import TAKEN_OUT, Event
from loopgate.traffic.base import Dynamics, Insertion, Traffic


class Paths:
    """The paths that have been laid out, in a layout.

    Vehicles with the same drawn legs share a path.
    """

    def __init__(self, layout: PlaceLayout) -> None:
        self._layout = layout
        self._laid: dict[int, tuple[Drawings, list[Leg]]] = {}
        """The drawn legs and their path, by identity of the drawn legs."""
        self._on_edge: dict[str, list[Place]] = {}
        """The places by their edge."""
        self._over_edge: dict[str, list[Movement]] = {}
        """The movements to lanes that are no places, by the edge of the lane."""
        self.places = layout.places
        """The places, by name."""

    def of(self, track: Track) -> list[Leg]:
        """Return the legs of a path; it is laid out when it is first asked for."""
        key = id(track.legs)
        laid = self._laid.get(key)
        if laid is None:
            laid = self._laid[key] = track.legs, self._layout.path(track.legs)
        return laid[1]

    def bodies_beside(self, leg: Leg) -> Iterator[Body]:
        """Yield the vehicles that hold slots on the other lanes of the edge of a leg's place."""
        self._sort()
        for place in self._on_edge.get(_edge(leg.place.name), ()):
            if place is not leg.place:
                yield from place.bodies

    def is_passed(self, leg: Leg) -> bool:
        """Return whether a vehicle drives, or is about to, over another lane of the edge that is no place."""
        self._sort()
        for movement in self._over_edge.get(_edge(leg.place.name), ()):
            for trip in movement.junction.trips:
                begin_m = trip.line_m + trip.over.ahead_m
                if trip.over.movement is movement and trip.vehicle.front_m > begin_m - _COMES_M:
                    return True
        return False

    def _sort(self) -> None:
        """Sort places and movements by edge, once."""
        if self._on_edge:
            return
        for place in self.places.values():
            self._on_edge.setdefault(_edge(place.name), []).append(place)
        lanes = {_lane(name) for name in self.places}
        for movement in self._layout.movements:
            lane = movement.name.partition(">")[2]
            if lane not in lanes:
                self._over_edge.setdefault(_edge(lane), []).append(movement)

    def _sort_anew(self) -> None:
        self._on_edge.clear()
        self._over_edge.clear()

    def lay(self, tracks: Iterable[Track]) -> None:
        """Lay paths out before vehicles come."""
        for track in tracks:
            self.of(track)

    def lay_more(
        self, slots: Mapping[str, int], ways: Mapping[str, Drawings], diaries: Sequence[Diary]
    ) -> None:
        """Lay more paths out while vehicles drive; the places that exist stay.

        Parameters
        ----------
        slots
            The slots of all places.
        ways
            The drawn legs of all paths, by the name of the loop.
        diaries
            The diaries of the vehicles on the road.
        """
        laid = {id(diary.path): (diary.path, ways[diary.track.loop]) for diary in diaries}
        self._layout.extend(slots, list(ways.values()), list(laid.values()))
        self._laid.clear()
        self._sort_anew()

    def lay_anew(self, layout: PlaceLayout) -> None:
        """Use another layout; no vehicle is on the road."""
        self._layout, self.places = layout, layout.places
        self._laid.clear()
        self._sort_anew()


def _lane(place: str) -> str:
    """Return the lane of a place, which is called by it."""
    return place.partition("/")[0]


def _edge(place: str) -> str:
    """Return the edge of a place, or of a lane."""
    return _lane(place).rpartition("_")[0]


_GAP_M: Final = 2.5
"""The gap of a new vehicle to the vehicle ahead [m]."""

_COMES_M, _ACROSS_M = 15.0, 3.0
"""A vehicle is about to come to a lane if it is nearer than the first; it swings over the lane beside while
more than the second of it is not yet on its own [m]."""


class Arrivals:
    """Inserts vehicles in SUMO, and puts them into the ledger in the step in which they depart."""

    def __init__(self, traffic: Traffic, ledger: Ledger, paths: Paths) -> None:
        self._traffic, self._ledger, self._paths = traffic, ledger, paths
        self.coming: list[Track] = []
        """The vehicles that shall depart in the next step, with their paths."""
        self._kept: dict[str, dict[Place, float]] = {}
        """The metres that are kept for each of these ahead of it [m]."""
        self._held: set[str] = set()
        """Those of them that are held."""
        self.missed: list[Track] = []
        """The vehicles that found no space on the road in the last step, with their paths."""
        self.departed_s: dict[str, float] = {}
        """When each vehicle of `let_in` departed [s]."""

    def let_in(self, track: Track, insertion: Insertion, needed_m: float = 0.0) -> bool:
        """Let a vehicle depart in the next step; call it only if `is_clear` and `Ledger.fits` allow that.

        It is held at its stop line unless it asks before it must brake for that, however fast it departs.
        Return False if SUMO cannot insert it so that it can brake there. `needed_m`: its length with its gap
        [m].
        """
        leg = track.legs[track.position]
        self._traffic.put_in(track.vehicle, insertion)
        make = make_for(track, self._traffic)
        if leg.end_m - track.front_m <= make.asks_within_m():
            try:
                self._traffic.hold(track.vehicle, leg.line.edge, leg.line.lane, leg.line.position_m)
            except TrafficError:
                self._traffic.take_out(track.vehicle)
                return False
            self._held.add(track.vehicle)
        self.coming.append(track)
        self._kept[track.vehicle] = self._ledger.reserve(self._leg_of(track), needed_m)
        return True

    def come(self, welcome: Callable[[Sequence[Track]], None]) -> None:
        """Call `welcome` for each vehicle that has departed, before the ledger grants its slot to another."""
        departed = set(self._traffic.departed()) if self.coming else set[str]()
        coming, self.coming, self.missed = self.coming, [], []
        for track in coming:
            self._ledger.come(self._leg_of(track), self._kept.pop(track.vehicle))
            # Two vehicles that come in one step could close a circle together.
            if track.vehicle in departed and self._fits(track):
                welcome([track])
                self._ledger.vehicles[track.vehicle].held = track.vehicle in self._held
                self.departed_s[track.vehicle] = self._traffic.now_s - self._traffic.step_s
            else:
                self._traffic.take_out(track.vehicle)
                self.missed.append(track)
            self._held.discard(track.vehicle)

    def _fits(self, track: Track) -> bool:
        return self._ledger.fits(self._leg_of(track), sum(self._traffic.size(track.vehicle)))

    def _leg_of(self, track: Track) -> Leg:
        return self._paths.of(track)[track.position]

    def is_clear(self, track: Track, gap_m: float = _GAP_M) -> bool:
        """Return whether the place where a vehicle starts has a free slot, and all its vehicles are ahead.

        `gap_m`: the gap that the vehicle keeps to them [m].
        """
        leg = self._paths.of(track)[track.position]
        clear_m = track.front_m - leg.begin_m + gap_m
        if leg.place.is_full():
            return False
        for body in leg.place.bodies:
            other = body.vehicle
            rear_m = other.front_m - body.begin_m - other.make.length_m
            if rear_m < clear_m or (other.parks and other.stops_here()):
                return False
        return not (any(map(_swings_in, self._paths.bodies_beside(leg))) or self._paths.is_passed(leg))


def _swings_in(body: Body) -> bool:
    """Return whether a vehicle lies across the beginning of its place, or is about to."""
    front_m = body.vehicle.front_m - body.begin_m
    return front_m > -_COMES_M and front_m - body.vehicle.make.length_m < -_ACROSS_M


class Fronts:
    """The fronts of all vehicles after the last step: what their odometers say, on their paths.

    `names`: the vehicles, in the order of their rows. `vehicles`: the same as objects of the ledger.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.names: list[str] = []
        self.vehicles: list[Vehicle] = []
        self._shifts_m: dict[Vehicle, float] = {}
        """By how much arc lengths are larger on the present path than on the first, where they are [m]."""

    def add(self, vehicles: Sequence[Vehicle]) -> None:
        """Add vehicles that have come, with their fronts as they are now."""
        names = [vehicle.name for vehicle in vehicles]
        for vehicle, odometer_m in zip(vehicles, self._traffic.odometers(names), strict=True):
            vehicle.offset_m = vehicle.front_m - odometer_m
            vehicle.front_m = odometer_m + vehicle.offset_m  # as it is read: it has not moved by rounding
        self.names += names
        self.vehicles += vehicles

    def keep(self, rows: Sequence[int]) -> None:
        """Keep the vehicles in these rows, in their order, and drop the others."""
        self.names = [self.names[row] for row in rows]
        self.vehicles = [self.vehicles[row] for row in rows]
        if self._shifts_m:
            there = set(self.vehicles)
            self._shifts_m = {one: by_m for one, by_m in self._shifts_m.items() if one in there}

    def shift(self, vehicle: Vehicle, by_m: float) -> None:
        """Note that a vehicle has changed to another path, where arc lengths are `by_m` larger."""
        self._shifts_m[vehicle] = self._shifts_m.get(vehicle, 0.0) + by_m
        vehicle.offset_m += by_m

    def as_driven(self) -> list[float]:
        """Return the arc length of each front [m]; other paths continue the first path of a vehicle."""
        if not self._shifts_m:
            return [vehicle.front_m for vehicle in self.vehicles]
        return [vehicle.front_m - self._shifts_m.get(vehicle, 0.0) for vehicle in self.vehicles]

    def odometers(self) -> Floats:
        """Return the odometers as they were after the last step [m]."""
        return np.array([vehicle.front_m - vehicle.offset_m for vehicle in self.vehicles])


class Totals:
    """Sums over the vehicles on the road and the vehicles that have left.

    `queues`: since `counts_from_s`, the queues on each edge on the way to the next edge. `leaps`: vehicle,
    time [s] and length [m] of each leap of an odometer.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.queues: dict[tuple[str, str], Queue] = {}
        self.counts_from_s = 0.0
        self.leaps: list[tuple[str, float, float]] = []
        self._steps = self._standing = 0
        self._driven_m = 0.0
        self._laps = self._told_laps = 0
        """Laps of vehicles that have left, and laps that `take_flow` has returned so far."""

    def leaves(self, diary: Diary) -> None:
        """Keep the laps of a vehicle that leaves."""
        self._laps += diary.all_laps

    def look(self, seen: StepSeen, diaries: Sequence[Diary], there: int) -> None:
        """Count one step. `there`: how many vehicles were there before the step; those are the first."""
        self._steps += 1
        self._driven_m += seen.driven_m
        for vehicle, moved_m in seen.leapt:
            self._note_leap(diaries[vehicle.row], moved_m, self._traffic.now_s)
        # A vehicle does not move in the step in which it departs.
        standing = [diaries[vehicle.row] for vehicle in seen.still if vehicle.row < there]
        if standing:
            self._stand(standing, self._traffic.step_s, self._traffic.now_s)

    def _stand(self, diaries: Sequence[Diary], step_s: float, now_s: float) -> None:
        self._standing += len(diaries)
        if now_s >= self.counts_from_s:
            queues: list[Queue] = []
            for diary in diaries:
                diary.stands(step_s, now_s)
                queue = diary.queue
                if queue is None:
                    queue = diary.queue = self.queues.setdefault(diary.movement, Queue())
                if not queue.now:
                    queues.append(queue)
                queue.now += 1
            for queue in queues:
                queue.steps[queue.now] = queue.steps.get(queue.now, 0) + 1
                queue.now = 0

    def _note_leap(self, diary: Diary, moved_m: float, now_s: float) -> None:
        name = diary.vehicle.name
        true_mps = self._traffic.speed(name)
        leap_m = moved_m - true_mps * self._traffic.step_s
        diary.leapt_m += leap_m
        self._driven_m -= leap_m
        self.leaps.append((name, now_s, leap_m))
        if true_mps < STANDING_MPS:
            self._stand([diary], self._traffic.step_s, now_s)

    def take_flow(self, diaries: Sequence[Diary]) -> tuple[int, float, float, int]:
        """Return the number of vehicles and the flow since the last call.

        The flow is the mean number of vehicles that stood, the distance of all vehicles [m], and their laps.
        """
        laps = self._laps + sum(diary.all_laps for diary in diaries)
        told = len(diaries), self._standing / max(1, self._steps), self._driven_m, laps - self._told_laps
        self._steps = self._standing = 0
        self._driven_m = 0.0
        self._told_laps = laps
        return told


def may_turn_off(ledger: Ledger, vehicle: Vehicle, leg: Leg) -> bool:
    """Return whether a vehicle can now change to another path, on which its place is `leg`.

    It can if it holds its place and nothing else, is neither steered nor a mover, and closes no circle of
    full places by the change.
    """
    if not vehicle.is_settled() or vehicle.steered or vehicle.mover:
        return False
    return ledger.may_turn(vehicle, leg)


def turn_off(ledger: Ledger, vehicle: Vehicle, leg: Leg, make: Make, lap_m: float) -> float:
    """Move a vehicle to another path as `Ledger.turn_off` does; it asks anew."""
    withdraw(ledger, vehicle)
    by_m = ledger.turn_off(vehicle, leg, make, lap_m)
    ledger.consider(vehicle)
    return by_m


def withdraw(ledger: Ledger, vehicle: Vehicle) -> None:
    """Forget the request of a vehicle and why it was refused; its wait so far still counts."""
    if vehicle.asks:
        vehicle.longest_s = max(vehicle.longest_s, ledger.now_s - vehicle.since_s)
    ledger.withdraw(vehicle)
    vehicle.reason = vehicle.cause = ""
    vehicle.refused_s.clear()


class Driving:
    """Drives vehicles along their paths, under the rules of a ledger.

    It reads all vehicles in one call after a step. All other work is only for vehicles that have reached a
    point where something is due.

    Parameters
    ----------
    traffic
        The running simulation.
    layout, ledger
        Places and paths; the ledger, without vehicles yet.
    sight
        Reads ordinary vehicles; None without ordinary traffic.
    stops
        For each vehicle, its stops in a round, in the order of its loop.
    has_room
        Returns whether ordinary vehicles leave space for a vehicle in its place.
    spacing
        Spaces vehicles on loops; its rule is one of the ledger's.
    """

    def __init__(
        self,
        traffic: Traffic,
        layout: PlaceLayout,
        ledger: Ledger,
        sight: Sight | None = None,
        stops: Mapping[str, Sequence[Stop]] = MappingProxyType({}),
        has_room: Callable[[Vehicle], bool] = lambda _: True,
        spacing: Spacing | None = None,
    ) -> None:
        self._traffic, self.ledger, self.sight = traffic, ledger, sight
        self._gated = bool(ledger.rules)
        self.paths = Paths(layout)
        self.arrivals = Arrivals(traffic, ledger, self.paths)
        self.rows: list[Row] = []
        """The events: time [s], vehicle, event, place, reason."""
        self.stages: dict[int, str] = {}
        """The stage of the gate that decided, by number of the event in `rows`."""
        self._spacing = spacing
        if spacing is not None:
            ledger.keeping.is_behind = spacing.is_behind
        if sight is not None:
            ledger.keeping.is_too_full = is_too_full
        self._round: dict[str, list[Leg]] = {}
        """The paths of the vehicles that drive loops, by name."""
        self.diaries: list[Diary] = []
        self.diary_of: dict[str, Diary] = {}
        """The diaries by name of the vehicle."""
        self.fronts = Fronts(traffic)
        """The positions of the vehicles, in the order of `diaries`."""
        self.totals = Totals(traffic)
        self.steering = Steering(traffic, self.rows)
        self.brakes = Brakes(traffic, self.rows)
        self.used_stops = UsedStops(traffic)
        self.lights, self._lit = Lights(traffic), layout.is_lit
        self.lending = Lending(traffic, ledger)
        self._courtesy = Courtesy(traffic)
        self.parking = Parking(traffic, ledger, has_room, self.rows)
        self.stops = Stops(traffic, ledger, stops, self.parking, self.rows)
        self.parts: list[Part] = [self.steering, self.brakes, self.used_stops, self.lights]
        """What keeps something of each vehicle."""
        self.parts += [self.lending, self._courtesy, self.stops, *([] if spacing is None else [spacing])]
        self.is_courteous = sight is not None
        """Whether vehicles slow down before junctions to which an ordinary vehicle comes."""
        self.on_leaving: Callable[[Diary, str], None] = lambda _diary, _why: None
        """Called with the diary of each vehicle that leaves, and the reason."""
        self.on_answer: Callable[[int, float], None] = lambda _decisions, _took_s: None
        """Called after each answer with the number of decisions and the time that they took [s]."""
        self.taken_out: list[str] = []
        """The vehicles that SUMO took out before the end of their routes, as calibrators do."""
        self.sumo_s = 0.0
        """Wall time in SUMO's steps [s]."""
        self.changes = 0
        """How often vehicles have come or gone."""

    def take_in(self, tracks: Sequence[Track]) -> None:
        """Put vehicles on the road under the ledger, in line where they are, and answer requests."""
        self.welcome(tracks)
        self.answer()

    def welcome(self, tracks: Sequence[Track], beyond: int = 0) -> None:
        """Put vehicles on the road under the ledger; then call `answer`.

        `beyond`: how many vehicles more than its slots a place may hold.
        """
        traffic, first = self._traffic, len(self.diaries)
        self.ledger.now_s = traffic.now_s
        self.changes += len(tracks)
        made = self.ledger.made
        for number, track in sorted(enumerate(tracks, made), key=lambda one: _behind_m(one[1])):
            make = make_for(track, traffic)
            vehicle = self.ledger.take_in(
                track.vehicle, self.paths.of(track), track.position, make, track.lap_m, beyond, number
            )
            vehicle.front_m, vehicle.speed = track.front_m, traffic.speed(track.vehicle)
            put_in_order(self.ledger, vehicle)
        for track in tracks:
            vehicle = self.ledger.vehicles[track.vehicle]
            vehicle.row = len(self.diaries)
            diary = Diary(vehicle, track, self.paths.of(track))
            self.diaries.append(diary)
            self.diary_of[track.vehicle] = diary
            if self._gated:
                traffic.put_under_gate(track.vehicle, keeps_lane=track.keeps_lane)
                self.rows.append((traffic.now_s, track.vehicle, Event.START, vehicle.leg.place.name, ""))
            self.rows.append((traffic.now_s, track.vehicle, Event.EDGE, diary.edge, ""))
        fresh = self.diaries[first:]
        self.fronts.add([diary.vehicle for diary in fresh])
        for diary in fresh:
            self.ledger.passed(diary.vehicle)
        for track in tracks:
            vehicle = self.ledger.vehicles[track.vehicle]
            for part in self.parts:
                part.take_in(vehicle, track)
            if track.renewed_on:
                self._round[track.vehicle] = self.paths.of(track)
        if any(track.vehicle in self._round for track in tracks):
            self._leave_room()

    def _leave_room(self) -> None:
        """Set the share of slots from which places are crowded."""
        if self.ledger.pressing is not None:
            paths = {id(path): path for path in self._round.values()}
            places = {leg.place: None for path in paths.values() for leg in path}
            self.ledger.pressing.room_for(len(self.ledger.vehicles), places)

    @property
    def once(self) -> int:
        """The number of vehicles on the road that drive once."""
        return len(self.ledger.vehicles) - len(self._round)

    @property
    def rounds(self) -> Iterable[Sequence[Leg]]:
        """The paths of the vehicles on the road that drive loops."""
        return self._round.values()

    @property
    def granted(self) -> list[int]:
        """The number of the last leg granted to each vehicle, in the order of `diaries`."""
        return [diary.vehicle.granted for diary in self.diaries]

    def leave(self, name: str, why: str = "left") -> None:
        """Release a vehicle, wherever it is; the slots and crossings that it holds become free."""
        self._leave(name, why)
        self._close_up()

    def _leave(self, name: str, why: str) -> None:
        """Release a vehicle; call `_close_up` after the last one, since that looks at all vehicles."""
        vehicle = self.ledger.vehicles[name]
        row = vehicle.row
        if self._gated:
            for body in vehicle.bodies[:-1]:
                self.rows.append((self._traffic.now_s, name, Event.LEAVE, body.place.name, ""))
            self.rows.append((self._traffic.now_s, name, Event.END, vehicle.leg.place.name, why))
            self._traffic.leave_gate(name)
        diary = self.diaries[row]
        self.on_leaving(diary, why)
        self.totals.leaves(diary)
        del self.diary_of[name]
        self.ledger.leave(vehicle)
        self.changes += 1
        if self._round.pop(name, None) is not None:
            self._leave_room()
        for part in self.parts:
            part.forget(vehicle)
        self.ledger.log = [one for one in self.ledger.log if one[1] is not vehicle]

    def _close_up(self) -> None:
        """Take the rows of the vehicles that have left out of all lists; the rows after them move up."""
        rows = [row for row, diary in enumerate(self.diaries) if diary.vehicle.name in self.diary_of]
        self.diaries = [self.diaries[row] for row in rows]
        self.fronts.keep(rows)
        for row, diary in enumerate(self.diaries):
            diary.vehicle.row = row

    def turn_off(self, vehicle: Vehicle, track: Track, edges: Sequence[str]) -> bool:
        """Lead a vehicle to another path from its place, which is leg `track.position` of that path.

        Return whether that can be done now. `edges`: its route in SUMO.
        """
        path, make = self.paths.of(track), vehicle.make
        if not may_turn_off(self.ledger, vehicle, path[track.position]):
            return False
        self.stops.takes_back(vehicle)
        self._traffic.lead(vehicle.name, edges)
        kind = make.with_top(track.top_speed_mps * make.haste)
        by_m = turn_off(self.ledger, vehicle, path[track.position], kind, track.lap_m)
        row = vehicle.row
        self.fronts.shift(vehicle, by_m)
        self.diaries[row].turns_off(track, path, by_m)
        for part in self.parts:
            part.turned_off(vehicle, track)
        if vehicle.name in self._round:
            self._round[vehicle.name] = path
        self.changes += 1
        self.rows.append(
            (self._traffic.now_s, vehicle.name, Event.REROUTE, vehicle.leg.place.name, track.loop)
        )
        return True

    def jumped(self, name: str, skipped_m: float) -> None:
        """Note that SUMO moved a vehicle `skipped_m` ahead without driving."""
        vehicle = self.ledger.vehicles[name]
        vehicle.offset_m += skipped_m
        self.diaries[vehicle.row].jumped(skipped_m)

    def step(self) -> None:
        """Advance SUMO by one step, then call `after_step`."""
        self.ledger.open_up()
        began = perf_counter()
        self._traffic.step()
        self.sumo_s += perf_counter() - began
        self.after_step()

    def after_step(self) -> None:
        """Act after a step of SUMO: read the vehicles, answer requests, and hold or release vehicles."""
        now_s = self._traffic.now_s
        self.ledger.now_s = now_s
        self._say_goodbye(self._traffic.arrived())
        there = len(self.diaries)
        self.arrivals.come(self.welcome)
        odometers_m = self._traffic.odometers(self.fronts.names)
        seen = look(self.fronts.vehicles, self.diaries, odometers_m, self.ledger, self.rows)
        for vehicle in seen.renewed:
            self._hold_anew(vehicle)
        self.brakes.look()
        self.totals.look(seen, self.diaries, there)
        for name in self._traffic.halted():
            if name in self.diary_of:
                self._halts(self.diary_of[name], now_s)
        for vehicle in self.steering.step():
            if vehicle.held:
                self._hold(vehicle)
            self.ledger.consider(vehicle)
        if self.stops.any:
            self.stops.look()
        self.answer()
        self.used_stops.look(self.diaries)
        if self._spacing is not None:
            self._spacing.look()
        if self._gated:
            self.steering.look_for_strays(self.diaries)

    def _say_goodbye(self, arrived: Sequence[str]) -> None:
        """Release the vehicles that SUMO has taken off the road, if they are under the ledger."""
        gone = [name for name in arrived if name in self.ledger.vehicles]
        for name in gone:
            self._leave(name, self._why_gone(name))
        if gone:
            self._close_up()

    def _why_gone(self, name: str) -> str:
        """Return whether a vehicle that SUMO calls arrived was at the end of its route."""
        diary = self.diary_of[name]
        last = len(diary.track.legs) - 2  # the last place on the road
        if not diary.track.legs[-1].away or diary.vehicle.granted >= last:
            return "arrived"
        self.taken_out.append(name)
        return TAKEN_OUT

    def answer(self) -> None:
        """Answer requests, and tell SUMO which vehicles to release and to hold."""
        now_s = self._traffic.now_s
        if self.sight is not None:
            self.sight.look(self.ledger.vehicles, self.changes)
        decisions, began = self.ledger.decisions, perf_counter()
        self.ledger.answer(now_s)
        self.on_answer(self.ledger.decisions - decisions, perf_counter() - began)
        gone, stay = write_down(self.ledger, self.diaries, self.rows, self.stages)
        for vehicle in gone:
            self._go(vehicle, now_s)
        for vehicle in stay:
            if not vehicle.held:
                self._hold(vehicle)
        if self._lit:
            self.lights.look(gone, stay)
            self.lending.look(self.lights.at_red)
        if self.is_courteous:
            self._courtesy.look(gone)

    def _go(self, vehicle: Vehicle, now_s: float) -> None:
        """Let a vehicle drive that has got a grant, and keep it to the lanes of its path."""
        diary = self.diaries[vehicle.row]
        if vehicle.held:
            vehicle.held = vehicle.halted = False
            if diary.goes_on(now_s):
                self.rows.append((now_s, vehicle.name, Event.GO, vehicle.leg.place.name, ""))
            if not self.steering.leads_back(vehicle):
                self._traffic.release(vehicle.name)
        if vehicle.steered:
            before = vehicle.granted - 1
            drawn = diary.drawn(before)
            laps_m = before // len(diary.track.legs) * vehicle.lap_m
            self.steering.begin(vehicle, drawn.guides, laps_m + drawn.end_m)

    def _halts(self, diary: Diary, now_s: float) -> None:
        """Record that a vehicle has come to rest at the stop line where it is held."""
        vehicle = diary.vehicle
        if vehicle.held and diary.halted_s == inf:
            diary.halted_s = now_s
            self.brakes.forget(vehicle)
            self.used_stops.made(vehicle, diary.track)
            vehicle.halted = True
            self.rows.append((now_s, vehicle.name, Event.HOLD, self.wanted(vehicle), ""))

    @staticmethod
    def wanted(vehicle: Vehicle) -> str:
        """Return the name of the next place of a vehicle; an empty text where its path ends."""
        wanted = vehicle.wanted()
        return wanted.name if wanted else ""

    def keep_hold(self, vehicle: Vehicle) -> None:
        """Hold a vehicle again whose owner has taken its hold away."""
        if vehicle.held and self._traffic.lost_hold(vehicle.name):
            self._hold(vehicle)

    def _hold(self, vehicle: Vehicle) -> None:
        line = self.diaries[vehicle.row].drawn(vehicle.granted).line
        vehicle.held = True
        try:
            on_lane = self._traffic.hold(vehicle.name, line.edge, line.lane, line.position_m)
        except ClosedLaneError:  # the vehicle stops before its stop line, since it asked in time
            self._traffic.brake(vehicle.name, hard=False)
        except TrafficError:  # too late to stop there
            self.brakes.overrun(vehicle)
        else:
            if on_lane:
                self.brakes.holds(vehicle)
            else:
                self.steering.lead_back(vehicle, line)

    def _hold_anew(self, vehicle: Vehicle) -> None:
        """Set the vehicle's stop again if SUMO, renewing the route, has put it off by a round."""
        track = self.diaries[vehicle.row].track
        renewed_on = track.renewed_on
        if track.renews:
            self._traffic.renew(vehicle.name, track.rounds[0].route)
        self.stops.renewed(vehicle)
        if not vehicle.held:
            self.steering.renew(vehicle, renewed_on)
        elif vehicle.speed > 0.0 and self.diaries[vehicle.row].drawn(vehicle.granted).line.edge == renewed_on:
            self._traffic.release(vehicle.name)
            self._hold(vehicle)
        self.used_stops.renewed(vehicle)


def _behind_m(track: Track) -> float:
    """Return where the place of a vehicle begins, counted from its front [m]; negative."""
    return track.legs[track.position].begin_m - track.front_m


def make_for(track: Track, traffic: Traffic) -> Make:
    """Return the properties of a vehicle on its path, as the simulator has them now."""
    like = traffic.dynamics(track.vehicle)
    haste = max(1.0, like.speed_factor)
    return make_of(
        like,
        track.top_speed_mps * haste,
        foreseen=track.foreseen,
        brakes_late=track.brakes_late,
    )


def make_of(like: Dynamics, top: float, *, foreseen: bool, brakes_late: bool) -> Make:
    """Return the properties of a vehicle from what the simulator says of it; `top`: its top speed [m/s]."""
    return Make(
        like.length_m,
        like.accel_mps2,
        like.decel_mps2,
        top,
        max(1.0, like.speed_factor),
        like.min_gap_m,
        pace=like.speed_factor,
        own_top=like.top_mps,
        dawdles=like.dawdles,
        foreseen=foreseen,
        brakes_late=brakes_late,
    )
