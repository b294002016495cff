"""The events of a run: written during the run with bounded memory, and read again."""

import os
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from loopgate.arrays import Floats
from loopgate.disk import DISK_FULL, writing
from loopgate.errors import ResultsError
from loopgate.reading import refusing
from loopgate.results.columns import EVENT, EVENT_COLUMNS, PLACE, REASON, STAGE, TIME, VEHICLE, Event
from loopgate.results.table_reading import NO_PARQUET, check_columns

_END_BYTES = 8_192
_END_BYTES_PER_PIECE = 2_048
_SMALL = 500  # rows; what is left of a disk is filled up to so many


class TableFile:
    """A Parquet file written piece by piece.

    A Parquet file without its end, which lists the pieces, is lost. So room for a piece and for the end is
    reserved before the piece is written; where there is none, the file ends before it.

    Raises `ResultsError` if it cannot be written.
    """

    def __init__(self, file: Path, schema: pa.Schema) -> None:
        self._file = file
        self._pieces = 0
        self._broken = False
        with writing(file):
            self._stream = file.open("wb")
            try:
                self._reserve(0)
                self._writer = pq.ParquetWriter(
                    self._stream, schema, compression="zstd", write_statistics=False
                )
            except BaseException:
                self._stream.close()
                raise

    def write(self, table: pa.Table) -> None:
        """Write a piece.

        Raises `ResultsError` if the disk has no room for all of it. The first rows may be there.
        """
        with writing(self._file, keep=True):
            self._write(table)

    def close(self) -> None:
        """Finish the file; may be called twice.

        Raises `ResultsError` if it cannot be finished, and is lost.
        """
        if self._stream.closed:
            return
        try:
            # After a piece that failed it may fail again: that has been said already.
            expected = (OSError, pa.ArrowException) if self._broken else ()
            with writing(self._file, keep=True), suppress(*expected):
                self._writer.close()
            with writing(self._file, keep=True):
                self._stream.truncate(self._stream.tell())
        finally:
            with suppress(OSError):
                self._stream.close()

    def _write(self, table: pa.Table) -> None:
        try:
            self._reserve(table.nbytes)
        except OSError:
            half = table.num_rows // 2
            if half < _SMALL:
                raise
            self._write(table.slice(0, half))
            self._write(table.slice(half))
            return
        try:
            self._writer.write_table(table)
        except (OSError, pa.ArrowException):
            self._broken = True
            raise
        self._pieces += 1

    def _reserve(self, more_bytes: int) -> None:
        """Reserve disk space for a number of bytes and the end of the file, where the disk allows it."""
        if not hasattr(os, "posix_fallocate"):
            return
        room = more_bytes + _END_BYTES + _END_BYTES_PER_PIECE * (self._pieces + 1)
        try:
            os.posix_fallocate(self._stream.fileno(), self._stream.tell(), room)
        except OSError as error:
            if error.errno in DISK_FULL:
                raise


_BATCH = 50_000
_WORD = pa.dictionary(pa.int32(), pa.string())
_WORDS = (VEHICLE, EVENT, PLACE, REASON, STAGE)
_SCHEMA = pa.schema([(TIME, pa.float64()), *((name, _WORD) for name in _WORDS)])
_WIDTH = len(_SCHEMA)


class Recorder:
    """Collects events and writes them in batches to ``events.parquet``.

    `file`: the file to write; None keeps nothing. Words are kept as numbers from the moment they come in:
    most rows arrive by the thousand, and repeat few words. Raises `ResultsError` if the disk is full, as do
    `note`, `passed` and `close`; the events before that can be read.
    """

    def __init__(self, file: Path | None) -> None:
        self._file = TableFile(file, _SCHEMA) if file else None
        self._codes: dict[str, int] = {"": 0}
        self._words: list[str] = []
        self._flat: list[float] = []
        self._passed: list[tuple[int, Floats, NDArray[np.int32]]] = []
        self._passed_rows = 0
        self.before: Callable[[], None] = lambda: None
        """Called before an event is noted: who keeps rows for later passes them then."""

    def code(self, word: str) -> int:
        """Return the number of a word, for `passed`."""
        return self._codes.setdefault(word, len(self._codes))

    @property
    def words(self) -> Sequence[str]:
        """The words by number."""
        self._words += map(str, islice(self._codes, len(self._words), None))
        return self._words

    def note(
        self, time_s: float, vehicle: str, event: Event, place: str, reason: str = "", stage: str = ""
    ) -> None:
        """Record one event."""
        if self._file is None:
            return
        self.before()
        codes = self._codes
        try:
            row = (time_s, codes[vehicle], codes[event], codes[place], codes[reason], codes[stage])
        except KeyError:
            code = self.code
            row = (time_s, code(vehicle), code(event), code(place), code(reason), code(stage))
        self._flat += row
        if len(self._flat) >= _WIDTH * _BATCH:
            self._flush()

    def passed(self, times: Floats, rows: NDArray[np.int32]) -> None:
        """Record rows of codes (vehicle, event, place; optionally reason and stage); times in [s]."""
        if self._file is None:
            return
        self._passed.append((len(self._flat) // _WIDTH, times.copy(), rows.copy()))
        self._passed_rows += len(rows)
        if self._passed_rows >= _BATCH:
            self._flush()

    def close(self) -> None:
        """Write the remaining events and finish the file; may be called twice."""
        if self._file is not None:
            try:
                self.before()
                self._flush()
            finally:
                self._file.close()
                self._file = None

    def _flush(self) -> None:
        if self._file is None or not (self._flat or self._passed):
            return
        times, rows = self._rows()
        arrays = [pa.array(times), *(self._column(column) for column in rows.T)]
        # Before it is written: what finds no room once is not tried again, and an interruption that comes in
        # the meantime is noticed after it, when nothing must be left that is written already.
        self._flat.clear()
        self._passed.clear()
        self._passed_rows = 0
        self._file.write(pa.Table.from_arrays(arrays, schema=_SCHEMA))

    def _column(self, codes: NDArray[np.int32]) -> pa.Array:
        """Return numbered words as a dictionary column."""
        used = np.flatnonzero(np.bincount(codes))
        numbers = np.zeros(used.max(initial=0) + 1, dtype=np.int32)
        numbers[used] = np.arange(len(used))
        every = self.words
        words = pa.array([every[code] for code in used.tolist()], type=pa.string())
        return pa.DictionaryArray.from_arrays(pa.array(numbers[codes]), words)

    def _rows(self) -> tuple[Floats, NDArray[np.int32]]:
        """Return times and words of all unwritten rows, in order."""
        noted = np.array(self._flat).reshape(-1, _WIDTH)
        times, rows = noted[:, 0], noted[:, 1:].astype(np.int32)
        if not self._passed:
            return times, rows
        sizes = [len(passed) for _, _, passed in self._passed]
        words = np.concatenate([passed for _, _, passed in self._passed])
        passed = np.zeros((self._passed_rows, _WIDTH - 1), dtype=np.int32)
        passed[:, : words.shape[1]] = words
        passed_at = np.concatenate([times for _, times, _ in self._passed])
        if not self._flat:
            return passed_at, passed
        before = np.repeat([place for place, _, _ in self._passed], sizes)
        return np.insert(times, before, passed_at), np.insert(rows, before, passed, axis=0)


class Happening(NamedTuple):
    """An event: a row of the events, see `loopgate.results.columns`."""

    time_s: float
    vehicle: str
    event: str
    place: str
    reason: str = ""
    stage: str = ""


class EventFeed(Recorder):
    """Records events in files of a folder, and returns the events of each step."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._files = folder, [folder / "events0.parquet"]
        super().__init__(self._files[0])
        self._fresh: list[Happening] = []

    def note(
        self, time_s: float, vehicle: str, event: Event, place: str, reason: str = "", stage: str = ""
    ) -> None:
        """Record one event."""
        self.before()
        self._fresh.append(Happening(time_s, vehicle, str(event), place, reason, stage))
        super().note(time_s, vehicle, event, place, reason, stage)

    def passed(self, times: Floats, rows: NDArray[np.int32]) -> None:
        """Record many events."""
        words = self.words
        self._fresh += [
            Happening(time_s, *(words[number] for number in row))
            for time_s, row in zip(times.tolist(), rows.tolist(), strict=True)
        ]
        super().passed(times, rows)

    def take(self) -> list[Happening]:
        """Return the events since the last time, in order."""
        self.before()
        fresh, self._fresh = self._fresh, []
        return fresh

    def read(self) -> pd.DataFrame:
        """Return all events so far as a table with the columns `EVENT_COLUMNS`."""
        if self._file is not None:
            self.before()
            self._flush()
            self._file.close()
            self._files.append(self._folder / f"events{len(self._files)}.parquet")
            self._file = TableFile(self._files[-1], _SCHEMA)
        done = self._files if self._file is None else self._files[:-1]
        return pd.concat([read_events(file) for file in done], ignore_index=True)


def read_events(file: Path, kinds: Collection[Event] = ()) -> pd.DataFrame:
    """Read ``events.parquet``: `EVENT_COLUMNS`, the words as plain strings.

    Files written before there was a column of stages get an empty one.

    `kinds`: which events to read; all if empty.

    Raises `ResultsError` as for `read_event_pieces`.
    """
    pieces = list(read_event_pieces(file, kinds))
    return pd.concat(pieces, ignore_index=True) if len(pieces) > 1 else pieces[0]


def read_event_pieces(file: Path, kinds: Collection[Event] = ()) -> Iterator[pd.DataFrame]:
    """Read ``events.parquet`` in pieces, as `read_events`, so that a long run fits into memory.

    There is at least one piece, be it empty.

    Raises `ResultsError` if the file cannot be read, is damaged or no table of events.
    """
    wanted = {kind.value for kind in kinds}
    with refusing(file, "table", ResultsError, wrong=NO_PARQUET):
        schema = pq.read_schema(file)
        check_columns(schema, EVENT_COLUMNS[:4], file)
        names = [name for name in EVENT_COLUMNS if name in schema.names]
        with pq.ParquetFile(file, read_dictionary=[name for name in names if name in _WORDS]) as source:
            yielded = False
            for batch in source.iter_batches(batch_size=_BATCH, columns=names):
                batch.validate(full=True)
                frame = pd.DataFrame({name: _plain(batch.column(name)) for name in names})
                if wanted:
                    frame = frame[frame[EVENT].isin(wanted)].reset_index(drop=True)
                yielded = True
                yield _with_stage(frame)
            if not yielded:
                yield _with_stage(pd.DataFrame({name: [] for name in names}))


def _plain(column: pa.Array) -> Floats | NDArray[np.object_]:
    if not pa.types.is_dictionary(column.type):
        return np.asarray(column.to_numpy(zero_copy_only=False), dtype=np.float64)
    # One string for all rows that hold the same word.
    words = np.array([*column.dictionary.to_pylist(), ""], dtype=object)
    return np.asarray(words[column.indices.fill_null(len(words) - 1).to_numpy(zero_copy_only=False)])


def _with_stage(frame: pd.DataFrame) -> pd.DataFrame:
    if STAGE not in frame:
        frame[STAGE] = ""
    return frame[list(EVENT_COLUMNS)]
