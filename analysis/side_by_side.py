"""Simulate scenarios side by side, one on each processor, with one bar of progress for all."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from concurrent.futures import wait
from multiprocessing import Manager
from pathlib import Path
from typing import Any

from loopgate import LocalExecutor
from loopgate.cli.terminal import show_progress
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

LOOK_S = 0.5
"""How often the bar is renewed [s]."""


def side_by_side(what: str, runs: Mapping[Path, Scenario]) -> list[dict[str, Any]]:
    """Simulate each scenario into its folder; return their summaries, in order.

    The bar counts the simulated seconds of all.
    """
    total = sum(round(scenario.duration_s) for scenario in runs.values())
    executor = LocalExecutor()
    with Manager() as manager, show_progress(what, total=total) as report:
        now_s = manager.dict()
        try:
            futures = [executor.submit(_drive, scenario, folder, now_s) for folder, scenario in runs.items()]
            while wait(futures, timeout=LOOK_S).not_done:
                report(round(sum(now_s.values())))
            return [future.result() for future in futures]
        finally:
            executor.shutdown(cancel_futures=True)


def _drive(scenario: Scenario, folder: Path, now_s: MutableMapping[str, float]) -> dict[str, Any]:
    """Simulate in a process of its own; keep in `now_s` how far it is."""

    def tick(now: float, _: object) -> None:
        now_s[str(folder)] = now

    return simulate(scenario, folder, tick=tick, overwrite=True)
