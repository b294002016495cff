"""Vehicles under a gate in a running simulation: they join, drive and leave."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from loopgate.drive.books import Books
from loopgate.drive.changing import ChangingEngine
from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.track import Track
from loopgate.errors import GateError
from loopgate.gates import Gate, Reason, make_gate
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.negotiation.base import Negotiation
from loopgate.network import RoadNetwork
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.newcomers import Newcomer
from loopgate.simulation.plan import Plan
from loopgate.simulation.scenario import SERVE_AFTER_S
from loopgate.simulation.surroundings import Surroundings
from loopgate.traffic.base import Traffic

__all__ = ["GONE", "Fleet"]

GONE = "gone"
"""Why a vehicle left that is on the road no longer."""

_AGAIN_S = 1.0
"""A newcomer that was refused is looked at again after this time [s]."""

_MOVED_M = 3.0
"""A vehicle further than this from where its odometer puts it has been moved [m]."""


class _Orders:
    """An obstacle: what the owner of the vehicles wants of them.

    Nobody is granted anything while the plan is to change, nor while it is to stop before it gets there: it
    would keep a crossing from others meanwhile.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.pause = False
        self.drivers: Sequence[Driver] = ()

    def in_the_way(self, robot: int) -> Reason | None:
        """Return TRAFFIC for newcomers, which are no more than that so far, and STOP."""
        if self.pause:
            return Reason.TRAFFIC
        driver = self.drivers[robot]
        line = driver.track.stop_lines[driver.granted % len(driver.track.legs)]
        stops = self._traffic.stops_before(driver.id, line.edge, line.position_m)
        return Reason.STOP if stops else None

    def granted(self, robot: int) -> None:
        """Do nothing."""

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return nobody: it ends by itself."""
        del robot
        return ()


class Fleet:
    """The vehicles under a gate, and those that wait to be.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation; somebody else makes its steps.
    recorder
        Takes the events.
    gate, negotiation
        The gate's name or class, and the negotiation.
    lights
        Whether traffic lights are obeyed.

    Notes
    -----
    A vehicle is taken in where it is as a whole in a place of its loop and can stop at the end of that: then
    it holds a slot there and nothing else, and the gate is made anew for all vehicles as they stand. It is a
    start like any other, which the gate refuses if it could not keep its promise; then the vehicle waits. A
    place in which it stands may so hold one more than it has slots for.

    A loop that is new changes the plan. Where the others' places stay as they are they drive on. Else all
    grants are withheld until each vehicle holds one place only; then all join anew, by the new plan.
    """

    def __init__(
        self,
        network: RoadNetwork,
        traffic: Traffic,
        recorder: Recorder,
        *,
        gate: object,
        negotiation: Negotiation,
        lights: bool,
    ) -> None:
        self._network, self._traffic, self._recorder = network, traffic, recorder
        self._gate, self._negotiation, self._lights = gate, negotiation, lights
        self.plan = Plan(network, ())
        self._next: Plan | None = None
        self._orders = _Orders(traffic)
        self.newcomers: dict[str, Newcomer] = {}
        self.keeper: Gatekeeper | None = None
        self.engine: ChangingEngine | None = None
        self.around: Surroundings | None = None
        self.changes = 0
        """How often vehicles joined or left."""
        self.on_leaving: Callable[[Driver], None] = lambda _: None
        """Called with each vehicle that leaves, while it can still be asked."""

    @property
    def members(self) -> Mapping[str, Driver]:
        """Those under the gate, by name."""
        return self.engine.driver_of if self.engine else {}

    def add(self, newcomers: Sequence[Newcomer]) -> None:
        """Take vehicles in as soon as they can be.

        Raises
        ------
        RefusedLoopError
            If a loop of theirs cannot work as queues; then none is added.
        """
        plan = (self._next or self.plan).extended((n.loop, n.kind) for n in newcomers)
        if plan is not self.plan:
            self._next = plan
        self.newcomers.update((newcomer.vehicle, newcomer) for newcomer in newcomers)

    def drop(self, vehicles: Iterable[str], reason: str) -> None:
        """Let vehicles go, whether they are under the gate or wait to be."""
        gone = set(vehicles)
        for vehicle in sorted(gone & self.newcomers.keys()):
            del self.newcomers[vehicle]
            self._traffic.leave_gate(vehicle)
        members = self.members
        leaving = sorted(gone & members.keys())
        if not leaving or self.engine is None:
            return
        now = self._traffic.now_s
        for vehicle in leaving:
            driver = members[vehicle]
            self.on_leaving(driver)
            for leg in range(int(driver.row["tail"]), driver.granted + 1):
                self._recorder.note(now, vehicle, Event.LEAVE, driver.leg(leg).state)
            self._recorder.note(now, vehicle, Event.END, driver.leg(driver.granted).state, reason)
            self._traffic.leave_gate(vehicle)
        books = self.engine.books()
        books.strike(leaving)
        if books.in_line:
            self._change(books, {})
        else:
            self.engine.clear()

    def after_step(self) -> None:
        """Do what is due after a step of the traffic."""
        self._notice()
        if self.engine is not None and self.members:
            self._heed_speeds(self.engine.vehicles)
            self.engine.after_step()
        self._take_in()

    def _heed_speeds(self, vehicles: Any) -> None:  # noqa: ANN401  a table, by column
        """Count on it that vehicles go on as fast as they are told to drive, beyond any limit."""
        faster = vehicles["speed"] + vehicles["accel"] * self._traffic.step_s
        told = vehicles["speed"] > vehicles["top"]
        vehicles["top"] = np.where(told, faster, vehicles["top"])

    def _notice(self) -> None:
        """Let go of those that are gone, and take those for newcomers that are elsewhere than they drove."""
        if not self.members and not self.newcomers:
            return
        present = set(self._traffic.vehicles())
        self.drop([n.vehicle for n in self.newcomers.values() if n.seen and n.vehicle not in present], GONE)
        self.drop(self.members.keys() - present, GONE)
        moved = [vehicle for vehicle, driver in self.members.items() if self._is_moved(driver)]
        self._rejoin(moved, "moved")
        for newcomer in self.newcomers.values():
            newcomer.seen |= newcomer.vehicle in present

    def _rejoin(self, vehicles: Sequence[str], reason: str) -> None:
        kinds = {loop.id: (loop, kind) for loop, kind in self.plan.users}
        now = self._traffic.now_s
        again = [Newcomer(v, *kinds[self.members[v].track.loop], now, seen=True) for v in vehicles]
        self.drop(vehicles, reason)
        self.newcomers = {newcomer.vehicle: newcomer for newcomer in again} | self.newcomers  # they go first

    def _is_moved(self, driver: Driver) -> bool:
        lane, at_m = self._traffic.lane(driver.id)
        if lane.startswith(":"):
            return False
        edge = lane.rpartition("_")[0]
        if all(name != edge for _, name in driver.track.edges):
            return True
        front_m = self._traffic.odometer(driver.id) + float(driver.row["offset"])
        return abs(driver.track.near(edge, at_m, front_m) - front_m) > _MOVED_M

    def _take_in(self) -> None:
        """Hold newcomers back, and take in those who can be."""
        if self._next is not None and not self._replan(self._next):
            return
        now = self._traffic.now_s
        on_road = [newcomer for newcomer in self.newcomers.values() if newcomer.seen]
        for newcomer in on_road:
            newcomer.look(self._traffic, self.plan)
        ready = [n for n in on_road if n.inside and now >= n.tried_s + _AGAIN_S]
        if not ready or self._try(ready) or len(ready) == 1:
            return
        for newcomer in ready:
            self._try([newcomer])

    def _replan(self, plan: Plan) -> bool:
        """Go over to another plan if that can be done now; else see to it that it can be soon."""
        goes_on = not self.members or plan.goes_on_with(self.plan)
        if not goes_on and not (self.engine is not None and self.engine.settled):
            self._orders.pause = True
            return False
        self._orders.pause = False
        for newcomer in self.newcomers.values():
            newcomer.let_go(self._traffic)
        if not goes_on:
            self._rejoin(list(self.members), "another plan")
        self._next, self.plan = None, plan
        if self.around is not None:
            self.around.plan(plan.itineraries, plan.tracks, plan.room)
        if self.engine is not None and self.members:
            self._change(self.engine.books(), {})
        return True

    def _try(self, newcomers: Sequence[Newcomer]) -> bool:
        """Take newcomers in together if places and gate allow it."""
        books, drivers = Books({}, {}, {}), self.members
        if self.engine is not None and drivers:
            books = self.engine.books()
        tracks: dict[str, Track] = {}
        left = {n.vehicle: n.left_m for n in newcomers}

        def left_m(state: str, other: str) -> float:
            return left[other] if other in left else drivers[other].left_m(state)

        for newcomer in newcomers:
            newcomer.tried_s = self._traffic.now_s
            position = newcomer.position or 0
            track = self.plan.track(
                newcomer.vehicle, newcomer.loop.id, front_m=newcomer.arc_m, position=position
            )
            state = track.legs[position].state
            if len(books.holders.get(state, ())) > self.plan.room[state]:
                return False
            tracks[newcomer.vehicle] = track
            books.enter(newcomer.vehicle, state, newcomer.left_m, partial(left_m, state))
        try:
            self._change(books, tracks)
        except GateError:
            return False
        for vehicle in tracks:
            del self.newcomers[vehicle]
        return True

    def _change(self, books: Books, joining: Mapping[str, Track]) -> None:
        """Make system, gate and tables anew.

        Raises
        ------
        GateError
            If the gate cannot keep its promise with those who join; then all is as it was.
        """
        members = self.members
        vehicles = books.in_line
        tracks = [joining[v] if v in joining else self.plan.on(members[v].track) for v in vehicles]
        positions = [
            track.start_position if track.vehicle in joining else members[track.vehicle].granted
            for track in tracks
        ]
        room = self.plan.room
        system = _system(tracks, positions, {state: len(line) for state, line in books.lines.items()}, room)
        gate = make_gate(self._gate, system, perf_counter)
        _refuse_crowd(gate, system, room)
        self.changes += 1
        if self.engine is None:
            self.keeper = Gatekeeper(system, gate, self._negotiation, serve_after_s=SERVE_AFTER_S)
            self.keeper.obstacles = (self._orders,)
            self.engine = ChangingEngine(self._traffic, (), self.keeper, self._recorder, foresees=False)
            self._orders.drivers = self.engine.drivers
            self.around = Surroundings(
                self._network, self._traffic, self.engine, self.keeper, lights=self._lights, others=True
            )
            self.around.plan(self.plan.itineraries, self.plan.tracks, room)
        self.engine.change(tracks, books, system=system, gate=gate, room=room)


def _system(
    tracks: Sequence[Track], positions: Sequence[int], standing: Mapping[str, int], room: Mapping[str, int]
) -> System:
    """Return the vehicles as robots that stand where they are; a place holds all that stand in it."""
    robots = [
        Robot(
            RobotId(track.vehicle),
            tuple(leg.state for leg in track.legs),
            start=position % len(track.legs),
        )
        for track, position in zip(tracks, positions, strict=True)
    ]
    visited = dict.fromkeys(state for robot in robots for state in robot.path)
    capacity = {StateId(state): max(room[state], standing.get(state, 0)) for state in visited}
    return System(robots, capacity, capacity.keys())


def _refuse_crowd(gate: Gate, system: System, room: Mapping[str, int]) -> None:
    """See to it that everyone can still go on where a place holds more than it has slots for."""
    slots = [room[state] for state in system.states]
    if slots == list(system.room) or getattr(gate, "promise", "") != "everyone":
        return
    wide = [max(SPARE, most) if own else most for most, own in zip(slots, system.private, strict=True)]
    if find_crowd(system.paths, wide) is not None:
        msg = "with those who join not everyone could go on for ever"
        raise GateError(msg)
