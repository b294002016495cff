"""Records the position of every vehicle on its loop in each step, for the replay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from loopgate.results.columns import FRONT, FRONTS_PER_M, TIME, VEHICLE
from loopgate.results.recorder import Recorder, TableFile
from loopgate.simulation.drive import Drive
from loopgate.traffic.base import Traffic

__all__ = ["FrontRecorder"]

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
        self._fronts: list[NDArray[np.float64]] = []
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
        self._fronts.append(fronts)
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
