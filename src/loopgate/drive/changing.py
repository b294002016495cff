"""An engine whose vehicles join and leave, and go on by other ways."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Any, cast

import numpy as np

from loopgate.abstraction.track import Track
from loopgate.drive import step as drive
from loopgate.drive.build import places_on
from loopgate.drive.codes import NOBODY, NOTHING, STOPPING
from loopgate.drive.driver import Driver
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.ground import HOLDERS, LINE
from loopgate.errors import TrafficError
from loopgate.gates import Gate
from loopgate.gates.certified.chain import leads_round
from loopgate.model import System
from loopgate.results.columns import Event

__all__ = ["ChangingEngine"]

_SAME_M = 0.5
"""Vehicles that are ahead of one another by less than this stand beside each other [m]."""


class ChangingEngine(Engine):
    """An engine whose vehicles join and leave: each takes a row of the tables, and gives it back."""

    _shut = False
    """Whether any state is shut."""
    _withheld: AbstractSet[str] = frozenset()
    """The vehicles that get no grant."""

    @property
    def keeper(self) -> Gatekeeper:
        """What answers requests; there is a gate."""
        if self._gatekeeper is None:
            msg = "vehicles join and leave under a gate only"
            raise TrafficError(msg)
        return self._gatekeeper

    def lay(self, ways: Sequence[Track], room: Mapping[str, int]) -> None:
        """Lay ways on which vehicles are or will come; who is on one goes on by that of the same name.

        Parameters
        ----------
        ways
            One track at least of each, and one of each vehicle that ends on it.
        room
            How many vehicles the states on them hold, by name.
        """
        self._ground.lay(ways, places_on(ways, room))
        now = {track.loop: track for track in ways}
        for driver in self.drivers:
            known = now[driver.track.loop]
            driver.track = replace(driver.track, legs=known.legs)
            driver.row["leg_at"] = self._ground.leg_at(driver.track)
        self.run["version"] += 1
        self._use_tables()

    def go_by(self, system: System, gate: Gate, *, joined: bool) -> None:
        """Let another gate decide; `joined` as in `Gatekeeper.change`.

        Parameters
        ----------
        system
            The vehicles that there are as robots, in any order; with none it may be of others.
        gate
            Made for it.
        """
        keeper, drivers = self.keeper, self.driver_of
        rows = [drivers[robot.id].robot for robot in system.robots] if drivers else []
        keeper.change(system, gate, rows, joined=joined)
        private = {name for name, alone in zip(system.states, system.private, strict=True) if alone}
        rooms = [place.room for place in self._ground.places]
        if not keeper.in_place:  # all fit into a private state, its vehicle as often as it holds it
            named = zip(self._ground.states, rooms, strict=True)
            rooms = [len(system.robots) if name in private else room for name, room in named]
        cast("Any", self.tables.states)["room"] = rooms
        self.run["version"] += 1
        self._use_tables()

    def knows(self, track: Track) -> bool:
        """Return whether the tables contain this track, so that a vehicle can join on it."""
        return self._ground.knows(track)

    def stand(self, tracks: Sequence[Track]) -> list[Driver]:
        """Let vehicles stand where their tracks begin, to be taken over; return them."""
        self._ground.take(tracks)
        self._use_tables()
        return self._number(tracks)

    def join(self, tracks: Sequence[Track]) -> None:
        """Take vehicles in; under a gate each is held at the end of its state, in line as it stands there."""
        now = self.run["now_s"] = self._traffic.now_s
        for driver in self.stand(tracks):
            self._take_in(driver)
            if self._gatekeeper is not None:
                driver.row["held"] = True
                driver.row["line_m"] = driver.row["held_m"] = driver.end_m(driver.granted)
                self._line_up(driver)
                self.take_turn(driver)
                self._let_first_ask(self._state_of(driver))
        self._carry_out(now)

    def leave(self, vehicles: Sequence[str]) -> None:
        """Let vehicles go, with all that they hold."""
        for vehicle in vehicles:
            driver = self.driver_of.pop(vehicle)
            robot, last = driver.robot, self.drivers[-1]
            self._step(drive.LEAVE, robot, last.robot)
            self._ground.give_back(robot)
            self.drivers[robot], self._ids[robot] = last, last.id
            self.drivers.pop()
            self._ids.pop()
            if last is not driver:
                last.goes_on(robot, self.tables)
            self.beside.discard(vehicle)
            self._steering.forget(vehicle)
            self._used_stops.drop(vehicle)
        self._use_tables()
        self.arrived = ()
        self._carry_out(self._traffic.now_s)

    def answer(self) -> None:
        """Answer those who ask since somebody has come or gone; all who are there must have joined."""
        self.keeper.answer()
        self._carry_out(self._traffic.now_s)

    def shut(self, state: str) -> None:
        """Let nobody into a state, until `open_up`."""
        cast("Any", self.tables.states)["shut"][self._number_of(state)] = self._shut = True

    def open_up(self) -> None:
        """Let vehicles into all states again."""
        if self._shut:
            self.run["version"] += 1
            cast("Any", self.tables.states)["shut"][:] = self._shut = False

    def withhold(self, vehicles: AbstractSet[str]) -> None:
        """Grant nothing to these from now on, and again to those that were named in the call before."""
        drivers = self.driver_of
        for vehicle in (self._withheld - vehicles) & drivers.keys():
            if drivers[vehicle].row["withheld"] == STOPPING:
                drivers[vehicle].row["withheld"] = NOTHING
        for vehicle in vehicles:
            drivers[vehicle].row["withheld"] = STOPPING
        self._withheld = vehicles

    def wait_outside(self, numbers: Mapping[str, int]) -> None:
        """Take note of how many wait to depart into each state: they count as queues there."""
        outside = cast("Any", self.tables.states)["outside"]
        outside[:] = 0
        for state, waiting in numbers.items():
            outside[self._number_of(state)] = waiting

    def turn_off(self, vehicle: str, track: Track, position: int) -> bool:
        """Lead a vehicle on by another way from its place on; return whether it can be done now.

        It can where it holds that place and nothing else, and does not wait to move out of others' way; and
        where no circle of full places closes by it.

        Parameters
        ----------
        track
            On one of the ways that are laid.
        position
            Of its place on that.

        Raises
        ------
        TrafficError
            If the simulator does not take the way.
        """
        driver, keeper = self.driver_of[vehicle], self.keeper
        row = driver.row
        if not keeper.in_place or not driver.settled or driver.id in self.beside:
            return False
        if row["steered"] or row["going"] or row["mover"]:
            return False
        state = self._state_of(driver)
        line = keeper.line(state)
        if len(line) >= keeper.slots(state) and line[0] == driver.robot:
            wanted = self._number_of(track.legs[(position + 1) % len(track.legs)].state)
            if leads_round(keeper, wanted, state):
                return False
        here = bisect_left([begin_m for begin_m, _ in track.edges], track.legs[position].end_m) - 1
        now = self._traffic.now_s
        self._traffic.lead(driver.id, track.onward(here))
        if row["pending"]:
            row["longest_s"] = driver.worst_wait_s(now)
        self._withdraw([driver])
        self._ground.turn_off(driver, track, position)
        self._recorder.note(now, driver.id, Event.REROUTE, driver.leg(position).state, track.loop)
        self.changes += 1
        self.run["version"] += 1
        self._let_first_ask(state)
        self.answer()
        return True

    def holding(self, state: str) -> list[Driver]:
        """Return the vehicles that hold a state."""
        return [self.drivers[robot] for robot in self.keeper.holders(self._number_of(state))]

    def line(self, state: str) -> list[Driver]:
        """Return the vehicles whose last grant is a state, first one first."""
        return [self.drivers[robot] for robot in self.keeper.line(self._number_of(state))]

    def slots(self, state: str) -> int:
        """Return how many vehicles a state holds."""
        return self.keeper.slots(self._number_of(state))

    def _state_of(self, driver: Driver) -> int:
        """Return the number of the state of a vehicle's last grant."""
        return self._number_of(driver.leg(driver.granted).state)

    def _number_of(self, state: str) -> int:
        """Return the number of a state."""
        return self._ground.states[state]

    def _with(self, driver: Driver, which: tuple[str, str]) -> tuple[list[int], list[int]]:
        """Return a list of a vehicle's state with it where it is on the road, and who is behind it."""
        leg = driver.leg(driver.granted).state
        others = [robot for robot in self._ground.read(self._number_of(leg), which) if robot != driver.robot]
        # Of several that come at once the others are not in order yet.
        line = sorted((*others, driver.robot), key=lambda robot: self._left_m(self.drivers[robot], leg))
        return line, line[line.index(driver.robot) + 1 :]

    def _left_m(self, driver: Driver, state: str) -> float:
        """Return how far it is to the end of a state [m]; from its rear for one beside the road.

        One that stands next to it cannot let it in, and so goes first.
        """
        return driver.left_m(state) + (driver.length_m if driver.id in self.beside else 0.0)

    def _line_up(self, driver: Driver) -> None:
        """Let a vehicle be where it is among those that hold its state."""
        self._put(self._state_of(driver), HOLDERS, self._with(driver, HOLDERS)[0])

    def _put(self, state: int, which: tuple[str, str], robots: Sequence[int]) -> None:
        self._ground.write(state, which, robots)
        self.run["version"] += 1

    def take_turn(self, driver: Driver) -> None:
        """Update a vehicle's rank in the line of its place: others may have passed it."""
        state, (line, behind) = self._state_of(driver), self._with(driver, LINE)
        if line != self._ground.read(state, LINE):
            self._put(state, LINE, line)
            self._let_wait([self.drivers[robot] for robot in behind])
            self._let_first_ask(state)

    def mend_order(self) -> int:
        """Put the lines of all places in the order on the road; return how many were not in it."""
        v, states, lists = self.vehicles, cast("Any", self.tables.states), self.tables.lists
        left_m = v["line_m"] - v["front"]
        for driver in (self.driver_of[vehicle] for vehicle in sorted(self.beside)):
            left_m[driver.robot] += driver.length_m
        mended = 0
        for state in np.flatnonzero(states["queue"] > 1).tolist():
            robots = lists[states["line"][state] :][: states["queue"][state]]
            if (np.diff(left_m[robots]) < -_SAME_M).any():
                self.take_turn(self.drivers[int(robots[0])])
                mended += 1
        return mended

    def _let_wait(self, drivers: Sequence[Driver]) -> None:
        """Let vehicles ask when it is their turn: somebody is before them."""
        for driver in drivers:
            driver.row["asking"] |= driver.row["pending"]
        self._withdraw(drivers)

    def _let_first_ask(self, state: int) -> None:
        """Let the first in a state ask in time, and those behind it hold back."""
        line = [self.drivers[robot] for robot in self._ground.read(state, LINE)]
        for driver in line:
            if not driver.row["held"] and driver.id not in self.beside:
                driver.row["asking"] = True
        if line and not line[0].row["steered"] and line[0].id not in self.beside:
            self._step(drive.CONSIDER, robots=np.array([line[0].robot], dtype=np.int64))

    @property
    def sets_aside(self) -> bool:
        """Whether vehicles can step aside: under the chain rule, which asks only who is in which place."""
        return self.keeper.by_chain

    def wait_for_nothing(self, vehicle: str) -> None:
        """Let a vehicle stand where it is and ask for nothing, held by nobody, until `wait_again`."""
        driver = self.driver_of[vehicle]
        row, now = driver.row, self._traffic.now_s
        if row["pending"]:
            row["longest_s"] = driver.worst_wait_s(now)
        row["asking"] = False
        self._withdraw([driver])
        if row["held"]:
            row["hold_s"] += 0.0 if np.isnan(row["halted_s"]) else now - row["halted_s"]
            row["held"], row["held_m"], row["halted_s"] = False, np.inf, np.nan
            self._release(driver)
        row["stop_m"] = driver.front_m
        self.run["version"] += 1

    def call_back(self, vehicle: str) -> None:
        """Let a vehicle that waits for nothing drive on as soon as it is back on the road."""
        self.driver_of[vehicle].row["stop_m"] = np.inf

    def wait_again(self, vehicle: str) -> None:
        """Let a vehicle ask in its turn again."""
        driver = self.driver_of[vehicle]
        driver.row["stop_m"], driver.row["asking"] = np.inf, True
        self._let_first_ask(self._state_of(driver))
        self.answer()

    def step_aside(self, vehicle: str, why: str = "") -> bool:
        """Let a vehicle that parks give up its slot; return whether it does.

        It does where it holds one state as a whole; until `come_back` it is in none.
        """
        driver = self.driver_of[vehicle]
        row = driver.row
        if not self.sets_aside or not row["tail"] == row["crossed"] == row["granted"]:
            return False
        state = self._state_of(driver)
        row["asking"] = False
        self._withdraw([driver])
        for which in (HOLDERS, LINE):
            self._put(state, which, [r for r in self._ground.read(state, which) if r != driver.robot])
        self.beside.add(driver.id)
        row["aside"] = True
        place = driver.leg(driver.granted).state
        self._recorder.note(self._traffic.now_s, driver.id, Event.PARK, place, why)
        self._let_first_ask(state)
        return True

    def has_slot_for(self, driver: Driver) -> bool:
        """Return whether one that has stepped aside may have a slot again: the chain rule's answer."""
        states, state = cast("Any", self.tables.states), self._state_of(driver)
        here = states[state]
        free = here["room"] - here["held_by"]
        if free <= 0 or here["shut"] or here["mover"] != NOBODY or (free == 1 and here["slot"] != NOBODY):
            return False
        if here["queue"] + 1 < here["room"]:
            return True
        line, _ = self._with(driver, LINE)
        return not leads_round(self.keeper, self.keeper.wanted(line[0]), state)

    def come_back(self, driver: Driver) -> None:
        """Let one that has stepped aside have a slot again; it is on the road only with `is_back`."""
        self._line_up(driver)
        self.take_turn(driver)

    def is_back(self, driver: Driver) -> None:
        """Take note that one that has come back is on the road."""
        self.take_turn(driver)
        self.beside.discard(driver.id)
        driver.row["aside"] = False
        state = self._state_of(driver)
        line = [self.drivers[robot].id for robot in self._ground.read(state, LINE)]
        before = [vehicle for vehicle in line[: line.index(driver.id)] if vehicle not in self.beside]
        ahead = before[-1] if before else ""
        place = driver.leg(driver.granted).state
        self._recorder.note(self._traffic.now_s, driver.id, Event.RETURN, place, ahead)
        driver.row["asking"] = True
        self._let_first_ask(state)

    @property
    def settled(self) -> bool:
        """Whether every vehicle holds the state it is in and nothing else."""
        v = self.vehicles
        one = (v["tail"] == v["granted"]) & (v["crossed"] == v["granted"]) & ~v["steered"] & ~v["going"]
        return bool(one.all())
