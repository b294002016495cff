"""Run what is missing of a sweep file, and print a row for each combination of what it varies but seeds.

    python analysis/sweep_table.py analysis/small_networks.toml

Results are kept in ``out/NAME``, by the name in the file. It may be ended at any time; started again, it goes
on where it was. Runs of one hour on a small network take a fraction of a second each.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas as pd
from frame_table import frame_table
from rich.console import Console
from sweep_runs import sweep_runs

from loopgate.analysis import compute_safety, compute_time_to_deadlock
from loopgate.results import columns as ac
from loopgate.results import columns as c
from loopgate.sweep import Sweep, read_sweep

ROOT = Path(__file__).resolve().parents[1]
_GIVEN = (c.SEED, "routes")
"""What is varied, and has no rows of its own: seeds, and routes that a network comes with."""

HEADINGS = {
    ac.FAILED: "refused",
    ac.RUNS: "runs",
    ac.DEADLOCKED: "deadlocks",
    ac.MEDIAN_TIME: "median at [s]",
    c.COLLISIONS: "collisions",
    c.TELEPORTS: "teleports",
    ac.CLEAN: "clean",
    c.LAPS_PER_H: "laps/h",
    c.LONGEST_WAIT: "longest wait [s]",
}


def varied(sweep: Sweep) -> list[str]:
    """Return the keys by which the table has rows, in the order of the file."""
    return [key for key in sweep.grid if key not in _GIVEN]


def rows_of(runs: pd.DataFrame, by: list[str], order: dict[str, list[Any]]) -> pd.DataFrame:
    """Return the rows of the table, sorted as the values stand in the file."""
    medians = compute_time_to_deadlock(runs=runs, by=by)[[*by, ac.MEDIAN_TIME]]
    rows = compute_safety(runs=runs, by=by).merge(medians, on=by, how="left")
    places = {key: {value: at for at, value in enumerate(order[key])} for key in by}

    def place(values: pd.Series[Any]) -> pd.Series[Any]:
        return values.map(lambda value: places[str(values.name)].get(value, len(places)))

    return rows.sort_values(by, key=place)


def main(name: str) -> None:
    """Run what is missing, then print."""
    sweep = read_sweep(name)
    by, out = varied(sweep), ROOT / "out" / sweep.name
    runs = sweep_runs(sweep, out)
    table = rows_of(runs, by, {key: list(sweep.grid[key]) for key in by})
    if c.NETWORK in by:
        table[c.NETWORK] = [Path(network).name.removesuffix(".net.xml") for network in table[c.NETWORK]]
    console = Console(highlight=False, width=max(Console().width, 150))
    headings = {**{key: key for key in by}, **HEADINGS}
    console.print(frame_table(table, headings, title=f"{sweep.name}, {len(runs)} runs"))
    for reason in sorted(set(runs[c.ERROR]) - {""}):
        console.print(f"refused: {reason}")


if __name__ == "__main__":
    main(sys.argv[1])
