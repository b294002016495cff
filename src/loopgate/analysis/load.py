"""Load what runs and sweeps wrote, as tidy tables, in one line."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from loopgate.analysis.rows import read_run_row, read_summary
from loopgate.errors import ResultsError
from loopgate.results import columns as run
from loopgate.results import row_columns as c
from loopgate.results.reading import maker, other_columns, read_rows, read_table
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
    notes: tuple[str, ...] = ()
    """What to know of rows that another version of loopgate made."""


def read_run(folder: Path | str) -> Run:
    """Load a run folder.

    Raises
    ------
    ResultsError
        If a file of it is missing, cannot be read, or lacks a column.
    """
    folder = Path(folder)
    summary = read_summary(folder)
    made_by = maker(summary)
    events = read_table(folder / "events.parquet", run.EVENT_COLUMNS[:5], made_by=made_by)
    if run.STAGE not in events:  # there were no stages once
        events[run.STAGE] = ""
    return Run(
        folder=folder,
        summary=summary,
        events=events,
        vehicles=read_table(folder / "vehicles.parquet", run.VEHICLE_COLUMNS, made_by=made_by),
        edges=read_table(folder / "edges.parquet", run.EDGE_COLUMNS, made_by=made_by),
    )


def read_results(folder: Path | str) -> Results:
    """Load the results of a sweep, also while it runs; or a run folder, or a folder of run folders.

    Raises
    ------
    ResultsError
        If it is none of these, a file cannot be read, or lacks what the analysis cannot do without.
    """
    folder = Path(folder)
    if (folder / "rows").is_dir():
        rows, notes = _read_rows(folder / "rows")
        named = (run.EDGE, run.EDGE_LENGTH, run.SHAPE)
        edge_sets = {
            file.stem: read_table(file, named, made_by="")
            for file in sorted((folder / "edges").glob("*.parquet"))
        }
        return Results(
            folder, _with_varying_keys(_latest(rows)), edge_sets, _manifest(folder / "sweep.json"), notes
        )
    runs = [folder] if (folder / "summary.json").is_file() else _run_folders(folder)
    if not runs:
        msg = f"{folder}: no results; expected rows/ (a sweep), summary.json (a run) or a folder of runs"
        raise ResultsError(msg)
    return _from_runs(folder, runs)


def _run_folders(folder: Path) -> list[Path]:
    return sorted(file.parent for file in folder.glob("*/summary.json"))


def _from_runs(folder: Path, runs: list[Path]) -> Results:
    rows, edge_sets = [], {}
    for one in runs:
        row, edges = read_run_row(one)
        rows.append({**row, c.KEY: one.name, c.ATTEMPT: 1})
        edge_sets[row[c.EDGE_SET]] = edges
    return Results(folder, pa.Table.from_pylist(rows, schema=ROW_SCHEMA).to_pandas(), edge_sets)


def _read_rows(folder: Path) -> tuple[pd.DataFrame, tuple[str, ...]]:
    for left in reversed(range(_READ_TRIES)):
        files = sorted(folder.glob("*.parquet"))
        try:
            tables = [read_rows(file) for file in files]
            others = [other for file in files if (other := other_columns(file))]
            rows: pd.DataFrame = pa.concat_tables([ROW_SCHEMA.empty_table(), *tables]).to_pandas()
        except FileNotFoundError as error:
            if not left:
                msg = f"{folder}: its files change faster than they can be read; try again"
                raise ResultsError(msg) from error
            time.sleep(0.2)
        else:
            return rows, tuple(_notes(folder, others))
    raise AssertionError  # the loop returns or raises


def _notes(folder: Path, others: list[tuple[str, str]]) -> Iterator[str]:
    missing, besides = (Counter(one[which] for one in others if one[which]) for which in (0, 1))
    for names, files in missing.items():
        yield f"{folder}: another version made {files} files, without {names}: not known of those runs"
    for names, files in besides.items():
        yield f"{folder}: another version made {files} files, with more columns, not read: {names}"


def _manifest(file: Path) -> Mapping[str, Any]:
    if not file.is_file():
        return {}
    try:
        known = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        msg = f"{file}: not a readable description of a sweep ({' '.join(str(error).split())[:200]})"
        raise ResultsError(msg) from error
    if not isinstance(known, dict):
        msg = f"{file}: not a description of a sweep; expected a JSON object"
        raise ResultsError(msg)
    return known


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
