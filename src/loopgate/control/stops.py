"""Makes the stops of vehicles in every round of a loop; SUMO gets each stop one round ahead.

SUMO knows all stops of the next round, so that persons find a line to their destination. Where a loop passes
a road several times, SUMO gets a stop there only after the last pass before the stop.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import inf, nan
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.diary import Row
from loopgate.control.ledger import Ledger
from loopgate.control.parking import Parking
from loopgate.control.part import Part
from loopgate.control.places import Vehicle, braking_m
from loopgate.errors import TrafficError
from loopgate.network.stops import Stop
from loopgate.traffic.base import Traffic

# Values of `loopgate.results.columns.Event`.
STOP: Final = "stop"
SERVED: Final = "served"
MISSED: Final = "missed"

_PAST_M: Final = 0.5
"""SUMO gets a stop again when the vehicle is this far past its last pass of the spot [m]."""

_MISSED_M: Final = 10.0
"""A vehicle has missed a stop when it is this far past it [m]."""


class _Ahead:
    """A stop to come: at arc length `at_m`, with its number among the vehicle's stops, and its round."""

    def __init__(self, at_m: float, number: int, round_: int) -> None:
        self.at_m: Final = at_m
        self.number: Final = number
        self.round: Final = round_


class _StopsAhead:
    """The stops of one vehicle, in the order of its loop.

    `since_m`: for each stop, how far before it the vehicle passes the same spot for the last time [m].
    `ahead`: the stops of the next round, nearest first. `told`: how many of them SUMO knows. `since_s`: since
    when the vehicle is at a stop [s]; infinite if it is not. `again`: whether it drives a loop. `loop`: the
    loop's name.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        stops: Sequence[Stop],
        since_m: Sequence[float],
        renewed_on: str,
        *,
        again: bool,
        loop: str,
    ) -> None:
        self.loop: Final = loop
        self.vehicle: Final = vehicle
        self.stops: Final = stops
        self.since_m: Final = since_m
        self.renewed_on: Final = renewed_on
        self.again: Final = again
        self.ahead: list[_Ahead] = []
        self.told = 0
        self.since_s = inf


class Stops(Part):
    """Gives SUMO the stops of vehicles, and tells the ledger where the next ones are.

    Parameters
    ----------
    stops
        By vehicle, in the order of its loop.
    parking
        Handles vehicles that park.
    rows
        Gets the events.
    """

    def __init__(
        self,
        traffic: Traffic,
        ledger: Ledger,
        stops: Mapping[str, Sequence[Stop]],
        parking: Parking,
        rows: list[Row],
    ) -> None:
        self._traffic, self._ledger, self._parking, self._rows = traffic, ledger, parking, rows
        self._stops = {vehicle: some for vehicle, some in stops.items() if some}
        self._ways: dict[str, _StopsAhead] = {}
        self._untold: dict[str, None] = {}
        self.served = self.missed = 0
        """How many stops were made, and how many were missed."""
        self.made: dict[str, tuple[int, float]] = {}
        """For each vehicle, how many stops it has made, and how long it stood at them [s]."""
        self.visits: list[tuple[str, str, str, float, float, float]] = []
        """Each stop that was made: vehicle, stop, loop; when it came, went on, and was due to go on [s].
        As in SUMO's ``stop-output`` the time at which the step begins counts."""

        self.any: Final = bool(self._stops)
        """Whether some vehicle has stops; otherwise there is nothing to look at."""

    @property
    def bus_stops(self) -> tuple[str, ...]:
        """The bus stops at which vehicles stop, each once."""
        every = (stop for some in self._stops.values() for stop in some)
        return tuple(dict.fromkeys(stop.name for stop in every if stop.kind == "busStop"))

    def take_in(self, vehicle: Vehicle, track: Track) -> None:
        """Set the stops of a vehicle that has come."""
        stops, lap_m = self._stops.get(vehicle.name), vehicle.lap_m
        if not stops:
            return
        again = bool(track.renewed_on)
        passes = [[begin + stop.end_m for begin, edge in track.edges if edge == stop.edge] for stop in stops]
        since = [
            min((stop.arc_m - at - _PAST_M) % lap_m + _PAST_M for at in some)
            for stop, some in zip(stops, passes, strict=True)
        ]
        way = self._ways[vehicle.name] = _StopsAhead(
            vehicle, stops, since, track.renewed_on, again=again, loop=track.loop
        )
        first_m = vehicle.front_m + braking_m(vehicle.speed, vehicle.make.decel, self._traffic.step_s)
        behind = [] if again else [n for n, stop in enumerate(stops) if stop.arc_m < first_m]
        for number in behind:
            self._miss(way, number)
        found = [
            (first_m + (stop.arc_m - first_m) % lap_m, number)
            for number, stop in enumerate(stops)
            if number not in behind
        ]
        way.ahead = [_Ahead(at_m, number, 0) for at_m, number in sorted(found)]
        self._tell(way)

    def may_take(self, vehicle: str, track: Track) -> bool:
        """Return whether a vehicle can make all its stops on a path: it passes each once, on the same lane.

        It cannot change to another path while its next stop is near.
        """
        way = self._ways.get(vehicle)
        if way is None or not way.again:
            return True
        one = way.vehicle
        brakes_m = braking_m(one.speed, one.make.decel, self._traffic.step_s) + _MISSED_M
        soon = one.stop_m - one.front_m < brakes_m or (one.stops_here() and one.line_m < inf)
        if way.since_s < inf or soon:
            return False
        edges = [edge for _, edge in track.edges]
        lanes = {f"{leg.line.edge}_{leg.line.lane}" for leg in track.legs if leg.line.edge}
        return all(edges.count(stop.edge) == 1 and (stop.lane in lanes or not lanes) for stop in way.stops)

    def takes_back(self, vehicle: Vehicle) -> None:
        """Let SUMO forget the stops that it knows of a vehicle, which is about to change to another path."""
        way = self._ways.get(vehicle.name)
        if way is not None:
            for coming in way.ahead[: way.told]:
                self._traffic.drop_stop(vehicle.name, way.stops[coming.number].in_round(coming.round))
            way.told = 0

    def turned_off(self, vehicle: Vehicle, track: Track) -> None:
        """Set the stops of a vehicle anew on another path, which `may_take` allowed."""
        before = self._ways.get(vehicle.name)
        if before is None:
            return
        begins = {edge: begin_m for begin_m, edge in track.edges}
        stops = [replace(stop, arc_m=begins[stop.edge] + stop.end_m) for stop in before.stops]
        since = [vehicle.lap_m] * len(stops)
        way = _StopsAhead(vehicle, stops, since, track.renewed_on, again=True, loop=before.loop)
        for coming in before.ahead:
            ahead_m = (stops[coming.number].arc_m - vehicle.front_m) % vehicle.lap_m
            if ahead_m < _PAST_M:
                ahead_m += vehicle.lap_m  # it has just made this stop
            way.ahead.append(_Ahead(vehicle.front_m + ahead_m, coming.number, coming.round))
        way.ahead.sort(key=lambda one: one.at_m)
        self._ways[vehicle.name] = way
        self._tell(way)

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._ways.pop(vehicle.name, None)
        self._untold.pop(vehicle.name, None)
        self._parking.forget(vehicle)

    def renewed(self, vehicle: Vehicle) -> None:
        """Set the next stop again if SUMO renewed the route on its edge; else SUMO puts the stop off."""
        way = self._ways.get(vehicle.name)
        if way is None or not way.told:
            return
        coming = way.ahead[0]
        stop = way.stops[coming.number]
        if stop.edge != way.renewed_on or way.since_s < inf:
            return
        stop = stop.in_round(coming.round)
        with suppress(TrafficError):  # SUMO puts the stop off, and it counts as missed
            self._traffic.drop_stop(vehicle.name, stop)
            self._traffic.set_stop(vehicle.name, stop)

    def look(self) -> None:
        """Record the stops that began or ended in the last step; then look after vehicles that park."""
        if self._ways:
            self._look_at_stops()
        self._parking.look()

    def _look_at_stops(self) -> None:
        traffic, now_s = self._traffic, self._traffic.now_s
        for name in traffic.stops_begun():
            way = self._ways.get(name)
            if way is not None and way.since_s == inf:
                way.since_s = now_s
                stop = way.stops[way.ahead[0].number]
                self._note(way, STOP, stop)
                way.vehicle.parks = stop.parks and not self._parking.begin(way.vehicle, stop)
        for name in traffic.stops_ended():
            way = self._ways.get(name)
            if way is not None:
                for _ in range(way.told - traffic.stops_ahead(name)):
                    self._serve(way, now_s)
        for name in sorted(self._untold):
            self._tell(self._ways[name])
        for way in self._ways.values():
            if way.vehicle.front_m > way.vehicle.stop_m + _MISSED_M:
                self._pass_by(way)

    def made_now(self) -> Iterator[tuple[str, Stop]]:
        """Yield each vehicle that stands at a stop, with the stop."""
        for name, way in self._ways.items():
            if way.since_s < inf:
                yield name, way.stops[way.ahead[0].number]

    def _tell(self, way: _StopsAhead) -> None:
        """Give SUMO the next stops that it can take now; tell the ledger where the first of them is."""
        vehicle = way.vehicle
        while way.told < len(way.ahead):
            coming = way.ahead[way.told]
            if vehicle.front_m < coming.at_m - way.since_m[coming.number] + _PAST_M:
                break
            stop = way.stops[coming.number].in_round(coming.round)
            try:
                self._traffic.set_stop(vehicle.name, stop)
            except TrafficError:
                del way.ahead[way.told]
                self._miss(way, coming.number)
                self._put_off(way, coming)
                break
            way.told += 1
        if way.told < len(way.ahead):
            self._untold[vehicle.name] = None
        else:
            self._untold.pop(vehicle.name, None)
        self._show(way)

    def _show(self, way: _StopsAhead) -> None:
        """Tell the ledger where the vehicle's next stop is; a vehicle that drives once may have none left."""
        way.vehicle.stop_m = way.ahead[0].at_m if way.ahead else inf
        way.vehicle.parks = False

    def _serve(self, way: _StopsAhead, now_s: float) -> None:
        done = way.ahead.pop(0)
        way.told -= 1
        self.served += 1
        served, stood_s = self.made.get(way.vehicle.name, (0, 0.0))
        came_s, stop = min(way.since_s, now_s), way.stops[done.number]
        self.made[way.vehicle.name] = served + 1, stood_s + now_s - came_s
        until_s = stop.in_round(done.round).until_s if not done.round or stop.cycle_s else None
        step_s = self._traffic.step_s
        times_s = came_s - step_s, now_s - step_s, nan if until_s is None else until_s
        self.visits.append((way.vehicle.name, stop.name, way.loop, *times_s))
        way.since_s = inf
        self._note(way, SERVED, stop)
        self._put_off(way, done)
        self._tell(way)
        if way.vehicle.asks:  # its wait begins now: until now it waited for no vehicle
            self._ledger.withdraw(way.vehicle)
            self._ledger.consider(way.vehicle)

    def _pass_by(self, way: _StopsAhead) -> None:
        gone = way.ahead.pop(0)
        self._miss(way, gone.number)
        if way.again:
            self._put_off(way, gone)  # SUMO has put it off until the vehicle comes there again
            self._show(way)
        else:
            way.told -= 1
            self._tell(way)

    @staticmethod
    def _put_off(way: _StopsAhead, done: _Ahead) -> None:
        """Put a stop off to the next round, if there is one."""
        if way.again:
            way.ahead.append(_Ahead(done.at_m + way.vehicle.lap_m, done.number, done.round + 1))

    def _miss(self, way: _StopsAhead, number: int) -> None:
        self.missed += 1
        self._note(way, MISSED, way.stops[number])

    def _note(self, way: _StopsAhead, event: str, stop: Stop) -> None:
        self._rows.append((self._traffic.now_s, way.vehicle.name, event, stop.name, ""))
