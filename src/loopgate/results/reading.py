"""Reads tables of results, also those that another version of loopgate made: as far as they can be read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from loopgate.errors import ResultsError
from loopgate.results import row_columns as c
from loopgate.results.row_schema import ROW_SCHEMA

__all__ = ["lacks", "maker", "other_columns", "read_rows", "read_table"]

_NEEDED = (
    c.KEY,
    c.ATTEMPT,
    c.STATUS,
    c.ERROR,
    c.SCENARIO,
    c.NETWORK,
    c.GATE,
    c.VEHICLES,
    c.SEED,
    c.DURATION,
    c.MEASURED,
    c.LAPS,
    c.LAPS_PER_H,
    c.KM_PER_H,
    c.OUTCOME,
    c.DEADLOCKS,
)
"""Without these a row says nothing; what else is missing is only not known of it."""

_MOST_NAMES = 4
_MOST_CHARACTERS = 200


def maker(summary: Mapping[str, Any]) -> str:
    """Return the version of loopgate that made a run, from its summary; empty if it does not say."""
    versions = summary.get("versions")
    return str(versions.get("loopgate", "")) if isinstance(versions, Mapping) else ""


def lacks(file: Path, missing: Iterable[str], made_by: str, *, what: str = "column") -> ResultsError:
    """Return the error that names what a file of results lacks, who made it, and what to do."""
    ours = version("loopgate")
    msg = f"{file}: it has no {what} {_listed(missing)}"
    if made_by in {"", ours}:
        return ResultsError(f"{msg}, which loopgate {ours} expects; make it again")
    return ResultsError(f"{msg}: loopgate {made_by} made it, this is {ours}; make it again, or use {made_by}")


def read_table(
    file: Path,
    wanted: Sequence[str],
    *,
    made_by: str,
    only: bool = False,
    filters: list[tuple[str, str, list[str]]] | None = None,
) -> pd.DataFrame:
    """Read a table of a run folder.

    Parameters
    ----------
    file
        A Parquet file.
    wanted
        Columns that it must have.
    made_by
        The version of loopgate that made it, as far as known.
    only
        Whether to leave out all other columns.
    filters
        Which rows to read, as pandas takes it.

    Raises
    ------
    ResultsError
        If it cannot be read, or has not all these columns.
    """
    try:
        there = pq.read_schema(file).names
        missing = [name for name in wanted if name not in there]
        if missing:
            raise lacks(file, missing, made_by)
        return pd.read_parquet(file, columns=list(wanted) if only else None, filters=filters)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise _unreadable(file, error) from error


def read_rows(file: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Read a file of rows of a sweep; columns that only newer versions write are null.

    Parameters
    ----------
    file
        In the folder ``rows``.
    columns
        Which to read; default: all.

    Raises
    ------
    FileNotFoundError
        If it is gone: a sweep that runs may just have merged it.
    ResultsError
        If it cannot be read, or lacks a column without which rows say nothing.
    """
    try:
        there = pq.read_schema(file).names
        missing = [name for name in _NEEDED if name not in there]
        if missing:
            raise lacks(file, missing, _made_rows(file, there))
        return pq.read_table(file, schema=ROW_SCHEMA, columns=columns)
    except FileNotFoundError:
        raise
    except (OSError, ValueError, pa.ArrowException) as error:
        raise _unreadable(file, error) from error


def other_columns(file: Path) -> tuple[str, str] | None:
    """Compare a file of rows with what this version writes.

    Returns
    -------
    tuple
        The columns that it lacks and those that it has besides, as lists in words; None if it has the same.
    """
    there = pq.read_schema(file).names
    missing = [name for name in ROW_SCHEMA.names if name not in there]
    besides = [name for name in there if name not in ROW_SCHEMA.names]
    return (_listed(missing), _listed(besides)) if missing or besides else None


def _made_rows(file: Path, there: Sequence[str]) -> str:
    if c.LOOPGATE_VERSION not in there:
        return ""
    made = set(pq.read_table(file, columns=[c.LOOPGATE_VERSION])[c.LOOPGATE_VERSION].to_pylist()) - {None}
    return ", ".join(sorted(made))


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    more = len(every) - _MOST_NAMES
    return ", ".join(every[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _unreadable(file: Path, error: Exception) -> ResultsError:
    what = "no such file" if isinstance(error, FileNotFoundError) else " ".join(str(error).split())
    return ResultsError(f"{file}: not a readable Parquet file ({what[:_MOST_CHARACTERS]})")
