"""The same seed gives the same files, byte for byte, in any fresh process, alone or in a sweep."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
TABLES = "events", "vehicles", "edges", "streets", "flow", "loops", "fronts"
CLOCKS = "wall_s", "decision_us", "stage_us", "command"
GATES = "certified", "open"
SWEEP = f"""
[base]
network = "{GRID}"
loops = 8
vehicles = 24
duration_s = 60
[grid]
gate = ["certified", "open"]
seed = [3]
"""


def loopgate(*words: str, hash_seed: int) -> None:
    """Do a command in a process of its own."""
    command = [sys.executable, "-c", "from loopgate.cli.main import main; main()", *words]
    told = {**os.environ, "PYTHONHASHSEED": str(hash_seed)}
    subprocess.run(command, check=True, env=told, capture_output=True, timeout=600)


def written(folder: Path) -> dict[str, Any]:
    """Return the bytes of the tables of a run, and the summary without clocks."""
    files = {name: (folder / f"{name}.parquet").read_bytes() for name in TABLES}
    summary = json.loads((folder / "summary.json").read_text())
    return {**files, "summary": {key: value for key, value in summary.items() if key not in CLOCKS}}


def alone(folder: Path, gate: str, *options: str, hash_seed: int) -> dict[str, Any]:
    """Run with seed 3."""
    given = ["--loops", "8", "--vehicles", "24", "--duration", "60", "--seed", "3", "--gate", gate]
    loopgate("run", GRID, *given, *options, "-o", str(folder), hash_seed=hash_seed)
    return written(folder)


def in_a_sweep(folder: Path, *, workers: int, hash_seed: int) -> dict[str, dict[str, Any]]:
    """Make the runs by so many workers; return them by gate."""
    folder.mkdir()
    (folder / "s.toml").write_text(SWEEP)
    words = "--workers", str(workers), "--keep-runs", "-o", str(folder / "rows")
    loopgate("sweep", str(folder / "s.toml"), *words, hash_seed=hash_seed)
    runs = [written(one) for one in (folder / "rows" / "runs").iterdir()]
    return {run["summary"]["gate"]: run for run in runs}


def differing(first: dict[str, Any], others: Sequence[dict[str, Any]]) -> list[list[str]]:
    """Return what is otherwise in each of the others."""
    return [[part for part in first if first[part] != other[part]] for other in others]


def test_hash_seed_backend_workers_and_company_decide_nothing(tmp_path: Path) -> None:
    """Strings hash otherwise in each process; SUMO runs in it or beside it; runs before it are no matter."""
    sweeps = [in_a_sweep(tmp_path / f"s{number}", workers=number, hash_seed=number + 4) for number in (1, 2)]
    for gate in GATES:
        first = alone(tmp_path / f"a-{gate}", gate, hash_seed=1)
        again = alone(tmp_path / f"b-{gate}", gate, "--traci", hash_seed=2)
        assert differing(first, [again, *(sweep[gate] for sweep in sweeps)]) == [[], [], []]
