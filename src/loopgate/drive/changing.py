"""An engine whose vehicles join and leave: for those who are there tables are made anew."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from loopgate.drive import step as drive
from loopgate.drive.books import Books, carry_over, read_books, write_books
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.track import Track
from loopgate.errors import TrafficError
from loopgate.gates import Gate
from loopgate.model import StateId, System

__all__ = ["ChangingEngine"]


class ChangingEngine(Engine):
    """An engine whose vehicles join and leave."""

    def books(self) -> Books:
        """Return who holds what."""
        return read_books(self.tables, self.drivers, self._keeper.system)

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
            One track per robot of the system, in its order: that of `Books.in_line`.
        books
            Who holds what from now on.
        gate
            Made for the system.
        room
            How many vehicles the states hold, by name: fewer than in the system where more stand in one.
        """
        before, numbers = self.tables, {driver.id: driver.robot for driver in self.drivers}
        self._keeper.change(system, gate)
        self._make(tracks)
        for vehicle in numbers.keys() - self.driver_of.keys():
            self._steering.forget(vehicle)
            self._worn.drop(vehicle)
        robots = {numbers[d.id]: d.robot for d in self.drivers if d.id in numbers}
        carry_over(before, self.tables, robots)
        write_books(books, self.tables, self.drivers, system)
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

    def join(self, tracks: Sequence[Track]) -> None:
        """Go on with more vehicles, where there is no gate."""
        before, count = self.tables, len(self.drivers)
        self._make([*(driver.track for driver in self.drivers), *tracks])
        carry_over(before, self.tables, {robot: robot for robot in range(count)})
        self._run["now_s"] = self._traffic.now_s
        for driver in self.drivers[count:]:
            self._take_in(driver)

    def shut(self, state: str) -> None:
        """Let nobody into a state, until `open_up` or the next change."""
        names = self._keeper.system.states
        if state in names:  # else nobody comes there
            cast("Any", self.tables.states)["shut"][names.index(StateId(state))] = True

    def open_up(self) -> None:
        """Let vehicles into all states again."""
        shut = cast("Any", self.tables.states)["shut"]
        self._run["version"] += int(shut.any())
        shut[:] = False

    def wait_outside(self, numbers: Mapping[str, int]) -> None:
        """Take note of how many wait to depart into each state: they count as queues there."""
        outside = cast("Any", self.tables.states)["outside"]
        outside[:] = [numbers.get(name, 0) for name in self._keeper.system.states]

    def clear(self) -> None:
        """Go on without any vehicle: all have left."""
        before, gone = self.tables, list(self.driver_of)
        self._make(())
        carry_over(before, self.tables, {})
        for vehicle in gone:
            self._steering.forget(vehicle)
            self._worn.drop(vehicle)

    def _let_heads_ask(self, books: Books) -> None:
        """Let those ask who are first in their states now, and nobody who is not."""
        v, waiting = self.vehicles, self._run["waiting"][0]
        later = {vehicle for line in books.lines.values() for vehicle in line[1:]}
        for vehicle in later:
            row = self.driver_of[vehicle].row
            row["asking"] |= row["pending"]
            row["pending"] = False
        queue = cast("Any", self.tables.entries)["waiting"]
        still = [robot for robot in queue[:waiting].tolist() if v["pending"][robot]]
        queue[: len(still)] = still
        self._run["waiting"] = len(still)
        self._run["now_s"] = self._traffic.now_s
        first = [d.robot for d in self.drivers if d.id not in later and not d.row["steered"]]
        self._step(drive.CONSIDER, robots=np.array(first, dtype=np.int64))
        self._keeper.answer()
        self._carry_out(self._traffic.now_s)

    @property
    def settled(self) -> bool:
        """Whether every vehicle holds the state it is in and nothing else."""
        v = self.vehicles
        one = (v["tail"] == v["granted"]) & (v["crossed"] == v["granted"]) & ~v["steered"] & ~v["going"]
        return bool(one.all())
