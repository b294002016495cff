"""The map: roads, loops, and the zones where loops meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.survey import survey
from loopgate.arrays import Floats
from loopgate.model import StateId
from loopgate.network.loop import Loop, cut_curve
from loopgate.network.road import RoadNetwork
from loopgate.reading import counted
from loopgate.report.base_map import (
    DPI,
    INK,
    base_map,
    draw_lines,
    entry,
    points_per_m,
    put_label,
    put_legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
_LEGEND_LOOPS = 24


def draw_map(
    network: RoadNetwork,
    loops: Sequence[Loop],
    itineraries: Sequence[Itinerary],
    file: Path | str,
    *,
    starts_m: Sequence[float] = (),
    unwatched: Sequence[str] = (),
    title: str = "",
    dpi: int = DPI,
) -> None:
    """Draw roads, loops and zones to a PNG, SVG or PDF file.

    Raises `ResultsError` if the file cannot be written.

    Parameters
    ----------
    loops
        One per vehicle.
    itineraries
        One per loop, to draw its zones; or none.
    starts_m
        Arc length of each vehicle's front at the beginning [m], to mark it; possibly none.
    unwatched
        Edges to mark as those that no loop reaches.
    """
    with base_map(network, loops, file, title=title, dpi=dpi) as axes:
        scale = points_per_m(axes)
        found = survey(itineraries)
        zones = {zone.state: zone.length_m for zone in found.zones}
        if itineraries:
            _zones(axes, itineraries, zones, scale)
        left = [np.asarray(lane.shape) for edge in unwatched for lane in network.edges[edge].lanes[:1]]
        draw_lines(axes, left, _ZONE, 1.4, 5)
        _loops(axes, loops, starts_m, scale)
        shares = {loop.loop: loop.shared for loop in found.loops}
        _legend(axes, loops, shares, len(found.zones), len(left), starts=bool(starts_m))


def _zones(
    axes: Axes,
    itineraries: Sequence[Itinerary],
    zones: Mapping[StateId, float],
    scale: float,
) -> None:
    width = float(np.clip(9.0 * scale, 5.0, 16.0))
    where: dict[str, list[Floats]] = {}
    for itinerary in itineraries:
        loop, curve = itinerary.loop, itinerary.loop.curve()
        for leg in itinerary.legs:
            if leg.state in zones:
                line = cut_curve(*curve, loop.length_m, leg.begin_m, leg.end_m)
                where.setdefault(leg.state, []).append(line)
    every = [line for lines in where.values() for line in lines]
    # A pale band with a darker edge, so that it reads in grey as well.
    for colour, extra, order in ((_ZONE, 1.6, 3), ("#FBD9BF", 0.0, 4)):
        draw_lines(axes, every, colour, width + extra, order, capstyle="round", joinstyle="round")
    for state, lines in where.items():
        longest = max(lines, key=len)
        middle = longest[len(longest) // 2]
        put_label(axes, state.removeprefix("zone"), middle, "#8A3B00", _ZONE, 11)


def _loops(axes: Axes, loops: Sequence[Loop], starts_m: Sequence[float], scale: float) -> None:
    width = float(np.clip(2.2 * scale, 1.6, 2.6))
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


def _legend(
    axes: Axes, loops: Sequence[Loop], shares: Mapping[str, float], zones: int, left: int, *, starts: bool
) -> None:
    entries = [
        entry(
            f"{loop.id}  {loop.length_m / 1000.0:.1f} km"
            + (f", {shares[loop.id]:.0%} shared" if loop.id in shares else ""),
            color=_style(k)[0],
            linestyle=_style(k)[1],
            linewidth=2.0 * _WIDTHS[k % len(_WIDTHS)],
        )
        for k, loop in enumerate(loops[:_LEGEND_LOOPS])
    ]
    if len(loops) > _LEGEND_LOOPS:
        entries.append(entry(f"and {counted(len(loops) - _LEGEND_LOOPS, 'more loop')}", linestyle="none"))
    if zones:
        entries.append(entry(f"zones: one vehicle at a time ({zones})", color="#FBD9BF", linewidth=8))
    if left:
        entries.append(entry(f"on no loop ({counted(left, 'street')})", color=_ZONE, linewidth=1.4))
    if starts:
        dot = {"marker": "o", "markersize": 7.5, "markerfacecolor": INK, "markeredgecolor": "white"}
        entries.append(entry("vehicle at its start", linestyle="none", **dot))
    put_legend(axes, entries, spacing=0.45, padding=0.9)
