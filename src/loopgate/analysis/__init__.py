"""Analysis in pandas: pure functions from tables to tables, columns with units."""

from loopgate.analysis.monitoring import (
    compute_edge_holds,
    compute_edges,
    compute_revisit_intervals,
    compute_revisits,
)
from loopgate.analysis.trips import (
    compute_holds,
    compute_laps,
    compute_throughput,
    compute_vehicle_holds,
    compute_waits,
)

__all__ = [
    "compute_edge_holds",
    "compute_edges",
    "compute_holds",
    "compute_laps",
    "compute_revisit_intervals",
    "compute_revisits",
    "compute_throughput",
    "compute_vehicle_holds",
    "compute_waits",
]
