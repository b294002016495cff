"""Runs of a system without roads and clocks: traces, Monte Carlo rounds, exact counts, paths that change."""

from loopgate.research.runs.montecarlo import RoundCounts, run_rounds
from loopgate.research.runs.path_change import PathChangeError, change_path
from loopgate.research.runs.trace import trace_moves

__all__ = [
    "PathChangeError",
    "RoundCounts",
    "change_path",
    "run_rounds",
    "trace_moves",
]
