"""Tables on which vehicles come and go one by one, and go on by another way; and ways are laid."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, Self

import numpy as np

from loopgate.abstraction.track import Track
from loopgate.drive.around import AROUND
from loopgate.drive.build import Code, LegRows, Place, moves_of, places_of, states_of, vehicle_rows
from loopgate.drive.codes import REASONS
from loopgate.drive.driver import Driver
from loopgate.drive.rows import table
from loopgate.drive.step import FULL
from loopgate.drive.tables import (
    DriveRow,
    EntryRow,
    ReasonRow,
    RoadRow,
    Tables,
    VehicleRow,
)
from loopgate.model import System
from loopgate.results.columns import Event

__all__ = ["HOLDERS", "LINE", "Ground", "nothing_around"]

HOLDERS: Final = ("holders", "held_by")
LINE: Final = ("line", "queue")
"""Where a list of a state begins and how long it is: those that hold it, and those in line."""

_PASSING: Final = ("passing", "under_way")

_AT_FIRST: Final = 256
"""Room for so many vehicles; twice as many whenever that is not enough."""

_GRANTS: Final = 256
"""The numbers of so many of its last grants are known of each vehicle: it is on fewer crossings at once."""

_OF_VEHICLES: Final = ("vehicles", "entries", "rows", "times", "acts", "calls", "fronts", "numbers")
"""Tables that grow with the vehicles."""

_OF_THE_WAY: Final = (
    "loop",
    "lap_m",
    "next_lap_m",
    "road_at",
    "roads",
    "road",
    "road_lap",
    "leg_at",
    "legs",
    "lit",
    "pivot",
)
"""Columns that say where on which way a vehicle is."""

_WORDS: Final = {
    **{event.value: event for event in Event},
    "not_granted": "not granted",
    "chain": "chain",
}


class Ground:
    """Tables for ways, on which vehicles come and go one by one: only their rows are made.

    The vehicles are the first rows of a table; where one leaves, the last takes its row. There is room for as
    many as there were at once, or up to twice as many. States, movements and edges keep their numbers.

    Parameters
    ----------
    code
        Gives words their numbers.
    step_s
        Length of a simulation step [s].
    signals
        Numbers of the signals that are obeyed, by movement.
    """

    def __init__(self, code: Code, *, step_s: float, signals: Mapping[str, int] | None = None) -> None:
        self.code = code
        self._signals = signals or {}
        self.states: dict[str, int] = {}
        """Numbers of the states by name."""
        self.roads: list[str] = []
        """Names of the edges by number, those of each loop one after the other."""
        self.places: Sequence[Place] = ()
        """The same as they are on the road, by number."""
        self._moves: dict[str, int] = {}
        self._roads_at: dict[tuple[tuple[float, str], ...], int] = {}
        self._legs_at: dict[int, int] = {}
        self._ways: Sequence[Any] = ()
        """The ways that are laid, so that nothing else has their identities."""
        self._count = 0
        run = table(DriveRow, length=1)
        run["step_s"] = step_s
        run["decided_s"] = -math.inf
        run["serve_after_s"] = math.inf
        run["looked_s"] = -math.inf
        for name, word in _WORDS.items():  # in this order, which numbers the words of the trace
            if name in DriveRow.__annotations__:
                run[name] = code(word)
        words = [code(reason.value) if reason else 0 for reason in REASONS]
        legs = LegRows((), self.states, self._moves, {})
        made: dict[str, Any] = {
            **dict.fromkeys(Tables._fields),
            "run": run,
            "reasons": table(ReasonRow, {"word": words}),
            "roads": table(RoadRow, length=0),
            "states": states_of((), (), code),
            "moves": moves_of(legs, ()),
            "lists": np.zeros(0, dtype=np.int64),
            **legs.tables,
            **_room_for(0),
        }
        self._tables = Tables(**made)  # row by row they are what it says

    @classmethod
    def of(
        cls,
        tracks: Sequence[Track],
        system: System | None,
        code: Code,
        *,
        step_s: float,
        signals: Mapping[str, int] | None = None,
    ) -> Self:
        """Return tables of vehicles that nobody joins: all stand where their tracks begin, nobody asks.

        Parameters
        ----------
        tracks
            One per vehicle.
        system
            The states, its robots the vehicles in the same order; None where vehicles drive under no gate.
        """
        made = cls(code, step_s=step_s, signals=signals)
        made.lay(tracks, places_of(system) if system else {})
        made.take(tracks)
        return made

    @property
    def tables(self) -> Tables:
        """The tables of those who are there."""
        return self._tables._replace(vehicles=self._tables.vehicles[: self._count])

    def lay(self, ways: Sequence[Track], places: Mapping[str, Place]) -> None:
        """Lay these ways; who is on one that was laid before goes on by that of the same name.

        Parameters
        ----------
        ways
            One track at least of each way, and one for each vehicle that ends on it.
        places
            The states on them.
        """
        before: Any = self._tables
        for edges in dict.fromkeys(track.edges for track in ways):
            if edges not in self._roads_at:
                self._roads_at[edges] = len(self.roads)
                self.roads += [name for _, name in edges]
        roads = table(RoadRow, length=len(self.roads))
        for edges, at in self._roads_at.items():
            roads["begin_m"][at : at + len(edges)] = [begin_m for begin_m, _ in edges]
        roads["name"] = [self.code(name) for name in self.roads]
        roads["stood_s"][: len(before.roads)] = before.roads["stood_s"]
        legs = LegRows(ways, self.states, self._moves, self._signals)
        self.places = [places[name] for name in self.states]
        states = states_of(self.states, self.places, self.code)
        moves = moves_of(legs, states["most"].tolist())
        lists = np.zeros(2 * states["most"].sum() + moves["most"].sum(), dtype=np.int64)
        end = 0
        for old, new, (begin, length) in (
            (before.states, states, HOLDERS),
            (before.states, states, LINE),
            (before.moves, moves, _PASSING),
        ):
            ends = end + np.cumsum(new["most"])
            new[begin] = ends - new["most"]
            end = int(ends[-1]) if len(ends) else end
            new[length][: len(old)] = old[length]
            for was, to, count in zip(old[begin], new[begin], old[length], strict=False):
                lists[to : to + count] = before.lists[was : was + count]
        for name in ("room", "slot", "slot_before", "served", "mover", "filled", "short", "outside", "shut"):
            states[name][: len(before.states)] = before.states[name]
        for name in ("way", "entered"):
            moves[name][: len(before.moves)] = before.moves[name]
        made: dict[str, Any] = {
            "roads": roads,
            "states": states,
            "moves": moves,
            "lists": lists,
            **legs.tables,
        }
        self._tables = before._replace(**made)
        self._ways, self._legs_at = legs.ways, legs.at

    def knows(self, track: Track) -> bool:
        """Return whether the tables contain this track, so that a vehicle can join on it."""
        return (id(track.legs) in self._legs_at or not track.legs) and track.edges in self._roads_at

    def take(self, tracks: Sequence[Track]) -> range:
        """Make rows for vehicles that stand where their tracks begin; return their numbers.

        Each holds its state, behind all others there. Tables that were given out before are old ones if there
        was no room in them.
        """
        robots = range(self._count, self._count + len(tracks))
        self._count = robots.stop
        if robots.stop > len(self._tables.vehicles):
            more: dict[str, Any] = _room_for(max(robots.stop, 2 * robots.start, _AT_FIRST))
            for name in _OF_VEHICLES:
                was = getattr(self._tables, name)
                more[name][: len(was)] = was
            self._tables = self._tables._replace(**more)
        every: Any = self._tables.vehicles
        every[robots.start : robots.stop] = self._rows(tracks)
        for robot, track in zip(robots, tracks, strict=True):
            for leg in track.legs[track.start_position :][:1]:
                state = self.states[leg.state]
                for which in (HOLDERS, LINE):
                    self.write(state, which, [*self.read(state, which), robot])
        return robots

    def _rows(self, tracks: Sequence[Track]) -> Any:  # noqa: ANN401  a table
        roads = [self._roads_at[track.edges] for track in tracks]
        return vehicle_rows(tracks, self.code, roads=roads, legs=[self.leg_at(track) for track in tracks])

    def leg_at(self, track: Track) -> int:
        """Return where the legs of a track begin in the table of legs."""
        return self._legs_at[id(track.legs)] if track.legs else 0

    def read(self, state: int, which: tuple[str, str]) -> list[int]:
        """Return a list of a state: `HOLDERS` or `LINE`."""
        row: Any = self._tables.states[state]
        robots: list[int] = self._tables.lists[row[which[0]] :][: row[which[1]]].tolist()
        return robots

    def write(self, state: int, which: tuple[str, str], robots: Sequence[int]) -> None:
        """Let a list of a state be this."""
        row: Any = self._tables.states[state]
        self._tables.lists[row[which[0]] : row[which[0]] + len(robots)] = robots
        row[which[1]] = len(robots)

    def turn_off(self, driver: Driver, track: Track, position: int) -> None:
        """Let a vehicle that holds one place and nothing else go on by another way from there on.

        The place is the leg `position` of that, which ends where the vehicle's own does.
        """
        row, before = driver.row, driver.granted
        by_m = track.legs[position].end_m - driver.end_m(before)
        track = replace(track, vehicle=driver.id, start_m=driver.front_m + by_m, start_position=position)
        fresh = self._rows([track])[0]
        for name in _OF_THE_WAY:
            row[name] = fresh[name]
        row["top"] = track.top_speed_mps * row["haste"]
        for name in ("entered", "granted", "tail", "crossed"):
            row[name] = position
        for name in ("offset", "front", "rear_m", "line_m", "held_m", "stop_m"):
            row[name] += by_m
        row["moved_m"] += by_m
        row["note_m"], row["red_since_s"] = -np.inf, np.nan  # another light is ahead
        numbers = self._tables.numbers[driver.robot]
        numbers[position % _GRANTS] = numbers[before % _GRANTS]
        driver.turns_off(track, by_m)

    def give_back(self, robot: int) -> None:
        """Let the last vehicle have a row; that of `robot` is needed no longer."""
        self._count -= 1
        every: Any = self._tables.vehicles
        every[robot] = every[self._count]
        self._tables.numbers[robot] = self._tables.numbers[self._count]


def nothing_around() -> dict[str, Any]:
    """Return the tables of ordinary traffic, by name, and those of lights: there are none.

    All of these, so that with ordinary traffic the same is compiled whether lights are obeyed or not.
    """
    rows = {name: table(row, length=0) for name, row in AROUND.items()}
    numbers = {name: np.zeros(0, dtype=np.int64) for name in ("way_at", "lane_lists", "letters")}
    return {**rows, **numbers, "routes": np.zeros((0, 2), dtype=np.int64)}


def _room_for(count: int) -> dict[str, Any]:
    """Return the tables of so many vehicles."""
    return {
        "vehicles": table(VehicleRow, length=count),
        "entries": table(EntryRow, length=count),
        "rows": np.zeros((2 * FULL * count, 5), dtype=np.int32),
        "times": np.zeros(2 * FULL * count),
        "acts": np.zeros((FULL * count, 3), dtype=np.int64),
        "calls": np.zeros((count, 2), dtype=np.int64),
        "fronts": np.zeros(count),
        "numbers": np.zeros((count, _GRANTS), dtype=np.int64),
    }
