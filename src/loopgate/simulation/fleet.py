"""All vehicles under way, in arrays: read once per step, with what each of them has reached."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.sensing import Vehicles, Ways, sense
from loopgate.simulation.track import Track
from loopgate.traffic.base import Dynamics, Traffic

__all__ = ["NOWHERE", "Fleet"]

NOWHERE = math.inf

_ROWS_PER_VEHICLE = 16


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
    """

    def __init__(
        self, tracks: Sequence[Track], starts_m: Sequence[float], traffic: Traffic, recorder: Recorder
    ) -> None:
        self._traffic = traffic
        self._recorder = recorder
        self._ids = [track.vehicle for track in tracks]
        self._step_s = traffic.step_s
        code = recorder.code
        self._events = (code(Event.EDGE.value), code(Event.LAP.value), code(Event.ENTER.value))
        self._ways = _ways(tracks, code)
        self.vehicles = _vehicles(tracks, np.array(starts_m, dtype=np.float64), self._ways)
        """The arrays; offset, rear_m, line_m, trespassing, asking and granted are for the caller to set."""
        self.fronts: list[float] = list(starts_m)
        """Unwrapped arc length of each front after the last step [m]."""
        self.speeds = [0.0] * len(tracks)
        """Speeds in the last step [m/s]."""
        self._odometer = np.zeros(len(tracks))
        rows = _ROWS_PER_VEHICLE * len(tracks)
        self._rows = np.zeros((rows, 3), dtype=np.int32)
        self._calls = np.zeros((4 * len(tracks), 2), dtype=np.int32)
        self._sense(np.zeros(0))  # so that compiling, or loading what was compiled, is no part of the run

    def take_over(self, dynamics: Sequence[Dynamics], top_mps: Sequence[float]) -> None:
        """Learn what the vehicles can do, and what their odometers read while they stand at their starts."""
        self._ways.accel[:] = [d.accel_mps2 for d in dynamics]
        self._ways.decel[:] = [d.decel_mps2 for d in dynamics]
        self._ways.top[:] = top_mps
        self._read_odometers()
        self.vehicles.offset[:] = self.vehicles.front - self._odometer

    def advance(self, now_s: float) -> Iterator[tuple[int, int]]:
        """Read all vehicles after a step, record what they passed, and say whom to look at.

        Returns
        -------
        iterator of (vehicle, call)
            Vehicles that the caller has to look at, and why: a constant of `loopgate.simulation.sensing`.
        """
        self._read_odometers()
        noted, called = self._sense(self._odometer)
        self.fronts = self.vehicles.front.tolist()
        self.speeds = self.vehicles.speed.tolist()
        if noted:
            self._recorder.passed(now_s, self._rows[:noted])
        return iter(self._calls[:called].tolist())

    def _read_odometers(self) -> None:
        read = self._traffic.odometers(self._ids)
        self._odometer = np.fromiter(read, dtype=np.float64, count=len(self._ids))

    def _sense(self, odometer: NDArray[np.float64]) -> tuple[int, int]:
        return sense(
            odometer,
            self.vehicles,
            self._ways,
            self._step_s,
            self._events,
            self._rows,
            self._calls,
        )


def _ways(tracks: Sequence[Track], code: Callable[[str], int]) -> Ways:
    """Write out edges and legs, once for all vehicles of a loop."""
    roads, legs = _Table(), _Table()
    for track in tracks:
        roads.add(track.edges, [begin for begin, _ in track.edges], [code(e) for _, e in track.edges])
        legs.add((track.states, track.begins_m), track.begins_m, [code(s) for s in track.states])
    count = len(tracks)
    pivots = [[e for _, e in track.edges].index(track.rerouted_on) for track in tracks]
    return Ways(
        top=np.ones(count),
        accel=np.ones(count),
        decel=np.ones(count),
        lap_m=np.array([track.lap_m for track in tracks], dtype=np.float64),
        loop_code=np.array([code(track.loop) for track in tracks], dtype=np.int32),
        vehicle_code=np.array([code(track.vehicle) for track in tracks], dtype=np.int32),
        road_begin=np.array(roads.begin, dtype=np.int64),
        road_count=np.array(roads.count, dtype=np.int64),
        pivot=np.array(pivots, dtype=np.int64),
        leg_begin=np.array(legs.begin, dtype=np.int64),
        leg_count=np.array(legs.count, dtype=np.int64),
        road_m=np.array(roads.arc_m, dtype=np.float64),
        road_code=np.array(roads.code, dtype=np.int32),
        leg_m=np.array(legs.arc_m, dtype=np.float64),
        leg_code=np.array(legs.code, dtype=np.int32),
    )


def _vehicles(tracks: Sequence[Track], front: NDArray[np.float64], ways: Ways) -> Vehicles:
    count = len(tracks)
    passed = [
        bisect_right([begin for begin, _ in track.edges], m % track.lap_m)
        for track, m in zip(tracks, front.tolist(), strict=True)
    ]
    road = np.array(passed, dtype=np.int64)
    road_lap = np.floor(front / ways.lap_m).astype(np.int64) + road // ways.road_count
    start = np.array([track.start_position for track in tracks], dtype=np.int64)
    return Vehicles(
        offset=np.zeros(count),
        front=front,
        speed=np.zeros(count),
        note_m=np.full(count, -NOWHERE),
        rear_m=np.full(count, NOWHERE),
        line_m=np.full(count, NOWHERE),
        trespassing=np.zeros(count, dtype=np.bool_),
        asking=np.zeros(count, dtype=np.bool_),
        next_lap_m=front + ways.lap_m,
        laps=np.zeros(count, dtype=np.int64),
        road=road % ways.road_count,
        road_lap=road_lap,
        entered=start,
        granted=start.copy(),
    )


class _Table:
    """Rows of arc lengths and codes, shared by the vehicles for which they are the same."""

    def __init__(self) -> None:
        self._at: dict[object, int] = {}
        self.begin: list[int] = []
        self.count: list[int] = []
        self.arc_m: list[float] = []
        self.code: list[int] = []

    def add(self, key: object, arc_m: Sequence[float], codes: Sequence[int]) -> None:
        """Add a vehicle."""
        if key not in self._at:
            self._at[key] = len(self.arc_m)
            self.arc_m += arc_m
            self.code += codes
        self.begin.append(self._at[key])
        self.count.append(len(arc_m))
