"""Tables about all vehicles over time: how many stand, distance and laps; and the table of loops."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence

import pandas as pd

from loopgate.results.columns import FLOW_COLUMNS, LOOP_COLUMNS
from loopgate.simulation.drive import Drive
from loopgate.traffic.base import Traffic

__all__ = ["FlowMeter", "Row", "flow_table", "loop_table", "with_last_parts"]

Row = tuple[float, int, float, float, int]


def flow_table(rows: list[Row]) -> pd.DataFrame:
    """Return rows as a table with the columns `FLOW_COLUMNS`."""
    return pd.DataFrame(rows, columns=list(FLOW_COLUMNS))


def with_last_parts(rows: Iterable[Row], parts: Iterable[tuple[float, float]]) -> list[Row]:
    """Return rows with what arriving vehicles drove in their last steps, for which SUMO has no odometer.

    `parts`: when each vehicle arrived [s], and the distance [m].
    """
    told = [list(row) for row in rows]
    ends_s = [row[0] for row in told]
    for at_s, metres in parts:
        if (number := bisect_left(ends_s, at_s)) < len(told):
            told[number][3] += metres
    return [(time_s, int(there), still, metres, int(laps)) for time_s, there, still, metres, laps in told]


def loop_table(ways: Mapping[str, Sequence[tuple[float, str]]]) -> pd.DataFrame:
    """Return a table with the columns `LOOP_COLUMNS`: the edges of each loop, and where they begin [m]."""
    rows = [(loop, edge, begin_m) for loop, edges in ways.items() for begin_m, edge in edges]
    return pd.DataFrame(rows, columns=list(LOOP_COLUMNS))


class FlowMeter:
    """Records distance, laps and standing of all vehicles together at intervals.

    Parameters
    ----------
    traffic, drive
        The simulation and the drive of a run that has not begun.
    """

    def __init__(self, traffic: Traffic, drive: Drive) -> None:
        self._traffic = traffic
        self._drive = drive
        self.rows: list[Row] = []
        """The rows for `flow_table`."""

    def look(self) -> None:
        """Add a row about the time since the last row; call every `FLOW_EVERY_S`, and at the end."""
        if not self.rows or self.rows[-1][0] < self._traffic.now_s:
            self.rows.append((self._traffic.now_s, *self._drive.take_flow()))
