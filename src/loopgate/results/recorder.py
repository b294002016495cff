"""The events of a run: written as they happen, in memory that does not grow with the run, and read back."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from loopgate.results.columns import EVENT, EVENT_COLUMNS, PLACE, REASON, STAGE, TIME, VEHICLE, Event

__all__ = ["Recorder", "read_events"]

_BATCH = 50_000
_WORD = pa.dictionary(pa.int32(), pa.string())
_WORDS = (VEHICLE, EVENT, PLACE, REASON, STAGE)
_SCHEMA = pa.schema([(TIME, pa.float64()), *((name, _WORD) for name in _WORDS)])


class Recorder:
    """Collects events and writes them in batches to ``events.parquet``.

    Parameters
    ----------
    file
        The file to write; None keeps nothing.
    """

    def __init__(self, file: Path | None) -> None:
        self._writer = pq.ParquetWriter(file, _SCHEMA, compression="zstd") if file else None
        self._rows: list[tuple[float, str, str, str, str, str]] = []

    def note(
        self, time_s: float, vehicle: str, event: Event, place: str, reason: str = "", stage: str = ""
    ) -> None:
        """Record one event."""
        if self._writer is None:
            return
        self._rows.append((time_s, vehicle, event.value, place, reason, stage))
        if len(self._rows) >= _BATCH:
            self._flush()

    def close(self) -> None:
        """Write what is left and finish the file; may be called twice."""
        if self._writer is not None:
            self._flush()
            self._writer.close()
            self._writer = None

    def _flush(self) -> None:
        if self._writer is None or not self._rows:
            return
        columns = zip(*self._rows, strict=True)
        arrays = [
            pa.array(column, type=field.type.value_type if pa.types.is_dictionary(field.type) else field.type)
            for column, field in zip(columns, _SCHEMA, strict=True)
        ]
        encoded = [a.dictionary_encode() if pa.types.is_string(a.type) else a for a in arrays]
        self._writer.write_table(pa.Table.from_arrays(encoded, schema=_SCHEMA))
        self._rows.clear()


def read_events(file: Path) -> pd.DataFrame:
    """Read ``events.parquet``: `EVENT_COLUMNS`, the words as plain strings.

    Files written before there was a column of stages get an empty one.
    """
    frame = pd.read_parquet(file)
    if STAGE not in frame:
        frame[STAGE] = ""
    return frame.astype(dict.fromkeys(_WORDS, "str"))[list(EVENT_COLUMNS)]
