"""The map: roads, loops, and the zones where loops meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.survey import survey
from loopgate.errors import ResultsError
from loopgate.model import StateId
from loopgate.network.contacts import Floats
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["COLOURS", "draw_map"]

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#8C510A", "#332288", "#999933")
"""Colours of the loops: told apart also by people who see red and green alike (Okabe and Ito; Tol)."""

_DASHES: tuple[Literal["solid"] | tuple[float, tuple[float, ...]], ...] = (
    "solid",
    (0, (5, 1.2)),
    (0, (1.2, 1.0)),
)
_WIDTHS = (1.6, 1.1, 0.75)
"""Broad loops lie below narrow ones, so that loops on the same lane are stripes side by side."""

_ZONE = "#D55E00"
_ROAD, _CASING, _INK = "#ffffff", "#c3c9ce", "#23292e"
_GROUND = "#f1f2f0"
_CARS = frozenset({"passenger", "bus", "delivery"})
_LEGEND_LOOPS = 24
_SIZE_IN = 11.0
_PANEL_IN = 2.7
"""Width of the legend beside the map."""


def draw_map(
    network: RoadNetwork,
    loops: Sequence[Loop],
    itineraries: Sequence[Itinerary],
    file: Path | str,
    *,
    starts_m: Sequence[float] = (),
    title: str = "",
) -> None:
    """Draw roads, loops and zones to a picture; the name's ending says which format (PNG, SVG, PDF).

    Parameters
    ----------
    network
        The roads.
    loops
        One per vehicle.
    itineraries
        One per loop, to draw its zones; or none.
    file
        The picture.
    starts_m
        Arc length of each vehicle's front at the beginning [m], to mark it; possibly none.
    title
        A line above the map.

    Raises
    ------
    ResultsError
        If the file cannot be written.
    """
    with mpl.rc_context({"font.family": "sans-serif", "font.size": 9.0, "svg.hashsalt": "loopgate"}):
        figure = Figure(figsize=(_SIZE_IN, _SIZE_IN), facecolor=_GROUND)
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, _SIZE_IN / (_SIZE_IN + _PANEL_IN), 1.0))
        axes.set_axis_off()
        axes.set_aspect("equal")
        _frame(axes, figure, network, loops)
        points_per_m = _points_per_m(axes)
        _roads(axes, network, points_per_m)
        found = survey(itineraries)
        zones = {zone.state: zone.length_m for zone in found.zones}
        if itineraries:
            _zones(axes, loops, itineraries, zones, points_per_m)
        _loops(axes, loops, starts_m, points_per_m)
        _scale_bar(axes)
        shares = {loop.loop: loop.shared for loop in found.loops}
        _legend(axes, loops, shares, len(found.zones), starts=bool(starts_m))
        if title:
            axes.text(
                0.015,
                0.985,
                title,
                transform=axes.transAxes,
                va="top",
                fontsize=14,
                color=_INK,
                weight="bold",
            )
        try:
            Path(file).parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(file, dpi=170, facecolor=_GROUND)
        except (OSError, ValueError) as error:
            msg = f"{file}: cannot write the picture ({error})"
            raise ResultsError(msg) from error


def _frame(axes: Axes, figure: Figure, network: RoadNetwork, loops: Sequence[Loop]) -> None:
    """Show the loops with some room round them; the whole network where there are no loops."""
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


def _points_per_m(axes: Axes) -> float:
    low, high = axes.get_xlim()
    return _SIZE_IN * 72.0 / (high - low)


def _roads(axes: Axes, network: RoadNetwork, points_per_m: float) -> None:
    edges = [edge for edge in network.edges.values() if any(edge.allows(vclass) for vclass in _CARS)]
    lanes = [lane for edge in edges for lane in edge.lanes if lane.allowed & _CARS]
    shapes = [np.asarray(lane.shape) for lane in lanes]
    junctions = {name: None for edge in edges for name in (edge.from_junction, edge.to_junction)}
    outlines = [np.asarray(shape) for name in junctions if (shape := network.junctions[name].shape)]
    for colour, extra, order in ((_CASING, 1.2, 1), (_ROAD, 0.0, 2)):
        widths = [max(lane.width_m * points_per_m, 0.5) + extra for lane in lanes]
        axes.add_collection(
            LineCollection(shapes, colors=colour, linewidths=widths, zorder=order, capstyle="butt"),
            autolim=False,
        )
        axes.add_collection(
            PolyCollection(outlines, facecolors=colour, edgecolors=colour, linewidths=extra, zorder=order),
            autolim=False,
        )


def _zones(
    axes: Axes,
    loops: Sequence[Loop],
    itineraries: Sequence[Itinerary],
    zones: Mapping[StateId, float],
    points_per_m: float,
) -> None:
    width = float(np.clip(9.0 * points_per_m, 5.0, 16.0))
    where: dict[str, list[Floats]] = {}
    for loop, itinerary in zip(loops, itineraries, strict=True):
        curve = loop.curve()
        for leg in itinerary.legs:
            if leg.state in zones:
                where.setdefault(leg.state, []).append(_stretch(curve, loop.length_m, leg.begin_m, leg.end_m))
    every = [line for lines in where.values() for line in lines]
    # A pale band with a darker edge, so that it reads in grey as well.
    for colour, extra, order in ((_ZONE, 1.6, 3), ("#FBD9BF", 0.0, 4)):
        axes.add_collection(
            LineCollection(
                every,
                colors=colour,
                linewidths=width + extra,
                zorder=order,
                capstyle="round",
                joinstyle="round",
            ),
            autolim=False,
        )
    for state, lines in where.items():
        longest = max(lines, key=len)
        x, y = longest[len(longest) // 2]
        axes.annotate(
            state.removeprefix("zone"),
            (x, y),
            xytext=(8, 8),
            textcoords="offset points",
            fontsize=8,
            weight="bold",
            color="#8A3B00",
            zorder=11,
            bbox={"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": _ZONE, "linewidth": 0.8},
        )


def _loops(axes: Axes, loops: Sequence[Loop], starts_m: Sequence[float], points_per_m: float) -> None:
    width = float(np.clip(2.2 * points_per_m, 1.6, 2.6))
    for number, loop in enumerate(loops):
        points, arcs = loop.curve()
        colour, dash = _style(number)
        axes.plot(
            *np.vstack((points, points[:1])).T,
            color=colour,
            linestyle=dash,
            linewidth=width * _WIDTHS[number % len(_WIDTHS)],
            zorder=6.0 + 0.1 * (number % len(_WIDTHS)),
        )
        _arrows(axes, points, arcs, loop.length_m, colour)
        if number < len(starts_m):
            x, y = _at(points, arcs, starts_m[number] % loop.length_m)
            axes.plot(
                x,
                y,
                marker="o",
                markersize=7.5,
                markerfacecolor=colour,
                markeredgecolor="white",
                markeredgewidth=1.4,
                zorder=10,
            )


def _style(number: int) -> tuple[str, Literal["solid"] | tuple[float, tuple[float, ...]]]:
    return COLOURS[number % len(COLOURS)], _DASHES[number // len(COLOURS) % len(_DASHES)]


def _arrows(axes: Axes, points: Floats, arcs: Floats, length_m: float, colour: str) -> None:
    count = max(2, round(length_m / 350.0))
    for k in range(count):
        arc = (k + 0.5) * length_m / count
        tail, head = _at(points, arcs, arc), _at(points, arcs, min(arc + 4.0, length_m))
        if head == tail:
            continue
        axes.annotate(
            "",
            xy=head,
            xytext=tail,
            zorder=8,
            arrowprops={
                "arrowstyle": "-|>",
                "color": colour,
                "mutation_scale": 13.0,
                "linewidth": 0.0,
                "shrinkA": 0.0,
                "shrinkB": 0.0,
            },
        )


def _at(points: Floats, arcs: Floats, arc_m: float) -> tuple[float, float]:
    return float(np.interp(arc_m, arcs, points[:, 0])), float(np.interp(arc_m, arcs, points[:, 1]))


def _stretch(curve: tuple[Floats, Floats], lap_m: float, begin_m: float, end_m: float) -> Floats:
    """Return the curve between two arc lengths, which may lie beyond the lap's ends."""
    points, arcs = curve
    all_points = np.vstack((points, points, points))
    all_arcs = np.concatenate((arcs - lap_m, arcs, arcs + lap_m))
    inside = (all_arcs > begin_m) & (all_arcs < end_m)
    ends = [
        [np.interp(arc, all_arcs, all_points[:, 0]), np.interp(arc, all_arcs, all_points[:, 1])]
        for arc in (begin_m, end_m)
    ]
    return np.vstack((ends[0], all_points[inside], ends[1]))


def _scale_bar(axes: Axes) -> None:
    low, high = axes.get_xlim()
    wanted = (high - low) / 6.0
    size = 10.0 ** np.floor(np.log10(wanted))
    bar = max(size * step for step in (1.0, 2.0, 5.0) if size * step <= wanted)
    x, y = low + 0.02 * (high - low), axes.get_ylim()[0] + 0.025 * (high - low)
    axes.plot([x, x + bar], [y, y], color=_INK, linewidth=2.2, solid_capstyle="butt", zorder=12)
    axes.text(x + bar / 2.0, y + 0.006 * (high - low), f"{bar:g} m", ha="center", color=_INK, zorder=12)


def _legend(
    axes: Axes, loops: Sequence[Loop], shares: Mapping[str, float], zones: int, *, starts: bool
) -> None:
    entries = [
        Line2D(
            [],
            [],
            color=_style(k)[0],
            linestyle=_style(k)[1],
            linewidth=2.0 * _WIDTHS[k % len(_WIDTHS)],
            label=f"{loop.id}  {loop.length_m / 1000.0:.1f} km"
            + (f", {shares[loop.id]:.0%} shared" if loop.id in shares else ""),
        )
        for k, loop in enumerate(loops[:_LEGEND_LOOPS])
    ]
    if len(loops) > _LEGEND_LOOPS:
        entries.append(Line2D([], [], linestyle="none", label=f"and {len(loops) - _LEGEND_LOOPS} more loops"))
    if zones:
        band = Line2D([], [], color="#FBD9BF", linewidth=8, label=f"zones: one vehicle at a time ({zones})")
        entries.append(band)
    if starts:
        dot = Line2D(
            [],
            [],
            linestyle="none",
            marker="o",
            markersize=7.5,
            markerfacecolor=_INK,
            markeredgecolor="white",
            label="vehicle at its start",
        )
        entries.append(dot)
    legend = axes.legend(
        handles=entries,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        fontsize=8.5,
        frameon=False,
        borderpad=0.9,
        labelspacing=0.45,
        handlelength=2.6,
    )
    legend.set_zorder(20)
