"""Vehicles on closed loops in a SUMO road network: no collisions, no lock while none stands for good.

What a notebook needs is here; each name is imported when it is first used, so that the command line and the
gates do not wait for pandas or SUMO::

    from loopgate import Scenario, run
    from loopgate.analysis import compute_holds

Tables of tables are computed by `loopgate.analysis`, figures of them drawn by `loopgate.plots`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from loopgate.errors import LoopgateError
    from loopgate.gates import make_gate
    from loopgate.model import Robot, System, read_system
    from loopgate.network import Loop, RoadNetwork, find_loops, read_loops
    from loopgate.replay import Replay, make_replay
    from loopgate.report.page import ReportFiles, write_report
    from loopgate.research.state_space import explore
    from loopgate.runs.fcd import read_fcd
    from loopgate.runs.results import Results, read_results
    from loopgate.runs.run import Run, read_run
    from loopgate.runs.start import run
    from loopgate.simulation.attaching.attach import attach
    from loopgate.simulation.attaching.attached import Attached
    from loopgate.simulation.scenario import Scenario, read_scenario
    from loopgate.sweep import LocalExecutor, Sweep, SweepOutcome, read_sweep, run_sweep

_MODULES = {
    "loopgate.errors": ("LoopgateError",),
    "loopgate.gates": ("make_gate",),
    "loopgate.model": ("Robot", "System", "read_system"),
    "loopgate.network": ("Loop", "RoadNetwork", "find_loops", "read_loops"),
    "loopgate.replay": ("Replay", "make_replay"),
    "loopgate.report.page": ("ReportFiles", "write_report"),
    "loopgate.runs.fcd": ("read_fcd",),
    "loopgate.runs.results": ("Results", "read_results"),
    "loopgate.runs.run": ("Run", "read_run"),
    "loopgate.runs.start": ("run",),
    "loopgate.simulation.attaching.attach": ("attach",),
    "loopgate.simulation.attaching.attached": ("Attached",),
    "loopgate.simulation.scenario": ("Scenario", "read_scenario"),
    "loopgate.sweep": ("LocalExecutor", "Sweep", "SweepOutcome", "read_sweep", "run_sweep"),
    "loopgate.research.state_space": ("explore",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [
    "Attached",
    "LocalExecutor",
    "Loop",
    "LoopgateError",
    "Replay",
    "ReportFiles",
    "Results",
    "RoadNetwork",
    "Robot",
    "Run",
    "Scenario",
    "Sweep",
    "SweepOutcome",
    "System",
    "attach",
    "explore",
    "find_loops",
    "make_gate",
    "make_replay",
    "read_fcd",
    "read_loops",
    "read_results",
    "read_run",
    "read_scenario",
    "read_sweep",
    "read_system",
    "run",
    "run_sweep",
    "write_report",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
