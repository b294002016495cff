"""Drive the runs of ``tests/sumo/test_frozen_runs.py`` by the ledger and by the tables, and say which differ.

python analysis/heart_frozen.py ["pressure" "lights obeyed" ...]
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pandas as pd

from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "sumo"), str(ROOT / "tests" / "support"), str(ROOT / "analysis")]

frozen = import_module("test_frozen_runs")  # it is in no package

_KINDS = ["grant", "enter", "lap"]
_ROW = ["time_s", "vehicle", "event", "place"]


def drive(scenario: Scenario, engine: str, folder: Path) -> tuple[dict[str, Any], pd.DataFrame]:
    """Return the summary of a run, and its grants, entries and laps in an order that both have."""
    summary = simulate(replace(scenario, engine=engine, on_deadlock="continue"), folder, overwrite=True)
    rows = read_events(folder / "events.parquet")
    rows = rows[rows["event"].isin(_KINDS)][_ROW].sort_values(_ROW)
    return summary, rows.reset_index(drop=True)


def main() -> None:
    """Print a line for each run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        frozen.write_inputs(folder)
        for called, given in frozen.SCENARIOS.items():
            if not given.gated or "misled" in called or called not in (sys.argv[1:] or [called]):
                continue
            files = {
                key: getattr(given, key).replace(frozen.TEMPORARY, str(folder))
                for key in ("network", "routes", "traffic")
            }
            (mine, my_rows), (theirs, rows) = (
                drive(replace(given, **files), engine, folder / "run") for engine in ("ledger", "tables")
            )
            same = "the same" if my_rows.equals(rows) else "differs"
            sys.stdout.write(
                f"{called}: {same}, {mine['distance_km'] / theirs['distance_km']:.3f} of the distance, "
                f"longest wait {mine['longest_wait_s']:.0f} s and {theirs['longest_wait_s']:.0f} s, audit "
                f"{mine['audit']}, {mine['trespasses']} trespasses, {mine['collisions']} collisions\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
