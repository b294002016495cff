"""Writes ways, states and vehicles out into the tables of the drive."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loopgate.abstraction.itinerary import Crossing, Leg
from loopgate.abstraction.track import Track
from loopgate.drive.codes import NOBODY
from loopgate.drive.rows import table
from loopgate.drive.tables import FoeRow, LegRow, MoveRow, PassRow, StateRow, VehicleRow
from loopgate.model import System

__all__ = ["Code", "LegRows", "Place", "moves_of", "places_of", "places_on", "states_of", "vehicle_rows"]

_OFTEN = 64
"""So often a vehicle may hold its private state, lap after lap."""

Code = Callable[[str], int]


class Place(NamedTuple):
    """How many vehicles a state holds, how many its lists, and whether vehicles leave it in order."""

    room: int
    most: int
    in_order: bool = True


def places_of(system: System) -> dict[str, Place]:
    """Return the states of vehicles that nobody joins: all fit into a private one, as often as it is held."""
    everybody, fifo = len(system.robots), set(system.fifo_states)
    return {
        name: Place(everybody, min(everybody, _OFTEN), in_order=False)
        if private
        else Place(room, room + 1, number in fifo)
        for number, (name, room, private) in enumerate(
            zip(system.states, system.room, system.private, strict=True)
        )
    }


def places_on(ways: Sequence[Track], room: Mapping[str, int]) -> dict[str, Place]:
    """Return the states on ways that vehicles may come on; all are left in order.

    There may be one more in a state than it holds: one that joined in it. Where ways end there is room for
    everybody, but lists for those only who end there, whichever way to the same edge they take: else lists
    lay far apart in memory.
    """
    once = [track for track in ways if track.legs and not track.rounds]
    numbers = Counter(track.edges[-1][1] for track in once)
    ending = {track.legs[-1].state: numbers[track.edges[-1][1]] for track in once}
    states = dict.fromkeys(leg.state for track in ways for leg in track.legs)
    return {s: Place(room[s], min(room[s] + 1, ending.get(s, room[s] + 1))) for s in states}


def vehicle_rows(
    tracks: Sequence[Track], code: Code, *, roads: Sequence[int], legs: Sequence[int]
) -> NDArray[np.void]:
    """Return a row for each vehicle, which stands where its track begins.

    Parameters
    ----------
    code
        Gives words their numbers.
    roads, legs
        Where the edges and the legs of each begin in their tables.
    """
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
        "road_at": roads,
        "roads": count,
        "road": road % count,
        "road_lap": np.floor(front / lap_m).astype(np.int64) + road // count,
        "pivot": [[e for _, e in t.edges].index(t.rerouted_on) if t.rounds else NOBODY for t in tracks],
        "foreseen": True,
        "heeds_renewal": [track.renews for track in tracks],
        "leg_at": legs,
        "legs": [len(track.legs) for track in tracks],
        "entered": start,
        "granted": start,
        "tail": start,
        "crossed": start,
        "halted_s": math.nan,
        "red_since_s": math.nan,
        "yields_s": math.nan,
        "kept_mps": math.nan,
        "clear": NOBODY,
        "stands_s": math.nan,
        "freed": NOBODY,
        "lit": [sum(len(leg.crossings) for leg in t.legs[: t.start_position]) for t in tracks],
    }
    return table(VehicleRow, columns, length=len(tracks))


class LegRows:
    """The legs of some ways, once for all vehicles of a loop, their crossings and the foes of these.

    Parameters
    ----------
    ways
        One track at least of each way.
    states, moves
        Numbers by name; who is new gets the next.
    signals
        Numbers of the signals that are obeyed, by movement.
    """

    def __init__(
        self,
        ways: Sequence[Track],
        states: dict[str, int],
        moves: dict[str, int],
        signals: Mapping[str, int],
    ) -> None:
        self.ways = tuple({id(track.legs): track.legs for track in ways}.values())
        self.states, self.moves, self._signals = states, moves, signals
        every = [leg for way in self.ways for leg in way]
        for leg in every:
            states.setdefault(leg.state, len(states))
            for crossing in leg.crossings:
                moves.setdefault(crossing.id, len(moves))
        self.at: dict[int, int] = {}
        """Where the legs of a way begin, by the identity of the way."""
        self._legs: list[tuple[float | int, ...]] = []
        self._passes: list[tuple[float | int, ...]] = []
        self._foes: list[tuple[float | int, ...]] = []
        self._foes_of: dict[int, tuple[int, int]] = {}
        """By crossing, which loops may have in common: where its foes begin and end."""
        for way in self.ways:
            self.at[id(way)] = len(self._legs)
            for leg in way:
                self._add(leg)

    def _add(self, leg: Leg) -> None:
        begin = len(self._passes)
        for crossing in leg.crossings:
            if id(crossing) not in self._foes_of:
                first = len(self._foes)
                self._meet(crossing)
                self._foes_of[id(crossing)] = first, len(self._foes)
            row = self.moves[crossing.id], crossing.speed_mps, crossing.wait_m, *self._foes_of[id(crossing)]
            signal = self._signals.get(crossing.id, NOBODY)
            self._passes.append((*row, signal, leg.end_m + crossing.ahead_m))
        room = leg.begin_m, leg.end_m, leg.slot_m
        self._legs.append((*room, self.states[leg.state], bool(leg.guides), begin, len(self._passes)))

    def _meet(self, crossing: Crossing) -> None:
        for foe in sorted(crossing.foes & self.moves.keys()):  # nobody drives on the others
            begin_m, end_m = crossing.overlaps.get(foe, (np.nan, np.nan))
            soonest_s, least_mps = crossing.soonest(begin_m)
            until_s, _ = crossing.soonest(end_m)
            mean_mps = end_m / until_s if until_s > 0.0 else least_mps
            self._foes.append((self.moves[foe], begin_m, end_m, soonest_s, least_mps, mean_mps))

    @property
    def tables(self) -> dict[str, NDArray[np.void]]:
        """Their tables, by name."""
        return {
            "legs": _filled(LegRow, self._legs),
            "passes": _filled(PassRow, self._passes),
            "foes": _filled(FoeRow, self._foes),
        }


def states_of(names: Iterable[str], places: Sequence[Place], code: Code) -> NDArray[np.void]:
    """Return the states, which nobody holds."""
    columns = {
        "room": [place.room for place in places],
        "word": [code(name) for name in names],
        "fifo": [place.in_order for place in places],
        "most": [place.most for place in places],
        "slot": NOBODY,
        "slot_before": NOBODY,
        "served": NOBODY,
        "mover": NOBODY,
    }
    return table(StateRow, columns, length=len(places))


def moves_of(legs: LegRows, most_in: Sequence[int]) -> NDArray[np.void]:
    """Return the movements, which nobody is on; `most_in` says how many the lists of each state hold.

    Each vehicle on a movement has a slot in the state behind its leg, which may cross it several times.
    """
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
    most = [sum(most_in[state] * count for state, count in led_to.items()) for led_to in times]
    beside = np.arange(len(most))
    out_of: dict[int, list[int]] = {}
    for move, state in lanes.items():
        out_of.setdefault(state, []).append(move)
    for moves in out_of.values():
        beside[moves] = [*moves[1:], *moves[:1]]
    return table(MoveRow, {"most": most, "way": NOBODY, "beside": beside}, length=len(most))


def _filled(row: type, rows: Sequence[tuple[float | int, ...]]) -> NDArray[np.void]:
    made = table(row, length=len(rows))
    made[:] = rows
    return made
