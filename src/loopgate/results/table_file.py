"""Reading the Parquet tables of runs and sweeps: a damaged file is refused, and so is one of another kind."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from loopgate.errors import ResultsError
from loopgate.reading import refusing
from loopgate.results import columns as run
from loopgate.results import row_columns as c
from loopgate.results.row_schema import ROW_SCHEMA

__all__ = ["NO_PARQUET", "check_columns_of", "check_sizes_of", "read_rows", "read_table"]

NO_PARQUET = "not a readable Parquet file"
_LARGEST = 1e15

_TEXTS = {run.VEHICLE, run.EVENT, run.PLACE, run.REASON, run.STAGE, run.LOOP, run.EDGE, run.SHAPE}
_NUMBERS = {*run.EVENT_COLUMNS, *run.VEHICLE_COLUMNS, *run.EDGE_COLUMNS} - _TEXTS


def read_table(
    file: Path,
    needed: Iterable[str],
    *,
    columns: Collection[str] | None = None,
    filters: list[tuple[str, str, list[str]]] | None = None,
) -> pa.Table:
    """Read a table of a run.

    Parameters
    ----------
    file
        The Parquet file.
    needed
        Columns that it must have.
    columns, filters
        What to read of it, as pyarrow understands it; default: all.

    Raises
    ------
    ResultsError
        If it cannot be read, is damaged, lacks a column, or holds texts for numbers.
    """
    with refusing(file, "table", ResultsError, wrong=NO_PARQUET):
        with pq.ParquetFile(file) as opened:
            check_columns_of(opened.schema_arrow, needed, file)
        table = pq.read_table(file, columns=None if columns is None else list(columns), filters=filters)
        return _whole(table)


def read_rows(file: Path) -> pa.Table:
    """Read rows of a results table, `ROW_SCHEMA`.

    Raises
    ------
    ResultsError
        If it cannot be read, is damaged, or a row has no key or attempt; the text says how to go on.
    """
    wrong = f"{NO_PARQUET}; remove it and run the same sweep again: its rows will be made anew"
    with refusing(file, "table", ResultsError, wrong=wrong):
        table = _whole(pq.read_table(file, schema=ROW_SCHEMA))
        for name in (c.KEY, c.ATTEMPT):
            if table[name].null_count:
                msg = f"{file}: a row has no {name}; remove the file and run the same sweep again"
                raise ResultsError(msg)
        check_sizes_of(table, file)
        return table


def check_sizes_of(rows: pa.Table, file: Path) -> None:
    """Refuse rows with numbers that no run has, whose squares and sums would be none."""
    for field in rows.schema:
        if not (pa.types.is_floating(field.type) or pa.types.is_integer(field.type)):
            continue
        ends = pc.min_max(rows[field.name]).as_py()
        if any(end is not None and abs(end) > _LARGEST for end in ends.values()):
            msg = f"{file}: {field.name} runs from {ends['min']:g} to {ends['max']:g}; no run has that"
            raise ResultsError(msg)


def check_columns_of(schema: pa.Schema, needed: Iterable[str], file: Path) -> None:
    """Refuse a table that lacks a column, or holds texts for numbers or numbers for texts."""
    missing = [name for name in needed if name not in schema.names]
    if missing:
        msg = f"{file}: the column {missing[0]} is missing; it has {', '.join(schema.names) or 'none'}"
        raise ResultsError(msg)
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
    """Return a table without what pandas has written about it, which may be damaged and is not needed."""
    table.validate(full=True)  # pandas would read beyond the end of a column that is damaged
    return table.replace_schema_metadata(None)
