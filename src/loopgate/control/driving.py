"""Drives the vehicles of a run through the ledger: steps SUMO, answers requests, holds and releases."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf
from time import perf_counter
from types import MappingProxyType

from loopgate.abstraction.itinerary import Track
from loopgate.control.arrivals import Arrivals
from loopgate.control.brakes import Brakes
from loopgate.control.courtesy import Courtesy
from loopgate.control.diary import Diary, Row, look, write_down
from loopgate.control.fronts import Fronts
from loopgate.control.layout import Layout
from loopgate.control.leading import may_turn_off, turn_off
from loopgate.control.ledger import Ledger
from loopgate.control.lights import Lights
from loopgate.control.ordinary import is_too_full
from loopgate.control.parking import Parking, put_in_order
from loopgate.control.paths import Paths
from loopgate.control.places import Leg, Make, Vehicle
from loopgate.control.sight import Sight
from loopgate.control.spacing import Spacing
from loopgate.control.steering import Steering
from loopgate.control.stops import Stops
from loopgate.control.totals import Totals
from loopgate.control.used_stops import UsedStops
from loopgate.errors import ClosedLaneError, TrafficError
from loopgate.network.stops import Stop
from loopgate.results.columns import TAKEN_OUT, Event
from loopgate.traffic.base import Traffic


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
        layout: Layout,
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
        self.lights = Lights(traffic)
        self._courtesy = Courtesy(traffic)
        self.parking = Parking(traffic, ledger, has_room, self.rows)
        self.stops = Stops(traffic, ledger, stops, self.parking, self.rows)
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
            like = traffic.dynamics(track.vehicle)
            haste = max(1.0, like.speed_factor)
            make = Make(
                like.length_m,
                like.accel_mps2,
                like.decel_mps2,
                track.top_speed_mps * haste,
                haste,
                like.min_gap_m,
                # An ordinary vehicle may hold up a vehicle that also obeys SUMO's right of way.
                foreseen=track.foreseen and not traffic.gives_way,
                brakes_late=track.brakes_late,
            )
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
            vehicle, again = self.ledger.vehicles[track.vehicle], bool(track.renewed_on)
            self.stops.take_in(vehicle, track.edges, track.renewed_on, again=again)
            if self._spacing is not None:
                self._spacing.take_in(vehicle, track.loop)
            if again:
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
        self.steering.forget(vehicle)
        self.brakes.forget(vehicle)
        self.used_stops.forget(vehicle)
        self.lights.forget(vehicle)
        self._courtesy.forget(vehicle)
        self.stops.forget(vehicle)
        if self._spacing is not None:
            self._spacing.forget(vehicle)
        self.ledger.log = [one for one in self.ledger.log if one[1] is not vehicle]
        del self.diaries[row]
        self.fronts.drop(row)
        for later in self.diaries[row:]:
            later.vehicle.row -= 1

    def turn_off(self, vehicle: Vehicle, track: Track, edges: Sequence[str]) -> bool:
        """Lead a vehicle to another path from its place, which is leg `track.position` of that path.

        Return whether that can be done now. `edges`: its route in SUMO.
        """
        path, make = self.paths.of(track), vehicle.make
        if not may_turn_off(vehicle, path[track.position]):
            return False
        self._traffic.lead(vehicle.name, edges)
        kind = make.with_top(track.top_speed_mps * make.haste)
        by_m = turn_off(self.ledger, vehicle, path[track.position], kind, track.lap_m)
        row = vehicle.row
        self.fronts.shift(row, by_m)
        self.diaries[row].turns_off(track, path, by_m)
        self.used_stops.turned_off(vehicle)
        if vehicle.name in self._round:
            self._round[vehicle.name] = path
        if self._spacing is not None:
            self._spacing.forget(vehicle)
            self._spacing.take_in(vehicle, track.loop)
        self.changes += 1
        self.rows.append(
            (self._traffic.now_s, vehicle.name, Event.REROUTE, vehicle.leg.place.name, track.loop)
        )
        return True

    def jumped(self, name: str, skipped_m: float) -> None:
        """Note that SUMO moved a vehicle `skipped_m` ahead without driving."""
        diary = self.diaries[self.ledger.vehicles[name].row]
        self.fronts.jumped(diary.vehicle.row, skipped_m)
        diary.jumped(skipped_m)

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
        for name in self._traffic.arrived():
            if name in self.ledger.vehicles:
                self.leave(name, self._why_gone(name))
        there = len(self.diaries)
        self.arrivals.come(self.welcome)
        fronts_m, driven_m = self.fronts.read(there)
        seen = look(self.diaries, fronts_m, self.ledger, self.rows)
        for vehicle in seen.renewed:
            self._hold_anew(vehicle)
        self.brakes.look()
        self.totals.look(seen, there, driven_m)
        for name in self._traffic.halted():
            if name in self.diary_of:
                self._halts(self.diary_of[name], now_s)
        for vehicle in self.steering.step():
            if vehicle.held:
                self._hold(vehicle)
            self.ledger.consider(vehicle)
        self.stops.look()
        self.answer()
        self.used_stops.look(self.diaries)
        if self._spacing is not None:
            self._spacing.look()
        if self._gated:
            self.steering.look_for_strays(self.diaries)

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
            if vehicle.held:
                vehicle.held = vehicle.halted = False
                if self.diaries[vehicle.row].goes_on(now_s):
                    self.rows.append((now_s, vehicle.name, Event.GO, vehicle.leg.place.name, ""))
                if not self.steering.leads_back(vehicle):
                    self._traffic.release(vehicle.name)
            if vehicle.steered:
                before = vehicle.granted - 1
                drawn = self.diaries[vehicle.row].drawn(before)
                laps_m = before // len(self.diaries[vehicle.row].track.legs) * vehicle.lap_m
                self.steering.begin(vehicle, drawn.guides, laps_m + drawn.end_m)
        for vehicle in stay:
            if not vehicle.held:
                self._hold(vehicle)
        self.lights.look(gone, stay)
        if self.is_courteous:
            self._courtesy.look(gone)

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
