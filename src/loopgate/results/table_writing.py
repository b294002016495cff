"""A Parquet file that grows for hours, and stays readable if the disk fills up."""

import os
from contextlib import suppress
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from loopgate.disk import DISK_FULL, writing

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
