"""Numbers and words of a replay, compressed into one text."""

import base64
import json
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

_BYTE = 256
_WIDEST = 4
_PIECE = 1 << 22


@dataclass(slots=True)
class Pack:
    """Columns of whole numbers, with a description in JSON.

    A column is kept as differences, taken once or twice. The sign of each difference is folded into the
    lowest bit. The column is cut into planes: the lowest bytes of all numbers, then the next bytes. If a
    vehicle drives evenly or stands, most bytes are then zero.
    """

    _columns: list[npt.NDArray[np.uint8]] = field(default_factory=list)
    _at: int = 0

    def column(self, values: npt.ArrayLike, *, differences: int = 1) -> list[int]:
        """Add a column; return its first byte, length, bytes per number and how often differences were taken.

        The numbers, and their differences, must fit into 32 bits with a sign.
        """
        numbers = np.asarray(values, dtype=np.int64)
        for _ in range(differences):
            numbers = np.diff(numbers, prepend=0)
        folded = ((numbers << 1) ^ (numbers >> 63)).astype(np.uint64)
        largest = int(folded.max(initial=0))
        width = next((w for w in range(1, _WIDEST + 1) if largest < _BYTE**w), 0)
        if not width:
            msg = f"a number of {largest // 2} is too large for the page"
            raise ValueError(msg)
        place = [self._at, len(folded), width, differences]
        for plane in range(width):
            self._columns.append(((folded >> np.uint64(8 * plane)) & np.uint64(_BYTE - 1)).astype(np.uint8))
        self._at += width * len(folded)
        return place

    def text(self, description: Any, report: Callable[[int, int], None] = lambda _done, _all: None) -> str:  # noqa: ANN401  any JSON
        """Return the compressed content in base64: length of the description, description, columns.

        `report` is called with the number of bytes compressed so far, and the number of all bytes.
        """
        words = json.dumps(description, separators=(",", ":")).encode()
        content = b"".join((len(words).to_bytes(4, "little"), words, *(c.tobytes() for c in self._columns)))
        squeezer = zlib.compressobj(9)
        parts = []
        for at in range(0, len(content), _PIECE):
            parts.append(squeezer.compress(content[at : at + _PIECE]))
            report(at, len(content))
        parts.append(squeezer.flush())
        return base64.b64encode(b"".join(parts)).decode("ascii")
