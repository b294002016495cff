"""Results of several folders as one table, and the report on them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner

from loopgate.analysis import add_series
from loopgate.cli.main import cli
from loopgate.errors import ResultsError
from loopgate.runs.results import read_results
from loopgate.sweep import Sweep, run_sweep

RUNNER = f"{Path(__file__).parents[1] / 'sweep' / 'fake_runner.py'}:run"


@pytest.fixture
def swept(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that sweeps a grid into a folder of that name."""

    def sweep(name: str, grid: dict[str, Sequence[Any]], **base: object) -> Path:
        described = Sweep(name, {"network": "sumo:DRT", "vehicles": 10, "duration_s": 400, **base}, grid)
        with ThreadPoolExecutor(1) as pool:
            run_sweep(described, tmp_path / name, executor=pool, runner=RUNNER)
        return tmp_path / name

    return sweep


def test_more_seeds_from_elsewhere(swept: Callable[..., Path]) -> None:
    """Two sweeps over different seeds are one table; a run that both made counts once, and that is said."""
    one, two = swept("a", {"seed": [1, 2]}), swept("b", {"seed": [2, 3]})
    results = read_results([one, two])
    assert sorted(results.runs["seed"]) == [1, 2, 3]
    assert results.folders == (one, two)
    assert results.name == "a, b"
    assert results.manifest["runs"] == 3
    assert results.notes == ("1 runs are in more than one folder, made by the same code; they count once",)
    assert "results" not in results.runs
    assert set(results.runs["edge_set"]) <= set(results.edge_sets)


def test_what_varies_between_folders_is_a_column(swept: Callable[..., Path]) -> None:
    """In each of them it is the same in all rows, and so is no column there."""
    one, two = swept("a", {"seed": [1]}, rho_m=1.5), swept("b", {"seed": [1]}, rho_m=2.0)
    assert "rho_m" not in read_results(one).runs
    assert sorted(read_results([one, two]).runs["rho_m"]) == [1.5, 2.0]


def test_before_and_after_a_change_of_the_code(swept: Callable[..., Path], tmp_path: Path) -> None:
    """The same runs by different codes both stay, told apart by where they come from, in the report too."""
    one = swept("a", {"seed": [1, 2]})
    two = tmp_path / "b"
    shutil.copytree(one, two)
    for file in (two / "rows").glob("*.parquet"):
        pd.read_parquet(file).assign(loopgate_code="other").to_parquet(file, index=False)
    runs = read_results([one, two]).runs
    assert sorted(runs["results"]) == [str(one)] * 2 + [str(two)] * 2
    assert sorted(add_series(runs)["series"].unique()) == [
        f"SUMO's rules, results {one}",
        f"SUMO's rules, results {two}",
    ]


def test_no_folder_at_all() -> None:
    """An empty list is no question."""
    with pytest.raises(ResultsError, match="no folder of results; give at least one"):
        read_results([])


def test_a_report_on_several_folders(swept: Callable[..., Path]) -> None:
    """The page goes into the first, and shows how to load and to repeat."""
    one, two = swept("a", {"seed": [1]}), swept("b", {"seed": [2]})
    ended = CliRunner().invoke(cli, ["report", str(one), str(two)])
    assert ended.exit_code == 0, ended.output
    text = (one / "report.html").read_text(encoding="utf-8")
    assert "2 runs, none failed." in text
    assert f"loopgate report {one} {two} -o {one / 'report.html'}" in text
