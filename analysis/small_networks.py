"""Deadlocks and collisions on the small networks, gate by gate: ``make small-networks``.

Runs what is missing of ``small_networks.toml`` (200 runs of one simulated hour, a fraction of a second each)
into ``out/small-networks`` and prints a row per network and gate. It may be ended at any time; started again,
it goes on where it was.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
from frame_table import frame_table
from rich.console import Console

from loopgate.analysis import columns as ac
from loopgate.analysis import compute_safety, compute_time_to_deadlock
from loopgate.cli.progress import show_progress
from loopgate.results import row_columns as c
from loopgate.runs.results import read_results
from loopgate.sweep import read_sweep, run_sweep

HERE = Path(__file__).resolve().parent
OUT = HERE.parent / "out" / "small-networks"
BY = (c.NETWORK, c.GATE)

HEADINGS = {
    c.NETWORK: "network",
    c.GATE: "gate",
    ac.RUNS: "runs",
    ac.DEADLOCKED: "deadlocked",
    ac.MEDIAN_TIME: "median at [s]",
    c.COLLISIONS: "collisions",
    c.TELEPORTS: "teleports",
    ac.CLEAN: "audit clean",
    c.LAPS_PER_H: "laps/h",
}


def _by(gates: list[str]) -> Callable[[pd.Series[str]], pd.Series[str]]:
    """Return the key that sorts gates as listed, and other names by themselves."""
    place = {gate: f"{number:03}" for number, gate in enumerate(gates)}
    return lambda names: names.map(lambda name: place.get(name, name))


def main() -> None:
    """Run what is missing, then print."""
    sweep = read_sweep(HERE / "small_networks.toml")
    with show_progress("small networks", total=len(sweep.points())) as report:
        outcome = run_sweep(sweep, OUT, report=lambda p: report(p.present + p.done, p.total))
    runs = read_results(OUT).runs
    runs = runs[runs[c.KEY].isin({point.key for point in sweep.points()})]  # not those of earlier versions
    medians = compute_time_to_deadlock(runs=runs, by=BY)[[*BY, ac.MEDIAN_TIME]]
    rows = compute_safety(runs=runs, by=BY).merge(medians, on=list(BY))
    rows[c.NETWORK] = [Path(name).name.removesuffix(".net.xml") for name in rows[c.NETWORK]]
    rows = rows.sort_values([c.NETWORK, c.GATE], key=_by(list(sweep.grid[c.GATE])))
    title = f"One vehicle per loop, one hour, {outcome.total} runs"
    Console(width=110).print(frame_table(rows, HEADINGS, title=title))


if __name__ == "__main__":
    main()
