"""Tables on which vehicles come and go one by one, and go on by another way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from loopgate.drive.build import (
    Code,
    LegRows,
    Lists,
    RoadRows,
    movements_of,
    moves_of,
    roads_of,
    states_of,
    tables_of,
    vehicle_rows,
    with_room,
)
from loopgate.drive.driver import Driver
from loopgate.drive.rows import table
from loopgate.drive.tables import Tables, VehicleRow
from loopgate.drive.track import Track

__all__ = ["Ground"]

_NUMBERS = 64
"""On fewer crossings at once is a vehicle that comes and goes: each is longer than a place of two."""

_AT_FIRST = 256
"""Room for so many vehicles; twice as many whenever that is not enough."""

_OF_VEHICLES = ("vehicles", "entries", "rows", "times", "acts", "lists")
"""Tables that grow with the vehicles."""

_CHANGED = ("run", "states", "moves", "reasons")
"""Tables of the ways in which something changes while vehicles drive."""

_OF_THE_WAY = ("loop", "lap_m", "next_lap_m", "road_at", "roads", "road", "road_lap", "legs", "lit")
"""Columns that say where on which way a vehicle is."""


class Ground:
    """Tables for ways that are known, on which vehicles come and go one by one: only their rows are made.

    The vehicles are the first rows of a table; where one leaves, the last takes its row. There is room for as
    many as there were at once, or up to twice as many. What depends on the ways alone is made once.

    Parameters
    ----------
    ways
        One track at least of each way, and one for each vehicle that ends on it.
    room
        How many vehicles the states on them hold, by name; all are left in order.
    code
        Gives words their numbers.
    step_s, signals
        See `make_tables`.
    """

    def __init__(
        self,
        ways: Sequence[Track],
        room: Mapping[str, int],
        code: Code,
        *,
        step_s: float,
        signals: Mapping[str, int],
    ) -> None:
        self._code = code
        self.movements, self.roads = movements_of(ways), roads_of(ways)
        """Names of the movements and edges by number; see `Engine`."""
        self.states = tuple(dict.fromkeys(leg.state for track in ways for leg in track.legs))
        """Names of the states by number."""
        lists = Lists()
        legs, self._roads = LegRows(self.states, ways, signals), RoadRows(code)
        self._legs = {id(track.legs): (track.legs, legs.add(track.legs)) for track in ways}
        self._edges = {track.edges: self._roads.add(track.edges) for track in ways}
        rooms = [room[state] for state in self.states]
        ending = _ending(ways)
        most = [min(n + 1, ending.get(state, n + 1)) for state, n in zip(self.states, rooms, strict=True)]
        states = states_of(self.states, rooms, [True] * len(rooms), most, lists, code)
        tables = tables_of(legs, self._roads, states, moves_of(legs, states, lists), code, step_s)
        self._numbers_at = lists.end
        self._bare = tables
        self.clear()

    def clear(self) -> None:
        """Begin anew, with nobody there; tables that were given out stay as they are."""
        fresh = {name: getattr(self._bare, name).copy() for name in _CHANGED}
        self._count = 0
        self._tables = self._bare._replace(**fresh)
        self._make_room(_AT_FIRST)

    def _make_room(self, most: int) -> None:
        """Make room for so many vehicles at once."""
        self._every = table(VehicleRow, length=most)
        lists = np.zeros(self._numbers_at + most * _NUMBERS, dtype=np.int64)
        before, self._tables = self._tables, with_room(most, self._tables, vehicles=self._every, lists=lists)
        for name in _OF_VEHICLES:
            was: Any = getattr(before, name)
            getattr(self._tables, name)[: len(was)] = was

    @property
    def tables(self) -> Tables:
        """The tables of those who are there."""
        return self._tables._replace(vehicles=cast("Any", self._every[: self._count]))

    def knows(self, track: Track) -> bool:
        """Return whether a vehicle can come on a track."""
        return id(track.legs) in self._legs and track.edges in self._edges

    def take(self, track: Track) -> int:
        """Make a row for a vehicle that stands where its track begins; return its number.

        Tables that were given out before are old ones if there was no room in them.
        """
        robot = self._count
        if robot == len(self._every):
            self._make_room(2 * robot)
        row = self._every[robot]
        self._every[robot] = vehicle_rows([track], self._roads, self._code)[0]
        row["leg_at"] = self._legs[id(track.legs)][1]
        row["numbers"], row["number_at"] = _NUMBERS, self._numbers_at + robot * _NUMBERS
        self._count += 1
        return robot

    def turn_off(self, driver: Driver, track: Track, position: int) -> None:
        """Let a vehicle that holds one place and nothing else go on by another way from there on.

        The place is the leg `position` of that, which ends where the vehicle's own does.
        """
        row, before = driver.row, driver.granted
        by_m = track.legs[position].end_m - driver.end_m(before)
        track = replace(track, vehicle=driver.id, start_m=driver.front_m + by_m, start_position=position)
        fresh = vehicle_rows([track], self._roads, self._code)[0]
        for name in _OF_THE_WAY:
            row[name] = fresh[name]
        row["leg_at"] = self._legs[id(track.legs)][1]
        row["top"] = track.top_speed_mps * row["haste"]
        for name in ("entered", "granted", "tail", "crossed"):
            row[name] = position
        for name in ("offset", "front", "rear_m", "line_m", "held_m", "stop_m"):
            row[name] += by_m
        row["moved_m"] += by_m
        row["note_m"], row["red_since_s"] = -np.inf, np.nan  # another light is ahead
        lists = self._tables.lists
        at = int(row["number_at"])
        lists[at + position % _NUMBERS] = lists[at + before % _NUMBERS]
        driver.turns_off(track, by_m)

    def give_back(self, robot: int) -> None:
        """Let the last vehicle have a row; that of `robot` is needed no longer."""
        self._count -= 1
        last, lists = self._count, self._tables.lists
        to, at = (self._numbers_at + k * _NUMBERS for k in (robot, last))
        lists[to : to + _NUMBERS] = lists[at : at + _NUMBERS]
        self._every[robot] = self._every[last]
        self._every[robot]["number_at"] = to


def _ending(ways: Sequence[Track]) -> dict[str, int]:
    """Return how many end in each state in which ways end, whichever way to the same edge they take.

    There is room for everybody in it, but lists for these only: else they lay far apart in memory.
    """
    once = [track for track in ways if not track.rounds]
    numbers = Counter(track.edges[-1][1] for track in once)
    return {track.legs[-1].state: numbers[track.edges[-1][1]] for track in once}
