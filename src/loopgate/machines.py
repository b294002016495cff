"""What differs between operating systems: locks on files, limits, processors, memory."""

import os
import sys
from importlib import import_module
from typing import Any


def _module(name: str) -> Any:  # noqa: ANN401  a module of one operating system
    try:
        return import_module(name)
    except ImportError:
        return None


_FCNTL, _RESOURCE = _module("fcntl"), _module("resource")
"""Not there on Windows."""


def lock(descriptor: int) -> None:
    """Lock an open file until it is closed; raise `BlockingIOError` if another process has it."""
    if _FCNTL is not None:
        _FCNTL.flock(descriptor, _FCNTL.LOCK_EX | _FCNTL.LOCK_NB)
        return
    windows = import_module("msvcrt")
    try:
        windows.locking(descriptor, windows.LK_NBLCK, 1)
    except OSError as error:
        raise BlockingIOError(*error.args) from error


def is_mine(owner: int) -> bool:
    """Return whether the user of this process owns a file; where files have no owners, every one is."""
    return not hasattr(os, "getuid") or owner == os.getuid()


def largest_file_bytes() -> int | None:
    """Return the size that no file of this process may exceed; None if there is no such limit."""
    if _RESOURCE is None:
        return None
    limit, _ = _RESOURCE.getrlimit(_RESOURCE.RLIMIT_FSIZE)
    return None if limit == _RESOURCE.RLIM_INFINITY else int(limit)


def processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def peak_memory_bytes() -> int:
    """Return the largest resident memory of this process so far; 0 where nobody can tell."""
    if _RESOURCE is None:
        return 0
    peak = _RESOURCE.getrusage(_RESOURCE.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else peak * 1024)
