"""Many runs: a grid of scenarios, executed anywhere, one row each."""

from loopgate.sweep.description import Point, Sweep, read_sweep
from loopgate.sweep.execution import Progress, SweepOutcome, run_sweep
from loopgate.sweep.local import LocalExecutor

__all__ = ["LocalExecutor", "Point", "Progress", "Sweep", "SweepOutcome", "read_sweep", "run_sweep"]
