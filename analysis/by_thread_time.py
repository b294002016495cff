"""Let runs be timed by the processor time of their thread: other programs on the machine hardly change it.

Runs measure by the clock, also in their summaries (`wall_s`). Figures of what a gate costs are a quotient of
two times; by the clock such a quotient is wrong by a factor of two on a machine with other work.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from time import thread_time

from loopgate.control import driving
from loopgate.simulation import loop_run, plain_run, run


def time_by_thread() -> None:
    """Let all runs of this process, with SUMO inside it, measure `wall_s` by the time of their thread."""
    for module in (driving, loop_run, plain_run, run):
        module.perf_counter = thread_time  # type: ignore[attr-defined]


def median_and_spread(values: Sequence[float], form: str = ".0%") -> str:
    """Return the median of several measurements, with the least and the greatest of them."""
    middle = f"{statistics.median(values):{form}}"
    return f"{middle} ({min(values):{form}} to {max(values):{form}})" if len(values) > 1 else middle
