"""Make the missing runs of a sweep, and keep each row as it comes.

``rows/`` holds Parquet files: one per finished run until there are enough to merge them into a chunk.
A file appears whole or not at all (written beside, flushed to the disk, renamed). A merge writes the chunk
before it removes the parts, so a row may be found twice after a crash, never not at all; readers keep one
row per key, that of the latest attempt. ``edges/`` holds the edge tables that rows refer to by the hash of
their content, written before the row.
"""

import contextlib
import json
import os
import shlex
import sys
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, Self

import pyarrow as pa
import pyarrow.parquet as pq
from pebble import ProcessExpired

from loopgate.disk import DISK_FULL, disk_error
from loopgate.errors import ResultsError, SweepError
from loopgate.folders import FolderLock, remove_abandoned
from loopgate.machines import processors
from loopgate.reading import as_path, of_kind
from loopgate.results import columns as c
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.results.table_reading import read_rows
from loopgate.sweep.description import Point, Sweep
from loopgate.sweep.files import PackedFile, pack
from loopgate.sweep.local import LocalExecutor, why_died, why_late
from loopgate.sweep.task import (
    DEFAULT_RUNNER,
    MANIFEST,
    Result,
    Task,
    UnfitWorkerError,
    execute,
    failed_row,
    own_code,
    seal,
)
from loopgate.versions import versions

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


_TRIES = 2  # a worker that dies takes its run with it; the second time it is the run's own doing


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a sweep: runs done, failed and left."""

    total: int
    """Number of all runs of the sweep."""
    present: int
    """Number of runs whose row existed before."""
    done: int
    """Number of runs made now, failed runs included."""
    failed: int
    """Number of failed runs made now."""
    seconds: float
    """Wall time so far [s]."""


@dataclass(frozen=True, slots=True)
class SweepOutcome(Progress):
    """The outcome of a sweep: runs made, failed and reused, and the results folder."""

    folder: Path
    """The results folder."""


def run_sweep(  # noqa: PLR0913 - each is a choice of the caller's, all but two by name
    sweep: Sweep,
    folder: Path | str,
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    timeout_s: float | None = None,
    runner: str = DEFAULT_RUNNER,
    retry_failed: bool = False,
    keep_runs: bool = False,
    window: int | None = None,
    report: Callable[[Progress], None] | None = None,
) -> SweepOutcome:
    """Run all scenarios of a sweep that have no row in the results folder yet.

    You may stop it at any moment; the same call continues it. No finished run is lost or made twice.

    Raises `SweepError` if the sweep has no runs, or the executor breaks down. Raises `ResultsError` if the
    folder cannot be written, or a worker's disk is full. The rows made so far are kept.

    Parameters
    ----------
    executor
        Any `concurrent.futures.Executor`, on this machine or others; `run_sweep` does not shut it down.
        Default: a `LocalExecutor` with `workers` processes and `timeout_s` [s] per run.
    runner
        ``module:function`` or ``file.py:function`` that runs a scenario (see `loopgate.sweep.task.Runner`).
    retry_failed
        Whether to repeat failed runs; the new row replaces the old row.
    keep_runs
        Whether to keep each run folder in ``folder/runs/KEY`` (workers must share the file system).
    window
        Largest number of calls in the executor at once; default: four per worker.
    report
        Called with the progress after each run.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from loopgate import Sweep, run_sweep
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> sweep = Sweep("seeds", {**roads, "gate": "open", "duration_s": 60}, {"seed": [1, 2]})
    >>> run_sweep(sweep, "out/seeds", executor=ThreadPoolExecutor(1)).done
    2
    """
    sweep = of_kind(Sweep, sweep, "run_sweep: the sweep", SweepError, "a Sweep, as read_sweep returns")
    folder = as_path(folder, "folder of the sweep", ResultsError)
    points = sweep.points()
    with Store(folder) as store:
        store.write_manifest(_manifest(sweep, points, folder))
        again = {None, c.STATUS_FAILED} if retry_failed else {None}
        todo = [p for p in points if store.finished(p.key) in again]
        state = _State(store, len(points), len(points) - len(todo), report or (lambda _: None))
        tasks = deque(
            Task(
                point,
                runner,
                names={key: _from_here(path) for key, path in point.files.items()},
                attempt=store.attempts(point.key) + 1,
                keep=folder.resolve() / "runs" / point.key if keep_runs else None,
                seal=seal(folder) if keep_runs else "",
                code=own_code(),
            )
            for point in todo
        )
        workers = min(workers or processors(), max(len(todo), 1))
        with _executor(executor, workers, timeout_s) as (pool, size):
            _drive(tasks, pool, window or 4 * size, state, cache(_pack))
        store.merge()
        return SweepOutcome(**asdict(state.progress()), folder=folder)


class _State:
    def __init__(self, store: Store, total: int, present: int, report: Callable[[Progress], None]) -> None:
        self.store, self.total, self.present, self._report = store, total, present, report
        self.done = self.failed = 0
        self._begin = time.perf_counter()

    def progress(self) -> Progress:
        seconds = time.perf_counter() - self._begin
        return Progress(self.total, self.present, self.done, self.failed, seconds)

    def add(self, result: Result) -> None:
        self.store.add(result)
        self.done += 1
        self.failed += result.row[c.STATUS] == c.STATUS_FAILED
        self._report(self.progress())


def _pack(path: Path) -> PackedFile:
    try:
        return pack(path)
    except OSError as error:
        msg = f"{path}: cannot read the file ({error.strerror or error})"
        raise SweepError(msg) from error


def _drive(
    tasks: deque[Task], pool: Executor, window: int, state: _State, pack_once: Callable[[Path], PackedFile]
) -> None:
    def submit(task: Task) -> Future[Result]:
        files = {key: pack_once(path) for key, path in task.point.files.items()}
        return pool.submit(execute, replace(task, files=files))

    pending: dict[Future[Result], tuple[Task, int]] = {}
    try:
        while tasks or pending:
            while tasks and len(pending) < window:
                task = tasks.popleft()
                pending[submit(task)] = (task, 1)
            # Some executors answer with futures that wake no waiter when their workers go: look now and then.
            for future in wait(pending, timeout=5.0, return_when=FIRST_COMPLETED).done:
                task, tries = pending.pop(future)
                result = _result(future, task, tries)
                if result is None:
                    pending[submit(task)] = (task, tries + 1)
                else:
                    state.add(result)
    finally:
        for future in pending:
            future.cancel()


def _result(future: Future[Result], task: Task, tries: int) -> Result | None:
    """Return the run's result, or None if it should be tried again."""
    try:
        return future.result()
    except BrokenProcessPool as error:
        msg = (
            "a worker process ended before it began; all rows so far are kept. A script that sweeps must do "
            "so below: if __name__ == '__main__'"
        )
        raise SweepError(msg) from error
    except BrokenExecutor as error:
        msg = f"the executor broke down ({error}); all rows so far are kept, the same command goes on"
        raise SweepError(msg) from error
    except ProcessExpired as error:  # an error of the system for Python, as the next two
        return None if tries < _TRIES else Result(failed_row(task, why_died(error)))
    except TimeoutError as error:
        return Result(failed_row(task, why_late(error)))
    except OSError as error:
        if error.errno not in DISK_FULL:
            msg = f"a worker cannot be started ({error}); all rows so far are kept, the same command goes on"
            raise SweepError(msg) from error
        msg = (
            f"a worker's disk is full ({error}); all rows written so far are safe. Free some space there and "
            "run the same command again: it goes on where it stopped"
        )
        raise ResultsError(msg) from error
    except UnfitWorkerError as error:
        msg = f"{error}; all rows so far are kept, the same command goes on"
        raise SweepError(msg) from error
    except CancelledError as error:
        msg = "the executor cancelled a run; all rows so far are kept, the same command goes on"
        raise SweepError(msg) from error
    except Exception as error:  # noqa: BLE001 - for instance a remote worker that died too often
        return Result(failed_row(task, f"{type(error).__name__}: {' '.join(str(error).split())}"))


@contextlib.contextmanager
def _executor(
    given: Executor | None, workers: int, timeout_s: float | None
) -> Iterator[tuple[Executor, int]]:
    if given is not None:
        yield given, workers
        return
    local = LocalExecutor(workers, timeout_s=timeout_s)
    try:
        yield local, workers
    except BaseException:
        local.shutdown(cancel_futures=True)
        raise
    else:
        local.shutdown()
    finally:
        remove_abandoned()  # of workers that were ended in the middle of a run


def _from_here(path: Path) -> str:
    """Return the path relative to the working directory, if it lies there."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


def _manifest(sweep: Sweep, points: Sequence[Point], folder: Path) -> dict[str, Any]:
    program, *words = sys.argv or [""]  # a script or a notebook has words of its own
    return {
        "name": sweep.name,
        "runs": len(points),
        "base": dict(sweep.base),
        "grid": {axis: list(values) for axis, values in sweep.grid.items()},
        "include": [dict(rule) for rule in sweep.include],
        "exclude": [dict(rule) for rule in sweep.exclude],
        "folder": str(folder),
        "command": shlex.join(["loopgate", *words]) if Path(program).stem == "loopgate" else "",
        "versions": versions("eclipse-sumo"),
        "keys": [point.key for point in points],
    }
