"""The loop: step the traffic, look at the vehicles that reached something, ask the gate, hold and release."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Container, Mapping, Sequence
from functools import partial
from time import perf_counter
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from loopgate.abstraction.track import Track
from loopgate.arrays import Floats
from loopgate.drive import step as drive
from loopgate.drive.codes import BRAKE, HEED, HEEDLESS, PIVOT, RELEASE, STEER, STOP
from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.ground import Ground
from loopgate.drive.rows import columns
from loopgate.drive.sense import STANDING_MPS
from loopgate.drive.steering import Steering
from loopgate.drive.step import FULL, Step
from loopgate.drive.used_stops import UsedStops
from loopgate.errors import ClosedLaneError, TrafficError
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.traffic.base import Traffic

__all__ = ["Engine"]

_LEAP_MPS = 5.0
"""An odometer that goes by so much faster than its vehicle can has leapt [m/s]."""

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
        Whether it can be told ahead when vehicles will be past a crossing.
    unforeseen
        The vehicles of which it cannot be told, even if it can of others.
    ground
        Ways on which others may come; by default there are those of the tracks, and nobody comes.
    """

    def __init__(
        self,
        traffic: Traffic,
        tracks: Sequence[Track],
        gatekeeper: Gatekeeper | None,
        recorder: Recorder,
        *,
        foresees: bool = True,
        unforeseen: Container[str] = (),
        ground: Ground | None = None,
    ) -> None:
        self._traffic = traffic
        self._gatekeeper = gatekeeper
        self._recorder = recorder
        self.foresees = foresees
        self._unforeseen = unforeseen
        self.changes = 0
        """How often vehicles have got other numbers, or others have come."""
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
        self._odometers: Floats = np.zeros(0)
        self._once = False
        """Whether any vehicle drives its route once."""
        if ground is None:
            system, signals = (gatekeeper.system, gatekeeper.signals) if gatekeeper else (None, {})
            ground = Ground.of(tracks, system, recorder.code, step_s=traffic.step_s, signals=signals)
        else:
            ground.take(tracks)
        self._ground, self.tables = ground, ground.tables
        self._told = np.zeros(3, dtype=np.int64)
        self._use_tables()
        self._number(tracks)
        recorder.before = self.settle
        self._steering = Steering(traffic, recorder, self._ahead_of)
        self._used_stops = UsedStops(traffic)
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
        self.leaps: list[tuple[str, float, float]] = []
        """Whose odometers have leapt, when [s], and by how much [m]."""
        self._next_look_s = 0.0
        self._turns = 0
        self.sumo_s = 0.0
        """Wall time spent in the simulator's steps [s]."""

    def _use_tables(self) -> None:
        """Work from now on on the tables as they are: ways have been laid, or vehicles have come or gone."""
        self.settle()
        self.changes += 1
        ground, keeper, before = self._ground, self._gatekeeper, self.tables
        self.tables = tables = ground.tables
        self.run = cast("Any", tables.run)
        """The table of the run, one row, by column."""
        self._told = columns(cast("NDArray[np.void]", tables.run), "rows", "lost")[0]
        """How many rows there are, how many acts, and how many found no room."""
        self.run["yields"] = self._traffic.gives_way
        self.run["foresees"] = self.foresees and not self._traffic.gives_way
        self.vehicles = cast("NDArray[np.void]", tables.vehicles)
        """The table of vehicles, by column."""
        self._step = keeper.take_over(ground) if keeper else Step(tables)
        if tables.acts is not before.acts:  # there was no room in those
            for driver in self.drivers:
                driver.goes_on(driver.robot, tables)

    def odometers(self) -> tuple[Sequence[str], Floats]:
        """Return the vehicles, and what their odometers read after the last step [m]."""
        v = self.vehicles  # the odometers as they were read do not know who has come or gone since
        return self._ids, v["front"] - v["offset"]

    @property
    def stood_s(self) -> Mapping[str, float]:
        """For how long vehicles have stood on each edge, from ``run["counts_from_s"]`` on [s]."""
        stood_s: defaultdict[str, float] = defaultdict(float)
        for name, some_s in zip(self._ground.roads, cast("Any", self.tables.roads)["stood_s"], strict=True):
            stood_s[name] += float(some_s)
        return stood_s

    def _number(self, tracks: Sequence[Track]) -> list[Driver]:
        """Let vehicles that have got the last rows have drivers; return these."""
        first = len(self.drivers)
        fresh = [Driver(robot, track, self.tables) for robot, track in enumerate(tracks, first)]
        self.drivers += fresh
        self._ids += [driver.id for driver in fresh]
        self._once |= any(not track.rounds for track in tracks)
        self.driver_of.update((driver.id, driver) for driver in fresh)
        return fresh

    def _take_in(self, driver: Driver) -> None:
        """Take over a vehicle where it is, at the beginning or later."""
        traffic, row, now = self._traffic, driver.row, self._traffic.now_s
        driver.drives_like(traffic.dynamics(driver.id))
        row["offset"] = driver.front_m - traffic.odometer(driver.id)
        row["speed"] = traffic.speed(driver.id)
        row["foreseen"] = driver.id not in self._unforeseen
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
        self._note_leaps(now)
        if self._gatekeeper and now >= self._next_look_s:
            self._next_look_s = now + _LOOK_EVERY_S
            self._look_for_strays()

    def _note_leaps(self, now: float) -> None:
        """Take note of odometers that went faster than their vehicles can: only what was driven counts.

        SUMO's leaps when a train turns round, by where its new front is; others when a vehicle is moved.
        """
        v = self.vehicles
        for robot in np.flatnonzero(v["speed"] > v["top"] + _LEAP_MPS).tolist():
            driver = self.drivers[robot]
            step_s, true_mps = self._traffic.step_s, self._traffic.speed(driver.id)
            leap_m = (driver.speed_mps - true_mps) * step_s
            driver.leapt_m += leap_m
            if true_mps < STANDING_MPS:
                row: Any = driver.row
                self.run["standing"] += 1
                if now >= self.run["counts_from_s"][0]:
                    row["stood_s"] += step_s
                    road = row["road_at"] + (row["road"] - 1) % row["roads"]
                    cast("Any", self.tables.roads)["stood_s"][road] += step_s
            self.run["driven_m"] -= leap_m
            self.leaps.append((driver.id, now, leap_m))

    def _take_leave(self) -> None:
        """Take note of those who have arrived: they stay where they were until they are let go."""
        self.arrived = tuple(name for name in self._traffic.arrived() if name in self.driver_of)
        for name in self.arrived:
            self._steering.forget(name)

    def _turn(self, now: float) -> None:
        """Do what is due after a step of the traffic."""
        keeper, self._odometers = self._gatekeeper, self._read()
        if keeper is None:
            self._step(drive.LOOK, odometer=self._odometers)
            self._carry_out(now)
            return
        halted = self._came_to_rest()
        self._turns += 1
        busy = self._steering.is_due(self._odometers) or self._turns % _TIMED_EVERY == 0
        if keeper.compiled and not busy and not keeper.looks_around:
            unread = self._step(drive.TURN, odometer=self._odometers, robots=halted)
            while unread:
                keeper.read_lights()
                unread = self._step(drive.ANSWER)
        else:
            self._step(drive.LOOK, odometer=self._odometers, robots=halted)
            if busy:
                self._carry_out(now)
                self._on_their_lanes()
            keeper.answer()
        self._carry_out(now)
        self._used_stops.forget(self.driver_of)

    def _read(self) -> Floats:
        """Return what the odometers read, by vehicle [m]; not a number for one that has arrived."""
        if not self.arrived:
            return self._traffic.odometers(self._ids)
        there = list(self._ids)
        gone = sorted(self.driver_of[name].robot for name in self.arrived)
        for robot in reversed(gone):
            del there[robot]
        return np.insert(self._traffic.odometers(there), np.array(gone) - np.arange(len(gone)), np.nan)

    def _ahead_of(self, driver: Driver) -> Driver | None:
        """Return who has got the slot right before that of a vehicle's last grant, and still has it."""
        if self._gatekeeper is None:
            return None
        holders = self._gatekeeper.holders(self._gatekeeper.here(driver.robot))
        at = holders.index(driver.robot)
        return self.drivers[holders[at - 1]] if at else None

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
        waiting, fresh = (int(self.run[name][0]) for name in ("waiting", "fresh"))
        still = [robot for robot in queue[:waiting].tolist() if pending[robot]]
        self.run["fresh"] = int(pending[queue[waiting - fresh : waiting]].sum())
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
        return inside + keeper.outside_blockers(driver.robot, self._ids), driver.leg(driver.granted + 1).state

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
        except ClosedLaneError:  # it stands before its line, since it asked in time
            driver.row["held_m"] = np.inf
            self._traffic.brake(driver.id, hard=False)
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
        for robot in np.flatnonzero(self.vehicles["speed"] < STANDING_MPS).tolist():
            driver = self.drivers[robot]
            if driver.row["held"] or driver.row["steered"] or driver.id in self.arrived:
                continue
            leg = int(driver.row["entered"])
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
        self._used_stops.renewed(driver)
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
                self._used_stops.made(driver)
                robots.append(driver.robot)
        return np.array(robots, dtype=np.int64)
