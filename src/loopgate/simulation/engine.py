"""The loop: step the traffic, look at the vehicles that reached something, ask the gate, hold and release."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from time import perf_counter

from loopgate.errors import TrafficError
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.driver import Driver
from loopgate.simulation.fleet import NOWHERE, Fleet
from loopgate.simulation.gatekeeper import Answer, Gatekeeper
from loopgate.simulation.sensing import MUST_ASK, PIVOTED, REAR_PASSED, RUNS_THROUGH, Vehicle
from loopgate.simulation.sight import Sight
from loopgate.simulation.steering import Steering
from loopgate.simulation.track import Track
from loopgate.traffic.base import Traffic

__all__ = ["FORGOTTEN_STOPS", "Engine"]

STANDING_MPS = 0.1

_LOOK_EVERY_S = 10.0
"""How often those that stand are asked for their lane [s]."""

FORGOTTEN_STOPS = 10
"""So many stops are left behind before SUMO is made to forget them, now and then."""


class Engine:
    """Drives vehicles round their loops, step by step.

    The fleet reads all vehicles once per step; what follows costs only for the vehicles that reached a point
    where something is to be decided: the last one before a gate at which the vehicle can still brake (so that
    one granted there does not slow down), or where its rear is out of what it held.

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
    foresees
        Whether drivers are such that it can be told ahead when they will be past a crossing.
    """

    _row: type[Vehicle] = Vehicle

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
        self.drivers = [Driver(robot, track) for robot, track in enumerate(tracks)]
        self._driver_of = {driver.id: driver for driver in self.drivers}
        starts_m = [driver.start_m for driver in self.drivers]
        self.fleet = Fleet(tracks, starts_m, traffic, recorder, self._row)
        if gatekeeper:
            gatekeeper.sight = Sight(
                self.drivers,
                gatekeeper.itineraries,
                self.fleet,
                gatekeeper.system,
                gatekeeper.occupancy,
                foresees=foresees and not traffic.gives_way,
            )
        self._steering = Steering(traffic, self.fleet, recorder)
        self._forgetful: dict[int, int] = {}
        self._next_look_s = 0.0
        self._grants = 0
        self.overruns = 0
        """Refused vehicles that could not brake for their line, or did not: should be none."""
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
        now = traffic.now_s
        dynamics = [traffic.dynamics(driver.id) for driver in self.drivers]
        for driver, can in zip(self.drivers, dynamics, strict=True):
            driver.drives_like(can, traffic.step_s)
        self.fleet.take_over(dynamics, [driver.top for driver in self.drivers])
        for driver in self.drivers:
            if keeper:
                traffic.put_under_gate(driver.id, keeps_lane=driver.track.keeps_lane)
                place = driver.track.states[driver.track.start_position]
                self._recorder.note(now, driver.id, Event.START, place)
            self._recorder.note(now, driver.id, Event.EDGE, driver.track.first_edge)
        if keeper:
            self._set_out(now)

    def _set_out(self, now: float) -> None:
        for driver in self.drivers:
            self._aim(driver)
            self._consider(driver, now)
        self._answer(now)

    def step(self) -> None:
        """Advance the traffic by one step and do what is due."""
        began = perf_counter()
        self._traffic.step()
        self.sumo_s += perf_counter() - began
        now = self._traffic.now_s
        self._turn(now)
        if self._gatekeeper and now >= self._next_look_s:
            self._next_look_s = now + _LOOK_EVERY_S
            self._look_for_strays()

    def _turn(self, now: float) -> None:
        """Do what is due after a step of the traffic."""
        calls = self.fleet.advance(now)
        if self._gatekeeper is None:
            return
        for vehicle in self._traffic.halted():
            self._came_to_rest(vehicle, now)
        for robot, call in calls:
            driver = self.drivers[robot]
            if call == MUST_ASK:
                self._ask(driver, now)
            elif call == REAR_PASSED:
                self._free_behind(driver, now)
            elif call == PIVOTED:
                self._route_renewed(driver)
            elif call == RUNS_THROUGH:
                self._runs_through(driver, now)
            else:
                self._note_trespass(driver, now)
        self._forget_stops()
        for driver in self._on_their_lanes():
            self._consider(driver, now)
        self._answer(now)

    def measure_from_now(self) -> None:
        """Let all figures begin now: the warm-up is over."""
        now = self._traffic.now_s
        for driver in self.drivers:
            driver.measure_from(self.front_m(driver), int(self.fleet.vehicles.laps[driver.robot]), now)

    def jumped(self, vehicle: str, skipped_m: float) -> None:
        """Take note that the simulator moved `vehicle` ahead by `skipped_m` (no gate)."""
        robot = self._driver_of[vehicle].robot
        self.fleet.vehicles.offset[robot] += skipped_m
        self.fleet.vehicles.next_lap_m[robot] += (
            skipped_m  # the part of the lap that was skipped is not driven
        )

    def front_m(self, driver: Driver) -> float:
        """Return where the front of the vehicle was after the last step, unwrapped [m]."""
        return float(self.fleet.fronts[driver.robot])

    def laps(self, driver: Driver) -> int:
        """Return the laps since the warm-up."""
        return int(self.fleet.vehicles.laps[driver.robot]) - driver.laps_before

    def refused(self, vehicle: str) -> Callable[[], tuple[list[list[str]], str]] | None:
        """Return what tells whom a refused vehicle waits for, and the state it wants; None if it is not.

        Of each set of vehicles, some must move on.
        """
        if self._gatekeeper is None:
            return None
        driver = self._driver_of.get(vehicle)
        if driver is None or driver.halted_since is None:
            return None
        return partial(self._refusal, driver)

    def _refusal(self, driver: Driver) -> tuple[list[list[str]], str]:
        return self._blockers(driver), driver.track.states[driver.position(driver.granted + 1)]

    @property
    def strays(self) -> int:
        """Vehicles that the simulator took to another lane than their loop's."""
        return self._steering.strays

    def settle(self) -> None:
        """Bring the drivers and the gatekeeper up to date, for those who read their figures."""

    def _blockers(self, driver: Driver) -> list[list[str]]:
        keeper = self._gatekeeper
        if keeper is None:
            return []
        inside = [[self.drivers[r].id for r in robots] for robots in keeper.blockers(driver.robot)]
        return inside + keeper.outside_blockers(driver.robot)

    def _aim(self, driver: Driver) -> None:
        """Tell the fleet where the vehicle's grants end, and where it gives back what it leaves."""
        robot, vehicles = driver.robot, self.fleet.vehicles
        vehicles.granted[robot] = driver.granted
        vehicles.note_m[robot] = -NOWHERE  # its beginning is to be noted too
        vehicles.line_m[robot] = driver.line_m
        if driver.granted - 1 <= driver.crossed:  # else it still leaves an earlier leg
            self._aim_rear(driver)

    def _aim_rear(self, driver: Driver) -> None:
        keeper = self._gatekeeper
        target = NOWHERE
        if driver.behind:
            end_m, begin_m, _ = driver.behind[0]
            target = begin_m + driver.length
            if driver.tail == driver.crossed and keeper is not None:
                here = keeper.system.paths[driver.robot][driver.tail % driver.legs]
                # Nobody waits for a slot while there are others: one look for slot and crossing together.
                left_m = end_m + driver.length
                target = max(target, left_m) if keeper.occupancy.room(here) > 0 else left_m
        self.fleet.vehicles.rear_m[driver.robot] = target

    def _free_behind(self, driver: Driver, now: float) -> None:
        keeper = self._gatekeeper
        if keeper is None:
            return
        robot, legs = driver.robot, driver.legs
        rear = self.fleet.fronts[robot] - driver.length
        while driver.rear_leaves(rear):
            position = (driver.tail - 1) % legs
            keeper.left(robot, keeper.system.paths[robot][position])
            self._recorder.note(now, driver.id, Event.LEAVE, driver.track.states[position])
        while driver.rear_clears(rear):
            keeper.cleared(robot, (driver.crossed - 1) % legs)
        self._aim_rear(driver)

    def _count_overrun(self) -> None:
        self.overruns += 1

    def _note_trespass(self, driver: Driver, now: float) -> None:
        begins = not self.fleet.vehicles.trespassing[driver.robot]
        self.fleet.vehicles.trespassing[driver.robot] = begins
        if begins:
            self.trespasses += 1
            place = driver.track.states[driver.position(driver.granted + 1)]
            self._recorder.note(now, driver.id, Event.ENTER, place, "not granted")

    def _consider(self, driver: Driver, now: float) -> None:
        """Let a vehicle ask now if it must, else when it must: its line is new, or it is first in it now."""
        keeper, robot = self._gatekeeper, driver.robot
        if keeper is None or driver.legs <= 1 or keeper.pending(robot) or self._steering.busy(driver):
            return
        if keeper.position(robot) != driver.position(driver.granted):
            return  # it has been granted in this step and is about to be told
        left_m = driver.line_m - self.fleet.fronts[robot]
        if driver.must_ask(left_m, self.fleet.speeds[robot]):
            self._ask(driver, now)
        else:
            self.fleet.vehicles.asking[robot] = True

    def _ask(self, driver: Driver, now: float) -> None:
        keeper = self._gatekeeper
        if keeper is None:
            return
        self.fleet.vehicles.asking[driver.robot] = False
        if self._steering.busy(driver):
            return  # it is considered when it is on its lane
        first = keeper.first_before(driver.robot)
        if first is None:
            keeper.asks(driver.robot, now)
            driver.asked_s = now
        elif self.drivers[first].halted_since is None:
            # It asks when the vehicle before it is granted. That may be too late to stop at the line then,
            # since it brakes for that vehicle no earlier than it must. One that rests there it cannot pass.
            self._hold(driver)

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
        self._grants += 1
        driver.grant(self._grants)
        self._aim(driver)
        place = driver.track.states[driver.position(driver.granted)]
        self._recorder.note(now, driver.id, Event.GRANT, place, answer.reason.value, answer.stage)
        if driver.asked_s is not None:
            driver.longest_wait_s = max(driver.longest_wait_s, now - driver.asked_s)
            driver.asked_s = None
        if driver.held:
            self._release(driver)
            if driver.halted_since is not None:
                driver.hold_s += now - driver.halted_since
                driver.halted_since = None
                self._recorder.note(now, driver.id, Event.GO, place)
        if keeper.occupancy.room(answer.request.wanted) <= 0:
            self._hurry_out(answer.request.wanted)
        self._steering.begin(driver)
        self._consider(driver, now)  # the next state may begin within the braking distance
        line = keeper.line(answer.request.here)
        if line:
            self._consider(self.drivers[line[0]], now)
            for robot in line[1:]:
                if not self.drivers[robot].held:
                    self.fleet.vehicles.asking[robot] = True

    def _hurry_out(self, state: int) -> None:
        """Give each slot of a state that is full now back as soon as the rear is out of it."""
        keeper = self._gatekeeper
        if keeper is None:
            return
        for robot in keeper.occupancy.holders(state):
            other = self.drivers[robot]
            if other.tail < other.granted:
                self._aim_rear(other)

    def _stay(self, driver: Driver, answer: Answer, now: float) -> None:
        wanted = driver.track.states[driver.position(driver.granted + 1)]
        self._recorder.note(now, driver.id, Event.REFUSE, wanted, answer.reason.value, answer.stage)
        self._hold(driver)

    def _hold(self, driver: Driver) -> None:
        if driver.held:
            return
        self._stop(driver)

    def _stop(self, driver: Driver) -> None:
        driver.held = True
        self.fleet.vehicles.held_m[driver.robot] = self.fleet.vehicles.line_m[driver.robot]
        line = driver.track.stop_lines[driver.position(driver.granted)]
        try:
            on_lane = self._traffic.hold(driver.id, line.edge, line.lane_index, line.position_m)
        except TrafficError:
            self._runs_through(driver, self._traffic.now_s)
        else:
            if not on_lane:
                self._steering.lead_back(driver, line.edge, line.lane_index, line.position_m)

    def _release(self, driver: Driver) -> None:
        if not self._steering.leads_back(driver):
            self._traffic.release(driver.id)
        driver.held = False
        self.fleet.vehicles.held_m[driver.robot] = NOWHERE

    def _on_their_lanes(self) -> list[Driver]:
        """Return who needs to be steered no longer; if it is refused, it can stop at its line now."""
        done = self._steering.step()
        for driver in done:
            if driver.held:
                self._stop(driver)
        return done

    def _look_for_strays(self) -> None:
        """Lead back who stands beside the lane of its loop, from where its way may not go on.

        SUMO's lanes are looked at only here, where vehicles are held, and where a stop leads to one.
        """
        fleet = self.fleet
        for driver, speed, leg in zip(self.drivers, fleet.speeds, fleet.columns["entered"], strict=True):
            if speed >= STANDING_MPS or driver.held or self._steering.busy(driver):
                continue
            line = driver.track.stop_lines[driver.position(leg)]
            front = fleet.fronts[driver.robot]
            lane, _ = self._traffic.lane(driver.id)
            beside = lane.startswith(f"{line.edge}_") and lane != f"{line.edge}_{line.lane_index}"
            if beside and driver.begin_m(leg) <= front <= driver.end_m(leg):
                self._steering.lead_back(driver, line.edge, line.lane_index, line.position_m)

    def _runs_through(self, driver: Driver, now: float) -> None:
        """Stop a vehicle that does not brake for its line, whatever the simulator makes of its stop.

        It stands where it comes to rest, as one that is refused, until it is granted what it asked for.
        """
        self._count_overrun()
        self.fleet.vehicles.held_m[driver.robot] = NOWHERE  # once is enough
        place = driver.track.states[driver.position(driver.granted + 1)]
        self._recorder.note(now, driver.id, Event.OVERRUN, place)
        self._traffic.brake(driver.id)

    def _route_renewed(self, driver: Driver) -> None:
        track = driver.track
        if driver.held:
            # A stop on the edge where SUMO renews the route has moved on to the next round with it.
            line = track.stop_lines[driver.position(driver.granted)]
            if line.edge == track.rerouted_on and driver.halted_since is None:
                self._release(driver)
                self._stop(driver)
        elif self._steering.busy(driver):
            self._steering.renew(driver)
        if driver.stops > FORGOTTEN_STOPS:
            self._forgetful.setdefault(driver.robot, 0)

    def _forget_stops(self) -> None:
        """Let SUMO forget stops: on one edge those made on all others, on the next those made on that."""
        for robot, done in list(self._forgetful.items()):
            driver = self.drivers[robot]
            if driver.held or self._steering.busy(driver):
                continue  # its stop ahead would be forgotten too
            if not self._traffic.forget_stops(driver.id, *driver.track.rounds[done]):
                continue
            self._forgetful[robot] = done + 1
            if done + 1 == len(driver.track.rounds):
                del self._forgetful[robot]
                driver.stops = 0

    def _came_to_rest(self, vehicle: str, now: float) -> None:
        driver = self._driver_of.get(vehicle)
        if driver is None or not driver.held or driver.halted_since is not None:
            return
        driver.halted_since = now
        driver.stops += 1
        wanted = driver.track.states[driver.position(driver.granted + 1)]
        self._recorder.note(now, vehicle, Event.HOLD, wanted)
