"""Tables for compiled code: one row class says what a row holds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Final, cast, get_type_hints

import numpy as np
from numba import config
from numpy.typing import NDArray

__all__ = ["columns", "table"]

_BYTES: Final = 8
_KINDS: Final = {float: np.float64, int: np.int64, bool: np.bool_}


def table(
    row: type, columns: Mapping[str, Any] | None = None, *, length: int | None = None
) -> NDArray[np.void]:
    """Return a table whose rows have the attributes that the class `row` and its bases annotate.

    Parameters
    ----------
    row
        A class with annotations ``float``, ``int`` and ``bool``, and nothing else.
    columns
        What to fill in; all other columns are zero.
    length
        Number of rows; by default that of the columns.
    """
    columns = columns or {}
    if length is None:
        length = len(next(iter(columns.values())))
    made = np.zeros(length, dtype=_kind(row))
    for name, values in columns.items():
        made[name] = values
    # Compiled code reads the columns of a row as attributes; uncompiled they have to be some.
    return made.view(np.recarray) if config.DISABLE_JIT else made  # type: ignore[attr-defined]  # set on import


def columns(made: NDArray[np.void], first: str, last: str) -> NDArray[np.int64]:
    """Return the whole numbers in some columns side by side, one row each: a view, much sooner read."""
    begin, end = (cast("Any", made.dtype.fields)[name][1] // _BYTES for name in (first, last))
    return made.view(np.ndarray).view(np.int64).reshape(len(made), -1)[:, begin : end + 1]


@cache
def _kind(row: type) -> np.dtype[np.void]:
    return np.dtype([(name, _KINDS[kind]) for name, kind in get_type_hints(row).items()], align=True)
