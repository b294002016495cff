"""Writes an abstraction and its vehicles out into the tables of the compiled drive."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from loopgate.abstraction.itinerary import Abstraction, Crossing, Itinerary
from loopgate.model import System
from loopgate.simulation.compiled import count as c
from loopgate.simulation.compiled.tables import Books, Foe, Leg, Move, Pass, State
from loopgate.simulation.fleet import Fleet
from loopgate.simulation.rows import table

__all__ = ["make_books"]

_LAPS = 16
"""A vehicle's grants are numbered for so many laps: it is under way on fewer at once."""

_OFTEN = 64
"""So often a vehicle may hold its private state, lap after lap."""


def make_books(abstraction: Abstraction, fleet: Fleet, code: Callable[[str], int]) -> Books:
    """Return the books at the start: everybody stands in the first state, nobody asks.

    Parameters
    ----------
    abstraction
        States and itineraries.
    fleet
        The vehicles, one per robot, with room for what makes them `Rider`.
    code
        Gives names their numbers.
    """
    system = abstraction.system
    vehicles = fleet.columns
    ways = {id(way): way for way in abstraction.itineraries}
    legs = _Legs(system, ways.values())
    first = {key: legs.add(way) for key, way in ways.items()}
    pool = _Pool()
    for name in ("tail", "crossed", "admitted"):
        vehicles[name] = system.initial.positions
    for name in ("asked_s", "halted_s"):
        vehicles[name] = np.nan
    vehicles["leg_at"] = [first[id(way)] for way in abstraction.itineraries]
    numbers = [_LAPS * len(way.legs) for way in abstraction.itineraries]
    vehicles["numbers"] = numbers
    vehicles["number_at"] = pool.add(numbers)
    states = _states(system, pool, code)
    moves = _moves(legs, states, pool, ways.values())
    lists = pool.numbers()
    _take_places(system, states, lists)
    # Row by row they are what `Books` says; mypy knows tables of rows by their element type only.
    return Books(*cast("Any", (*fleet.tables, *legs.tables(), states, moves, lists)))


class _Pool:
    """Lists one after the other, behind the counters."""

    def __init__(self) -> None:
        self._end = c.COUNTERS

    def add(self, lengths: Sequence[int]) -> NDArray[np.int64]:
        """Make room for lists; return where they begin."""
        ends = self._end + np.cumsum(np.array(lengths, dtype=np.int64))
        begins = ends - np.array(lengths, dtype=np.int64)
        self._end = int(ends[-1]) if len(ends) else self._end
        return begins

    def numbers(self) -> NDArray[np.int64]:
        """Return the pool, all zero."""
        return np.zeros(self._end, dtype=np.int64)


def _states(system: System, pool: _Pool, code: Callable[[str], int]) -> NDArray[np.void]:
    """As `Occupancy` has it, all fit into a private state: its vehicle, as often as it holds it."""
    everybody = len(system.robots)
    room = [everybody if private else room for private, room in zip(system.private, system.room, strict=True)]
    most = [
        min(holds, _OFTEN) if private else holds for private, holds in zip(system.private, room, strict=True)
    ]
    return table(
        State,
        {
            "room": room,
            "word": [code(name) for name in system.states],
            "most": most,
            "holders": pool.add(most),
            "line": pool.add(most),
            "slot": -1,
            "slot_before": -1,
        },
        length=len(system.states),
    )


def _moves(legs: _Legs, states: NDArray[np.void], pool: _Pool, ways: Iterable[Itinerary]) -> NDArray[np.void]:
    """Each vehicle on a movement has a slot in the state behind its leg, which may cross it several times."""
    times: list[Counter[int]] = [Counter() for _ in legs.moves]
    for way in ways:
        for leg, following in zip(way.legs, [*way.legs[1:], way.legs[0]], strict=True):
            for crossing, count in Counter(crossing.id for crossing in leg.crossings).items():
                led_to = times[legs.moves[crossing]]
                state = legs.states[following.state]
                led_to[state] = max(led_to[state], count)
    most = [sum(int(states["most"][state]) * count for state, count in led_to.items()) for led_to in times]
    return table(Move, {"most": most, "passing": pool.add(most), "way": -1}, length=len(most))


def _take_places(system: System, states: NDArray[np.void], pool: NDArray[np.int64]) -> None:
    lines = dict(zip(system.fifo_states, system.initial.queues, strict=True))
    holders: list[list[int]] = [[] for _ in system.states]
    for robot, (path, position) in enumerate(zip(system.paths, system.initial.positions, strict=True)):
        holders[path[position]].append(robot)
    for state, robots in enumerate(holders):
        for at, those in (("holders", robots), ("line", lines.get(state, robots))):
            begin = states[at][state]
            pool[begin : begin + len(robots)] = those
    states["held_by"] = states["queue"] = [len(robots) for robots in holders]


class _Legs:
    """Legs, their crossings and the foes of these, one after the other."""

    def __init__(self, system: System, ways: Iterable[Itinerary]) -> None:
        names = {crossing.id for way in ways for leg in way.legs for crossing in leg.crossings}
        self.moves = {name: number for number, name in enumerate(sorted(names))}
        """Movements by name."""
        self.states = {name: number for number, name in enumerate(system.states)}
        """States by name."""
        self._legs: list[tuple[float | int, ...]] = []
        self._passes: list[tuple[float | int, ...]] = []
        self._foes: list[tuple[float | int, ...]] = []

    def add(self, way: Itinerary) -> int:
        """Add the legs of a loop; return the number of the first."""
        first = len(self._legs)
        for leg in way.legs:
            begin = len(self._passes)
            for crossing in leg.crossings:
                self._cross(crossing)
            state = self.states[leg.state]
            self._legs.append((leg.begin_m, leg.end_m, state, bool(leg.pins), begin, len(self._passes)))
        return first

    def tables(self) -> tuple[NDArray[np.void], NDArray[np.void], NDArray[np.void]]:
        """Return legs, passes and foes."""
        return _filled(Leg, self._legs), _filled(Pass, self._passes), _filled(Foe, self._foes)

    def _cross(self, crossing: Crossing) -> None:
        begin = len(self._foes)
        for foe in sorted(crossing.foes & self.moves.keys()):  # nobody drives on the others
            self._foes.append((self.moves[foe], *crossing.overlaps.get(foe, (np.nan, np.nan))))
        self._passes.append((self.moves[crossing.id], crossing.speed_mps, begin, len(self._foes)))


def _filled(row: type, rows: Sequence[tuple[float | int, ...]]) -> NDArray[np.void]:
    made = table(row, length=len(rows))
    made[:] = rows
    return made
