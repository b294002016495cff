"""Each figure of the report from the table that it shows, for a notebook or a paper.

Tables come from `loopgate.analysis`; by default there is one series per gate, and the x axis shows vehicles.
The figures are Altair's charts: ``figure.save("throughput.svg")`` writes one (SVG, PNG, PDF, HTML, JSON).
"""

from loopgate.analysis.frames import of_tables
from loopgate.plots.charts import figure_svg, plot_capacity, plot_laps, plot_survival, unchecked
from loopgate.plots.course import plot_flow, plot_ranked, plot_time_space
from loopgate.plots.lines import (
    plot_against,
    plot_deadlock_rate,
    plot_decision_time,
    plot_fundamental,
    plot_mean,
    plot_paired,
)
from loopgate.plots.road_map import plot_edges
from loopgate.plots.watching import plot_seen_within, plot_unwatched

__all__ = [
    "figure_svg",
    "plot_against",
    "plot_capacity",
    "plot_deadlock_rate",
    "plot_decision_time",
    "plot_edges",
    "plot_flow",
    "plot_fundamental",
    "plot_laps",
    "plot_mean",
    "plot_paired",
    "plot_ranked",
    "plot_seen_within",
    "plot_survival",
    "plot_time_space",
    "plot_unwatched",
]

for _name in __all__:
    globals()[_name] = of_tables(unchecked(globals()[_name]), __name__)
