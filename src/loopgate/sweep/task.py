"""One run of a sweep, as it is executed on a worker: pure data in, one row out.

A task must be importable and picklable wherever a worker runs, so it names its runner by text.
"""

import contextlib
import functools
import hashlib
import importlib
import json
import os
import platform
import shutil
import socket
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, cast

import pandas as pd

from loopgate.analysis.rows import read_run_row
from loopgate.disk import DISK_FULL
from loopgate.errors import LoopgateError, SweepError
from loopgate.folders import temporary_folder
from loopgate.machines import peak_memory_bytes
from loopgate.network.road import content_identity
from loopgate.plugins import Plugins, in_file
from loopgate.results import columns as c
from loopgate.sweep.description import Point, with_files
from loopgate.sweep.files import PackedFile, unpack
from loopgate.versions import versions

_KIB_PER_MIB = 1024
_RESET_PEAK = "5"  # proc(5), clear_refs: reset the peak resident set size


def reset_peak_memory() -> None:
    """Reset the peak of memory; only Linux can, other systems keep the old peak."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text(_RESET_PEAK, encoding="ascii")


def peak_memory_mb() -> float:
    """Return the largest resident memory since the last reset, or of the process [MiB]."""
    try:
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / _KIB_PER_MIB
    except OSError:
        pass
    return peak_memory_bytes() / _KIB_PER_MIB**2


MANIFEST = "sweep.json"
"""The description of a sweep, in the folder of its results."""

Runner = Callable[[Mapping[str, Any], Path], object]
"""Runs a scenario (its files are local paths) and fills the folder with what a run folder holds."""

DEFAULT_RUNNER = "loopgate.sweep.simulate:run_scenario"

_LEFT_TO_THE_RUN = (c.VEHICLES, c.LOOPS, c.NEGOTIATION, c.LIGHTS)
"""Keys of a scenario that, where they are 0 or empty, let the run choose: its own figure counts."""

_ONE_AT_A_TIME = threading.Lock()  # a process holds one simulation; a worker with threads must queue


@dataclass(frozen=True, slots=True)
class Task:
    """A point of a sweep with its files, ready to travel."""

    point: Point
    runner: str = DEFAULT_RUNNER
    """``module:function`` or ``file.py:function``."""
    files: Mapping[str, PackedFile] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)
    """Names of the files for a command on the machine on which the sweep was started."""
    attempt: int = 1
    keep: Path | None = None
    """Folder in which to keep the run; None to remove the run after its row is made."""
    seal: str = ""
    """The hash of `MANIFEST` in the folder of results, where the worker has to see that folder (`keep`)."""
    code: str = ""
    """The code by which the sweep was started; the worker has to run the same. Empty for any."""


@dataclass(frozen=True, slots=True)
class Result:
    """A row, and the edges it refers to (None for a failed run)."""

    row: dict[str, Any]
    edges: pd.DataFrame | None = None


class UnfitWorkerError(SweepError):
    """A worker that cannot make the runs of a sweep as the sweep is meant; it makes no row."""


def execute(task: Task) -> Result:
    """Run a task and return its row; an error of the run becomes a row with status ``failed``.

    Raises `UnfitWorkerError` if the worker runs other code than the sweep was started by, or does not see the
    folder in which runs are to be kept; `OSError` if the worker's disk is full. That says nothing of the
    scenario, so it makes no row.
    """
    _check_worker(task)
    with _ONE_AT_A_TIME:
        started = time.perf_counter()
        reset_peak_memory()
        try:
            result = _run(task)
        except Exception as error:
            full = _disk_full(error)
            if full is not None:
                raise full from error
            result = Result(failed_row(task, _describe(error)))
        result.row[c.TOOK] = time.perf_counter() - started
        result.row[c.PEAK_MEMORY] = peak_memory_mb()
        result.row[c.WORKER] = _here()
        return result


def _check_worker(task: Task) -> None:
    if task.code and task.code != own_code():
        msg = (
            f"worker {_here()} runs loopgate {versions()['loopgate']} with other code ({own_code()}) than "
            f"that of the sweep ({task.code}): install the same version there, and start the worker again"
        )
        raise UnfitWorkerError(msg)
    if task.keep is not None and task.seal and seal(task.keep.parents[1]) != task.seal:
        msg = (
            f"worker {_here()} does not see the results in {task.keep.parents[1]}: runs are kept only where "
            f"workers share that folder; give them one, or sweep without keeping runs"
        )
        raise UnfitWorkerError(msg)


def seal(folder: Path) -> str:
    """Return the hash that identifies a results folder; empty if there is none."""
    with contextlib.suppress(OSError):
        return hashlib.sha256((folder / MANIFEST).read_bytes()).hexdigest()
    return ""


def _here() -> str:
    return f"{socket.gethostname()}:{os.getpid()}"


def _run(task: Task) -> Result:
    runner = load_runner(task.runner)
    with temporary_folder() as scratch:
        places = {key: str(_locate(task, key, scratch)) for key in task.files}
        scenario = with_files(task.point.scenario, places)
        out = scratch / "run"
        if task.keep is not None:
            shutil.rmtree(task.keep, ignore_errors=True)
            out = task.keep
        out.mkdir(parents=True)
        try:
            runner(scenario, out)
        finally:
            with contextlib.suppress(OSError):
                out.rmdir()  # only if the run failed before it wrote anything
        row, edges = read_run_row(out)
    # The command that reproduces the run, and what it warned of, name the user's files, not the worker's.
    names = {place: task.names.get(key, place) for key, place in places.items()}
    for place, name in {**names, str(out): f"out/{task.point.key}"}.items():
        for column in (c.COMMAND, c.WARNINGS):
            row[column] = (row.get(column) or "").replace(place, name) or None
    return Result({**row, **_identity(task)}, edges)


def _locate(task: Task, key: str, scratch: Path) -> Path:
    """Return where a file of the scenario is: its own place if this machine has it there, else a copy."""
    packed, path = task.files[key], task.point.files[key]
    try:
        if content_identity(path) == packed.identity:
            return path
    except (OSError, LoopgateError):
        pass
    return unpack(packed, scratch)


def failed_row(task: Task, error: str) -> dict[str, Any]:
    """Return the row of a run that came to nothing, for the reason given."""
    return {**_identity(task), c.STATUS: c.STATUS_FAILED, c.ERROR: error}


def _identity(task: Task) -> dict[str, Any]:
    """Return the columns that are known before the run; the scenario has precedence."""
    point = task.point
    asked = {
        name: value
        for name in c.OPTION_COLUMNS
        if (value := point.scenario.get(name)) is not None and (value or name not in _LEFT_TO_THE_RUN)
    }
    return {
        **asked,
        c.KEY: point.key,
        c.ATTEMPT: task.attempt,
        c.SCENARIO: json.dumps(dict(point.scenario), sort_keys=True, default=str),
        c.NETWORK_HASH: point.hashes.get("network"),
        c.ROUTES_HASH: point.hashes.get("routes"),
        c.LOOPGATE_CODE: own_code(),
        c.LOOPGATE_VERSION: versions()["loopgate"],
        c.SUMO_VERSION: metadata.version("eclipse-sumo"),
        c.PYTHON_VERSION: platform.python_version(),
        c.FINISHED: datetime.now(UTC),
    }


@functools.cache
def own_code() -> str:
    """Return a hash of the package's sources, as they are when this process first asks."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        digest.update(file.relative_to(root).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()[:12]


def load_runner(name: str) -> Runner:
    """Import the function that ``module:function`` or ``file.py:function`` names.

    Raises `SweepError` if there is no such module, file or function.
    """
    where = in_file(name)
    if where is not None:
        return Plugins("runner", "", SweepError).from_file(where)
    module_name, _, attribute = name.rpartition(":")
    try:
        return cast("Runner", getattr(importlib.import_module(module_name), attribute))
    except (ImportError, AttributeError, ValueError) as error:
        msg = f"runner {name}: cannot be imported ({error}); expected module:function or file.py:function"
        raise SweepError(msg) from error


def _describe(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, LoopgateError) else f"{type(error).__name__}: {text}"


def _disk_full(error: BaseException | None) -> OSError | None:
    while error is not None:
        if isinstance(error, OSError) and error.errno in DISK_FULL:
            return OSError(error.errno, error.strerror, error.filename)
        error = error.__cause__ or error.__context__
    return None
