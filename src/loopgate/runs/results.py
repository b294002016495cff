"""Many runs as one table, from sweeps and run folders."""

import json
import time
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from loopgate.analysis.rows import read_run_row
from loopgate.errors import ResultsError
from loopgate.reading import as_path, counted, listed, read_object, refusing, shown
from loopgate.results import columns as c
from loopgate.results.columns import SERIES
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.results.table_reading import Rows, check_sizes, read_rows, read_table

_READ_TRIES = 3  # a sweep that is running may merge files between listing and reading them


_ORDER = (c.NETWORK, c.GATE, c.ABSTRACTION, c.NEGOTIATION, c.LIGHTS, c.VEHICLES, c.SEED, c.SCENARIO, c.KEY)
"""Sorts runs as a reader looks for one; keys of sweeps are hashes."""


@dataclass(frozen=True, slots=True)
class Results:
    """The results of many runs, as tables.

    Examples
    --------
    >>> from loopgate import Scenario, read_results, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml", "gate": "open"}
    >>> made = [run(Scenario(**roads, seed=n, duration_s=60), f"many/seed{n}") for n in (1, 2)]
    >>> results = read_results("many")
    >>> results.runs[["seed", "outcome"]].values.tolist()
    [[1, 'done'], [2, 'done']]
    >>> int(results.read_flow(results.runs)["vehicles"].max())
    5
    """

    folders: tuple[Path, ...]
    """The folders from which the results were read."""
    runs: pd.DataFrame
    """One row per run, sorted by network, gate, settings, vehicles and seed; columns as in
    `results.columns`, and one for each further scenario key that varies."""
    edge_sets: Mapping[str, pd.DataFrame]
    """For each `EDGE_SET` its edges, in the order of the lists: `EDGE`, `EDGE_LENGTH` [m], `SHAPE`."""
    manifest: Mapping[str, Any] = field(default_factory=dict)
    """The description of the sweep; empty for run folders without a sweep."""
    notes: tuple[str, ...] = ()
    """Remarks on rows from another version of loopgate, and on repeated rows."""
    run_folders: Mapping[str, Path] = field(default_factory=dict)
    """The run folder for each run key; runs of a sweep have none unless they were kept."""

    def __repr__(self) -> str:
        return f"<Results: {counted(len(self.runs), 'run')} of {listed(map(str, self.folders))}>"

    @property
    def name(self) -> str:
        """The name of the sweep, or the names of the folders that were read."""
        return str(self.manifest.get("name") or ", ".join(folder.name for folder in self.folders))

    def read_flow(self, runs: pd.DataFrame) -> pd.DataFrame:
        """Read the measurements over time of all `runs` that still have a run folder.

        Columns: `FLOW_COLUMNS`, and of `runs` the columns `KEY` and `SERIES`.
        """
        series = runs[SERIES] if SERIES in runs else runs[c.GATE]
        parts = [
            read_table(file, c.FLOW_COLUMNS, made_by="").assign(**{c.KEY: key, SERIES: name})
            for key, name in zip(runs[c.KEY], series, strict=True)
            if key in self.run_folders and (file := self.run_folders[key] / "flow.parquet").is_file()
        ]
        return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(c.FLOW_COLUMNS))


def read_results(folder: Path | str | Sequence[Path | str]) -> Results:
    """Read the results of a sweep (complete or not), a run folder, or a folder of run folders.

    Several folders become one table. A run that is in several folders counts once if the same version of
    loopgate made it; otherwise a column `FOLDER` names the folder of each row.

    Raises `ResultsError` if a folder holds no results, or a file cannot be read or lacks a needed column.

    Examples
    --------
    >>> from loopgate import Scenario, read_results, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml", "gate": "open"}
    >>> made = [run(Scenario(**roads, seed=n, duration_s=60), f"out/seed{n}") for n in (1, 2)]
    >>> read_results("out").runs[["gate", "vehicles", "seed"]].values.tolist()
    [['open', 5, 1], ['open', 5, 2]]
    >>> len(read_results(["out/seed1", "out/seed2"]).runs)
    2
    """
    if isinstance(folder, Path | str):
        return _read(Path(folder))
    given: object = folder
    if given is not None and not isinstance(given, Collection):
        msg = f"folder of results is {shown(given)}; expected a path, or several in a list"
        raise ResultsError(msg)
    if not folder:
        msg = "no folder of results; give at least one"
        raise ResultsError(msg)
    parts = [_read(as_path(one, "folder of results", ResultsError)) for one in folder]
    return parts[0] if len(parts) == 1 else _together(parts)


def _read(folder: Path) -> Results:
    with refusing(folder, "folder of results", ResultsError):
        if (folder / "rows").is_dir():
            return _from_rows(folder)
        alone = (folder / "summary.json").is_file()
        runs = [folder] if alone else sorted(file.parent for file in folder.glob("*/summary.json"))
        if not runs:
            msg = f"{folder}: no results; expected rows/ (a sweep), summary.json (a run) or a folder of runs"
            raise ResultsError(msg)
        return _from_runs(folder, runs)


def _together(parts: Sequence[Results]) -> Results:
    folders = tuple(folder for part in parts for folder in part.folders)
    known = [part.runs[list(ROW_SCHEMA.names)].assign(**{c.FOLDER: str(part.folders[0])}) for part in parts]
    every = _with_varying_keys(pd.concat(known, ignore_index=True), folders[0])
    # The key of a run folder is its path: the same run only if it is the same folder.
    twins = every.duplicated([c.KEY, c.STATUS, c.LOOPGATE_CODE, c.SUMO_VERSION], keep="last")
    runs = every.drop(index=twins.index[twins]).reset_index(drop=True)
    if not runs.duplicated(c.KEY).any():
        runs = runs.drop(columns=c.FOLDER)
    count = int(twins.sum())
    notes = [note for part in parts for note in part.notes]
    notes += (
        [f"{count} runs are in more than one folder, made by the same code; they count once"] if count else []
    )
    planned = sum(int(p.manifest.get("runs", len(p.runs))) for p in parts) - count
    return Results(
        folders,
        runs,
        {name: edges for part in parts for name, edges in part.edge_sets.items()},
        {"runs": planned},
        tuple(notes),
        {key: folder for part in parts for key, folder in part.run_folders.items()},
    )


def _from_rows(folder: Path) -> Results:
    files = _read_rows(folder / "rows")
    tables = [one.table for one in files]
    rows: pd.DataFrame = pa.concat_tables([ROW_SCHEMA.empty_table(), *tables]).to_pandas()
    edge_sets = {
        file.stem: read_table(file, (c.EDGE, c.EDGE_LENGTH, c.SHAPE), made_by="")
        for file in sorted((folder / "edges").glob("*.parquet"))
    }
    manifest = folder / "sweep.json"
    known = read_object(manifest, "description of a sweep", ResultsError) if manifest.is_file() else {}
    notes = tuple(_notes(folder / "rows", files))
    latest = rows.sort_values([c.KEY, c.ATTEMPT], kind="stable").drop_duplicates(c.KEY, keep="last")
    runs = _with_varying_keys(latest.reset_index(drop=True), folder / "rows")
    return Results((folder,), runs, edge_sets, known, notes)


def _from_runs(folder: Path, runs: list[Path]) -> Results:
    rows, edge_sets = [], {}
    for one in runs:
        row, edges = read_run_row(one)
        rows.append({**row, c.KEY: str(one), c.ATTEMPT: 1})
        edge_sets[row[c.EDGE_SET]] = edges
    table = pa.Table.from_pylist(rows, schema=ROW_SCHEMA)
    check_sizes(table, folder)
    known = {str(one): one for one in runs}
    return Results((folder,), _with_varying_keys(table.to_pandas(), folder), edge_sets, run_folders=known)


def _read_rows(folder: Path) -> list[Rows]:
    for left in reversed(range(_READ_TRIES)):
        files = sorted(folder.glob("*.parquet"))
        try:
            return [read_rows(file) for file in files]
        except ResultsError as error:
            if not isinstance(error.__cause__, FileNotFoundError):
                raise
            if not left:
                msg = f"{folder}: its files change faster than they can be read; try again"
                raise ResultsError(msg) from error
            time.sleep(0.2)
    raise AssertionError  # the loop returns or raises


def _notes(folder: Path, files: Sequence[Rows]) -> Iterator[str]:
    for names, count in Counter(rows.missing for rows in files if rows.missing).items():
        yield f"{folder}: another version made {count} files, without {names}: not known of those runs"
    for names, count in Counter(rows.besides for rows in files if rows.besides).items():
        yield f"{folder}: another version made {count} files, with more columns, not read: {names}"


def _with_varying_keys(rows: pd.DataFrame, folder: Path) -> pd.DataFrame:
    """Add a column for each scenario key that has none yet and varies between the rows; sort the rows."""
    scenarios = [
        _scenario(text, f"{folder}: row {key}") if text else {}
        for key, text in zip(rows[c.KEY], rows[c.SCENARIO], strict=True)
    ]
    names = sorted({name for scenario in scenarios for name in scenario} - set(rows.columns))
    columns = {name: [scenario.get(name) for scenario in scenarios] for name in names}
    varying = {
        name: [str(v) if isinstance(v, list | dict) else v for v in values]
        for name, values in columns.items()
        if len({str(v) for v in values}) > 1
    }
    known = rows.assign(**{name: pd.Series(values, index=rows.index) for name, values in varying.items()})
    return known.sort_values(list(_ORDER), kind="stable", ignore_index=True)


def _scenario(text: str, what: str) -> dict[str, Any]:
    with refusing(what, "scenario", ResultsError):
        scenario = json.loads(text)
    if isinstance(scenario, dict):
        return scenario
    msg = f"{what}: its scenario is {shown(scenario)}; expected a JSON object"
    raise ResultsError(msg)
