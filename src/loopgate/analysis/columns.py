"""Column names of the tables that analysis makes, with units; of the run folder: `results.columns`."""

from __future__ import annotations

from typing import Final

__all__ = [
    "BEGIN",
    "END",
    "INTERVAL",
    "LAP_NUMBER",
    "LAP_TIME",
    "OPEN",
    "SINCE",
    "WAIT",
]

# one row per lap, hold, wait or revisit interval of a run
SINCE: Final = "since_s"  # simulated time [s] at which it began
BEGIN: Final = "begin_s"  # the same, or the begin of the period of observation if that is later
END: Final = "end_s"  # simulated time [s] at which it ended, or at which observation ended
OPEN: Final = "open"  # True if it had not ended when observation ended
LAP_NUMBER: Final = "lap"  # 1 for a vehicle's first lap
LAP_TIME: Final = "lap_s"
WAIT: Final = "wait_s"  # from the first refusal to the grant
INTERVAL: Final = "revisit_s"  # time between two visits of an edge
