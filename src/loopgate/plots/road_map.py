"""The road network as a heat map."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from loopgate.plots.style import HEAT_MAP, RC, Look, looks_of
from loopgate.results import columns as run
from loopgate.results import row_columns as c

__all__ = ["beside", "plot_edges", "points"]

_WIDTH = 5.2
_THIN, _THICK = 1.2, 5.0
_SHIFT = 0.006  # of the extent: both directions of a road stay apart
_MAPS = 4


@mpl.rc_context(RC)
def plot_edges(
    edges: pd.DataFrame,
    value: str,
    *,
    label: str = "",
    series: str = c.GATE,
    look: Mapping[str, Look] | None = None,
) -> Figure:
    """Draw the road network, each edge dark and thick where its figure is great: one map per series.

    Parameters
    ----------
    edges
        From `compute_edge_means`: the figure and `SHAPE` ("x,y x,y ..." [m]).
    value, label
        The column with the figure, and what the scale says.
    series
        The column that names series. At most four of those are drawn in which the figure is above 0; all
        share one scale.
    look
        Which series, in which order; default: all.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.plots import plot_edges
    >>> edges = pd.DataFrame({"gate": "open", "shape": ["0,0 80,0", "80,0 80,60"], "idleness_s": [20, 90]})
    >>> figure = plot_edges(edges, "idleness_s", label="idleness [s]")
    >>> figure.savefig("map.svg")
    """
    look = look or looks_of(edges[series])
    above = edges[edges[value] > 0][series].unique()
    known = above if len(above) else edges[series].unique()
    names = [name for name in look if name in known][:_MAPS]
    columns = min(len(names), 2) or 1
    rows = max(1, -(-len(names) // columns))
    shapes = {str(text): points(str(text)) for text in edges[run.SHAPE].unique()}
    every = np.concatenate(list(shapes.values())) if shapes else np.zeros((1, 2))
    low, high = every.min(axis=0), every.max(axis=0)
    extent = float(max(*(high - low), 1.0))
    tall = float((high - low)[1]) / float(max((high - low)[0], 1.0))
    height = min(max(tall, 0.35), 1.4) * _WIDTH / columns * rows
    figure = Figure(figsize=(_WIDTH, height + 0.9))
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    scale = Normalize(0.0, float(np.nanmax([edges[value].max(), 1e-9])))
    for axes, name in zip(grid.flat, names, strict=False):
        _draw(axes, edges[edges[series] == name], value, shapes, scale, extent)
        axes.set_title(name, fontsize=10)
        axes.set_xlim(low[0] - 0.03 * extent, high[0] + 0.03 * extent)
        axes.set_ylim(low[1] - 0.03 * extent, high[1] + 0.03 * extent)
    for axes in grid.flat:
        axes.set_aspect("equal")
        axes.axis("off")
    bar = figure.colorbar(
        mpl.cm.ScalarMappable(scale, HEAT_MAP),
        ax=list(grid.flat),
        location="bottom",
        shrink=0.7,
        aspect=35,
        pad=0.02,
    )
    bar.set_label(label)
    bar.outline.set_visible(False)
    return figure


def _draw(
    axes: Axes,
    edges: pd.DataFrame,
    value: str,
    shapes: Mapping[str, np.ndarray],
    scale: Normalize,
    extent: float,
) -> None:
    ordered = edges.sort_values(value, kind="stable", na_position="first")
    values = ordered[value].fillna(0.0).to_numpy(dtype=float)
    lines = [beside(shapes[str(text)], _SHIFT * extent) for text in ordered[run.SHAPE]]
    share = np.asarray(scale(values), dtype=float)
    axes.add_collection(
        LineCollection(
            lines,
            colors=mpl.colormaps[HEAT_MAP](0.08 + 0.92 * share),
            linewidths=_THIN + (_THICK - _THIN) * share,
            capstyle="round",
        )
    )


def points(text: str) -> np.ndarray:
    """Return the points of a shape as tables keep it, ``x,y x,y ...`` [m]."""
    return np.array([[float(v) for v in pair.split(",")[:2]] for pair in text.split()], dtype=float)


def beside(line: np.ndarray, distance: float) -> np.ndarray:
    """Return the line moved to its right, where the traffic of that direction drives."""
    along = np.gradient(line, axis=0) if len(line) > 1 else np.zeros_like(line)
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    moved: np.ndarray = line + distance * np.column_stack((along[:, 1], -along[:, 0])) / length
    return moved
