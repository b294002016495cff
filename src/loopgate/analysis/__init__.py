"""Analysis in pandas: pure functions from tables to tables, columns with units.

Columns that make a group are called `by` everywhere, the confidence level of an interval `level`.
"""

from loopgate.analysis.closures import compute_delayed, compute_stop_phases
from loopgate.analysis.comparison import (
    compute_capacity,
    compute_fundamental,
    compute_mean,
    compute_paired,
)
from loopgate.analysis.costs import (
    compute_decision_time,
    compute_edge_means,
    compute_lap_distribution,
    compute_ranked,
)
from loopgate.analysis.course import (
    compute_causes,
    compute_flow,
    compute_stuck,
    compute_time_space,
)
from loopgate.analysis.frames import of_tables
from loopgate.analysis.junctions import compute_junctions, compute_worst_movements
from loopgate.analysis.messages import compute_messages
from loopgate.analysis.monitoring import (
    compute_edge_holds,
    compute_edges,
    compute_revisit_intervals,
    compute_revisits,
)
from loopgate.analysis.outcomes import (
    compute_deadlock_rate,
    compute_safety,
    compute_survival,
    compute_time_to_deadlock,
    compute_trips,
)
from loopgate.analysis.series import add_series
from loopgate.analysis.standing import compute_blocked, compute_starving
from loopgate.analysis.stops import compute_stops
from loopgate.analysis.trips import (
    compute_holds,
    compute_laps,
    compute_throughput,
    compute_vehicle_holds,
    compute_waits,
)
from loopgate.analysis.waits import compute_longest_waits, compute_wait_causes
from loopgate.analysis.watching import (
    compute_districts,
    compute_promises,
    compute_rarest,
    compute_seen_within,
    compute_watch,
)

__all__ = [
    "add_series",
    "compute_blocked",
    "compute_capacity",
    "compute_causes",
    "compute_deadlock_rate",
    "compute_decision_time",
    "compute_delayed",
    "compute_districts",
    "compute_edge_holds",
    "compute_edge_means",
    "compute_edges",
    "compute_flow",
    "compute_fundamental",
    "compute_holds",
    "compute_junctions",
    "compute_lap_distribution",
    "compute_laps",
    "compute_longest_waits",
    "compute_mean",
    "compute_messages",
    "compute_paired",
    "compute_promises",
    "compute_ranked",
    "compute_rarest",
    "compute_revisit_intervals",
    "compute_revisits",
    "compute_safety",
    "compute_seen_within",
    "compute_starving",
    "compute_stop_phases",
    "compute_stops",
    "compute_stuck",
    "compute_survival",
    "compute_throughput",
    "compute_time_space",
    "compute_time_to_deadlock",
    "compute_trips",
    "compute_vehicle_holds",
    "compute_wait_causes",
    "compute_waits",
    "compute_watch",
    "compute_worst_movements",
]

for _name in __all__:
    globals()[_name] = of_tables(globals()[_name], __name__)
