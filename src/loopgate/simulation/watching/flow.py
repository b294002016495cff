"""How all vehicles together get on: how many stand, how far they drive, and where they stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
import pandas as pd

from loopgate.drive.engine import Engine
from loopgate.results.columns import FLOW_COLUMNS, FLOW_EVERY_S, LOOP_COLUMNS
from loopgate.traffic.base import Traffic

__all__ = ["FlowMeter", "Row", "flow_table", "loop_table"]

Row = tuple[float, int, float, float, int]


def flow_table(rows: list[Row]) -> pd.DataFrame:
    """Return rows as a table of `FLOW_COLUMNS`."""
    return pd.DataFrame(rows, columns=list(FLOW_COLUMNS))


def loop_table(ways: Mapping[str, Sequence[tuple[float, str]]]) -> pd.DataFrame:
    """Return `LOOP_COLUMNS` of loops, each with its edges and where they begin [m]."""
    rows = [(loop, edge, begin_m) for loop, edges in ways.items() for begin_m, edge in edges]
    return pd.DataFrame(rows, columns=list(LOOP_COLUMNS))


class FlowMeter:
    """Takes down how all vehicles together get on, which the drive counts in each step, gate or no gate.

    Parameters
    ----------
    traffic, engine
        The run's; it has not begun.
    warmup_s
        Standing before that counts neither for a vehicle nor for an edge [s]; the rows begin with the run.
    """

    def __init__(self, traffic: Traffic, engine: Engine, *, warmup_s: float) -> None:
        self._traffic = traffic
        self._engine = engine
        self._warmup_s = warmup_s
        self._begin_s: float | None = None
        self._next_s = 0.0
        self._steps = self._laps = 0
        self.rows: list[Row] = []
        """For `flow_table`."""
        self._edges: dict[str, float] = {}
        self._begin_roads()
        self._engine.run["counts"] = warmup_s <= 0.0

    def _begin_roads(self) -> None:
        """Begin with the roads as the engine numbers them now."""
        self._roads = self._engine.roads
        self._roads_s = cast("Any", self._engine.tables.roads)["stood_s"]

    def _settle(self) -> None:
        """Add up what was counted by number since the last time."""
        for number in np.flatnonzero(self._roads_s).tolist():
            edge = self._roads[number]
            self._edges[edge] = self._edges.get(edge, 0.0) + float(self._roads_s[number])
        self._roads_s[:] = 0.0

    def look(self) -> None:
        """Take note of the step that was made."""
        if self._roads is not self._engine.roads:
            self._settle()
            self._begin_roads()
        now, step_s = self._traffic.now_s, self._traffic.step_s
        if self._begin_s is None:
            self._begin_s = now - step_s + self._warmup_s
            self._next_s = now - step_s + FLOW_EVERY_S
        if now <= self._begin_s:
            self._engine.run["counts"] = now + step_s > self._begin_s
        self._steps += 1
        if now >= self._next_s:
            self._next_s += FLOW_EVERY_S
            v, run = self._engine.vehicles, self._engine.run[0]
            laps = int(v["laps"].sum())
            standing = int(run["standing"]) / self._steps
            self.rows.append((now, len(v), standing, float(run["driven_m"]), laps - self._laps))
            self._laps, self._steps = laps, 0
            run["standing"], run["driven_m"] = 0, 0.0

    def edges_s(self) -> dict[str, float]:
        """Return for how long vehicles stood on each edge [s]; those on which nobody stood may be missing."""
        self._settle()
        return self._edges
