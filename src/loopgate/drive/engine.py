"""The loop: step the traffic, look at the vehicles that reached something, ask the gate, hold and release."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from time import perf_counter
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from loopgate.drive import step as drive
from loopgate.drive.build import make_tables, movements_of, roads_of
from loopgate.drive.codes import BRAKE, HEED, HEEDLESS, PIVOT, RELEASE, STEER, STOP
from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.rows import columns
from loopgate.drive.sense import STANDING_MPS
from loopgate.drive.steering import Steering
from loopgate.drive.step import FULL, Step
from loopgate.drive.tables import Tables
from loopgate.drive.track import Track
from loopgate.drive.worn import WornStops
from loopgate.errors import TrafficError
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.traffic.base import Traffic

__all__ = ["Engine"]

_LOOK_EVERY_S = 10.0
"""How often those that stand are asked for their lane [s]."""

_TIMED_EVERY = 50
"""Every so many steps the decisions are timed alone; else they are made in one go with all the rest."""


class Engine:
    """Drives vehicles round their loops, step by step.

    All vehicles are read once per step; what follows costs only for the vehicles that reached a point where
    something is to be decided: the last one before a gate at which the vehicle can still brake (so that one
    granted there does not slow down), or where its rear is out of what it held.

    Parameters
    ----------
    traffic
        The running simulation.
    tracks
        One per vehicle; robots of the gatekeeper's system in the same order.
    gatekeeper
        None lets the simulator's own right of way rule.
    recorder
        Takes the events.
    foresees
        Whether drivers are such that it can be told ahead when they will be past a crossing.
    """

    def __init__(
        self,
        traffic: Traffic,
        tracks: Sequence[Track],
        gatekeeper: Gatekeeper | None,
        recorder: Recorder,
        *,
        foresees: bool = True,
    ) -> None:
        self._traffic = traffic
        self._gatekeeper = gatekeeper
        self._recorder = recorder
        self.foresees = foresees
        self.changes = 0
        """How often tables have been made anew: then vehicles have other numbers."""
        self.on_taking_in: Callable[[Driver], None] = lambda _: None
        """Called with each vehicle as soon as it has been taken over."""
        self.on_renewal: Callable[[Driver], None] = lambda _: None
        """Called with each vehicle that heeds it, and whose route has just been renewed."""
        self.beside: set[str] = set()
        """Vehicles that park beside the road, and hold nothing or are about to come back."""
        self.drivers: list[Driver] = []
        """All vehicles, by number; always the same list."""
        self.driver_of: dict[str, Driver] = {}
        """The same by name."""
        self.arrived: tuple[str, ...] = ()
        """Vehicles that the simulator took off the road in the last step, at the ends of their routes."""
        self._ids: list[str] = []
        self._stood_s: defaultdict[str, float] = defaultdict(float)
        self._counted: tuple[Sequence[str], Any] = (), np.zeros(0, dtype=[("stood_s", np.float64)])
        """The edges by number, and the table of them in which standing is counted."""
        self._told = np.zeros(3, dtype=np.int64)
        self._make(tracks)
        recorder.before = self.settle
        self._steering = Steering(traffic, recorder)
        self._worn = WornStops(traffic)
        self._do: dict[int, Callable[[Driver, int], None]] = {
            int(PIVOT): lambda driver, _: self._route_renewed(driver),
            int(STOP): self._stop,
            int(RELEASE): lambda driver, _: self._release(driver),
            int(STEER): self._steering.begin,
            int(BRAKE): lambda driver, _: traffic.brake(driver.id),
            int(HEED): lambda driver, _: traffic.heed_lights(driver.id, heeds=True),
            int(HEEDLESS): lambda driver, _: traffic.heed_lights(driver.id, heeds=False),
        }
        """What is done to a vehicle whose last grant is a leg, by number."""
        self._next_look_s = 0.0
        self._turns = 0
        self.sumo_s = 0.0
        """Wall time spent in the simulator's steps [s]."""

    def _make(self, tracks: Sequence[Track]) -> None:
        """Make tables for these vehicles, in which those that are new stand where their tracks begin."""
        system = self._gatekeeper.system if self._gatekeeper else None
        self._name(tracks)
        tables = make_tables(
            tracks, system, self._recorder.code, step_s=self._traffic.step_s, signals=self._signals
        )
        self._use(tables)
        self._number(tracks)

    @property
    def _signals(self) -> Mapping[str, int]:
        """The numbers of the signals that are obeyed, by movement."""
        timetable = self._gatekeeper.timetable if self._gatekeeper else None
        return timetable.numbers if timetable else {}

    def _name(self, tracks: Sequence[Track]) -> None:
        """Take note of what is on these tracks by number."""
        self.movements: Sequence[str] = movements_of(tracks)
        """Names of the movements by number."""
        self.roads: Sequence[str] = roads_of(tracks)
        """Names of the edges by number, one for each time that a loop leads over it; another list if anew."""

    def _use(self, tables: Tables, states: Sequence[str] | None = None) -> None:
        """Work on these tables from now on."""
        self.settle()
        self.changes += 1
        keeper = self._gatekeeper
        self.tables = tables
        self.run = cast("Any", tables.run)
        """The table of the run, one row, by column."""
        self._told = columns(cast("NDArray[np.void]", tables.run), "rows", "lost")[0]
        """How many rows there are, how many acts, and how many found no room."""
        self.run["foresees"] = self.foresees and not self._traffic.gives_way
        self.vehicles = cast("NDArray[np.void]", tables.vehicles)
        """The table of vehicles, by column."""
        if self._counted[1] is not tables.roads:
            self._count_stood()
            self._counted = self.roads, tables.roads
        self._step = keeper.take_over(tables, self._recorder.code, states) if keeper else Step(tables)

    def _count_stood(self) -> None:
        """Add up by edge for how long vehicles have stood since the last time."""
        roads, counted = self._counted
        stood_s = counted["stood_s"]
        for number in np.flatnonzero(stood_s).tolist():
            self._stood_s[roads[number]] += float(stood_s[number])
        stood_s[:] = 0.0

    @property
    def stood_s(self) -> Mapping[str, float]:
        """For how long vehicles have stood on each edge, from ``run["counts_from_s"]`` on [s].

        Edges on which nobody stood may be missing.
        """
        self._count_stood()
        return self._stood_s

    def _number(self, tracks: Sequence[Track]) -> None:
        """Let the vehicles have the rows of these tracks, and those that are new their drivers."""
        known = self.driver_of
        for robot, track in enumerate(tracks):
            if track.vehicle in known:
                known[track.vehicle].goes_on(robot, track, self.tables)
        self.drivers[:] = [
            known.get(track.vehicle) or Driver(robot, track, self.tables)
            for robot, track in enumerate(tracks)
        ]
        self._ids = [driver.id for driver in self.drivers]
        self._once = any(not track.rounds for track in tracks)
        self.arrived = ()
        self.driver_of.clear()
        self.driver_of.update(zip(self._ids, self.drivers, strict=True))

    def _take_in(self, driver: Driver) -> None:
        """Take over a vehicle where it is, at the beginning or later."""
        traffic, row, now = self._traffic, driver.row, self._traffic.now_s
        driver.drives_like(traffic.dynamics(driver.id))
        row["offset"] = driver.front_m - traffic.odometer(driver.id)
        row["speed"] = traffic.speed(driver.id)
        if self._gatekeeper is not None:
            traffic.put_under_gate(driver.id, keeps_lane=driver.track.keeps_lane)
            self._recorder.note(now, driver.id, Event.START, driver.leg(driver.granted).state)
        self._recorder.note(now, driver.id, Event.EDGE, driver.track.first_edge)
        self.on_taking_in(driver)

    def begin(self) -> None:
        """Make the first step, in which all vehicles appear, and take them over.

        Raises
        ------
        TrafficError
            If a vehicle could not be inserted at its start.
        """
        traffic, keeper = self._traffic, self._gatekeeper
        traffic.step()
        on_road = set(traffic.vehicles())
        missing = [driver.id for driver in self.drivers if driver.id not in on_road]
        if missing:
            names = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")  # noqa: PLR2004  a sample
            msg = (
                f"SUMO could not insert {len(missing)} of {len(self.drivers)} vehicles at the start: {names}"
            )
            raise TrafficError(msg)
        now = self.run["now_s"] = traffic.now_s
        for driver in self.drivers:
            self._take_in(driver)
        if keeper:
            self._step(drive.BEGIN)
            keeper.answer()
            self._carry_out(now)

    def step(self) -> None:
        """Advance the traffic by one step and do what is due."""
        began = perf_counter()
        self._traffic.step()
        self.sumo_s += perf_counter() - began
        self.after_step()

    def after_step(self) -> None:
        """Do what is due after a step of the traffic."""
        now = self.run["now_s"] = self._traffic.now_s
        if self._once:
            self._take_leave()
        self._turn(now)
        if self._gatekeeper and now >= self._next_look_s:
            self._next_look_s = now + _LOOK_EVERY_S
            self._look_for_strays()

    def _take_leave(self) -> None:
        """Take note of those who have arrived: they stay where they were until they are let go."""
        self.arrived = tuple(name for name in self._traffic.arrived() if name in self.driver_of)
        for name in self.arrived:
            self._steering.forget(name)

    def _turn(self, now: float) -> None:
        """Do what is due after a step of the traffic."""
        keeper, odometer = self._gatekeeper, self._read()
        if keeper is None:
            self._step(drive.LOOK, odometer=odometer)
            self._carry_out(now)
            return
        halted = self._came_to_rest()
        self._turns += 1
        busy = self._steering.steers or self._worn.any or self._turns % _TIMED_EVERY == 0
        if keeper.compiled and not busy:
            if self._step(drive.TURN, odometer=odometer, robots=halted):
                keeper.answer()  # lights had to be read before all was answered
        else:
            self._step(drive.LOOK, odometer=odometer, robots=halted)
            if busy or keeper.obstacles:
                self._carry_out(now)
                self._worn.forget(self.driver_of)
                self._on_their_lanes()
            keeper.answer()
        self._carry_out(now)

    def _read(self) -> NDArray[np.float64]:
        """Return what the odometers read, by vehicle [m]; not a number for one that has arrived."""
        if not self.arrived:
            return np.fromiter(self._traffic.odometers(self._ids), dtype=np.float64, count=len(self._ids))
        there = list(self._ids)
        gone = sorted(self.driver_of[name].robot for name in self.arrived)
        for robot in reversed(gone):
            del there[robot]
        read = np.fromiter(self._traffic.odometers(there), dtype=np.float64, count=len(there))
        return np.insert(read, np.array(gone) - np.arange(len(gone)), np.nan)

    def asks_anew(self, driver: Driver) -> None:
        """Let a vehicle that has made its stop ask as of now: before, it did not wait for anybody."""
        row, run = driver.row, self.run
        run["version"] += 1
        if self._gatekeeper is None or not row["pending"]:
            return
        self._withdraw([driver])
        self._step(drive.CONSIDER, robots=np.array([driver.robot], dtype=np.int64))

    def _withdraw(self, drivers: Sequence[Driver]) -> None:
        """Forget the requests of some vehicles, if they have any."""
        for driver in drivers:
            driver.row["pending"] = False
        pending, queue = self.vehicles["pending"], cast("Any", self.tables.entries)["waiting"]
        still = [robot for robot in queue[: self.run["waiting"][0]].tolist() if pending[robot]]
        queue[: len(still)] = still
        self.run["waiting"] = len(still)

    def measure_from_now(self) -> None:
        """Let all figures begin now: the warm-up is over."""
        for driver in self.drivers:
            driver.measure_from_now(self._traffic.now_s)

    def jumped(self, vehicle: str, skipped_m: float) -> None:
        """Take note that the simulator moved `vehicle` ahead by `skipped_m` (no gate)."""
        self.driver_of[vehicle].skipped(skipped_m)

    def refused(self, vehicle: str) -> Callable[[], tuple[list[list[str]], str]] | None:
        """Return what tells whom a refused vehicle waits for, and the state it wants; None if it is not.

        Of each set of vehicles, some must move on.
        """
        keeper, driver = self._gatekeeper, self.driver_of.get(vehicle)
        if keeper is None or driver is None or np.isnan(driver.row["halted_s"]):
            return None
        return partial(self._refusal, keeper, driver)

    def _refusal(self, keeper: Gatekeeper, driver: Driver) -> tuple[list[list[str]], str]:
        inside = [[self._ids[robot] for robot in robots] for robots in keeper.blockers(driver.robot)]
        return inside + keeper.outside_blockers(driver.robot), driver.leg(driver.granted + 1).state

    @property
    def strays(self) -> int:
        """Vehicles that the simulator took to another lane than their loop's."""
        return self._steering.strays

    @property
    def overruns(self) -> int:
        """Refused vehicles that could not brake for their line, or did not: should be none."""
        return int(self.run["overruns"][0])

    @property
    def trespasses(self) -> int:
        """Vehicles seen with their front in a state that was not granted to them: should be none."""
        return int(self.run["trespasses"][0])

    def settle(self) -> None:
        """Hand over the rows for the trace that are in the tables: several steps lie between two times."""
        rows = int(self._told[0])
        if rows:
            self._recorder.passed(self.tables.times[:rows], self.tables.rows[:rows])
            self._told[0] = 0

    def _carry_out(self, now: float) -> None:
        """Tell the traffic whom to hold and whom to let go."""
        rows, acts, lost = self._told.tolist()
        if lost:
            msg = f"{lost} events of one step at {now:g} s found no room; take shorter steps"
            raise TrafficError(msg)
        if rows >= FULL * len(self.drivers):
            self.settle()  # there is room for one more step
        if not acts:
            return
        self._told[1] = 0
        arrived = set(self.arrived)
        for robot, what, leg in self.tables.acts[:acts].tolist():
            driver = self.drivers[robot]
            if driver.id in arrived:
                continue
            self._do[what](driver, leg)

    def _stop(self, driver: Driver, leg: int) -> None:
        """Let a vehicle stop at the end of the last leg that was granted to it."""
        line = driver.leg(leg).line
        try:
            on_lane = self._traffic.hold(driver.id, line.edge, line.lane, line.position_m)
        except TrafficError:
            # It is stopped whatever the simulator makes of its stop, as in the compiled step.
            driver.row["held_m"] = np.inf
            self.run["overruns"] += 1
            self._recorder.note(self._traffic.now_s, driver.id, Event.OVERRUN, driver.leg(leg + 1).state)
            self._traffic.brake(driver.id)
        else:
            if not on_lane:
                self._steering.lead_back(driver, line.edge, line.lane, line.position_m)

    def _release(self, driver: Driver) -> None:
        if not self._steering.leads_back(driver):
            self._traffic.release(driver.id)

    def _on_their_lanes(self) -> None:
        """Take note of who needs to be steered no longer; if it is refused, it can stop at its line now."""
        done = self._steering.step()
        for driver in done:
            if driver.row["held"]:
                driver.row["held_m"] = driver.line_m
                self._stop(driver, driver.granted)
        if done:
            self._step(drive.CONSIDER, robots=np.array([driver.robot for driver in done], dtype=np.int64))

    def _look_for_strays(self) -> None:
        """Lead back who stands beside the lane of its loop, from where its way may not go on.

        SUMO's lanes are looked at only here, where vehicles are held, and where a stop leads to one.
        """
        v, arrived = self.vehicles, set(self.arrived)
        for robot in np.flatnonzero((v["speed"] < STANDING_MPS) & ~v["held"] & ~v["steered"]).tolist():
            driver = self.drivers[robot]
            if driver.id in arrived:
                continue
            leg = int(v["entered"][robot])
            line = driver.leg(leg).line
            lane, _ = self._traffic.lane(driver.id)
            beside = lane.startswith(f"{line.edge}_") and lane != f"{line.edge}_{line.lane}"
            if beside and driver.begin_m(leg) <= driver.front_m <= driver.end_m(leg):
                self._steering.lead_back(driver, line.edge, line.lane, line.position_m)

    def _route_renewed(self, driver: Driver) -> None:
        if driver.track.renews:
            self._traffic.renew(driver.id, driver.track.rounds[0].route)
        if driver.row["held"]:
            # A stop on the edge where SUMO renews the route has moved on to the next round with it.
            line = driver.leg(driver.granted).line
            if line.edge == driver.track.rerouted_on and np.isnan(driver.row["halted_s"]):
                self._release(driver)
                driver.row["held_m"] = driver.line_m
                self._stop(driver, driver.granted)
        elif driver.row["steered"]:
            self._steering.renew(driver)
        self._worn.renewed(driver)
        self.on_renewal(driver)

    def _came_to_rest(self) -> NDArray[np.int64]:
        """Return the held vehicles that came to rest in the last step."""
        halted = self._traffic.halted()
        if not halted:
            return drive.NO_ROBOTS
        robots = []
        for vehicle in halted:
            driver = self.driver_of.get(vehicle)
            if driver is not None and driver.row["held"] and np.isnan(driver.row["halted_s"]):
                self._worn.made(driver)
                robots.append(driver.robot)
        return np.array(robots, dtype=np.int64)
