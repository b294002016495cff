"""How well the loops of a run watched the road, in figures of its summary."""

from __future__ import annotations

from typing import Any

import pandas as pd

from loopgate.network.coverage import Coverage
from loopgate.results.columns import EDGE, IDLENESS, VISITS, WORST_IDLENESS

__all__ = ["monitoring_figures"]


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
