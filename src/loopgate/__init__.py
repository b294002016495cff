"""Vehicles on closed loops in a SUMO road network that never collide and never lock up.

Everything a study needs is here; each name is imported when it is first used, so that the command line and
the gates do not wait for pandas or SUMO::

    from loopgate import Scenario, Sweep, compute_mean, read_results, run, run_sweep, write_report
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from loopgate.analysis import (
        Results,
        Run,
        compute_capacity,
        compute_deadlock_rate,
        compute_decision_time,
        compute_edge_holds,
        compute_edge_means,
        compute_edges,
        compute_fundamental,
        compute_holds,
        compute_lap_distribution,
        compute_laps,
        compute_mean,
        compute_paired,
        compute_revisit_intervals,
        compute_revisits,
        compute_safety,
        compute_survival,
        compute_throughput,
        compute_time_to_deadlock,
        compute_vehicle_holds,
        compute_waits,
        compute_watch,
        read_results,
        read_run,
    )
    from loopgate.errors import LoopgateError
    from loopgate.report.page import ReportFiles, write_report
    from loopgate.simulation.run import run
    from loopgate.simulation.scenario import Scenario, read_scenario
    from loopgate.sweep import LocalExecutor, Sweep, SweepOutcome, read_sweep, run_sweep

__all__ = [
    "LocalExecutor",
    "LoopgateError",
    "ReportFiles",
    "Results",
    "Run",
    "Scenario",
    "Sweep",
    "SweepOutcome",
    "compute_capacity",
    "compute_deadlock_rate",
    "compute_decision_time",
    "compute_edge_holds",
    "compute_edge_means",
    "compute_edges",
    "compute_fundamental",
    "compute_holds",
    "compute_lap_distribution",
    "compute_laps",
    "compute_mean",
    "compute_paired",
    "compute_revisit_intervals",
    "compute_revisits",
    "compute_safety",
    "compute_survival",
    "compute_throughput",
    "compute_time_to_deadlock",
    "compute_vehicle_holds",
    "compute_waits",
    "compute_watch",
    "read_results",
    "read_run",
    "read_scenario",
    "read_sweep",
    "run",
    "run_sweep",
    "write_report",
]

_MODULES = {
    "loopgate.errors": ("LoopgateError",),
    "loopgate.report.page": ("ReportFiles", "write_report"),
    "loopgate.simulation.run": ("run",),
    "loopgate.simulation.scenario": ("Scenario", "read_scenario"),
    "loopgate.sweep": ("LocalExecutor", "Sweep", "SweepOutcome", "read_sweep", "run_sweep"),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in __all__:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(importlib.import_module(_HOME.get(name, "loopgate.analysis")), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
