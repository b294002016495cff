"""Load what runs and sweeps wrote, as tidy tables, in one line."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from loopgate.analysis.rows import read_run_row
from loopgate.errors import ResultsError
from loopgate.results import row_columns as c
from loopgate.results.row_schema import ROW_SCHEMA

__all__ = ["Results", "Run", "read_results", "read_run"]

_READ_TRIES = 3  # a sweep that is running may merge files between listing and reading them


@dataclass(frozen=True, slots=True)
class Run:
    """One run folder."""

    folder: Path
    summary: Mapping[str, Any]
    events: pd.DataFrame
    """`EVENT_COLUMNS`."""
    vehicles: pd.DataFrame
    """`VEHICLE_COLUMNS`."""
    edges: pd.DataFrame
    """`EDGE_COLUMNS`."""


@dataclass(frozen=True, slots=True)
class Results:
    """Many runs."""

    folder: Path
    runs: pd.DataFrame
    """One row per run, in the order of the keys; columns as in `results.row_columns`, and one for each
    further scenario key that varies."""
    edge_sets: Mapping[str, pd.DataFrame]
    """For each `EDGE_SET` its edges, in the order of the lists: `EDGE`, `EDGE_LENGTH` [m], `SHAPE`."""
    manifest: Mapping[str, Any] = field(default_factory=dict)
    """What the sweep consists of; empty for run folders without a sweep."""


def read_run(folder: Path | str) -> Run:
    """Load a run folder.

    Raises
    ------
    ResultsError
        If a file of it is missing or cannot be read.
    """
    folder = Path(folder)
    try:
        return Run(
            folder=folder,
            summary=json.loads((folder / "summary.json").read_text(encoding="utf-8")),
            events=pd.read_parquet(folder / "events.parquet"),
            vehicles=pd.read_parquet(folder / "vehicles.parquet"),
            edges=pd.read_parquet(folder / "edges.parquet"),
        )
    except (OSError, ValueError) as error:
        msg = f"{folder}: not a readable run folder ({' '.join(str(error).split())[:200]})"
        raise ResultsError(msg) from error


def read_results(folder: Path | str) -> Results:
    """Load the results of a sweep, also while it runs; or a run folder, or a folder of run folders.

    Raises
    ------
    ResultsError
        If it is none of these, or a file cannot be read.
    """
    folder = Path(folder)
    if (folder / "rows").is_dir():
        rows = _latest(_read_rows(folder / "rows"))
        edge_sets = {file.stem: _read(file) for file in sorted((folder / "edges").glob("*.parquet"))}
        manifest = folder / "sweep.json"
        known = json.loads(manifest.read_text(encoding="utf-8")) if manifest.is_file() else {}
        return Results(folder, _with_varying_keys(rows), edge_sets, known)
    runs = [folder] if (folder / "summary.json").is_file() else _run_folders(folder)
    if not runs:
        msg = f"{folder}: no results; expected rows/ (a sweep), summary.json (a run) or a folder of runs"
        raise ResultsError(msg)
    return _from_runs(folder, runs)


def _run_folders(folder: Path) -> list[Path]:
    return sorted(file.parent for file in folder.glob("*/summary.json"))


def _from_runs(folder: Path, runs: list[Path]) -> Results:
    rows, edge_sets = [], {}
    for run in runs:
        row, edges = read_run_row(run)
        rows.append({**row, c.KEY: run.name, c.ATTEMPT: 1})
        edge_sets[row[c.EDGE_SET]] = edges
    return Results(folder, pa.Table.from_pylist(rows, schema=ROW_SCHEMA).to_pandas(), edge_sets)


def _read_rows(folder: Path) -> pd.DataFrame:
    for left in reversed(range(_READ_TRIES)):
        files = sorted(folder.glob("*.parquet"))
        try:
            tables = [_read_table(file) for file in files]
            rows: pd.DataFrame = pa.concat_tables([ROW_SCHEMA.empty_table(), *tables]).to_pandas()
        except FileNotFoundError as error:
            if not left:
                msg = f"{folder}: its files change faster than they can be read; try again"
                raise ResultsError(msg) from error
            time.sleep(0.2)
        else:
            return rows
    raise AssertionError  # the loop returns or raises


def _read_table(file: Path) -> pa.Table:
    try:
        return pq.read_table(file, schema=ROW_SCHEMA)
    except FileNotFoundError:
        raise
    except (OSError, pa.ArrowInvalid) as error:
        msg = f"{file}: not a readable Parquet file ({' '.join(str(error).split())[:200]})"
        raise ResultsError(msg) from error


def _read(file: Path) -> pd.DataFrame:
    frame: pd.DataFrame = _read_edges(file).to_pandas()
    return frame


def _read_edges(file: Path) -> pa.Table:
    try:
        return pq.read_table(file)
    except (OSError, pa.ArrowInvalid) as error:
        msg = f"{file}: not a readable Parquet file ({' '.join(str(error).split())[:200]})"
        raise ResultsError(msg) from error


def _latest(rows: pd.DataFrame) -> pd.DataFrame:
    """Return one row per key: that of the latest attempt."""
    ordered = rows.sort_values([c.KEY, c.ATTEMPT], kind="stable")
    return ordered.drop_duplicates(c.KEY, keep="last").reset_index(drop=True)


def _with_varying_keys(rows: pd.DataFrame) -> pd.DataFrame:
    """Add a column for each scenario key that has no column yet and is not the same in all rows."""
    scenarios = [json.loads(text) if text else {} for text in rows[c.SCENARIO]]
    names = sorted({name for scenario in scenarios for name in scenario} - set(rows.columns))
    columns = {name: [scenario.get(name) for scenario in scenarios] for name in names}
    varying = {
        name: [str(v) if isinstance(v, list | dict) else v for v in values]
        for name, values in columns.items()
        if len({str(v) for v in values}) > 1
    }
    return rows.assign(**varying)
