"""The same seed gives the same files, byte for byte, in any fresh process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
TABLES = "events", "vehicles", "edges", "streets", "flow", "loops", "fronts"
CLOCKS = "wall_s", "decision_us", "stage_us", "command"


def run(folder: Path, *options: str, hash_seed: int, gate: str) -> dict[str, Any]:
    """Run in a process of its own; return the bytes of the tables, and the summary without clocks."""
    given = [GRID, "--loops", "8", "--vehicles", "24", "--duration", "60", "--seed", "3", "--gate", gate]
    program = [sys.executable, "-c", "from loopgate.cli.main import main; main()"]
    command = [*program, "run", *given, *options, "-o", str(folder)]
    told = {**os.environ, "PYTHONHASHSEED": str(hash_seed)}
    subprocess.run(command, check=True, env=told, capture_output=True, timeout=600)
    files = {name: (folder / f"{name}.parquet").read_bytes() for name in TABLES}
    summary = json.loads((folder / "summary.json").read_text())
    return {**files, "summary": {key: value for key, value in summary.items() if key not in CLOCKS}}


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_hash_seed_and_backend_decide_nothing(tmp_path: Path, gate: str) -> None:
    """Strings hash otherwise in each process, and SUMO runs in the process or beside it."""
    first = run(tmp_path / "a", hash_seed=1, gate=gate)
    for name, options, hash_seed in (("b", [], 2), ("c", [], 3), ("d", ["--traci"], 4)):
        other = run(tmp_path / name, *options, hash_seed=hash_seed, gate=gate)
        assert [part for part in first if first[part] != other[part]] == []
