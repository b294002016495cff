"""Locks on folders, and temporary folders that are removed when their process ends."""

import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from loopgate.disk import writing
from loopgate.machines import is_mine, lock

_LOCK = ".lock"
_PREFIX = "loopgate-"
_MARK = ".loopgate-temporary"
"""Locked while its folder is in use. Only a folder that holds it is removed: others may be named alike."""


class FolderLock:
    """A lock that keeps other processes out of a folder; it ends with its process.

    The operating system holds the lock: it ends with the process, however that ends.

    Parameters
    ----------
    folder
        It exists.
    name
        The file in it that is locked; there is none once the lock is released.
    """

    def __init__(self, folder: Path, name: str = _LOCK) -> None:
        self._file = folder / name
        self._open = -1
        """The descriptor of the file that this object has locked, or -1."""

    def acquire(self) -> bool:
        """Take the lock; return False if another process has it.

        Raises `OSError` if the file cannot be made.
        """
        descriptor = os.open(self._file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            lock(descriptor)
            # Who had it before may have removed the file since it was opened.
            mine = os.fstat(descriptor).st_ino == self._file.stat().st_ino
        except (BlockingIOError, FileNotFoundError):
            mine = False
        except OSError:
            os.close(descriptor)
            raise
        if mine:
            self._open = descriptor
        else:
            os.close(descriptor)
        return mine

    def release(self) -> None:
        """Release the lock; does nothing if it is not taken."""
        if self._open >= 0:
            # Before the lock goes: afterwards the file may be another's already.
            with suppress(OSError):
                self._file.unlink()
            os.close(self._open)
            self._open = -1


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Make a folder for the ``with`` block; remove folders that killed processes have left.

    Raises `ResultsError` if it cannot be made.
    """
    remove_abandoned()
    with writing("the folder for temporary files (TMPDIR)"):
        folder, held = _make()
    try:
        yield folder
    finally:
        _remove(folder)
        held.release()


def remove_abandoned() -> None:
    """Remove this user's temporary folders whose processes have ended."""
    with suppress(OSError):
        for folder in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
            with suppress(OSError):
                _remove_if_abandoned(folder)


def _make() -> tuple[Path, FolderLock]:
    while True:
        folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
        held = FolderLock(folder, _MARK)
        if held.acquire():
            return folder, held
        # Another process was quicker to take it for abandoned.


def _remove_if_abandoned(folder: Path) -> None:
    facts = folder.lstat()  # not of what a link leads to
    if not stat.S_ISDIR(facts.st_mode) or not is_mine(facts.st_uid) or not (folder / _MARK).is_file():
        return
    held = FolderLock(folder, _MARK)
    if held.acquire():
        try:
            _remove(folder)
        finally:
            held.release()


def _remove(folder: Path) -> None:
    """Remove a temporary folder, its mark last, so that an interrupted removal can go on later."""
    for content in [*folder.iterdir()] if folder.is_dir() else ():
        if content.name == _MARK:
            continue
        if content.is_dir() and not content.is_symlink():
            shutil.rmtree(content, ignore_errors=True)
        else:
            content.unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
