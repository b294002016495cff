"""Stops in every round of a loop; SUMO gets them one round ahead."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from loopgate.drive.driver import Driver
from loopgate.drive.engine import Engine
from loopgate.drive.sense import braking_m
from loopgate.errors import TrafficError
from loopgate.network.stops import Stop
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.drives import Made
from loopgate.simulation.fleet.parking import Parking
from loopgate.traffic.base import Traffic

_PAST_M = 0.5
"""So far past a place a vehicle has to be before SUMO is told that it stops there again [m]."""

_MISSED_M = 10.0
"""So far past a stop that it has not made a vehicle has missed it [m]."""


@dataclass(slots=True)
class _Ahead:
    """A stop that comes: where [m], which of the vehicle's it is, and in which of its rounds."""

    at_m: float
    number: int
    round: int


@dataclass(slots=True)
class _Way:
    """The stops of a vehicle.

    Attributes
    ----------
    stops
        In the order of its loop.
    since_m
        For each, how far before it the vehicle passes the same place before [m].
    ahead
        The stops of the next round, nearest first.
    told
        Of how many of them SUMO knows.
    served, missed, stood_s
        How many it has made and missed, and for how long it stood at them [s].
    since_s
        Since when it is at a stop [s].
    """

    driver: Driver
    stops: Sequence[Stop]
    since_m: Sequence[float]
    ahead: deque[_Ahead] = field(default_factory=deque)
    told: int = 0
    served: int = 0
    missed: int = 0
    stood_s: float = 0.0
    since_s: float | None = None


class Stops:
    """Sets the stops of vehicles, and tells the drive where the next stops are.

    SUMO knows of all stops of the next round, so that persons find a line that goes where they want to. Where
    a loop passes a road several times it is told of a stop there only when the vehicle has passed that road
    for the last time before.

    Parameters
    ----------
    stops
        By vehicle, in the order of its loop.
    parking
        Looks after those that park; None without a gate.
    """

    def __init__(
        self,
        traffic: Traffic,
        engine: Engine,
        recorder: Recorder,
        stops: Mapping[str, Sequence[Stop]],
        parking: Parking | None = None,
    ) -> None:
        self._traffic, self._engine, self._recorder = traffic, engine, recorder
        self._parking = parking
        self._stops = {vehicle: some for vehicle, some in stops.items() if some}
        self._ways: dict[str, _Way] = {}
        self._untold: set[str] = set()
        engine.on_taking_in, engine.on_renewal = self._take_in, self._renewed

    def _take_in(self, driver: Driver) -> None:
        """Set the stops of a vehicle that has come."""
        stops = self._stops.get(driver.id)
        if not stops:
            return
        driver.row["heeds_renewal"] = True
        track, lap_m = driver.track, driver.track.lap_m
        passes = [[begin + stop.end_m for begin, edge in track.edges if edge == stop.edge] for stop in stops]
        since = [
            min((stop.arc_m - at - _PAST_M) % lap_m + _PAST_M for at in some)
            for stop, some in zip(stops, passes, strict=True)
        ]
        way = self._ways[driver.id] = _Way(driver, stops, since)
        brakes_m = braking_m(driver.speed_mps, float(driver.row["decel"]), self._traffic.step_s)
        first_m = driver.front_m + brakes_m
        behind = [] if track.rounds else [n for n, stop in enumerate(stops) if stop.arc_m < first_m]
        for number in behind:
            self._missed(way, number)
        found = (
            (first_m + (stop.arc_m - first_m) % lap_m, number)
            for number, stop in enumerate(stops)
            if number not in behind
        )
        way.ahead.extend(_Ahead(at_m, number, 0) for at_m, number in sorted(found))
        self._tell(way)

    def _renewed(self, driver: Driver) -> None:
        """Set the next stop anew if it is on the edge where the route is renewed: else it is put off."""
        way = self._ways.get(driver.id)
        if way is None or not way.told:
            return
        coming = way.ahead[0]
        stop = way.stops[coming.number]
        if stop.edge != driver.track.rerouted_on or way.since_s is not None:
            return
        stop = stop.in_round(coming.round)
        with suppress(TrafficError):  # then it is put off, and noted as missed
            self._traffic.drop_stop(driver.id, stop)
            self._traffic.set_stop(driver.id, stop)

    def _tell(self, way: _Way) -> None:
        """Tell SUMO of the next stops of which it can be told, and the drive of the first."""
        driver = way.driver
        if not way.ahead:  # it drives once, and has made them all
            driver.row["stop_m"], driver.row["parks"] = np.inf, False
            self._untold.discard(driver.id)
            return
        while way.told < len(way.ahead):
            coming = way.ahead[way.told]
            if driver.front_m < coming.at_m - way.since_m[coming.number] + _PAST_M:
                break
            stop = way.stops[coming.number].in_round(coming.round)
            try:
                self._traffic.set_stop(driver.id, stop)
            except TrafficError:
                del way.ahead[way.told]
                self._missed(way, coming.number)
                self._put_off(way, coming)
                if not way.ahead:
                    self._tell(way)
                    return
                break
            way.told += 1
        (self._untold.add if way.told < len(way.ahead) else self._untold.discard)(driver.id)
        self._show(way)

    def _show(self, way: _Way) -> None:
        """Tell the drive of the next stop, and whether the slot is kept where the lane is left."""
        row, coming = way.driver.row, way.ahead[0]
        gives_up = self._parking is not None and self._parking.gives_up
        row["stop_m"], row["parks"] = coming.at_m, way.stops[coming.number].parks and not gives_up

    def look(self) -> None:
        """Take note of the stops that began and ended in the last step."""
        if not self._stops:
            return
        traffic, now = self._traffic, self._traffic.now_s
        for vehicle in traffic.stops_begun():
            way = self._ways.get(vehicle)
            if way is not None and way.since_s is None:
                way.since_s = now
                name = way.stops[way.ahead[0].number].name
                self._recorder.note(now, vehicle, Event.STOP, name)
                if self._parking is not None and way.stops[way.ahead[0].number].parks:
                    way.driver.row["parks"] = not self._parking.begin(way.driver)
        for vehicle in traffic.stops_ended():
            way = self._ways.get(vehicle)
            if way is not None:
                for _ in range(way.told - traffic.stops_ahead(vehicle)):
                    self._served(way, now)
        for vehicle in sorted(self._untold & self._engine.driver_of.keys()):
            self._tell(self._ways[vehicle])
        self._note_missed()
        if self._parking is not None:
            self._parking.look()

    def _served(self, way: _Way, now: float) -> None:
        done = way.ahead.popleft()
        way.told -= 1
        way.served += 1
        if way.since_s is not None:
            way.stood_s += now - way.since_s
            way.since_s = None
        driver = way.driver
        self._recorder.note(now, driver.id, Event.SERVED, way.stops[done.number].name)
        self._put_off(way, done)
        self._tell(way)
        self._engine.asks_anew(driver)

    def _note_missed(self) -> None:
        v: Any = self._engine.vehicles
        for robot in np.flatnonzero(v["front"] > v["stop_m"] + _MISSED_M).tolist():
            way = self._ways[self._engine.drivers[robot].id]
            gone = way.ahead.popleft()
            self._missed(way, gone.number)
            if way.driver.track.rounds:
                # SUMO has put it off to the next time that the vehicle comes there.
                self._put_off(way, gone)
                self._show(way)
            else:
                way.told -= 1
                self._tell(way)

    @staticmethod
    def _put_off(way: _Way, done: _Ahead) -> None:
        """Let a stop be made in the next round, if there is one."""
        if way.driver.track.rounds:
            way.ahead.append(_Ahead(done.at_m + way.driver.track.lap_m, done.number, done.round + 1))

    def _missed(self, way: _Way, number: int) -> None:
        way.missed += 1
        self._recorder.note(self._traffic.now_s, way.driver.id, Event.MISSED, way.stops[number].name)

    def made_now(self) -> Iterator[tuple[str, Stop]]:
        """Yield the vehicles that stand at a stop, each with that stop."""
        for vehicle, way in self._ways.items():
            if way.since_s is not None:
                yield vehicle, way.stops[way.ahead[0].number]

    def of(self, vehicle: str) -> Made:
        """Return the figures of the stops of a vehicle."""
        way = self._ways.get(vehicle)
        return Made() if way is None else Made(way.served, way.stood_s)

    def report(self) -> dict[str, Any]:
        """Return the figures of stops for ``summary.json``: made, missed, time [s]."""
        if not self._stops:
            return {}
        ways = self._ways.values()
        return {
            "stops": {
                "served": sum(way.served for way in ways),
                "missed": sum(way.missed for way in ways),
                "stopped_s": round(sum(way.stood_s for way in ways), 3),
                "under_way": sum(way.since_s is not None for way in ways),
                **(self._parking.figures() if self._parking is not None else {}),
            }
        }
