"""Packaged cities under ``algorithm2``, with bounded and unbounded sharing: ``make city``.

Runs what is missing of ``city.toml`` into ``out/city`` and prints a row per city, number of loops and bound;
the fewest laps are those of the slowest vehicle of all runs. May be ended and started again at any time.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from frame_table import frame_table
from rich.console import Console

from loopgate.analysis import columns as ac
from loopgate.analysis import compute_safety
from loopgate.cli.progress import show_progress
from loopgate.results import columns as rc
from loopgate.results import row_columns as c
from loopgate.runs.results import read_results
from loopgate.sweep import read_sweep, run_sweep

HERE = Path(__file__).resolve().parent
OUT = HERE.parent / "out" / "city"
MAX_SHARED = "max_shared"
FEWEST = "fewest_laps"
BY = (c.NETWORK, c.LOOPS, MAX_SHARED)

HEADINGS = {
    c.NETWORK: "network",
    c.LOOPS: "loops",
    MAX_SHARED: "bound",
    ac.FAILED: "refused",
    ac.RUNS: "runs",
    ac.DEADLOCKED: "deadlocks",
    c.COLLISIONS: "collisions",
    c.TELEPORTS: "teleports",
    ac.CLEAN: "clean",
    c.LAPS_PER_H: "laps/h",
    FEWEST: "fewest laps",
}


def fewest_laps(key: str) -> float:
    """Return the laps of the slowest vehicle of a run; missing where the run was refused."""
    file = OUT / "runs" / key / "vehicles.parquet"
    return float(pd.read_parquet(file)[rc.LAPS].min()) if file.exists() else float("nan")


def main() -> None:
    """Run what is missing, then print."""
    sweep = read_sweep(HERE / "city.toml")
    with show_progress("cities", total=len(sweep.points())) as report:
        run_sweep(sweep, OUT, keep_runs=True, report=lambda p: report(p.present + p.done, p.total))
    runs = read_results(OUT).runs
    runs = runs[runs[c.KEY].isin({point.key for point in sweep.points()})]  # not those of earlier versions
    runs[FEWEST] = [fewest_laps(key) for key in runs[c.KEY]]
    slowest = runs.groupby(list(BY), as_index=False)[FEWEST].min()
    rows = compute_safety(runs=runs, by=BY).merge(slowest, on=list(BY))
    console = Console(highlight=False, width=max(Console().width, 120))
    console.print(frame_table(rows, HEADINGS, title="algorithm2, one hour, five seeds"))
    for reason in sorted(set(runs[c.ERROR]) - {""}):
        console.print(f"refused: {reason}")


if __name__ == "__main__":
    main()
