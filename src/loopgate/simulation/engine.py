"""The loop: step the traffic, look at the vehicles that are due, ask the gate, hold and release."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from time import perf_counter

from loopgate.errors import TrafficError
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.driver import Driver
from loopgate.simulation.gatekeeper import Answer, Gatekeeper
from loopgate.simulation.sight import Sight
from loopgate.simulation.track import Track
from loopgate.traffic.base import Traffic

__all__ = ["Engine"]


class Engine:
    """Drives vehicles round their loops, step by step.

    The work of a step follows the events in it: each vehicle is looked at only when, at the earliest, it
    can reach something to be noted: an edge, the end of a lap, a place its rear leaves, the point before a
    gate where it must ask. That is before the vehicle has to brake, so that one granted does not slow down.

    Parameters
    ----------
    traffic
        The running simulation, before its first step.
    tracks
        One per vehicle; robots of the gatekeeper's system in the same order.
    gatekeeper
        None lets the simulator's own right of way rule.
    recorder
        Takes the events.
    """

    def __init__(
        self, traffic: Traffic, tracks: Sequence[Track], gatekeeper: Gatekeeper | None, recorder: Recorder
    ) -> None:
        self._traffic = traffic
        self._gatekeeper = gatekeeper
        self._recorder = recorder
        self._step_s = traffic.step_s
        self._step = 0
        self._due: defaultdict[int, list[Driver]] = defaultdict(list)
        self.drivers = [Driver(robot, track) for robot, track in enumerate(tracks)]
        self._driver_of = {driver.id: driver for driver in self.drivers}
        if gatekeeper:
            gatekeeper.sight = Sight(self.drivers, gatekeeper.itineraries, self._refresh)
        self.overruns = 0
        """Vehicles that could no longer brake when they were refused: should be none."""
        self.trespasses = 0
        """Vehicles seen with their front in a state that was not granted to them: should be none."""
        self.sumo_s = 0.0
        """Wall time spent in the simulator's steps [s]."""

    def begin(self) -> None:
        """Make the first step, in which all vehicles appear, and take them over.

        Raises
        ------
        TrafficError
            If a vehicle could not be inserted at its start.
        """
        self._traffic.step()
        on_road = set(self._traffic.vehicles())
        missing = [driver.id for driver in self.drivers if driver.id not in on_road]
        if missing:
            names = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")  # noqa: PLR2004  a sample
            msg = (
                f"SUMO could not insert {len(missing)} of {len(self.drivers)} vehicles at the start: {names}"
            )
            raise TrafficError(msg)
        now = self._traffic.now_s
        for driver in self.drivers:
            driver.drives_like(self._traffic.dynamics(driver.id), self._step_s)
            driver.odometer_reads(self._traffic.odometer(driver.id))
            if self._gatekeeper:
                self._traffic.put_under_gate(driver.id, keeps_lane=driver.track.keeps_lane)
                place = driver.track.states[driver.track.start_position]
                self._recorder.note(now, driver.id, Event.START, place)
            self._recorder.note(now, driver.id, Event.EDGE, driver.edge())
            self._look(driver, now)
        self._answer(now)

    def step(self) -> None:
        """Advance the traffic by one step and do what is due."""
        began = perf_counter()
        self._traffic.step()
        self.sumo_s += perf_counter() - began
        self._step += 1
        now = self._traffic.now_s
        if self._gatekeeper:
            for vehicle in self._traffic.halted():
                self._came_to_rest(vehicle, now)
        for driver in self._due.pop(self._step, ()):
            if driver.due_step == self._step:
                self._look(driver, now)
        if self._gatekeeper:
            self._answer(now)

    def measure_from_now(self) -> None:
        """Let all figures begin now: the warm-up is over."""
        now = self._traffic.now_s
        for driver in self.drivers:
            driver.measure_from(self.front_m(driver), now)

    def jumped(self, vehicle: str, skipped_m: float) -> None:
        """Take note that the simulator moved `vehicle` ahead by `skipped_m` (no gate)."""
        driver = self._driver_of[vehicle]
        driver.offset_m += skipped_m
        driver.next_lap_m += skipped_m  # the part of the lap that was skipped is not driven
        driver.aim()

    def front_m(self, driver: Driver) -> float:
        """Return where the front of the vehicle is now, unwrapped [m]."""
        return self._traffic.odometer(driver.id) + driver.offset_m

    def refused(self, vehicle: str) -> tuple[list[list[str]], str] | None:
        """Return whom a refused vehicle waits for (of each set, some must move on) and the state it wants."""
        if self._gatekeeper is None:
            return None
        driver = self._driver_of.get(vehicle)
        if driver is None or driver.halted_since is None:
            return None
        sets = self._gatekeeper.blockers(driver.robot)
        wanted = driver.track.states[driver.position(driver.granted + 1)]
        inside = [[self.drivers[r].id for r in robots] for robots in sets]
        return inside + self._gatekeeper.outside_blockers(driver.robot), wanted

    def _look(self, driver: Driver, now: float) -> None:
        self._refresh(driver)
        if driver.front_m >= driver.note_m:
            self._note(driver, now)
        if self._gatekeeper and driver.trespasses() != driver.trespassing:
            self._note_trespass(driver, now)
        self._look_again(driver, asking=self._ask(driver, now))

    def _note(self, driver: Driver, now: float) -> None:
        """Note all that the vehicle has passed since the last look: edges, laps, states."""
        front = driver.front_m
        begin, edge = driver.next_edge()
        while front >= begin:
            self._recorder.note(now, driver.id, Event.EDGE, edge)
            if driver.held and edge == driver.track.rerouted_on:
                self._hold_again(driver)
            driver.pass_edge()
            begin, edge = driver.next_edge()
        while front >= driver.next_lap_m:
            driver.laps += 1
            driver.next_lap_m += driver.track.lap_m
            self._recorder.note(now, driver.id, Event.LAP, driver.track.loop)
        if self._gatekeeper:
            self._note_entries(driver, now)
            self._free_behind(driver, now)
        driver.aim()

    def _note_entries(self, driver: Driver, now: float) -> None:
        """Record where the front is, as SUMO says: the audit holds the grants against it."""
        while driver.entered < driver.granted and driver.front_m >= driver.begin_m(driver.entered + 1):
            driver.entered += 1
            place = driver.track.states[driver.position(driver.entered)]
            self._recorder.note(now, driver.id, Event.ENTER, place)

    def _note_trespass(self, driver: Driver, now: float) -> None:
        driver.trespassing = driver.trespasses()
        if driver.trespassing:
            self.trespasses += 1
            place = driver.track.states[driver.position(driver.granted + 1)]
            self._recorder.note(now, driver.id, Event.ENTER, place, "not granted")

    def _hold_again(self, driver: Driver) -> None:
        # A stop on the edge where SUMO renews the route has moved on to the next round with it.
        line = driver.track.stop_lines[driver.position(driver.granted)]
        if line.edge == driver.track.rerouted_on and driver.halted_since is None:
            self._traffic.release(driver.id)
            self._traffic.hold(driver.id, line.edge, line.lane_index, line.position_m)

    def _free_behind(self, driver: Driver, now: float) -> None:
        keeper = self._gatekeeper
        if keeper is None:
            return
        rear = driver.front_m - driver.length
        while driver.crossed < driver.granted and rear >= driver.begin_m(driver.crossed + 1):
            keeper.cleared(driver.robot, driver.position(driver.crossed))
            driver.crossed += 1
        while driver.tail < driver.granted and rear >= driver.end_m(driver.tail):
            position = driver.position(driver.tail)
            keeper.left(driver.robot, keeper.system.paths[driver.robot][position])
            self._recorder.note(now, driver.id, Event.LEAVE, driver.track.states[position])
            driver.tail += 1

    def _ask(self, driver: Driver, now: float) -> bool:
        """Ask if the vehicle must; return whether the point where it must ask is still ahead of it."""
        keeper = self._gatekeeper
        if keeper is None or len(driver.track.states) <= 1 or keeper.pending(driver.robot):
            return False
        first = keeper.first_before(driver.robot)
        if first is not None and self.drivers[first].halted_since is not None:
            return False  # it cannot pass the one that rests at the line, and is asked when that one goes
        if not driver.must_ask():
            return True
        if first is not None:
            # It asks when the vehicle before it is granted. That may be too late to stop at the line then,
            # since it brakes for that vehicle no earlier than it must.
            self._hold(driver)
            return False
        keeper.asks(driver.robot, now)
        driver.asked_s = now
        return False

    def _answer(self, now: float) -> None:
        keeper = self._gatekeeper
        if keeper is None:
            return
        again = True
        while again:
            again = False
            for answer in keeper.decide(now):
                driver = self.drivers[answer.request.robot]
                if answer.granted:
                    self._go(driver, answer, now)
                    again = True
                else:
                    self._stay(driver, answer, now)

    def _go(self, driver: Driver, answer: Answer, now: float) -> None:
        keeper = self._gatekeeper
        if keeper is None:
            return
        driver.granted += 1
        driver.aim()
        place = driver.track.states[driver.position(driver.granted)]
        self._recorder.note(now, driver.id, Event.GRANT, place, answer.reason.value, answer.stage)
        if driver.asked_s is not None:
            driver.longest_wait_s = max(driver.longest_wait_s, now - driver.asked_s)
            driver.asked_s = None
        if driver.held:
            self._traffic.release(driver.id)
            driver.held = False
            if driver.halted_since is not None:
                driver.hold_s += now - driver.halted_since
                driver.halted_since = None
                self._recorder.note(now, driver.id, Event.GO, place)
        self._ask_afresh(driver, now)  # the next state may begin within the braking distance
        follower = keeper.head(answer.request.here)
        if follower is not None:
            self._ask_afresh(self.drivers[follower], now)

    def _stay(self, driver: Driver, answer: Answer, now: float) -> None:
        wanted = driver.track.states[driver.position(driver.granted + 1)]
        self._recorder.note(now, driver.id, Event.REFUSE, wanted, answer.reason.value, answer.stage)
        self._hold(driver)

    def _hold(self, driver: Driver) -> None:
        if driver.held:
            return
        if not driver.may_brake():
            self.overruns += 1
        line = driver.track.stop_lines[driver.position(driver.granted)]
        self._traffic.hold(driver.id, line.edge, line.lane_index, line.position_m)
        driver.held = True

    def _came_to_rest(self, vehicle: str, now: float) -> None:
        driver = self._driver_of.get(vehicle)
        if driver is None or not driver.held or driver.halted_since is not None:
            return
        driver.halted_since = now
        wanted = driver.track.states[driver.position(driver.granted + 1)]
        self._recorder.note(now, vehicle, Event.HOLD, wanted)

    def _refresh(self, driver: Driver) -> None:
        if driver.seen_step != self._step:
            driver.seen_step = self._step
            odometer_m, driver.speed = self._traffic.motion(driver.id)
            driver.front_m = odometer_m + driver.offset_m

    def _ask_afresh(self, driver: Driver, now: float) -> None:
        self._refresh(driver)
        self._look_again(driver, asking=self._ask(driver, now))

    def _look_again(self, driver: Driver, *, asking: bool) -> None:
        if driver.halted_since is not None:
            return  # nothing happens to it until it is let go, and then it is looked at
        step = self._step + driver.quiet_steps(asking=asking)
        if driver.due_step <= self._step or step < driver.due_step:
            driver.due_step = step
            self._due[step].append(driver)
