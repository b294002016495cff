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
        self._table: NDArray[np.void] | None = None
        self._names = pa.array([], type=pa.string())
        self._times: list[float] = []
        self._fronts: list[NDArray[np.float64]] = []

    def look(self) -> None:
        """Take note of the step that was made."""
        if self._table is not self._engine.vehicles:  # made anew when vehicles join or leave
            self._flush()
            self._table = self._engine.vehicles
            self._names = pa.array([driver.id for driver in self._engine.drivers], type=pa.string())
        fronts = self._table["front"].copy()
        self._times.append(self._traffic.now_s)
        self._fronts.append(fronts)
        if len(self._times) * len(fronts) >= _BATCH:
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
        fronts = np.rint(np.array(self._fronts).T * FRONTS_PER_M).astype(np.int32)
        vehicles, steps = fronts.shape
        numbers = np.repeat(np.arange(vehicles, dtype=np.int32), steps)
        columns = [
            pa.array(np.tile(np.array(self._times), vehicles)),
            pa.DictionaryArray.from_arrays(pa.array(numbers), self._names),
            pa.array(fronts.ravel()),
        ]
        self._times.clear()
        self._fronts.clear()
        self._file.write(pa.Table.from_arrays(columns, schema=_SCHEMA))
