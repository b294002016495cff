"""Results folders of every kind, made by the runner without SUMO."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from loopgate.report.page import write_report
from loopgate.runs.results import Results, read_results
from loopgate.sweep import Sweep, run_sweep

RUNNER = f"{Path(__file__).parents[1] / 'sweep' / 'fake_runner.py'}:run"
FULL: dict[str, list[Any]] = {"vehicles": [10, 40, 80], "gate": ["open", "certified"], "seed": [1, 2, 3]}

Make = Callable[..., Results]


def swept(
    folder: Path, grid: Mapping[str, Sequence[Any]], include: Sequence[Mapping[str, Any]] = (), **base: object
) -> Results:
    """Sweep a grid into a folder, and load its results."""
    described = Sweep("made", {"network": "sumo:DRT", "duration_s": 400, **base}, grid, include)
    with ThreadPoolExecutor(1) as pool:
        run_sweep(described, folder / "results", executor=pool, runner=RUNNER)
    return read_results(folder / "results")


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Return a function that sweeps a grid and loads its results."""
    return partial(swept, tmp_path)


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> tuple[Results, Path]:
    """Return results of two gates over vehicles and seeds, and the folder of their report ``r.html``."""
    folder = tmp_path_factory.mktemp("full")
    results = swept(folder, FULL)
    write_report(results, folder / "r.html")
    return results, folder
