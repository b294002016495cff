"""All vehicles under way, in arrays: read once per step, with what each of them has reached."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.rows import table
from loopgate.simulation.sensing import MOST_CALLS, MOST_ROWS, Floats, Mark, Vehicle, Vehicles, sense
from loopgate.simulation.track import Track
from loopgate.traffic.base import Dynamics, Traffic

__all__ = ["NOWHERE", "Fleet"]

NOWHERE = math.inf


class Fleet:
    """Where all vehicles are, step by step, and what they reach. Vehicles go by number.

    Arc length is unwrapped: it grows by `Track.lap_m` per lap. What only has to be noted (edges, laps, states
    entered) goes straight to the recorder; of the rest the caller is told.

    Parameters
    ----------
    tracks
        One per vehicle.
    starts_m
        Unwrapped arc length of each front at the beginning [m].
    traffic
        The running simulation.
    recorder
        Takes the events.
    row
        What the table of vehicles is to have room for.
    """

    def __init__(
        self,
        tracks: Sequence[Track],
        starts_m: Sequence[float],
        traffic: Traffic,
        recorder: Recorder,
        row: type[Vehicle] = Vehicle,
    ) -> None:
        self._traffic = traffic
        self._recorder = recorder
        self._ids = [track.vehicle for track in tracks]
        self._step_s = traffic.step_s
        code = recorder.code
        self._events = (code(Event.EDGE.value), code(Event.LAP.value), code(Event.ENTER.value))
        self.tables = _fleet(row, tracks, np.array(starts_m, dtype=np.float64), code)
        """The vehicles, their edges and their legs, for compiled code."""
        self.columns = cast("NDArray[np.void]", self.tables.vehicles)
        """The vehicles by column."""
        self.vehicles = Vehicles(*(self.columns[name] for name in Vehicles._fields))
        """Columns of them; from offset to granted, but for front and speed, they are for others to set."""
        self.fronts: list[float] | Floats = list(starts_m)
        """Unwrapped arc length of each front after the last step [m]."""
        self.speeds: list[float] | Floats = [0.0] * len(tracks)
        """Speeds in the last step [m/s]."""
        rows = MOST_ROWS * len(tracks)
        self._rows = np.zeros((rows, 3), dtype=np.int32)
        self._calls = np.zeros((MOST_CALLS * len(tracks), 2), dtype=np.int32)
        self._sense(np.zeros(0))  # so that compiling, or loading what was compiled, is no part of the run

    def take_over(self, dynamics: Sequence[Dynamics], top_mps: Sequence[float]) -> None:
        """Learn what the vehicles can do, and what their odometers read while they stand at their starts."""
        self.columns["accel"] = [d.accel_mps2 for d in dynamics]
        self.columns["decel"] = [d.decel_mps2 for d in dynamics]
        self.columns["top"] = top_mps
        self.vehicles.offset[:] = self.vehicles.front - self.read()

    def advance(self, now_s: float) -> Iterator[tuple[int, int]]:
        """Read all vehicles after a step, record what they passed, and say whom to look at.

        Returns
        -------
        iterator of (vehicle, call)
            Vehicles that the caller has to look at, and why: a constant of `loopgate.simulation.sensing`.
        """
        noted, called = self._sense(self.read())
        self.fronts = self.vehicles.front.tolist()
        self.speeds = self.vehicles.speed.tolist()
        if noted:
            self._recorder.passed(now_s, self._rows[:noted])
        return iter(self._calls[:called].tolist())

    def correct(self, vehicle: int, front_m: float) -> None:
        """Take note that the front of a vehicle is elsewhere on its loop than its odometer said [m]."""
        columns = self.vehicles
        columns.offset[vehicle] += front_m - columns.front[vehicle]
        columns.front[vehicle] = front_m
        self.fronts[vehicle] = front_m

    def read(self) -> Floats:
        """Return what the odometers read, by vehicle [m]."""
        return np.fromiter(self._traffic.odometers(self._ids), dtype=np.float64, count=len(self._ids))

    def _sense(self, odometer: NDArray[np.float64]) -> tuple[int, int]:
        return sense(odometer, *self.tables, self._step_s, self._events, self._rows, self._calls)


def _fleet(row: type[Vehicle], tracks: Sequence[Track], front: Floats, code: Callable[[str], int]) -> _Tables:
    """Write out edges and legs, once for all vehicles of a loop, and where each vehicle is."""
    roads, legs = _Marks(), _Marks()
    for track in tracks:
        roads.add(track.edges, [begin for begin, _ in track.edges], [code(e) for _, e in track.edges])
        legs.add((track.states, track.begins_m), track.begins_m, [code(s) for s in track.states])
    lap_m = np.array([track.lap_m for track in tracks], dtype=np.float64)
    count = np.array(roads.count, dtype=np.int64)
    passed = [
        bisect_right([begin for begin, _ in track.edges], m % track.lap_m)
        for track, m in zip(tracks, front.tolist(), strict=True)
    ]
    road = np.array(passed, dtype=np.int64)
    start = [track.start_position for track in tracks]
    columns = {
        "front": front,
        "note_m": -NOWHERE,
        "rear_m": NOWHERE,
        "line_m": NOWHERE,
        "held_m": NOWHERE,
        "next_lap_m": front + lap_m,
        "road": road % count,
        "road_lap": np.floor(front / lap_m).astype(np.int64) + road // count,
        "entered": start,
        "granted": start,
        "top": 1.0,
        "accel": 1.0,
        "decel": 1.0,
        "lap_m": lap_m,
        "loop": [code(track.loop) for track in tracks],
        "name": [code(track.vehicle) for track in tracks],
        "road_at": roads.begin,
        "roads": count,
        "pivot": [[e for _, e in track.edges].index(track.rerouted_on) for track in tracks],
        "mark_at": legs.begin,
        "legs": legs.count,
    }
    # Row by row they are what `_Tables` says, in compiled code.
    return _Tables(*cast("Any", (table(row, columns, length=len(tracks)), roads.table(), legs.table())))


class _Tables(NamedTuple):
    vehicles: Sequence[Vehicle]
    roads: Sequence[Mark]
    marks: Sequence[Mark]


class _Marks:
    """Rows of arc lengths and codes, shared by the vehicles for which they are the same."""

    def __init__(self) -> None:
        self._at: dict[object, int] = {}
        self.begin: list[int] = []
        self.count: list[int] = []
        self._begin_m: list[float] = []
        self._name: list[int] = []

    def add(self, key: object, arc_m: Sequence[float], codes: Sequence[int]) -> None:
        """Add a vehicle."""
        if key not in self._at:
            self._at[key] = len(self._begin_m)
            self._begin_m += arc_m
            self._name += codes
        self.begin.append(self._at[key])
        self.count.append(len(arc_m))

    def table(self) -> NDArray[np.void]:
        """Return the rows."""
        return table(Mark, {"begin_m": self._begin_m, "name": self._name})
