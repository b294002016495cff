"""Errors of the disk, in one line that names the file."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from loopgate.errors import ResultsError

DISK_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""Errors of a disk, a quota or a limit on files that has nothing left to give."""


def disk_error(error: OSError) -> str:
    """Return a short message about an error of the disk, with a way out if it is full.

    Libraries put words of their own around those of the system; here they are the system's alone.
    """
    if error.errno in DISK_FULL:
        return f"{os.strerror(error.errno).lower()}; free some space and run the same command again"
    return " ".join((error.strerror or str(error)).split())


@contextmanager
def writing(file: Path | str, *, keep: bool = False) -> Iterator[None]:
    """Turn an error of the disk inside the ``with`` block into one line.

    Raises `ResultsError` if it cannot be written; the text names the file.

    Parameters
    ----------
    file
        The file that is written.
    keep
        Whether a file that a full disk cut short stays; else there is none, rather than half of one.
    """
    try:
        yield
    except OSError as error:
        path = Path(file)
        if error.errno in DISK_FULL and not keep and path.is_file():
            with suppress(OSError):
                path.unlink()
        msg = f"{file}: cannot be written ({disk_error(error)})"
        raise ResultsError(msg) from error
