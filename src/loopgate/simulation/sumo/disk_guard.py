"""Ends a run before SUMO's own output fills the disk."""

import resource
import shutil
from pathlib import Path

from loopgate.disk import disk_error
from loopgate.errors import ResultsError

_SPARE_BYTES = 4 << 20
"""Least free space: SUMO keeps 1 MiB of text and of compressed text in memory until it closes its file
[bytes]."""


class DiskGuard:
    """Ends a run before the disk is full: SUMO would end the process if it could not write.

    Parameters
    ----------
    file
        The file that SUMO writes. A check takes one or two microseconds, so it can be made in every step.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._folder = file.parent
        limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        self._limit = None if limit == resource.RLIM_INFINITY else limit

    def check(self) -> None:
        """Check the space left on the disk.

        Raises
        ------
        ResultsError
            If it may not suffice for the rest of SUMO's output.
        """
        try:
            left = shutil.disk_usage(self._folder).free
            if self._limit is not None:
                written = self._file.stat().st_size if self._file.exists() else 0
                left = min(left, self._limit - written)
        except OSError as error:
            msg = f"{self._file}: cannot be written ({disk_error(error)})"
            raise ResultsError(msg) from error
        if left < _SPARE_BYTES:
            msg = (
                f"{self._file}: cannot go on, {max(left, 0) / 2**20:.1f} MiB are left on the disk and SUMO "
                f"needs {_SPARE_BYTES >> 20}; free some space and run the same command again"
            )
            raise ResultsError(msg)
