"""Deadlocks and collisions on the small networks, gate by gate: ``make small-networks``.

Runs what is missing of ``small_networks.toml`` (200 runs of one simulated hour, a fraction of a second each)
into ``out/small-networks`` and prints a row per network and gate. It may be ended at any time; started again,
it goes on where it was.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
from rich.console import Console

from loopgate.analysis import columns as ac
from loopgate.analysis import compute_deadlock_rate, compute_time_to_deadlock, read_results
from loopgate.cli.frame_table import frame_table
from loopgate.cli.progress import show_progress
from loopgate.results import row_columns as c
from loopgate.sweep import read_sweep, run_sweep

HERE = Path(__file__).resolve().parent
OUT = HERE.parent / "out" / "small-networks"
BY = (c.NETWORK, c.GATE)
CLEAN = "clean"

HEADINGS = {
    c.NETWORK: "network",
    c.GATE: "gate",
    ac.RUNS: "runs",
    ac.DEADLOCKED: "deadlocked",
    ac.MEDIAN_TIME: "median at [s]",
    c.COLLISIONS: "collisions",
    c.TELEPORTS: "teleports",
    CLEAN: "audit clean",
    c.LAPS_PER_H: "laps/h",
}


def summarise(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per network and gate; the columns are those of `HEADINGS`."""
    clean = (runs[c.AUDIT] == "clean").astype("Int64").mask(runs[c.AUDIT] == "not gated")
    runs = runs.assign(**{CLEAN: clean})
    rates = compute_deadlock_rate(runs=runs, by=BY)
    times = compute_time_to_deadlock(runs=runs, by=BY)
    counts = runs.groupby(list(BY), as_index=False).agg(
        {c.COLLISIONS: "sum", c.TELEPORTS: "sum", CLEAN: _sum_or_none, c.LAPS_PER_H: "mean"}
    )
    rows = rates.merge(times[[*BY, ac.MEDIAN_TIME]], on=list(BY)).merge(counts, on=list(BY))
    return rows.assign(**{c.NETWORK: [Path(name).name.removesuffix(".net.xml") for name in rows[c.NETWORK]]})


def _by(gates: list[str]) -> Callable[[pd.Series[str]], pd.Series[str]]:
    """Return the key that sorts gates as listed, and other names by themselves."""
    place = {gate: f"{number:03}" for number, gate in enumerate(gates)}
    return lambda names: names.map(lambda name: place.get(name, name))


def _sum_or_none(values: pd.Series[int]) -> int:
    return values.sum(min_count=1)


def main() -> None:
    """Run what is missing, then print."""
    sweep = read_sweep(HERE / "small_networks.toml")
    with show_progress("small networks", total=len(sweep.points())) as report:
        outcome = run_sweep(sweep, OUT, report=lambda p: report(p.present + p.done, p.total))
    rows = summarise(read_results(OUT).runs)
    rows = rows.sort_values([c.NETWORK, c.GATE], key=_by(list(sweep.grid[c.GATE])))
    title = f"One vehicle per loop, one hour, {outcome.total} runs"
    Console(width=110).print(frame_table(rows, HEADINGS, title=title))


if __name__ == "__main__":
    main()
