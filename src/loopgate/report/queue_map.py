"""The map of queues: places by capacity, crossings, conflicts, refused loops."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from loopgate.abstraction.queue_survey import CrossingSurvey, QueueSurvey, RefusedLoop
from loopgate.arrays import Floats
from loopgate.network.loop import arc_lengths, cut_line
from loopgate.network.road import RoadNetwork
from loopgate.plots.road_map import beside
from loopgate.reading import listed
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

_STEPS = (2, 3, 4, 6, 10, 20)
"""Capacities at which a new colour begins."""

_COLOURS = "YlGnBu"
"""From pale to dark also for those who see red and green alike, and apart from the grey of the roads."""

_PALE, _DARK = 0.22, 1.0
_CROSSING, _CONFLICT, _REFUSED, _REFUSED_BAND = "#6c757d", "#D55E00", "#AA3377", "#EFC6DC"
_HALF_ROAD_M = 1.6
_DOT_SCALE = 1.2
"""Below so many points per metre a junction is too small for its conflicts to be seen: it gets a dot."""

_MOST_NAMES = 2
_NEAR_PT = 50.0
"""Refused loops whose marks lie nearer than this share a label."""


def draw_queues(
    network: RoadNetwork, found: QueueSurvey, file: Path | str, *, title: str = "", dpi: int = DPI
) -> None:
    """Draw places, crossings and refused loops to a PNG, SVG or PDF file.

    Raises `ResultsError` if the file cannot be written.

    Parameters
    ----------
    file
        The picture (PNG, SVG, PDF).
    """
    loops = [*found.loops, *(refusal.loop for refusal in found.refused)]
    with base_map(network, loops, file, title=title, dpi=dpi) as axes:
        scale = points_per_m(axes)
        width = float(np.clip(3.0 * scale, 2.4, 8.0))
        # Where lines are broader than roads, each direction moves to its side, so that both are seen.
        aside_m = max(0.0, 0.62 * width / scale - _HALF_ROAD_M)
        _crossings(axes, network, found, width, aside_m)
        _places(axes, network, found, width, aside_m)
        _conflicts(axes, network, found, scale)
        _refused(axes, found.refused, width, scale)
        _legend(axes, found, dots=scale < _DOT_SCALE)


def _places(axes: Axes, network: RoadNetwork, found: QueueSurvey, width: float, aside_m: float) -> None:
    lines = [
        _beside(_part(network, place.lane, place.begin_m, place.begin_m + place.length_m), aside_m)
        for place in found.places
    ]
    colours = [_colour(place.capacity) for place in found.places]
    for extra, colour, order in ((1.3, [INK] * len(lines), 4), (0.0, colours, 5)):
        draw_lines(axes, lines, colour, width + extra, order)


def _crossings(axes: Axes, network: RoadNetwork, found: QueueSurvey, width: float, aside_m: float) -> None:
    """Draw each crossing as a thin line; lanes too short to queue on are broader."""
    via = {connection.id: connection.via for connection in network.connections}
    thin = [
        np.asarray(network.lanes[lane].shape, dtype=np.float64)
        for crossing in found.crossings
        for lane in via.get(crossing.id, ())
    ]
    thin += [_over(network, crossing) for crossing in found.crossings if crossing.stretch is not None]
    joined = [np.asarray(network.lanes[lane.lane].shape, dtype=np.float64) for lane in found.joined]
    for lines, line_width in ((thin, 0.9), (joined, 0.55 * width)):
        draw_lines(axes, [_beside(line, aside_m) for line in lines], _CROSSING, line_width, 3)


def _over(network: RoadNetwork, crossing: CrossingSurvey) -> Floats:
    """Return the line of a stretch: along its lane, or straight between two lanes."""
    stretch = crossing.stretch
    if stretch is None:
        return np.zeros((0, 2))
    before, after = (
        _part(network, lane, stretch.begin_m, stretch.end_m)
        for lane in (crossing.from_lane, crossing.to_lane)
    )
    return before if crossing.from_lane == crossing.to_lane else np.vstack((before[0], after[-1]))


def _part(network: RoadNetwork, lane_id: str, begin_m: float, end_m: float) -> Floats:
    """Return the drawn shape of a part of a lane; positions are SUMO's, by its own length of the lane."""
    lane = network.lanes[lane_id]
    points = np.asarray(lane.shape, dtype=np.float64)
    return cut_line(points, arc_lengths(points, 0.0, lane.length_m), begin_m, end_m)


def _conflicts(axes: Axes, network: RoadNetwork, found: QueueSurvey, scale: float) -> None:
    """Mark the stretches that two movements share, or their junctions if the stretches are tiny."""
    via = {connection.id: connection.via for connection in network.connections}
    lines = [line for crossing in found.crossings for line in _shared(network, via, crossing)]
    over = [crossing for crossing in found.crossings if crossing.stretch is not None and crossing.conflicts]
    lines += [_over(network, crossing) for crossing in over]
    draw_lines(axes, lines, _CONFLICT, float(np.clip(1.0 * scale, 0.8, 2.6)), 7, capstyle="round")
    if scale < _DOT_SCALE:
        at: dict[str, int] = {}
        for crossing in found.crossings:
            if crossing.conflicts and crossing.junction:
                at[crossing.junction] = at.get(crossing.junction, 0) + len(crossing.conflicts)
        places = [(network.junctions[name].x, network.junctions[name].y) for name in at]
        places += [tuple(_over(network, crossing).mean(axis=0)) for crossing in over]
        dots = np.array(places).reshape(-1, 2)
        counts = [*at.values(), *(len(crossing.conflicts) for crossing in over)]
        sizes = [3.0 + 2.2 * np.sqrt(count / 2.0) for count in counts]
        axes.scatter(
            dots[:, 0],
            dots[:, 1],
            s=np.square(sizes),
            c=_CONFLICT,
            edgecolors="white",
            linewidths=0.6,
            zorder=8,
        )
    unlisted = [
        line.mean(axis=0)
        for crossing in found.crossings
        for line in _shared(network, via, crossing, unlisted=True)
    ]
    marks = np.array(unlisted).reshape(-1, 2)
    axes.scatter(
        marks[:, 0],
        marks[:, 1],
        s=52,
        marker="D",
        facecolors="none",
        edgecolors=INK,
        linewidths=1.3,
        zorder=9,
    )


def _shared(
    network: RoadNetwork, via: dict[str, tuple[str, ...]], crossing: CrossingSurvey, *, unlisted: bool = False
) -> Iterator[Floats]:
    """Yield the stretches of a crossing that it shares with others."""
    shapes = [np.asarray(network.lanes[lane].shape, dtype=np.float64) for lane in via.get(crossing.id, ())]
    if not shapes or crossing.length_m <= 0.0:
        return
    points = np.concatenate(shapes)
    arcs = arc_lengths(points, 0.0, crossing.length_m)
    for conflict in crossing.conflicts:
        if conflict.begin_m is None or conflict.end_m is None or (unlisted and conflict.listed):
            continue
        yield cut_line(points, arcs, conflict.begin_m, conflict.end_m)


def _refused(axes: Axes, refusals: Sequence[RefusedLoop], width: float, scale: float) -> None:
    """Draw refused loops as a band beneath the places, and mark the edge where each fails."""
    curves = [np.vstack((points, points[:1])) for points in (refusal.loop.curve()[0] for refusal in refusals)]
    for colour, line_width, dash, order in (
        (_REFUSED_BAND, width + 6.0, "solid", 2.4),
        (_REFUSED, 1.3, (0, (4, 1.6)), 2.6),
    ):
        draw_lines(axes, curves, colour, line_width, order, linestyles=[dash])
    labels: list[tuple[Floats, list[str]]] = []
    for refusal in refusals:
        at = refusal.loop.curve()[0][0]  # where no edge is to blame the label stands at the loop's beginning
        if refusal.edge is not None:
            spans = (span for span in refusal.loop.roads if span.edge == refusal.edge)
            at = np.asarray(next(spans).shapes[0][-1], dtype=np.float64)
            axes.plot(*at, "X", color=_REFUSED, markersize=10, markeredgecolor="white", zorder=11)
        near = next((names for where, names in labels if np.hypot(*(where - at)) * scale < _NEAR_PT), None)
        if near is None:
            labels.append((at, [refusal.loop.id]))
        else:
            near.append(refusal.loop.id)
    for at, names in labels:
        put_label(axes, listed(names, _MOST_NAMES), at, _REFUSED, _REFUSED, 12)


def _colour(capacity: int) -> tuple[float, float, float, float]:
    step = max(0, bisect_right(_STEPS, capacity) - 1)
    share = _PALE + (_DARK - _PALE) * step / (len(_STEPS) - 1)
    red, green, blue, alpha = mpl.colormaps[_COLOURS](share)
    return red, green, blue, alpha


def _beside(line: Floats, distance_m: float) -> Floats:
    """Return the line moved to its right."""
    steps = np.hypot(*np.diff(line, axis=0).T)
    line = line[np.concatenate(([True], steps > 0.0))]
    return beside(line, distance_m) if distance_m > 0.0 else line


def _legend(axes: Axes, found: QueueSurvey, *, dots: bool) -> None:
    entries: list[Line2D] = []
    for step, low in enumerate(_STEPS):
        high = _STEPS[step + 1] - 1 if step + 1 < len(_STEPS) else None
        inside = [p for p in found.places if low <= p.capacity and (high is None or p.capacity <= high)]
        if inside:
            span = f"{low}" if high == low else f"{low} or more" if high is None else f"{low} to {high}"
            label = f"place for {span} vehicles  ({len(inside)})"
            entries.append(entry(label, color=_colour(low), linewidth=6))
    entries.append(entry(f"crossing  ({len(found.crossings)})", color=_CROSSING, linewidth=1.2))
    if found.joined:
        label = f"lane too short to queue on  ({len(found.joined)})"
        entries.append(entry(label, color=_CROSSING, linewidth=3.5))
    if found.conflicts:
        style = {"linestyle": "none", "marker": "o", "markersize": 7.0} if dots else {"linewidth": 2.2}
        where = "conflicts here" if dots else "conflict of two crossings"
        entries.append(entry(f"{where}  ({found.conflicts})", color=_CONFLICT, **style))
    if found.unlisted:
        label = f"... that only geometry shows  ({len(found.unlisted)})"
        looks = {"marker": "D", "markerfacecolor": "none", "markeredgecolor": INK}
        entries.append(entry(label, linestyle="none", **looks))
    if found.refused:
        label = f"loop that cannot work  ({len(found.refused)})"
        mark = {"marker": "X", "markersize": 8, "markeredgecolor": "white"}
        entries.append(entry(label, color=_REFUSED, linestyle=(0, (4, 1.6)), **mark))
    put_legend(axes, entries, spacing=0.7)
