"""Results that another version made, or that lack something: said in one line, or noted."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest

from loopgate.errors import ResultsError
from loopgate.report.page import write_report
from loopgate.results.columns import EDGE_COLUMNS, EVENT_COLUMNS, VEHICLE_COLUMNS
from loopgate.results.figures import summary_rows
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.runs.results import read_results
from loopgate.runs.run import read_run
from loopgate.sweep import Sweep, run_sweep
from loopgate.sweep.execution import Store

RUNNER = f"{Path(__file__).parents[1] / 'sweep' / 'fake_runner.py'}:run"


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return a results folder with two rows in one file, and its two run folders."""
    sweep = Sweep("s", {"duration_s": 100}, {"vehicles": [5, 6]})
    with ThreadPoolExecutor(1) as pool:
        run_sweep(sweep, tmp_path, executor=pool, runner=RUNNER, keep_runs=True)
    return tmp_path


@pytest.fixture
def folder(results: Path) -> Path:
    """Return a run folder that version 0.0.7 made."""
    run = next((results / "runs").iterdir())
    vehicles = pd.DataFrame({name: ["v" if name in {"vehicle", "loop"} else 1.0] for name in VEHICLE_COLUMNS})
    vehicles.to_parquet(run / "vehicles.parquet")
    change(run / "summary.json", versions={"loopgate": "0.0.7"})
    return run


def change(file: Path, *drop: str, **entries: object) -> None:
    """Change entries of a JSON file, and drop some."""
    data: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    data = {key: value for key, value in (data | entries).items() if key not in drop}
    file.write_text(json.dumps(data), encoding="utf-8")


def drop(file: Path, *columns: str) -> None:
    """Take columns out of a table."""
    pd.read_parquet(file).drop(columns=list(columns)).to_parquet(file)


@pytest.mark.parametrize(
    ("name", "column"),
    [
        *(("events.parquet", column) for column in EVENT_COLUMNS[:5]),
        ("vehicles.parquet", "standing_s"),
        ("edges.parquet", "worst_idleness_s"),
    ],
)
def test_a_run_without_a_column(folder: Path, name: str, column: str) -> None:
    """File, column, the version that made it, and what to do."""
    drop(folder / name, column)
    words = rf"{name}: it has no column {column}: loopgate 0\.0\.7 made it, this is .*; make it again, or use"
    with pytest.raises(ResultsError, match=words):
        read_run(folder)


@pytest.mark.parametrize(("name", "column"), [("events.parquet", "place"), ("edges.parquet", "idleness_s")])
def test_a_report_on_a_run_without_a_column(folder: Path, name: str, column: str) -> None:
    """The same line; of runs that do not say who made them, that this version expects it."""
    change(folder / "summary.json", "versions")
    drop(folder / name, column)
    with pytest.raises(ResultsError, match=rf"{name}: it has no column {column}, which loopgate .* expects"):
        read_results(folder)


def test_a_run_without_stages_is_one_of_before_there_were_any(folder: Path) -> None:
    """They are empty, as `read_events` has it."""
    assert "stage" not in pd.read_parquet(folder / "events.parquet")
    assert set(read_run(folder).events["stage"]) == {""}
    assert set(EDGE_COLUMNS) <= set(read_run(folder).edges)


def test_a_summary_without_a_figure(folder: Path) -> None:
    """Without those that every row has; what is no summary at all is named as well."""
    change(folder / "summary.json", "laps", "duration_s")
    with pytest.raises(
        ResultsError, match=r"summary\.json: it has no figure duration_s, laps: loopgate 0\.0"
    ):
        read_results(folder)
    (folder / "summary.json").write_text("[]", encoding="utf-8")
    with pytest.raises(ResultsError, match=r"summary\.json: no summary of a run"):
        read_results(folder)


def test_rows_without_what_every_row_has(results: Path) -> None:
    """Reading and going on are refused alike."""
    (file,) = (results / "rows").iterdir()
    rows = pq.read_table(file)
    maker = rows.column_names.index("loopgate_version")
    rows = rows.set_column(maker, "loopgate_version", [["0.0.7", "0.0.8"]])
    pq.write_table(rows.drop_columns(["laps"]), file)
    words = r"\.parquet: it has no column laps: loopgate 0\.0\.7, 0\.0\.8 made it"
    with pytest.raises(ResultsError, match=words):
        read_results(results)
    with pytest.raises(ResultsError, match=words + ".*remove it and run the same sweep again"):
        Store(results)


def test_rows_without_a_newer_column_are_read_and_it_is_said(results: Path) -> None:
    """What was never measured is not known; no silence, and no refusal."""
    assert read_results(results).notes == ()
    (file,) = (results / "rows").iterdir()
    pq.write_table(pq.read_table(file).drop_columns(["worst_idleness_s", "coverage_edges"]), file)
    loaded = read_results(results)
    assert loaded.runs["worst_idleness_s"].isna().all()
    (note,) = loaded.notes
    assert "another version made 1 files, without worst_idleness_s, coverage_edges" in note
    with Store(results) as store:
        assert len(store) == 2


def test_rows_of_a_newer_version_are_read_but_not_written_to(results: Path) -> None:
    """A merge would lose what this version does not know."""
    (file,) = (results / "rows").iterdir()
    rows = pq.read_table(file)
    pq.write_table(rows.append_column("beauty", [[1.0] * len(rows)]), file)
    (note,) = read_results(results).notes
    assert "more columns, not read: beauty" in note
    with pytest.raises(ResultsError, match=r"columns that this one does not know \(beauty\)"):
        Store(results)


def test_a_column_of_another_type(results: Path) -> None:
    """One line, no traceback of a library."""
    (file,) = (results / "rows").iterdir()
    rows = pq.read_table(file)
    pq.write_table(rows.set_column(ROW_SCHEMA.get_field_index("laps"), "laps", [[[1]] * len(rows)]), file)
    with pytest.raises(ResultsError, match=r"\.parquet: not a readable Parquet file"):
        read_results(results)


@pytest.mark.parametrize("text", ["{", "[]"])
def test_a_broken_description_of_a_sweep(results: Path, text: str) -> None:
    """Named as such."""
    (results / "sweep.json").write_text(text, encoding="utf-8")
    with pytest.raises(ResultsError, match=r"sweep\.json: (not a JSON file|no description)"):
        read_results(results)


def test_edges_without_a_column(results: Path) -> None:
    """The table that rows refer to."""
    (file, *_) = (results / "edges").iterdir()
    drop(file, "shape")
    with pytest.raises(ResultsError, match=r"edges/.*\.parquet: it has no column shape"):
        read_results(results)


def test_runs_are_in_the_order_of_their_settings(tmp_path: Path) -> None:
    """By gate, vehicles and seed, of a sweep and of run folders; their keys are hashes and paths."""
    grid: dict[str, list[Any]] = {"seed": [2, 10], "vehicles": [40, 5], "gate": ["open", "certified"]}
    with ThreadPoolExecutor(1) as pool:
        sweep = Sweep("s", {"duration_s": 100}, grid)
        run_sweep(sweep, tmp_path, executor=pool, runner=RUNNER, keep_runs=True)
    wanted = [[g, v, s] for g in ("certified", "open") for v in (5, 40) for s in (2, 10)]
    for folder in (tmp_path, tmp_path / "runs"):
        assert read_results(folder).runs[["gate", "vehicles", "seed"]].to_numpy().tolist() == wanted


STRANGE: tuple[tuple[str, object, bool], ...] = (
    ("duration_s", "long", True),
    ("laps", "x", True),
    ("deadlocks", [3], True),
    ("refusals", {"occupied": "x"}, True),
    ("decision_us", None, False),
    ("wall_s", 3, False),
)
"""Figures that no run has, and whether a row of the run needs them."""


@pytest.mark.parametrize(("name", "value", "needed"), STRANGE)
def test_figures_that_no_run_has(name: str, value: object, *, needed: bool, folder: Path) -> None:
    """Words, figures and rows are refused in one line that names the file; a row does without some."""
    change(folder / "summary.json", **{name: value})
    one = read_run(folder)
    with pytest.raises(
        ResultsError, match=r"^summary.json: it holds what no run has, or another version made it"
    ):
        summary_rows(one.summary)
    assert one._repr_html_() is None
    for use in (lambda: one.figures, lambda: read_results(folder)):
        if needed:
            with pytest.raises(ResultsError) as caught:
                use()
            assert str(folder) in str(caught.value)
            assert "\n" not in str(caught.value)
        else:
            use()


def test_a_report_on_what_no_run_has(results: Path) -> None:
    """The folder is named, whatever the analysis stumbles on."""
    read = read_results(results)
    spoiled = replace(read, runs=read.runs.assign(km_per_h="fast"))
    with pytest.raises(ResultsError) as caught:
        write_report(spoiled, results / "page.html")
    assert str(caught.value).startswith(f"{results}: ")
    assert "what no run has" in str(caught.value)
