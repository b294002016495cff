"""What of a district was seen: the map of its streets, and how soon they were seen again."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from loopgate.analysis import columns as a
from loopgate.plots.road_map import beside, points
from loopgate.plots.style import HEAT_MAP, RC, looks
from loopgate.results import columns as run

__all__ = ["plot_seen_within", "plot_unwatched"]

_SIZE = (5.2, 3.5)
_WIDTH = 6.2
_UNSEEN = "#D55E00"
_SHIFT = 0.004  # of the extent: both directions of a road stay apart


@mpl.rc_context(RC)
def plot_unwatched(
    streets: pd.DataFrame, value: str = run.WORST_IDLENESS, *, label: str = "longest time unseen [s]"
) -> Figure:
    """Draw the map of a district: dark and thick where streets went unseen for long, dashed where for good.

    Parameters
    ----------
    streets
        ``streets.parquet``: `SHAPE` ("x,y x,y ..." [m]), `VISITS` and the figure.
    value, label
        The column with the figure, and what the scale says.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.plots import plot_unwatched
    >>> shapes = ["0,0 80,0", "80,0 80,60", "80,60 0,0"]
    >>> streets = pd.DataFrame({"shape": shapes, "visits": [9, 2, 0], "worst_idleness_s": [60, 300, 3600]})
    >>> figure = plot_unwatched(streets)
    >>> figure.savefig("unwatched.svg")
    """
    lines = [points(str(text)) for text in streets[run.SHAPE]]
    every = np.concatenate(lines) if lines else np.zeros((1, 2))
    low, high = every.min(axis=0), every.max(axis=0)
    extent = float(max(*(high - low), 1.0))
    tall = float((high - low)[1]) / float(max((high - low)[0], 1.0))
    figure = Figure(figsize=(_WIDTH, min(max(tall, 0.35), 1.4) * _WIDTH + 1.1))
    axes = figure.subplots()
    seen = (streets[run.VISITS] > 0).to_numpy()
    shifted = [beside(line, _SHIFT * extent) for line in lines]
    never = [line for line, visited in zip(shifted, seen, strict=True) if not visited]
    axes.add_collection(LineCollection(never, colors=_UNSEEN, linewidths=1.1, linestyles=(0, (3, 1.5))))
    order = np.argsort(streets[value].to_numpy(dtype=float), kind="stable")
    drawn = [k for k in order.tolist() if seen[k]]
    values = streets[value].to_numpy(dtype=float)[drawn]
    scale = Normalize(0.0, float(values.max(initial=1e-9)))
    share = np.asarray(scale(values), dtype=float)
    axes.add_collection(
        LineCollection(
            [shifted[k] for k in drawn],
            colors=mpl.colormaps[HEAT_MAP](0.08 + 0.92 * share),
            linewidths=1.2 + 2.8 * share,
            capstyle="round",
        )
    )
    axes.set_xlim(low[0] - 0.03 * extent, high[0] + 0.03 * extent)
    axes.set_ylim(low[1] - 0.03 * extent, high[1] + 0.03 * extent)
    axes.set_aspect("equal")
    axes.axis("off")
    if never:
        line = Line2D([], [], color=_UNSEEN, linewidth=1.1, linestyle=(0, (3, 1.5)))
        axes.legend([line], [f"never seen: {len(never)} of {len(lines)}"], loc="upper right")
    scaled = mpl.cm.ScalarMappable(scale, HEAT_MAP)
    bar = figure.colorbar(scaled, ax=axes, location="bottom", shrink=0.7, aspect=35, pad=0.02)
    bar.set_label(label)
    bar.outline.set_visible(False)
    return figure


@mpl.rc_context(RC)
def plot_seen_within(seen: Mapping[str, pd.DataFrame], *, bound_s: float | None = None) -> Figure:
    """Draw which share of the streets was seen within so long: at a random moment, and (thin) always.

    Parameters
    ----------
    seen
        Tables from `compute_seen_within`, by the name of the series.
    bound_s
        Time for which no street should go unseen [s], to be marked.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_seen_within
    >>> from loopgate.plots import plot_seen_within
    >>> rows = [(25, "v1", "edge", "e1"), (50, "v2", "edge", "e1"), (75, "v1", "edge", "e1")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> table = compute_seen_within(events=events, streets=["e1", "e2"], end_s=100)
    >>> figure = plot_seen_within({"covering": table}, bound_s=60)
    >>> figure.savefig("seen.svg")
    """
    figure = Figure(figsize=_SIZE)
    axes = figure.subplots()
    for (name, table), look in zip(seen.items(), looks(list(seen)).values(), strict=False):
        style = {"color": look.colour, "linestyle": look.dash}
        axes.plot(table[a.SEEN_WITHIN], table[a.NOW], label=name, **style)
        axes.plot(table[a.SEEN_WITHIN], table[a.ALWAYS], linewidth=0.8, **style)
    if bound_s is not None:
        axes.axvline(bound_s, color="#808080", linewidth=0.8, zorder=0)
        axes.text(bound_s, 0.02, f" {bound_s:g} s", fontsize=9)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_xlabel("seen within [s]: on average over time, and (thin) always")
    axes.set_ylabel("streets")
    if len(seen) > 1:
        axes.legend(loc="lower right")
    return figure
