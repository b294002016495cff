"""Runs of a system without roads and clocks: traces, Monte Carlo rounds and exact counts."""

from loopgate.research.runs.montecarlo import RoundCounts, run_rounds
from loopgate.research.runs.trace import trace_moves

__all__ = [
    "RoundCounts",
    "run_rounds",
    "trace_moves",
]
