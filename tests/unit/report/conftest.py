"""Results folders of every kind, made by the runner without SUMO."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from loopgate.runs.results import Results, read_results
from loopgate.sweep import Sweep, run_sweep

RUNNER = f"{Path(__file__).parents[1] / 'sweep' / 'fake_runner.py'}:run"
FULL = {"vehicles": [10, 40, 80], "gate": ["open", "certified"], "seed": [1, 2, 3]}

Make = Callable[..., Results]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Return a function that sweeps a grid and loads its results."""

    def sweep(
        grid: Mapping[str, Sequence[Any]], *, include: Sequence[Mapping[str, Any]] = (), **base: object
    ) -> Results:
        described = Sweep("made", {"network": "sumo:DRT", "duration_s": 400, **base}, grid, include)
        with ThreadPoolExecutor(1) as pool:
            run_sweep(described, tmp_path / "results", executor=pool, runner=RUNNER)
        return read_results(tmp_path / "results")

    return sweep
