"""The base of every map: a page, the roads in grey, a scale, a title."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from loopgate.arrays import Floats
from loopgate.disk import disk_error
from loopgate.errors import ResultsError
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork

Colours = str | Sequence[str] | Sequence[tuple[float, float, float, float]]

INK = "#23292e"
GROUND = "#f1f2f0"
_ROAD, _CASING = "#ffffff", "#c3c9ce"
_CARS = frozenset({"passenger", "bus", "delivery"})
DPI = 170
_SIZE_IN = 11.0
_PANEL_IN = 2.7
"""Width of the legend beside the map."""


@contextmanager
def base_map(
    network: RoadNetwork, loops: Sequence[Loop], file: Path | str, *, title: str = "", dpi: int = DPI
) -> Iterator[Axes]:
    """Yield a page with the roads round some loops; write it at the end of the ``with`` block.

    Raises `ResultsError` if the file cannot be written.

    Parameters
    ----------
    loops
        The loops that must be on the page; the whole network if there are none.
    file
        The picture; the name's ending says which format (PNG, SVG, PDF).
    dpi
        Pixels per inch of a PNG; the page is 13.7 inches wide.
    """
    with mpl.rc_context({"font.family": "sans-serif", "font.size": 9.0, "svg.hashsalt": "loopgate"}):
        figure = Figure(figsize=(_SIZE_IN, _SIZE_IN), facecolor=GROUND)
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, _SIZE_IN / (_SIZE_IN + _PANEL_IN), 1.0))
        axes.set_axis_off()
        axes.set_aspect("equal")
        _frame(axes, figure, network, loops)
        _roads(axes, network)
        yield axes
        _scale_bar(axes)
        if title:
            axes.text(
                0.015,
                0.985,
                title,
                transform=axes.transAxes,
                va="top",
                fontsize=14,
                color=INK,
                weight="bold",
                zorder=30,
            )
        try:
            Path(file).parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(file, dpi=dpi, facecolor=GROUND)
        except (OSError, ValueError) as error:
            why = disk_error(error) if isinstance(error, OSError) else error
            msg = f"{file}: cannot write the picture ({why})"
            raise ResultsError(msg) from error


def _frame(axes: Axes, figure: Figure, network: RoadNetwork, loops: Sequence[Loop]) -> None:
    """Show the loops with a margin, or the whole network if there are no loops."""
    if loops:
        points = np.concatenate([loop.curve()[0] for loop in loops])
    else:
        points = np.concatenate([np.asarray(lane.shape) for lane in network.lanes.values()])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.06 * float((high - low).max()) + 20.0
    low, high = low - margin, high + margin
    width, height = high - low
    # The page takes the shape of the map, within reason.
    ratio = float(np.clip(height / width, 0.55, 1.35))
    figure.set_size_inches(_SIZE_IN + _PANEL_IN, _SIZE_IN * ratio)
    middle = (low + high) / 2.0
    half = max(width, height / ratio) / 2.0
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half * ratio, middle[1] + half * ratio)


def draw_lines(
    axes: Axes,
    lines: Sequence[Floats],
    colours: Colours,
    widths: float | Sequence[float],
    order: float,
    **looks: Any,  # noqa: ANN401 - what matplotlib takes
) -> None:
    """Draw lines on the map, in one style or with a colour and a width for each."""
    drawn = LineCollection(lines, colors=colours, linewidths=widths, zorder=order, **looks)
    axes.add_collection(drawn, autolim=False)


def put_label(axes: Axes, text: str, at: Floats, colour: str, frame: str, order: float) -> None:
    """Write a text beside a point, in a frame."""
    axes.annotate(
        text,
        (float(at[0]), float(at[1])),
        xytext=(8, 8),
        textcoords="offset points",
        fontsize=8,
        weight="bold",
        color=colour,
        zorder=order,
        bbox={"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": frame, "linewidth": 0.8},
    )


def entry(label: str, **looks: Any) -> Line2D:  # noqa: ANN401 - what matplotlib takes
    """Return a line of the legend."""
    return Line2D([], [], label=label, **looks)


def put_legend(axes: Axes, entries: Sequence[Line2D], *, spacing: float, padding: float = 0.4) -> None:
    """Put the legend beside the map."""
    legend = axes.legend(
        handles=entries,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        fontsize=8.5,
        frameon=False,
        labelspacing=spacing,
        borderpad=padding,
        handlelength=2.6,
    )
    legend.set_zorder(20)


def points_per_m(axes: Axes) -> float:
    """Return how many points of the page a metre of road takes."""
    low, high = axes.get_xlim()
    return _SIZE_IN * 72.0 / (high - low)


def _roads(axes: Axes, network: RoadNetwork) -> None:
    scale = points_per_m(axes)
    edges = [edge for edge in network.edges.values() if any(edge.allows(vclass) for vclass in _CARS)]
    lanes = [lane for edge in edges for lane in edge.lanes if lane.allowed & _CARS]
    shapes = [np.asarray(lane.shape) for lane in lanes]
    junctions = {name: None for edge in edges for name in (edge.from_junction, edge.to_junction)}
    outlines = [np.asarray(shape) for name in junctions if (shape := network.junctions[name].shape)]
    for colour, extra, order in ((_CASING, 1.2, 1), (_ROAD, 0.0, 2)):
        widths = [max(lane.width_m * scale, 0.5) + extra for lane in lanes]
        draw_lines(axes, shapes, colour, widths, order)
        axes.add_collection(
            PolyCollection(outlines, facecolors=colour, edgecolors=colour, linewidths=extra, zorder=order),
            autolim=False,
        )


def _scale_bar(axes: Axes) -> None:
    low, high = axes.get_xlim()
    wanted = (high - low) / 6.0
    size = 10.0 ** np.floor(np.log10(wanted))
    bar = max(size * step for step in (1.0, 2.0, 5.0) if size * step <= wanted)
    x, y = low + 0.02 * (high - low), axes.get_ylim()[0] + 0.025 * (high - low)
    axes.plot([x, x + bar], [y, y], color=INK, linewidth=2.2, solid_capstyle="butt", zorder=12)
    axes.text(x + bar / 2.0, y + 0.006 * (high - low), f"{bar:g} m", ha="center", color=INK, zorder=12)
