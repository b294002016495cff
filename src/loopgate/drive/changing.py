"""An engine whose vehicles join and leave.

Tables are made anew for those who are there; but where all ways are known and the chain rule decides alone,
vehicles that drive once take their rows in tables made for all ways, and give them back.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from typing import Any, Final, cast

import numpy as np

from loopgate.drive import step as drive
from loopgate.drive.books import Books, carry_over, read_books, write_books
from loopgate.drive.codes import NOBODY
from loopgate.drive.driver import Driver
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.ground import Ground
from loopgate.drive.track import Track
from loopgate.errors import TrafficError
from loopgate.gates import Gate
from loopgate.gates.certified.entering import leads_round
from loopgate.model import StateId, System
from loopgate.results.columns import Event

__all__ = ["ChangingEngine"]


_LISTS: Final = (("holders", "held_by"), ("line", "queue"))
"""Where the lists of a state begin and how long they are: those that hold it, and those in line."""


class ChangingEngine(Engine):
    """An engine whose vehicles join and leave, and step aside where they park."""

    def _make(self, tracks: Sequence[Track]) -> None:
        super()._make(tracks)
        self.beside = {vehicle for vehicle in self.beside if vehicle in self.driver_of}

    _ground: Ground | None = None
    """Tables in which they do so one by one, where all their ways are known and the chain rule decides."""

    _laid: Ground | None = None
    """The same, whether they drive on it or not."""

    _shut = False
    """Whether any state is shut."""

    def drive_by(self, ways: Sequence[Track], room: Mapping[str, int]) -> None:
        """Make ready for all ways on which vehicles will come.

        Parameters
        ----------
        ways
            One track at least of each.
        room
            How many vehicles the states on them hold, by name.
        """
        self._laid = Ground(
            ways, room, self._recorder.code, step_s=self._traffic.step_s, signals=self._signals
        )

    def books(self) -> Books:
        """Return who holds what."""
        return read_books(self.tables, self.drivers, self._keeper.states, self.movements)

    @property
    def _keeper(self) -> Gatekeeper:
        if self._gatekeeper is None:
            msg = "vehicles join and leave under a gate only"
            raise TrafficError(msg)
        return self._gatekeeper

    def change(
        self,
        tracks: Sequence[Track],
        books: Books,
        *,
        system: System,
        gate: Gate,
        room: Mapping[str, int],
    ) -> None:
        """Go on with these vehicles: some have joined, held at the ends of their states, others have left.

        Parameters
        ----------
        tracks, system
            One track per robot of the system, in its order: that of `Books.everybody`.
        books
            Who holds what from now on.
        gate
            Made for the system.
        room
            How many vehicles the states hold, by name: fewer than in the system where more stand in one.
        """
        before, numbers = self.tables, {driver.id: driver.robot for driver in self.drivers}
        self._keeper.change(system, gate, joined=self._laid is not None)
        if self._laid is not None and self._keeper.by_chain:
            self._go_on_ground(self._laid, tracks)
        else:
            self._ground = None
            self._make(tracks)
        for vehicle in numbers.keys() - self.driver_of.keys():
            self._steering.forget(vehicle)
            self._worn.drop(vehicle)
        robots = {numbers[d.id]: d.robot for d in self.drivers if d.id in numbers}
        carry_over(before, self.tables, robots)
        write_books(books, self.tables, self.drivers, self._keeper.states, self.movements)
        if self._ground is None:
            states = cast("Any", self.tables.states)
            states["room"] = [
                most if private else room[name]
                for most, private, name in zip(states["room"], system.private, system.states, strict=True)
            ]
        for driver in self.drivers:
            if driver.id not in numbers:
                self._take_in(driver)
                driver.row["held"] = True
                driver.row["line_m"] = driver.row["held_m"] = driver.end_m(driver.granted)
        self._let_heads_ask(books)

    def _go_on_ground(self, ground: Ground, tracks: Sequence[Track]) -> None:
        """Go on in the tables for all ways that there are, in which vehicles can come and go."""
        ground.clear()
        for track in tracks:
            ground.take(track)
        self._ground, self.movements, self.roads = ground, ground.movements, ground.roads
        self._use(ground.tables, ground.states)
        self._number(tracks)

    @property
    def changes_in_place(self) -> bool:
        """Whether vehicles can come and go without tables made anew."""
        return self._ground is not None and self._keeper.by_chain

    def seats(self, track: Track) -> bool:
        """Return whether a vehicle can be taken in on a track without tables made anew."""
        return self.changes_in_place and self._ground is not None and self._ground.knows(track)

    def seat(self, track: Track) -> None:
        """Take in a vehicle that is held at the end of its state, behind all others there; see `seats`."""
        if self._ground is None:
            return
        robot, lists = self._ground.take(track), self.tables.lists
        self._use(self._ground.tables, self._ground.states)
        if self.tables.lists is not lists:  # there was no room
            for driver in self.drivers:
                driver.goes_on(driver.robot, driver.track, self.tables)
        self._once |= not track.rounds
        driver = Driver(robot, track, self.tables)
        self.drivers.append(driver)
        self._ids.append(driver.id)
        self.driver_of[driver.id] = driver
        self.run["now_s"] = self._traffic.now_s
        self._take_in(driver)
        self._step(drive.JOIN, robot)
        self._carry_out(self._traffic.now_s)

    def unseat(self, vehicles: Sequence[str]) -> bool:
        """Let vehicles go; return whether that can be done without tables made anew."""
        if self._ground is None or not self.changes_in_place:
            return False
        for vehicle in vehicles:
            driver = self.driver_of.pop(vehicle)
            robot, last = driver.robot, self.drivers[-1]
            self._step(drive.LEAVE, robot, last.robot)
            if last is not driver:
                self.drivers[robot], self._ids[robot] = last, last.id
            self.drivers.pop()
            self._ids.pop()
            self._ground.give_back(robot)
            self.beside.discard(vehicle)
            if last is not driver:
                last.goes_on(robot, last.track, self.tables)
            self._steering.forget(vehicle)
            self._worn.drop(vehicle)
        self._use(self._ground.tables, self._ground.states)
        self.arrived = ()
        self._carry_out(self._traffic.now_s)
        return True

    def answer(self) -> None:
        """Answer those who ask since somebody has come or gone; all who are there must have their seats."""
        self._keeper.answer()
        self._carry_out(self._traffic.now_s)

    def join(self, tracks: Sequence[Track]) -> None:
        """Go on with more vehicles, where there is no gate."""
        before, count = self.tables, len(self.drivers)
        self._make([*(driver.track for driver in self.drivers), *tracks])
        carry_over(before, self.tables, {robot: robot for robot in range(count)})
        self.run["now_s"] = self._traffic.now_s
        for driver in self.drivers[count:]:
            self._take_in(driver)

    def shut(self, state: str) -> None:
        """Let nobody into a state, until `open_up` or the next change."""
        number = self._keeper.number(state)
        if number is not None:  # else nobody comes there
            cast("Any", self.tables.states)["shut"][number] = self._shut = True

    def open_up(self) -> None:
        """Let vehicles into all states again."""
        if self._shut:
            self.run["version"] += 1
            cast("Any", self.tables.states)["shut"][:] = self._shut = False

    def wait_outside(self, numbers: Mapping[str, int]) -> None:
        """Take note of how many wait to depart into each state: they count as queues there."""
        outside = cast("Any", self.tables.states)["outside"]
        outside[:] = 0
        for state, waiting in numbers.items():
            number = self._keeper.number(state)
            if number is not None:  # else nobody asks to get there
                outside[number] = waiting

    def clear(self) -> None:
        """Go on without any vehicle: all have left."""
        before, gone = self.tables, list(self.driver_of)
        self._ground = None
        self._make(())
        carry_over(before, self.tables, {})
        for vehicle in gone:
            self._steering.forget(vehicle)
            self._worn.drop(vehicle)

    def _let_heads_ask(self, books: Books) -> None:
        """Let those ask who are first in their states now, and nobody who is not."""
        later = {vehicle for line in books.lines.values() for vehicle in line[1:]}
        self._let_wait([self.driver_of[vehicle] for vehicle in later])
        self.run["now_s"] = self._traffic.now_s
        off = later | self.beside
        first = [d.robot for d in self.drivers if d.id not in off and not d.row["steered"]]
        self._step(drive.CONSIDER, robots=np.array(first, dtype=np.int64))
        self.answer()

    def _let_wait(self, drivers: Sequence[Driver]) -> None:
        """Let vehicles ask when it is their turn: somebody is before them."""
        for driver in drivers:
            driver.row["asking"] |= driver.row["pending"]
        self._withdraw(drivers)

    @property
    def sets_aside(self) -> bool:
        """Whether vehicles can step aside: under the chain rule, which asks only who is in which place."""
        return self._keeper.by_chain

    def step_aside(self, driver: Driver) -> bool:
        """Let a vehicle that parks give up its slot; return whether it does.

        It does where it holds one state as a whole; until `come_back` it is in none.
        """
        row = driver.row
        if not self.sets_aside or not row["tail"] == row["crossed"] == row["granted"]:
            return False
        state = self._state_of(driver)
        row["asking"] = False
        self._withdraw([driver])
        for begin, length in _LISTS:
            self._write(
                state, begin, length, [r for r in self._read_list(state, begin, length) if r != driver.robot]
            )
        self.beside.add(driver.id)
        self._recorder.note(self._traffic.now_s, driver.id, Event.PARK, driver.leg(driver.granted).state)
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
        return not leads_round(self._keeper, self._keeper.wanted(self._with(driver, state)[0]), state)

    def turn_off(self, driver: Driver, track: Track, position: int) -> bool:
        """Lead a vehicle on by another way from its place on; return whether it can be done now.

        It can where it holds that place and nothing else, and does not wait to move out of others' way; and
        where no circle of full places closes by it.

        Parameters
        ----------
        driver
            The vehicle.
        track
            One of those in `drive_by`.
        position
            Of its place on that.

        Raises
        ------
        TrafficError
            If the simulator does not take the way.
        """
        row = driver.row
        settled = row["tail"] == row["crossed"] == row["granted"] == row["entered"]
        if self._ground is None or not settled or driver.id in self.beside:
            return False
        if row["steered"] or row["going"] or row["mover"]:
            return False
        state, states = self._state_of(driver), cast("Any", self.tables.states)
        line = self._read_list(state, *_LISTS[1])
        if states["queue"][state] >= states["room"][state] and line[0] == driver.robot:
            wanted = self._number_of(track.legs[(position + 1) % len(track.legs)].state)
            if leads_round(self._keeper, wanted, state):
                return False
        here = bisect_left([begin_m for begin_m, _ in track.edges], track.legs[position].end_m) - 1
        self._traffic.lead(driver.id, [name for _, name in track.edges[here:]])
        if row["pending"]:
            row["longest_s"] = driver.worst_wait_s(self._traffic.now_s)
        self._withdraw([driver])
        self._ground.turn_off(driver, track, position)
        self._recorder.note(
            self._traffic.now_s, driver.id, Event.REROUTE, driver.leg(position).state, track.loop
        )
        self.changes += 1
        self.run["version"] += 1
        self._let_first_ask(state)
        self.answer()
        return True

    def come_back(self, driver: Driver) -> None:
        """Let one that has stepped aside have a slot again; it is on the road only with `is_back`."""
        state = self._state_of(driver)
        holders = self._read_list(state, *_LISTS[0])
        self._write(state, *_LISTS[0], [*holders, driver.robot])
        self.take_turn(driver)

    def take_turn(self, driver: Driver) -> None:
        """Let one that is coming back be where it is in the line of its place: others may have passed."""
        state = self._state_of(driver)
        line, before = self._with(driver, state), self._read_list(state, *_LISTS[1])
        if line == before:
            return
        self._write(state, *_LISTS[1], line)
        self._let_wait([self.drivers[robot] for robot in line[1:] if robot != driver.robot])
        self._let_first_ask(state)

    def is_back(self, driver: Driver) -> None:
        """Take note that one that has come back is on the road."""
        self.take_turn(driver)
        self.beside.discard(driver.id)
        state = self._state_of(driver)
        line = [self.drivers[robot].id for robot in self._read_list(state, *_LISTS[1])]
        before = [vehicle for vehicle in line[: line.index(driver.id)] if vehicle not in self.beside]
        ahead = before[-1] if before else ""
        place = driver.leg(driver.granted).state
        self._recorder.note(self._traffic.now_s, driver.id, Event.RETURN, place, ahead)
        driver.row["asking"] = True
        self._let_first_ask(state)

    def holding(self, state: StateId) -> list[Driver]:
        """Return the vehicles that hold a state."""
        number = self._number_of(state)
        return [self.drivers[robot] for robot in self._keeper.holders(number)]

    def _state_of(self, driver: Driver) -> int:
        """Return the number of the state of a vehicle's last grant."""
        return self._number_of(driver.leg(driver.granted).state)

    def _number_of(self, state: StateId) -> int:
        number = self._keeper.number(state)
        if number is None:
            msg = f"nobody comes to {state}"
            raise KeyError(msg)
        return number

    def _with(self, driver: Driver, state: int) -> list[int]:
        """Return the line of a state with a vehicle where it is in it."""
        line = [robot for robot in self._read_list(state, *_LISTS[1]) if robot != driver.robot]
        left_m = driver.end_m(driver.granted) - driver.front_m
        others = (self.drivers[robot] for robot in line)
        at = sum(other.end_m(other.granted) - other.front_m <= left_m for other in others)
        return [*line[:at], driver.robot, *line[at:]]

    def _read_list(self, state: int, begin: str, length: str) -> list[int]:
        row = cast("Any", self.tables.states)[state]
        robots: list[int] = self.tables.lists[row[begin] : row[begin] + row[length]].tolist()
        return robots

    def _write(self, state: int, begin: str, length: str, robots: Sequence[int]) -> None:
        row = cast("Any", self.tables.states)[state]
        self.tables.lists[row[begin] : row[begin] + len(robots)] = robots
        row[length] = len(robots)
        self.run["version"] += 1

    def _let_first_ask(self, state: int) -> None:
        """Let the first in a state ask in time, and those behind it hold back."""
        line = [self.drivers[robot] for robot in self._read_list(state, *_LISTS[1])]
        for driver in line:
            if not driver.row["held"] and driver.id not in self.beside:
                driver.row["asking"] = True
        if line and not line[0].row["steered"] and line[0].id not in self.beside:
            self._step(drive.CONSIDER, robots=np.array([line[0].robot], dtype=np.int64))

    @property
    def settled(self) -> bool:
        """Whether every vehicle holds the state it is in and nothing else."""
        v = self.vehicles
        one = (v["tail"] == v["granted"]) & (v["crossed"] == v["granted"]) & ~v["steered"] & ~v["going"]
        return bool(one.all())
