"""How well the loops of a run watched the road, in figures of its summary."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from statistics import fmean
from typing import Any

import pandas as pd

from loopgate.analysis.watching import compute_watch, watch_figures
from loopgate.disk import writing
from loopgate.network import Loop
from loopgate.network.coverage import Coverage
from loopgate.results.columns import EDGE, IDLENESS, VISITS, WORST_IDLENESS, Event
from loopgate.results.recorder import read_events
from loopgate.results.row_columns import IF_EVEN, WORST_IF_EVEN
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.outcome import EVENTS, Folder, Tally
from loopgate.simulation.scenario import Scenario

__all__ = ["STREETS", "monitoring_figures", "write_streets"]

STREETS = "streets.parquet"


def monitoring_figures(edges: pd.DataFrame | None, coverage: Coverage | None) -> dict[str, Any]:
    """Return the figures of monitoring in ``summary.json``; None where there is nothing to say.

    Parameters
    ----------
    edges
        ``edges.parquet``; None or empty if nothing was measured. All edges count alike in the mean, however
        long they are; see `loopgate.analysis.monitoring` for what idleness is.
    coverage
        How much of the network the loops reach; None without loops.
    """
    figures: dict[str, Any] = {
        "coverage_edges": round(coverage.of_edges, 6) if coverage else None,
        "coverage_lane_km": round(coverage.of_lane_km, 6) if coverage else None,
    }
    if edges is None or edges.empty:
        nothing = ("idleness_s", "worst_idleness_s", "worst_idleness_edge", "unvisited_edges")
        return figures | dict.fromkeys(nothing)
    worst = int(edges[WORST_IDLENESS].to_numpy().argmax())
    return figures | {
        "idleness_s": round(float(edges[IDLENESS].mean()), 3),
        "worst_idleness_s": round(float(edges[WORST_IDLENESS].iloc[worst]), 3),
        "worst_idleness_edge": str(edges[EDGE].iloc[worst]),
        "unvisited_edges": int((edges[VISITS] == 0).sum()),
    }


def write_streets(
    scenario: Scenario,
    assembly: Assembly,
    tallies: Sequence[Tally],
    folder: Folder,
    *,
    begin_s: float,
    end_s: float,
) -> dict[str, Any]:
    """Write ``streets.parquet`` from the events, and return what the summary says of it.

    Its streets are all edges open to some vehicle's class, those on no loop included.
    """
    classes = {start.type.vclass for start in assembly.starts}
    bound_s = scenario.revisit_s or math.inf
    table = compute_watch(
        events=read_events(folder / EVENTS, (Event.EDGE,)),
        streets=[e.id for e in assembly.network.edges.values() if any(e.allows(name) for name in classes)],
        begin_s=begin_s,
        end_s=end_s,
        bound_s=bound_s,
    )
    with writing(folder / STREETS):
        table.to_parquet(folder / STREETS, index=False)
    return watch_figures(table, bound_s=bound_s) | _if_even(assembly.loops, tallies, end_s - begin_s)


def _if_even(loops: Sequence[Loop], tallies: Sequence[Tally], duration_s: float) -> dict[str, float | None]:
    """Return what idleness would be if the vehicles of each loop, as fast as they were, came evenly.

    A street that loops visit at rates v / lap waits for the inverse of their sum, half of it on average.
    """
    driven = defaultdict[str, float](float)
    for tally in tallies:
        driven[tally.loop] += tally.distance_m
    visits = defaultdict[str, float](float)
    for loop in loops:
        for edge in loop.edges:
            visits[edge] += driven[loop.id] / loop.length_m
    if not visits or min(visits.values()) <= 0.0:
        return {IF_EVEN: None, WORST_IF_EVEN: None}
    intervals = [duration_s / number for number in visits.values()]
    return {IF_EVEN: round(fmean(intervals) / 2.0, 3), WORST_IF_EVEN: round(max(intervals), 3)}
