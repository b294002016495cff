"""The results folder: rows that survive anything, each exactly once.

``rows/`` holds Parquet files: one per finished run until there are enough to merge them into a chunk.
A file appears whole or not at all (written beside, flushed to the disk, renamed). A merge writes the chunk
before it removes the parts, so a row may be found twice after a crash, never not at all; readers keep one
row per key, that of the latest attempt. ``edges/`` holds the edge tables that rows refer to by the hash of
their content, written before the row.
"""

import contextlib
import json
import os
import uuid
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Self

import pyarrow as pa
import pyarrow.parquet as pq

from loopgate.disk import DISK_FULL, disk_error
from loopgate.errors import ResultsError
from loopgate.folders import FolderLock
from loopgate.results import row_columns as c
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.results.table_reading import read_rows
from loopgate.sweep.task import MANIFEST, Result

_PART = "row-"
_CHUNK = "chunk-"
_TEMPORARY = ".tmp"
_MERGE_AT = 256


class Store:
    """A results folder open for writing, by one sweep at a time.

    Raises `ResultsError` if another sweep writes to it, or it cannot be written.

    Parameters
    ----------
    folder
        Made if it does not exist. What an interrupted sweep left behind is cleaned up.
    merge_at
        How many single rows are merged into one file.
    """

    def __init__(self, folder: Path, *, merge_at: int = _MERGE_AT) -> None:
        self.folder = folder
        self._rows, self._edges = folder / "rows", folder / "edges"
        self._merge_at = merge_at
        with self._explained():
            self._rows.mkdir(parents=True, exist_ok=True)
            self._edges.mkdir(exist_ok=True)
            self._lock = FolderLock(folder)
            if not self._lock.acquire():
                msg = (
                    f"{folder}: another sweep is writing to it; wait for it, or choose another folder with -o"
                )
                raise ResultsError(msg)
        self._attempts: dict[str, tuple[int, str]] = {}
        try:
            self._recover()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the folder."""
        self._lock.release()

    def finished(self, key: str) -> str | None:
        """Return the status of the row with this key, or None if there is none."""
        found = self._attempts.get(key)
        return None if found is None else found[1]

    def attempts(self, key: str) -> int:
        """Return the attempt of the row with this key, 0 if there is none."""
        return self._attempts.get(key, (0, ""))[0]

    def __len__(self) -> int:
        return len(self._attempts)

    def write_manifest(self, manifest: Mapping[str, Any]) -> None:
        """Write the description of the sweep, for readers of the results."""
        text = json.dumps(manifest, indent=1, default=str).encode()
        self._write(self.folder / MANIFEST, lambda file: file.write(text))

    def add(self, result: Result) -> None:
        """Keep a row for good; once this returns it survives a crash of the machine.

        Raises `ResultsError` if it cannot be written (disk full); rows that are there already stay.
        """
        row = result.row
        if result.edges is not None:
            target = self._edges / f"{row[c.EDGE_SET]}.parquet"
            if not target.exists():
                edges = pa.Table.from_pandas(result.edges, preserve_index=False)
                self._write(target, lambda file: pq.write_table(edges, file))
        table = pa.Table.from_pylist([row], schema=ROW_SCHEMA)
        self._write(self._rows / f"{_PART}{row[c.KEY]}.parquet", lambda file: pq.write_table(table, file))
        self._attempts[row[c.KEY]] = (row[c.ATTEMPT], row[c.STATUS])
        if len(list(self._rows.glob(f"{_PART}*.parquet"))) >= self._merge_at:
            self.merge()

    def merge(self) -> None:
        """Merge the single rows into one file."""
        parts = sorted(self._rows.glob(f"{_PART}*.parquet"))
        if len(parts) < 2:  # noqa: PLR2004 - nothing to merge
            return
        table = pa.concat_tables([read_rows(part).table for part in parts])
        target = self._rows / f"{_CHUNK}{uuid.uuid4().hex[:12]}.parquet"
        self._write(target, lambda file: pq.write_table(table, file, compression="zstd"))
        with self._explained():
            for part in parts:
                part.unlink()

    def _recover(self) -> None:
        with self._explained():
            for left in [*self._rows.glob(f"*{_TEMPORARY}"), *self._edges.glob(f"*{_TEMPORARY}")]:
                left.unlink()
        for file in sorted(self._rows.glob("*.parquet")):
            rows = read_rows(file, [c.KEY, c.ATTEMPT, c.STATUS])
            if rows.besides:
                # A merge would lose them.
                msg = (
                    f"{file}: made by another version of loopgate, with columns that this one does not know "
                    f"({rows.besides}); go on with that version, or choose another folder with -o"
                )
                raise ResultsError(msg)
            for row in rows.table.to_pylist():
                if row[c.ATTEMPT] >= self.attempts(row[c.KEY]):
                    self._attempts[row[c.KEY]] = (row[c.ATTEMPT], row[c.STATUS])

    def _write(self, target: Path, write: Callable[[BinaryIO], object]) -> None:
        temporary = target.with_name(target.name + _TEMPORARY)
        with self._explained():
            try:
                with temporary.open("wb") as file:
                    write(file)
                    file.flush()
                    os.fsync(file.fileno())
                temporary.replace(target)
            except BaseException:
                temporary.unlink(missing_ok=True)
                raise
            _sync_folder(target.parent)

    @contextlib.contextmanager
    def _explained(self) -> Iterator[None]:
        """Turn errors of the disk into one line with the way out."""
        try:
            yield
        except OSError as error:
            what = disk_error(error)
            if error.errno in DISK_FULL:
                msg = f"{self.folder}: {what}; all rows so far are safe, and it goes on where it stopped"
            else:
                msg = f"{self.folder}: cannot be written ({what})"
            raise ResultsError(msg) from error


def _sync_folder(folder: Path) -> None:
    """Make a rename in `folder` last through a crash of the machine."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
