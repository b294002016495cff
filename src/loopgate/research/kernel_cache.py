"""Compiles functions with Numba, and keeps the compiled code on the disk for each version of the sources.

Numba keeps what it compiled by file, and looks at that file only: a function keeps an old version of what it
calls, or of a constant, in another file. And several processes that find the sources changed must not share a
folder with those that still run the old ones. So the folder is named by a hash of all sources of the rooms in
which anything is compiled, and of `loopgate.gates`, whose reasons are constants there.
"""

import hashlib
import os
import shutil
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from loopgate.errors import LoopgateError

try:
    from numba import config, njit
    from numba.core import event
except ImportError as error:  # an extra
    msg = "exhaustive exploration needs numba; pip install 'sumo-loopgate[explore]'"
    raise LoopgateError(msg) from error

_PACKAGE = Path(__file__).parents[1]
_ROOMS = "*.py", "gates/*.py", "research/**/*.py"
"""The sources that what is compiled depends on."""

_NAME = _PACKAGE.name
_PREFIX = "loopgate-kernels-"
_OLD_S = 7 * 24 * 3600.0
"""After so long what was compiled of other sources is deleted [s]."""

F = TypeVar("F", bound=Callable[..., Any])


def kernel_folder(given: str = "", package: Path = _PACKAGE) -> str:
    """Return the folder for compiled code of the present sources; empty if it cannot be made.

    Compiled code is run as it is found. So a folder is taken only if it belongs to the user and nobody else
    may read or write there, and if nobody else can put another folder in its place.

    Parameters
    ----------
    given
        The folder that the user wants compiled code to be in (``NUMBA_CACHE_DIR``); else, and where that
        folder is not taken, it is the package's own, or the user's where that cannot be written to.
    """
    facts = [
        (str(file.relative_to(package)), file.stat().st_size, file.stat().st_mtime_ns)
        for file in sorted(file for room in _ROOMS for file in package.glob(room))
    ]
    name = _PREFIX + hashlib.sha256(repr(facts).encode()).hexdigest()[:16]
    own = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "loopgate"
    for place in (*((Path(given),) if given else ()), package / "__pycache__", own):
        folder = place / name
        try:
            if not os.path.lexists(folder):
                place.mkdir(parents=True, exist_ok=True)
                folder.mkdir(mode=0o700)
                _delete_old(place)
            if is_private(folder) and os.access(folder, os.W_OK):
                return str(folder)
        except OSError:
            continue
    return ""


def is_private(folder: Path) -> bool:
    """Return whether only the user can write to a folder or replace it."""
    if not hasattr(os, "geteuid"):  # Windows has no such modes; a user's folders there are closed to others
        return folder.is_dir()
    facts, above = folder.lstat(), folder.parent.stat()
    mine = stat.S_ISDIR(facts.st_mode) and facts.st_uid == os.geteuid()
    open_above = above.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not above.st_mode & stat.S_ISVTX
    kept = above.st_uid in {0, os.geteuid()} and not open_above
    return mine and stat.S_IMODE(facts.st_mode) & 0o777 == stat.S_IRWXU and kept


def _delete_old(place: Path) -> None:
    for folder in place.glob(f"{_PREFIX}*"):
        if time.time() - folder.stat().st_mtime > _OLD_S:
            shutil.rmtree(folder, ignore_errors=True)


# Numba has one such setting for all that is compiled: it is made as soon as anything here is imported.
config.CACHE_DIR = kernel_folder(config.CACHE_DIR)  # type: ignore[attr-defined]  # there once numba is imported


def mark(folder: str, group: str) -> bool:
    """Mark a group of functions as compiled; return False if it is marked or cannot be."""
    if not folder:
        return False
    try:
        Path(folder, f"{group}.mark").touch(exist_ok=False)
    except OSError:
        return False
    return True


class _Announcer(event.Listener):
    """Says on stderr that much is compiled: once for a folder, and for each of the package's own packages."""

    def on_start(self, event: event.Event) -> None:
        function = event.data["dispatcher"].py_func
        package, _, module = function.__module__.partition(".")
        group = module.partition(".")[0]
        if package == _NAME and mark(config.CACHE_DIR, group):  # type: ignore[attr-defined]
            text = f"compiling its kernels ({group}), once for this version; about half a minute"
            sys.stderr.write(f"loopgate: {text}\n")
            sys.stderr.flush()

    def on_end(self, event: event.Event) -> None:
        pass


_ANNOUNCER = _Announcer()
event.register("numba:compile", _ANNOUNCER)  # type: ignore[no-untyped-call]


class _Listener(event.Listener):
    """Tells the name of each function of ours that has been compiled."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell

    def on_start(self, event: event.Event) -> None:
        pass

    def on_end(self, event: event.Event) -> None:
        function = event.data["dispatcher"].py_func
        if function.__module__.partition(".")[0] == _NAME:
            self._tell(f"{function.__module__}.{function.__qualname__}")


def listen_to_compiling(tell: Callable[[str], None]) -> None:
    """Call `tell` with the name of each function that is compiled from now on.

    Nothing is announced on standard error any more.
    """
    event.unregister("numba:compile", _ANNOUNCER)  # type: ignore[no-untyped-call]
    event.register("numba:compile", _Listener(tell))  # type: ignore[no-untyped-call]


def kernel(function: F) -> F:
    """Decorate a function to be compiled at its first call; the compiled code is kept."""
    return cast("F", njit(cache=True, error_model="numpy")(function))
