"""Writes states and vehicles out into the tables of the drive."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from loopgate.abstraction import itinerary
from loopgate.drive.codes import NOBODY, REASONS
from loopgate.drive.rows import table
from loopgate.drive.step import FULL
from loopgate.drive.tables import (
    DriveRow,
    EntryRow,
    FoeRow,
    LegRow,
    LightRow,
    MoveRow,
    PassRow,
    PhaseRow,
    ReasonRow,
    RoadRow,
    SignalRow,
    StateRow,
    Tables,
    VehicleRow,
)
from loopgate.drive.track import Track
from loopgate.model import System
from loopgate.results.columns import Event

__all__ = [
    "Code",
    "LegRows",
    "Lists",
    "RoadRows",
    "make_tables",
    "movements_of",
    "moves_of",
    "roads_of",
    "states_of",
    "tables_of",
    "vehicle_rows",
    "with_room",
]

_LAPS = 16
"""A vehicle's grants are numbered for so many laps: it is under way on fewer at once."""

_OFTEN = 64
"""So often a vehicle may hold its private state, lap after lap."""

_WORDS = {
    **{event.value: event for event in Event},
    "not_granted": "not granted",
    "chain": "chain",
}

Code = Callable[[str], int]


def movements_of(tracks: Iterable[Track]) -> list[str]:
    """Return the movements on some track by number: sorted."""
    ways = {id(track.legs): track.legs for track in tracks}
    return sorted({crossing.id for way in ways.values() for leg in way for crossing in leg.crossings})


def roads_of(tracks: Iterable[Track]) -> list[str]:
    """Return the edges on some track by number: those of each loop one after the other."""
    return [name for edges in dict.fromkeys(track.edges for track in tracks) for _, name in edges]


def make_tables(
    tracks: Sequence[Track],
    system: System | None,
    code: Code,
    *,
    step_s: float,
    signals: Mapping[str, int] | None = None,
) -> Tables:
    """Return the tables at the start: everybody stands in the first state, nobody asks.

    Parameters
    ----------
    tracks
        One per vehicle.
    system
        The states, its robots the vehicles in the same order; None where vehicles drive under no gate.
    code
        Gives words their numbers.
    step_s
        Length of a simulation step [s].
    signals
        Numbers of the signals that are obeyed, by movement.
    """
    lists = Lists()
    legs = LegRows(system.states if system else (), tracks, signals or {})
    roads = RoadRows(code)
    first = [legs.add(track.legs) for track in tracks]
    numbers = [_LAPS * len(track.legs) for track in tracks]
    vehicles = vehicle_rows(tracks, roads, code)
    vehicles["leg_at"] = first
    vehicles["numbers"] = numbers
    vehicles["number_at"] = lists.add(numbers)
    states = _states_of(system, lists, code)
    moves = moves_of(legs, states, lists)
    held = lists.made()
    if system is not None:
        _take_places(system, states, held)
    return with_room(
        max(1, len(tracks)),
        tables_of(legs, roads, states, moves, code, step_s),
        vehicles=vehicles,
        lists=held,
    )


def tables_of(
    legs: LegRows,
    roads: RoadRows,
    states: NDArray[np.void],
    moves: NDArray[np.void],
    code: Code,
    step_s: float,
) -> Tables:
    """Return the tables of no vehicle."""
    run = table(DriveRow, length=1)
    run["step_s"] = step_s
    run["decided_s"] = -math.inf
    run["serve_after_s"] = math.inf
    run["looked_s"] = -math.inf
    for name, word in _WORDS.items():
        if name in DriveRow.__annotations__:
            run[name] = code(word)
    reasons = [code(reason.value) if reason else 0 for reason in REASONS]
    return Tables(
        run=cast("Any", run),  # row by row they are what `Tables` says
        vehicles=cast("Any", table(VehicleRow, length=0)),
        roads=cast("Any", roads.table()),
        legs=cast("Any", _filled(LegRow, legs.legs)),
        passes=cast("Any", _filled(PassRow, legs.passes)),
        foes=cast("Any", _filled(FoeRow, legs.foes)),
        states=cast("Any", states),
        moves=cast("Any", moves),
        reasons=cast("Any", table(ReasonRow, {"word": reasons})),
        entries=cast("Any", table(EntryRow, length=0)),
        rows=np.zeros((0, 5), dtype=np.int32),
        times=np.zeros(0),
        acts=np.zeros((0, 3), dtype=np.int64),
        calls=np.zeros((0, 2), dtype=np.int64),
        fronts=np.zeros(0),
        lists=np.zeros(0, dtype=np.int64),
        signals=cast("Any", table(SignalRow, length=0)),
        lights=cast("Any", table(LightRow, length=0)),
        phases=cast("Any", table(PhaseRow, length=0)),
        letters=np.zeros(0, dtype=np.int64),
    )


def with_room(count: int, tables: Tables, *, vehicles: NDArray[np.void], lists: NDArray[np.int64]) -> Tables:
    """Return the tables with lists for so many vehicles."""
    return tables._replace(
        vehicles=cast("Any", vehicles),
        entries=cast("Any", table(EntryRow, length=count)),
        rows=np.zeros((2 * FULL * count, 5), dtype=np.int32),
        times=np.zeros(2 * FULL * count),
        acts=np.zeros((FULL * count, 3), dtype=np.int64),
        calls=np.zeros((count, 2), dtype=np.int64),
        fronts=np.zeros(count),
        lists=lists,
    )


def vehicle_rows(tracks: Sequence[Track], roads: RoadRows, code: Code) -> NDArray[np.void]:
    """Return a row for each vehicle, which stands where its track begins; its legs are not in it yet."""
    front = np.array([track.front_m for track in tracks], dtype=np.float64)
    lap_m = np.array([track.lap_m for track in tracks], dtype=np.float64)
    count = np.array([len(track.edges) for track in tracks], dtype=np.int64)
    passed = [
        bisect_right([begin for begin, _ in track.edges], m % track.lap_m)
        for track, m in zip(tracks, front.tolist(), strict=True)
    ]
    road = np.array(passed, dtype=np.int64)
    start = [track.start_position for track in tracks]
    columns = {
        "name": [code(track.vehicle) for track in tracks],
        "loop": [code(track.loop) for track in tracks],
        "lap_m": lap_m,
        "top": 1.0,
        "haste": 1.0,
        "accel": 1.0,
        "decel": 1.0,
        "front": front,
        "note_m": -math.inf,
        "rear_m": math.inf,
        "line_m": math.inf,
        "held_m": math.inf,
        "stop_m": math.inf,
        "next_lap_m": front + lap_m,
        "road_at": [roads.add(track.edges) for track in tracks],
        "roads": count,
        "road": road % count,
        "road_lap": np.floor(front / lap_m).astype(np.int64) + road // count,
        "pivot": [[e for _, e in t.edges].index(t.rerouted_on) if t.rounds else NOBODY for t in tracks],
        "heeds_renewal": [track.renews for track in tracks],
        "legs": [len(track.legs) for track in tracks],
        "entered": start,
        "granted": start,
        "tail": start,
        "crossed": start,
        "halted_s": math.nan,
        "red_since_s": math.nan,
        "lit": [sum(len(leg.crossings) for leg in t.legs[: t.start_position]) for t in tracks],
    }
    return table(VehicleRow, columns, length=len(tracks))


class Lists:
    """Lists one after the other."""

    def __init__(self) -> None:
        self.end = 0

    def add(self, lengths: Sequence[int]) -> NDArray[np.int64]:
        """Make room for lists; return where they begin."""
        ends = self.end + np.cumsum(np.array(lengths, dtype=np.int64))
        begins = ends - np.array(lengths, dtype=np.int64)
        self.end = int(ends[-1]) if len(ends) else self.end
        return begins

    def made(self) -> NDArray[np.int64]:
        """Return them, all zero."""
        return np.zeros(self.end, dtype=np.int64)


class RoadRows:
    """Edges, once for all vehicles of a loop."""

    def __init__(self, code: Code) -> None:
        self._code = code
        self._at: dict[tuple[tuple[float, str], ...], int] = {}
        self._rows: list[tuple[float | int, ...]] = []

    def add(self, edges: tuple[tuple[float, str], ...]) -> int:
        """Add the edges of a loop; return the number of the first."""
        if edges not in self._at:
            self._at[edges] = len(self._rows)
            self._rows += [(begin_m, self._code(name), 0.0) for begin_m, name in edges]
        return self._at[edges]

    def table(self) -> NDArray[np.void]:
        """Return the rows."""
        return _filled(RoadRow, self._rows)


class LegRows:
    """Legs, once for all vehicles of a loop, their crossings and the foes of these, one after the other."""

    def __init__(self, states: Sequence[str], tracks: Sequence[Track], signals: Mapping[str, int]) -> None:
        ways = {id(track.legs): track.legs for track in tracks}
        self.ways = tuple(ways.values())
        self.moves = {name: number for number, name in enumerate(movements_of(tracks))}
        """Movements by name."""
        self.states = {name: number for number, name in enumerate(states)}
        """States by name."""
        self._signals = signals
        self.legs: list[tuple[float | int, ...]] = []
        self.passes: list[tuple[float | int, ...]] = []
        self.foes: list[tuple[float | int, ...]] = []
        self._at: dict[int, int] = {}
        self._foes_of: dict[int, tuple[itinerary.Crossing, int, int]] = {}
        """By crossing, which loops may have in common: where its foes begin and end."""

    def add(self, legs: Sequence[itinerary.Leg]) -> int:
        """Add the legs of a loop; return the number of the first."""
        if id(legs) in self._at:
            return self._at[id(legs)]
        first = self._at[id(legs)] = len(self.legs)
        for leg in legs:
            begin = len(self.passes)
            for crossing in leg.crossings:
                self._cross(crossing, leg.end_m)
            room = leg.begin_m, leg.end_m, leg.slot_m
            row = (*room, self.states[leg.state], bool(leg.guides), begin, len(self.passes))
            self.legs.append(row)
        return first

    def _cross(self, crossing: itinerary.Crossing, from_m: float) -> None:
        if id(crossing) not in self._foes_of:
            first = len(self.foes)
            self._meet(crossing)
            self._foes_of[id(crossing)] = crossing, first, len(self.foes)
        _, first, end = self._foes_of[id(crossing)]
        light = self._signals.get(crossing.id, NOBODY), from_m + crossing.ahead_m
        self.passes.append((self.moves[crossing.id], crossing.speed_mps, crossing.wait_m, first, end, *light))

    def _meet(self, crossing: itinerary.Crossing) -> None:
        for foe in sorted(crossing.foes & self.moves.keys()):  # nobody drives on the others
            begin_m, end_m = crossing.overlaps.get(foe, (np.nan, np.nan))
            soonest_s, least_mps = crossing.soonest(begin_m)
            until_s, _ = crossing.soonest(end_m)
            mean_mps = end_m / until_s if until_s > 0.0 else least_mps
            self.foes.append((self.moves[foe], begin_m, end_m, soonest_s, least_mps, mean_mps))


def _states_of(system: System | None, lists: Lists, code: Code) -> NDArray[np.void]:
    """All fit into a private state: its vehicle, as often as it holds it.

    In any other there may be one more than it holds: a vehicle that joined in it (`loopgate.drive.books`).
    """
    if system is None:
        return table(StateRow, length=0)
    everybody = len(system.robots)
    fifo = set(system.fifo_states)
    room = [everybody if private else room for private, room in zip(system.private, system.room, strict=True)]
    most = [min(n, _OFTEN) if private else n + 1 for private, n in zip(system.private, room, strict=True)]
    return states_of(system.states, room, [state in fifo for state in range(len(room))], most, lists, code)


def states_of(
    names: Sequence[str],
    room: Sequence[int],
    fifo: Sequence[bool],
    most: Sequence[int],
    lists: Lists,
    code: Code,
) -> NDArray[np.void]:
    """Return the states, which nobody holds: names, room, whether in order, and room in their lists."""
    columns = {
        "room": room,
        "word": [code(name) for name in names],
        "fifo": fifo,
        "most": most,
        "holders": lists.add(most),
        "line": lists.add(most),
        "slot": NOBODY,
        "slot_before": NOBODY,
        "served": NOBODY,
        "mover": NOBODY,
    }
    return table(StateRow, columns, length=len(room))


def moves_of(legs: LegRows, states: NDArray[np.void], lists: Lists) -> NDArray[np.void]:
    """Each vehicle on a movement has a slot in the state behind its leg, which may cross it several times."""
    times: list[Counter[int]] = [Counter() for _ in legs.moves]
    lanes: dict[int, int] = {}
    for way in legs.ways:
        for leg, following in zip(way, [*way[1:], *way[:1]], strict=True):
            for first in leg.crossings[:1]:
                lanes.setdefault(legs.moves[first.id], legs.states[leg.state])
            for crossing, count in Counter(crossing.id for crossing in leg.crossings).items():
                led_to = times[legs.moves[crossing]]
                state = legs.states[following.state]
                led_to[state] = max(led_to[state], count)
    most = [sum(int(states["most"][state]) * count for state, count in led_to.items()) for led_to in times]
    beside = np.arange(len(most))
    out_of: dict[int, list[int]] = {}
    for move, state in lanes.items():
        out_of.setdefault(state, []).append(move)
    for moves in out_of.values():
        beside[moves] = [*moves[1:], *moves[:1]]
    columns = {"most": most, "passing": lists.add(most), "way": NOBODY, "beside": beside}
    return table(MoveRow, columns, length=len(most))


def _take_places(system: System, states: NDArray[np.void], lists: NDArray[np.int64]) -> None:
    lines = dict(zip(system.fifo_states, system.initial.queues, strict=True))
    holders: list[list[int]] = [[] for _ in system.states]
    for robot, (path, position) in enumerate(zip(system.paths, system.initial.positions, strict=True)):
        holders[path[position]].append(robot)
    for state, robots in enumerate(holders):
        for at, those in (("holders", robots), ("line", lines.get(state, robots))):
            begin = states[at][state]
            lists[begin : begin + len(robots)] = those
    states["held_by"] = states["queue"] = [len(robots) for robots in holders]


def _filled(row: type, rows: Sequence[tuple[float | int, ...]]) -> NDArray[np.void]:
    made = table(row, length=len(rows))
    made[:] = rows
    return made
