"""Runs as a notebook has them: one to be made or read, and many as one table."""

from loopgate.runs.results import Results, read_results
from loopgate.runs.run import Run, read_run
from loopgate.runs.start import run

__all__ = ["Results", "Run", "read_results", "read_run", "run"]
