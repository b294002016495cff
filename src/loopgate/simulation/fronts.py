"""Where every vehicle is on its loop, step by step: what the drive reads anyway, kept for the replay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from loopgate.drive.engine import Engine
from loopgate.results.columns import FRONT, FRONTS_PER_M, TIME, VEHICLE
from loopgate.results.table_writing import TableFile
from loopgate.traffic.base import Traffic

__all__ = ["FrontRecorder"]

_BATCH = 250_000
_SCHEMA = pa.schema(
    [(TIME, pa.float64()), (VEHICLE, pa.dictionary(pa.int32(), pa.string())), (FRONT, pa.int32())]
)


class FrontRecorder:
    """Writes ``fronts.parquet``, in memory that does not grow with the run.

    Nothing is asked of the simulator, so it costs about a hundredth of a run.

    Parameters
    ----------
    file
        The file to write.
    traffic, engine
        The run's.

    Raises
    ------
    ResultsError
        If the disk is full, as do `look` and `close`; what was written before can be read.
    """

    def __init__(self, file: Path, traffic: Traffic, engine: Engine) -> None:
        self._file = TableFile(file, _SCHEMA)
        self._traffic = traffic
        self._engine = engine
        self._changes = -1
        self._numbers: dict[str, int] = {}
        """Numbers of the vehicles of this batch."""
        self._here = np.zeros(0, dtype=np.int32)
        self._moved_m = np.zeros(0)
        self._rows = 0
        self._times: list[float] = []
        self._vehicles: list[NDArray[np.int32]] = []
        self._fronts: list[NDArray[np.float64]] = []

    def look(self) -> None:
        """Take note of the step that was made."""
        if self._changes != self._engine.changes:  # vehicles have joined or left
            self._changes = self._engine.changes
            numbers = self._numbers
            drivers = self._engine.drivers
            here = [numbers.setdefault(driver.id, len(numbers)) for driver in drivers]
            self._here = np.array(here, dtype=np.int32)
            self._moved_m = np.array([driver.moved_m for driver in drivers])
        self._times.append(self._traffic.now_s)
        self._vehicles.append(self._here)
        self._fronts.append(self._engine.vehicles["front"] - self._moved_m)
        self._rows += len(self._here)
        if self._rows >= _BATCH:
            self._flush()

    def close(self) -> None:
        """Write what is left and finish the file; may be called twice."""
        try:
            self._flush()
        finally:
            self._file.close()

    def _flush(self) -> None:
        if not self._times:
            return
        times = np.repeat(self._times, [len(some) for some in self._vehicles])
        vehicles = np.concatenate(self._vehicles)
        order = np.argsort(vehicles, kind="stable")
        fronts = np.rint(np.concatenate(self._fronts) * FRONTS_PER_M).astype(np.int32)
        names = pa.array(list(self._numbers), type=pa.string())
        columns = [
            pa.array(times[order]),
            pa.DictionaryArray.from_arrays(pa.array(vehicles[order]), names),
            pa.array(fronts[order]),
        ]
        self._times.clear()
        self._vehicles.clear()
        self._fronts.clear()
        self._numbers.clear()
        self._changes, self._rows = -1, 0
        self._file.write(pa.Table.from_arrays(columns, schema=_SCHEMA))
