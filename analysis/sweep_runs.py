"""The loop that studies of many runs share: make what is missing of a sweep, and take its rows."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import pandas as pd

from loopgate.cli.terminal import show_progress
from loopgate.results import columns as c
from loopgate.runs.results import read_results
from loopgate.sweep import Sweep, run_sweep


def sweep_runs(sweep: Sweep, folder: Path, *, workers: int | None = None) -> pd.DataFrame:
    """Make the runs of a sweep that a results folder lacks; return a row for each run.

    It may be ended at any time; started again, it goes on where it was.
    """
    keys = {point.key for point in sweep.points()}
    with show_progress(sweep.name, total=len(keys)) as report:
        run_sweep(
            sweep,
            folder,
            workers=workers,
            retry_failed=True,
            report=lambda p: report(p.present + p.done, p.total),
        )
    return rows_with(folder, keys)


def rows_with(folder: Path, keys: Collection[str]) -> pd.DataFrame:
    """Return the rows with these keys, not those of earlier versions of the sweep."""
    runs = read_results(folder).runs
    return runs[runs[c.KEY].isin(list(keys))].copy()
