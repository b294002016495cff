"""Each figure of the report from the table that it shows, for a notebook or a paper.

Tables come from `loopgate.analysis`; by default there is one series per gate, and the x axis shows vehicles.
The figures are Matplotlib's: ``figure.savefig("throughput.pdf")`` writes one.
"""

from loopgate.plots.figures import (
    plot_deadlock_rate,
    plot_decision_time,
    plot_fundamental,
    plot_laps,
    plot_mean,
    plot_survival,
)
from loopgate.plots.road_map import plot_edges
from loopgate.plots.svg import figure_svg
from loopgate.plots.watching import plot_seen_within, plot_unwatched

__all__ = [
    "figure_svg",
    "plot_deadlock_rate",
    "plot_decision_time",
    "plot_edges",
    "plot_fundamental",
    "plot_laps",
    "plot_mean",
    "plot_seen_within",
    "plot_survival",
    "plot_unwatched",
]
