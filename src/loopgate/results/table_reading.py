"""Reads the Parquet tables of runs and sweeps, also of other versions of loopgate.

A damaged file is refused, and so is one that lacks what the reader needs or holds something else. What only
newer versions write is not known of older results.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from loopgate.errors import ResultsError
from loopgate.reading import listed, read_object, refusing
from loopgate.results import columns as c
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.versions import versions

_FORMULA = ("=", "+", "-", "@")
"""Begins what a spreadsheet computes, or hides from its reader."""
_FIGURES = frozenset("0123456789.,+-eE ")
"""A text of nothing else calls no function: shapes of streets, and edges named by numbers below zero."""


def plain(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with texts for lists, as every format can hold it."""
    lists = {
        name: table[name].map(lambda values: " ".join(map(str, values)), na_action="ignore")
        for name in table.columns
        if table[name].dtype == object and any(isinstance(value, np.ndarray) for value in table[name])
    }
    return table.assign(**lists)


def csv_of(table: pd.DataFrame) -> str:
    """Return the table as CSV that no spreadsheet takes for formulas.

    A text that begins as a formula does (``=``, ``+``, ``-``, ``@``, behind blanks too, or a tab) gets an
    apostrophe before it, unless it holds figures alone, as the shapes of streets do. Names of streets and
    files often begin so; the Parquet files hold these names as they are.
    """
    simple = plain(table)
    texts = {
        name: simple[name].map(_no_formula)
        for name in simple.columns
        if not pd.api.types.is_numeric_dtype(simple[name])
    }
    return str(simple.assign(**texts).rename(columns=_no_formula).to_csv(index=False))


def _no_formula(value: object) -> object:
    if not isinstance(value, str):
        return value
    text = value.replace("\r", " ")  # a reader may take the rest for a row of its own
    if _FIGURES.issuperset(text):
        return text
    return f"'{text}" if text.lstrip().startswith(_FORMULA) or text.startswith("\t") else text


NO_PARQUET = "not a readable Parquet file"

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

_AGAIN = "make it again"
_ROWS_AGAIN = "remove it and run the same sweep again to make its rows anew"

_TEXTS = {c.VEHICLE, c.EVENT, c.PLACE, c.REASON, c.STAGE}
_TEXTS |= {c.LOOP, c.EDGE, c.TO_EDGE, c.SHAPE, c.JUNCTION, c.MOVEMENT, c.SERVICE_LEVEL, c.STOP}
_NUMBERS = {
    *c.EVENT_COLUMNS,
    *c.VEHICLE_COLUMNS,
    *c.EDGE_COLUMNS,
    *c.JUNCTION_COLUMNS,
    *c.STOP_COLUMNS,
    c.STOOD,
    c.STILL,
    c.EDGE_BEGIN,
}
_NUMBERS -= _TEXTS

_LARGEST = 1e15
_MOST_NAMES = 4


def read_summary(folder: Path) -> dict[str, Any]:
    """Return the content of a run's ``summary.json``.

    Raises `ResultsError` if the folder is no run folder, or the file cannot be read.
    """
    file = folder / "summary.json"
    if folder.is_dir() and not file.exists():
        msg = f"{folder}: no run in it (no summary.json); expected the folder that loopgate run -o made"
        raise ResultsError(msg)
    return read_object(file, "summary of a run", ResultsError)


class Rows(NamedTuple):
    """Rows of a sweep, and the difference between their columns and the columns of this version."""

    table: pa.Table
    """`ROW_SCHEMA`, or some of its columns."""
    missing: str
    besides: str
    """`missing` and `besides`: the columns that the file lacks, and those that it has besides; empty if
    none."""


def maker(summary: Mapping[str, Any]) -> str:
    """Return the version of loopgate that made a run, from its summary; empty if it does not say."""
    named = summary.get("versions")
    return str(named.get("loopgate", "")) if isinstance(named, Mapping) else ""


def lacks(
    file: Path, missing: Iterable[str], made_by: str, *, what: str = "column", again: str = _AGAIN
) -> ResultsError:
    """Return the error that names the missing part of a file, its writer, and the way out."""
    ours = versions()["loopgate"]
    msg = f"{file}: it has no {what} {listed(missing, _MOST_NAMES)}"
    if made_by in {"", ours}:
        return ResultsError(f"{msg}, which loopgate {ours} expects; {again}")
    return ResultsError(f"{msg}: loopgate {made_by} made it, this is {ours}; {again}, or use {made_by}")


def read_table(
    file: Path,
    wanted: Sequence[str],
    *,
    made_by: str,
    only: bool = False,
    filters: list[tuple[str, str, list[str]]] | None = None,
) -> pd.DataFrame:
    """Read a table of a run.

    Raises `ResultsError` if it cannot be read, is damaged, lacks one of these columns, or holds texts for
    numbers.

    Parameters
    ----------
    wanted
        Columns that it must have.
    made_by
        The version of loopgate that made it, as far as known.
    only
        Whether to leave out all other columns.
    filters
        Which rows to read, as pyarrow takes it.
    """
    with refusing(file, "table", ResultsError, wrong=NO_PARQUET):
        check_columns(pq.read_schema(file), wanted, file, made_by)
        table = pq.read_table(file, columns=list(wanted) if only else None, filters=filters)
        frame: pd.DataFrame = _whole(table).to_pandas()
        return frame


def read_rows(file: Path, columns: Collection[str] | None = None) -> Rows:
    """Read a file of rows of a sweep; columns that only newer versions write are null.

    Raises `ResultsError` if it cannot be read, is damaged, lacks a column without which rows say nothing, or
    a row has no key or attempt; the text says how to go on. Its cause is a FileNotFoundError if the file is
    gone: a sweep that runs may just have merged it.

    Parameters
    ----------
    columns
        Which to read; default: all.
    """
    with refusing(file, "table", ResultsError, wrong=f"{NO_PARQUET}; {_ROWS_AGAIN}"):
        there = pq.read_schema(file).names
        lacking = [name for name in _NEEDED if name not in there]
        if lacking:
            raise lacks(file, lacking, _made_rows(file, there), again=_ROWS_AGAIN)
        table = pq.read_table(file, schema=ROW_SCHEMA, columns=None if columns is None else list(columns))
        table = _whole(table)
        for name in {c.KEY, c.ATTEMPT}.intersection(table.column_names):
            if table[name].null_count:
                msg = f"{file}: a row has no {name}; {_ROWS_AGAIN}"
                raise ResultsError(msg)
        check_sizes(table, file)
        missing = [name for name in ROW_SCHEMA.names if name not in there]
        besides = [name for name in there if name not in ROW_SCHEMA.names]
        return Rows(table, listed(missing, _MOST_NAMES), listed(besides, _MOST_NAMES))


def check_sizes(rows: pa.Table, file: Path) -> None:
    """Refuse rows with numbers that no run has: their squares and sums would not be finite."""
    for field in rows.schema:
        if not (pa.types.is_floating(field.type) or pa.types.is_integer(field.type)):
            continue
        ends = pc.min_max(rows[field.name]).as_py()
        if any(end is not None and abs(end) > _LARGEST for end in ends.values()):
            msg = f"{file}: {field.name} runs from {ends['min']:g} to {ends['max']:g}; no run has that"
            raise ResultsError(msg)


def check_columns(schema: pa.Schema, wanted: Iterable[str], file: Path, made_by: str = "") -> None:
    """Refuse a table of a run that lacks a column or has a column of the wrong type."""
    missing = [name for name in wanted if name not in schema.names]
    if missing:
        raise lacks(file, missing, made_by)
    for field in schema:
        kind = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
        if pa.types.is_null(kind):  # a column without rows
            continue
        text = pa.types.is_string(kind) or pa.types.is_large_string(kind)
        number = pa.types.is_floating(kind) or pa.types.is_integer(kind)
        if (field.name in _TEXTS and not text) or (field.name in _NUMBERS and not number):
            expected = "texts" if field.name in _TEXTS else "numbers"
            msg = f"{file}: the column {field.name} holds {kind}; expected {expected}"
            raise ResultsError(msg)


def _whole(table: pa.Table) -> pa.Table:
    """Return a table without the metadata of pandas, which may be damaged."""
    table.validate(full=True)  # pandas would read beyond the end of a column that is damaged
    return table.replace_schema_metadata(None)


def _made_rows(file: Path, there: Sequence[str]) -> str:
    if c.LOOPGATE_VERSION not in there:
        return ""
    column = _whole(pq.read_table(file, columns=[c.LOOPGATE_VERSION]))[c.LOOPGATE_VERSION]
    return ", ".join(sorted({str(made) for made in column.to_pylist() if made is not None}))
