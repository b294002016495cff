"""Figures from the tables that `loopgate.analysis` computes: one line, marker or box style per series."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter, MaxNLocator, PercentFormatter

from loopgate.analysis import columns as a
from loopgate.plots.style import RC, Look, looks_of
from loopgate.results import row_columns as c

__all__ = [
    "plot_deadlock_rate",
    "plot_decision_time",
    "plot_fundamental",
    "plot_laps",
    "plot_mean",
    "plot_survival",
]

_SIZE = (5.2, 3.5)
_SPREAD = 0.008
"""Distance between neighbouring series, as a share of the axis."""


@mpl.rc_context(RC)
def plot_mean(
    means: pd.DataFrame, label: str = "", *, series: str = c.GATE, look: Mapping[str, Look] | None = None
) -> Figure:
    """Draw means with intervals against vehicles, from `compute_mean` by series and vehicles.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_mean
    >>> from loopgate.plots import plot_mean
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "km_per_h": [90.0, 150.0]})
    >>> figure = plot_mean(compute_mean(runs=runs), "vehicle-km/h")
    >>> figure.savefig("figure.svg")
    """
    figure, axes = _frame()
    for name, part, style, shift in _lines(means, series, look):
        x = part[c.VEHICLES] + shift
        reach = np.abs(part[[a.LOW, a.HIGH]].sub(part[a.MEAN], axis=0).to_numpy(dtype=float).T)
        axes.errorbar(x, part[a.MEAN], yerr=np.nan_to_num(reach), capsize=2.5, label=name, **style.line())
    axes.set_ylabel(label)
    _from_zero(axes)
    return _finish(figure, axes)


@mpl.rc_context(RC)
def plot_deadlock_rate(
    rates: pd.DataFrame, *, series: str = c.GATE, look: Mapping[str, Look] | None = None
) -> Figure:
    """Draw the share of runs that lock up, with Wilson intervals, from `compute_deadlock_rate`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_deadlock_rate
    >>> from loopgate.plots import plot_deadlock_rate
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "deadlocks": [0, 1]})
    >>> figure = plot_deadlock_rate(compute_deadlock_rate(runs=runs))
    >>> figure.savefig("figure.svg")
    """
    figure, axes = _frame()
    for name, part, style, shift in _lines(rates, series, look):
        x = part[c.VEHICLES] + shift
        reach = np.abs(part[[a.LOW, a.HIGH]].sub(part[a.RATE], axis=0).to_numpy(dtype=float).T)
        axes.errorbar(x, part[a.RATE], yerr=reach, capsize=2.5, label=name, **style.line())
    axes.set_ylabel("runs that lock up")
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    return _finish(figure, axes)


@mpl.rc_context(RC)
def plot_survival(
    survival: pd.DataFrame, *, series: str = c.GATE, look: Mapping[str, Look] | None = None
) -> Figure:
    """Draw Kaplan-Meier curves with their bands, from `compute_survival`, one panel per vehicle count.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_survival
    >>> from loopgate.plots import plot_survival
    >>> runs = pd.DataFrame({"gate": "open", "first_deadlock_s": [900, None], "observed_s": [900, 3600]})
    >>> figure = plot_survival(compute_survival(runs=runs))
    >>> figure.savefig("figure.svg")
    """
    panels = [("", survival)]
    if c.VEHICLES in survival:
        panels = [(f"{count:g} vehicles", part) for count, part in survival.groupby(c.VEHICLES, sort=True)]
    columns = min(len(panels), 2) or 1
    rows = max(1, -(-len(panels) // columns))
    figure = Figure(figsize=(_SIZE[0], _SIZE[1] if rows == 1 else 2.2 * rows + 0.9))
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    look = look or looks_of(survival[series])
    for axes, (title, panel) in zip(grid.flat, panels, strict=False):
        axes.set_title(title, fontsize=10)
        for name, part, style, _ in _lines(panel, series, look):
            _survival_curve(axes, name, part, style)
    for axes in grid.flat[len(panels) :]:
        axes.set_axis_off()
    figure.supxlabel("simulated time [s]", fontsize=10)
    figure.supylabel("runs not yet locked up", fontsize=10)
    grid[0, 0].set_ylim(-0.03, 1.03)
    grid[0, 0].yaxis.set_major_formatter(PercentFormatter(1.0))
    return _legend(figure, grid.flat)


def _survival_curve(axes: Axes, name: str, part: pd.DataFrame, style: Look) -> None:
    axes.step(
        part[a.AT], part[a.SURVIVAL], where="post", label=name, color=style.colour, linestyle=style.dash
    )
    axes.fill_between(
        part[a.AT],
        part[a.LOW].astype(float),
        part[a.HIGH].astype(float),
        step="post",
        color=style.colour,
        alpha=0.15,
        linewidth=0,
    )
    ends = part[part[a.CENSORED] > 0]
    axes.plot(ends[a.AT], ends[a.SURVIVAL], linestyle="none", marker="|", color=style.colour)


@mpl.rc_context(RC)
def plot_laps(laps: pd.DataFrame, *, series: str = c.GATE, look: Mapping[str, Look] | None = None) -> Figure:
    """Draw lap times as boxes (25 to 75 %) with whiskers (5 to 95 %), from `compute_lap_distribution`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_lap_distribution
    >>> from loopgate.plots import plot_laps
    >>> quantiles = [60.0 + number for number in range(21)]
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": 40, "laps": 120, "lap_quantiles_s": [quantiles]})
    >>> figure = plot_laps(compute_lap_distribution(runs=runs))
    >>> figure.savefig("figure.svg")
    """
    figure, axes = _frame()
    counts = sorted(laps[c.VEHICLES].unique())
    lines = _lines(laps, series, look)
    width = 0.8 / max(len(lines), 1)
    for number, (name, rows, style, _) in enumerate(lines):
        part = rows.pivot_table(index=c.VEHICLES, columns=a.QUANTILE, values=a.LAP_TIME, observed=True)
        boxes = [
            {"whislo": row[0.05], "q1": row[0.25], "med": row[0.5], "q3": row[0.75], "whishi": row[0.95]}
            for _, row in part.iterrows()
        ]
        at = [counts.index(n) + (number - (len(lines) - 1) / 2) * width for n in part.index]
        line = {"color": style.colour, "linewidth": 1.2}
        axes.bxp(
            boxes,
            positions=at,
            widths=width * 0.8,
            showfliers=False,
            patch_artist=True,
            boxprops={"facecolor": style.colour, "alpha": 0.35, "edgecolor": style.colour},
            medianprops={"color": style.colour, "linewidth": 2},
            whiskerprops=line,
            capprops=line,
        )
        medians = [box["med"] for box in boxes]
        axes.plot(at, medians, linestyle="none", marker=style.marker, color=style.colour, label=name)
    axes.set_xticks(range(len(counts)), [f"{n:g}" for n in counts])
    axes.set_ylabel("lap time [s]")
    axes.set_ylim(bottom=0)
    return _finish(figure, axes, whole=False)


@mpl.rc_context(RC)
def plot_decision_time(
    decisions: pd.DataFrame, *, series: str = c.GATE, look: Mapping[str, Look] | None = None
) -> Figure:
    """Draw median and 99th percentile of the decision time, from `compute_decision_time`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_decision_time
    >>> from loopgate.plots import plot_decision_time
    >>> runs = pd.DataFrame({"gate": ["banker"], "vehicles": [40], "decisions": [1000], "refusals": [250]})
    >>> runs = runs.assign(messages=None, decision_median_us=5.0, decision_p99_us=30.0, decision_max_us=90.0)
    >>> figure = plot_decision_time(compute_decision_time(runs=runs))
    >>> figure.savefig("figure.svg")
    """
    figure, axes = _frame()
    for name, part, style, _ in _lines(decisions, series, look):
        axes.plot(part[c.VEHICLES], part[c.DECISION_MEDIAN], label=f"{name}, median", **style.line())
        axes.plot(
            part[c.VEHICLES],
            part[c.DECISION_P99],
            label=f"{name}, 99 %",
            **{**style.line(), "linestyle": "dotted", "markerfacecolor": "white"},
        )
    axes.set_ylabel("decision time [µs]")
    axes.set_yscale("log")
    for which in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        which(LogFormatter(minor_thresholds=(2.0, 0.7)))
    return _finish(figure, axes)


@mpl.rc_context(RC)
def plot_fundamental(
    runs: pd.DataFrame, *, series: str = c.GATE, look: Mapping[str, Look] | None = None
) -> Figure:
    """Draw flow over density, means over seeds, from `compute_fundamental`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_fundamental
    >>> from loopgate.plots import plot_fundamental
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "edge_km": 8.0, "km_per_h": [500, 800]})
    >>> runs = runs.assign(mean_speed_mps=[7.0, 5.0])
    >>> figure = plot_fundamental(compute_fundamental(runs=runs))
    >>> figure.savefig("figure.svg")
    """
    figure, axes = _frame()
    means = runs.groupby([series, c.VEHICLES], observed=True)[[a.DENSITY, a.FLOW]].mean().reset_index()
    for name, part, style, _ in _lines(means, series, look):
        axes.plot(part[a.DENSITY], part[a.FLOW], label=name, **style.line())
    axes.set_xlabel("density [vehicles per km of road on loops]")
    axes.set_ylabel("flow [vehicles/h]")
    axes.set_ylim(bottom=0)
    axes.set_xlim(left=0)
    return _finish(figure, axes, vehicles=False)


def _frame() -> tuple[Figure, Axes]:
    figure = Figure(figsize=_SIZE)
    return figure, figure.subplots()


def _from_zero(axes: Axes) -> None:
    """Let the axis begin at 0 and end a little above the highest point, so that its marker is whole."""
    axes.set_ylim(0.0, 1.07 * max(float(axes.dataLim.intervaly[1]), 1e-9))


class _Line(NamedTuple):
    """A series as it is drawn: beside its neighbours, so that intervals do not hide each other."""

    name: str
    rows: pd.DataFrame
    style: Look
    shift: float


def _lines(table: pd.DataFrame, series: str, look: Mapping[str, Look] | None) -> list[_Line]:
    look = look or looks_of(table[series])
    counts = table[c.VEHICLES].dropna() if c.VEHICLES in table else pd.Series(dtype=float)
    span = float(counts.max() - counts.min()) if len(counts) else 0.0
    # Round a single count there is room: its neighbours on the axis are no counts that were run.
    step = _SPREAD * span * min(1.0, 4 / max(len(look), 1)) if span else 0.8 / max(len(look), 1)
    lines = [
        _Line(name, table[table[series] == name], style, (number - (len(look) - 1) / 2) * step)
        for number, (name, style) in enumerate(look.items())
    ]
    return [line for line in lines if len(line.rows)]


def _finish(figure: Figure, axes: Axes, *, vehicles: bool = True, whole: bool = True) -> Figure:
    if vehicles:
        axes.set_xlabel("vehicles")
        low, high = axes.dataLim.intervalx
        if whole and high - low < 1.0:
            middle = round((low + high) / 2)
            axes.set_xlim(middle - 1, middle + 1)
            axes.set_xticks([middle])
        elif whole:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    return _legend(figure, [axes])


def _legend(figure: Figure, panels: Iterable[Axes]) -> Figure:
    """Name each series once, below all panels."""
    known: dict[str, Artist] = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        known.update(zip(map(str, labels), handles, strict=True))
    if known:
        columns = 1 if max(map(len, known)) > 24 else min(len(known), 3)  # noqa: PLR2004 - fits a phone
        figure.legend(list(known.values()), list(known), loc="outside lower center", ncols=columns)
    return figure
