"""Tables step by step: how many stand, distance and laps; fronts; and the table of loops."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from loopgate.results.columns import FLOW_COLUMNS, FRONT, FRONTS_PER_M, LOOP_COLUMNS, TIME, VEHICLE
from loopgate.results.recorder import Recorder, TableFile
from loopgate.simulation.drive import Drive
from loopgate.traffic.base import Traffic

_BATCH = 250_000
_SCHEMA = pa.schema(
    [(TIME, pa.float64()), (VEHICLE, pa.dictionary(pa.int32(), pa.string())), (FRONT, pa.int32())]
)


class FrontRecorder:
    """Writes the positions of all vehicles to ``fronts.parquet`` during the run, in bounded memory.

    The recorder asks nothing of SUMO, so it takes about 1 % of a run's time.

    Parameters
    ----------
    file
        The file to write.
    traffic, drive, recorder
        Simulation, drive and event recorder of the run.

    Raises
    ------
    ResultsError
        If the disk is full, here or in `look` and `close`; rows written before can be read.
    """

    def __init__(self, file: Path, traffic: Traffic, drive: Drive, recorder: Recorder) -> None:
        self._file = TableFile(file, _SCHEMA)
        self._traffic = traffic
        self._drive = drive
        self._recorder = recorder
        self._rows = 0
        self._times: list[float] = []
        self._fronts: list[array[float]] = []
        self._vehicles: list[NDArray[np.int64]] = []
        """The numbers of the vehicles' names, for each step in `_fronts`."""
        self._names = np.zeros(0, dtype=np.int64)
        self._changes = -1

    def look(self) -> None:
        """Record the positions after a step."""
        drive = self._drive
        if self._changes != drive.changes:  # vehicles may have come since the step
            self._changes, names = drive.changes, drive.names()
            self._names = np.fromiter(map(self._recorder.code, names), np.int64, len(names))
        fronts = drive.fronts()
        self._times.append(self._traffic.now_s)
        self._vehicles.append(self._names)
        self._fronts.append(array("d", fronts))
        self._rows += len(self._names)
        if self._rows >= _BATCH:
            self._flush()

    def close(self) -> None:
        """Write the remaining rows and close the file; a second call does nothing."""
        try:
            self._flush()
        finally:
            self._file.close()

    def _flush(self) -> None:
        if not self._times:
            return
        times = np.repeat(self._times, [len(some) for some in self._vehicles])
        different = {id(some): some for some in self._vehicles}  # mostly there is one
        words = [*dict.fromkeys(np.concatenate([*different.values()]).tolist())]
        kind = np.min_scalar_type(len(words))  # numbers of 16 bits are sorted much sooner
        rank = np.zeros(max(words, default=0) + 1, dtype=kind)
        rank[words] = np.arange(len(words))
        vehicles = rank[np.concatenate(self._vehicles)]
        order = np.argsort(vehicles, kind="stable")
        fronts = np.rint(np.concatenate(self._fronts) * FRONTS_PER_M).astype(np.int32)
        every = self._recorder.words
        names = pa.array([every[word] for word in words], type=pa.string())
        columns = [
            pa.array(times[order]),
            pa.DictionaryArray.from_arrays(pa.array(vehicles[order].astype(np.int32)), names),
            pa.array(fronts[order]),
        ]
        self._times.clear()
        self._vehicles.clear()
        self._fronts.clear()
        self._rows = 0
        self._file.write(pa.Table.from_arrays(columns, schema=_SCHEMA))


Row = tuple[float, int, float, float, int]


def flow_table(rows: list[Row]) -> pd.DataFrame:
    """Return rows as a table with the columns `FLOW_COLUMNS`."""
    return pd.DataFrame(rows, columns=list(FLOW_COLUMNS))


def with_last_parts(rows: Iterable[Row], parts: Iterable[tuple[float, float]]) -> list[Row]:
    """Return rows with what arriving vehicles drove in their last steps, for which SUMO has no odometer.

    `parts`: when each vehicle arrived [s], and the distance [m].
    """
    told = [list(row) for row in rows]
    ends_s = [row[0] for row in told]
    for at_s, metres in parts:
        if (number := bisect_left(ends_s, at_s)) < len(told):
            told[number][3] += metres
    return [(time_s, int(there), still, metres, int(laps)) for time_s, there, still, metres, laps in told]


def loop_table(ways: Mapping[str, Sequence[tuple[float, str]]]) -> pd.DataFrame:
    """Return a table with the columns `LOOP_COLUMNS`: the edges of each loop, and where they begin [m]."""
    rows = [(loop, edge, begin_m) for loop, edges in ways.items() for begin_m, edge in edges]
    return pd.DataFrame(rows, columns=list(LOOP_COLUMNS))


class FlowMeter:
    """Records distance, laps and standing of all vehicles together at intervals.

    Parameters
    ----------
    traffic, drive
        The simulation and the drive of a run that has not begun.
    """

    def __init__(self, traffic: Traffic, drive: Drive) -> None:
        self._traffic = traffic
        self._drive = drive
        self.rows: list[Row] = []
        """The rows for `flow_table`."""

    def look(self) -> None:
        """Add a row about the time since the last row; call every `FLOW_EVERY_S`, and at the end."""
        if not self.rows or self.rows[-1][0] < self._traffic.now_s:
            self.rows.append((self._traffic.now_s, *self._drive.take_flow()))
