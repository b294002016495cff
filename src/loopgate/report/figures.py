"""The figures of the report; each takes the table it shows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter, MaxNLocator, PercentFormatter

from loopgate.analysis import columns as a
from loopgate.report.style import Look
from loopgate.results import row_columns as c

__all__ = [
    "SERIES",
    "deadlock_figure",
    "decision_figure",
    "fundamental_figure",
    "laps_figure",
    "mean_figure",
    "survival_figure",
]

SERIES = "series"  # gate, and whatever else varies besides network, vehicles and seed
_SIZE = (5.2, 3.5)
# How far series stand apart, as a share of the axis, so that intervals do not hide each other.
_SPREAD = 0.008


def mean_figure(means: pd.DataFrame, look: Mapping[str, Look], label: str) -> Figure:
    """Draw means with intervals against vehicles, from `compute_mean` by series and vehicles."""
    figure, axes = _frame()
    shift = _shifts(means, look)
    for series, part in _parts(means, look):
        x = part[c.VEHICLES] + shift[series]
        reach = np.abs(part[[a.LOW, a.HIGH]].sub(part[a.MEAN], axis=0).to_numpy(dtype=float).T)
        axes.errorbar(
            x, part[a.MEAN], yerr=np.nan_to_num(reach), capsize=2.5, label=series, **look[series].line()
        )
    axes.set_ylabel(label)
    _from_zero(axes)
    return _finish(figure, axes)


def deadlock_figure(rates: pd.DataFrame, look: Mapping[str, Look]) -> Figure:
    """Draw the share of runs that lock up, with Wilson intervals, from `compute_deadlock_rate`."""
    figure, axes = _frame()
    shift = _shifts(rates, look)
    for series, part in _parts(rates, look):
        x = part[c.VEHICLES] + shift[series]
        reach = np.abs(part[[a.LOW, a.HIGH]].sub(part[a.RATE], axis=0).to_numpy(dtype=float).T)
        axes.errorbar(x, part[a.RATE], yerr=reach, capsize=2.5, label=series, **look[series].line())
    axes.set_ylabel("runs that lock up")
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    return _finish(figure, axes)


def survival_figure(survival: pd.DataFrame, look: Mapping[str, Look]) -> Figure:
    """Draw Kaplan-Meier curves with their bands, from `compute_survival`: a panel per vehicle count."""
    counts = sorted(survival[c.VEHICLES].unique())
    columns = min(len(counts), 2) or 1
    rows = max(1, -(-len(counts) // columns))
    figure = Figure(figsize=(_SIZE[0], _SIZE[1] if rows == 1 else 2.2 * rows + 0.9))
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for axes, count in zip(grid.flat, counts, strict=False):
        axes.set_title(f"{count:g} vehicles", fontsize=10)
        for series, part in _parts(survival[survival[c.VEHICLES] == count], look):
            _survival_curve(axes, series, part, look[series])
    for axes in grid.flat[len(counts) :]:
        axes.set_axis_off()
    figure.supxlabel("simulated time [s]", fontsize=10)
    figure.supylabel("runs not yet locked up", fontsize=10)
    grid[0, 0].set_ylim(-0.03, 1.03)
    grid[0, 0].yaxis.set_major_formatter(PercentFormatter(1.0))
    return _legend(figure, grid.flat)


def _survival_curve(axes: Axes, series: str, part: pd.DataFrame, style: Look) -> None:
    axes.step(
        part[a.AT], part[a.SURVIVAL], where="post", label=series, color=style.colour, linestyle=style.dash
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


def laps_figure(laps: pd.DataFrame, look: Mapping[str, Look]) -> Figure:
    """Draw lap times as boxes (25 to 75 %) with whiskers (5 to 95 %), from `compute_lap_distribution`."""
    figure, axes = _frame()
    counts = sorted(laps[c.VEHICLES].unique())
    names = [name for name in look if (laps[SERIES] == name).any()]
    width = 0.8 / max(len(names), 1)
    for number, series in enumerate(names):
        style = look[series]
        part = laps[laps[SERIES] == series].pivot_table(
            index=c.VEHICLES, columns=a.QUANTILE, values=a.LAP_TIME, observed=True
        )
        boxes = [
            {"whislo": row[0.05], "q1": row[0.25], "med": row[0.5], "q3": row[0.75], "whishi": row[0.95]}
            for _, row in part.iterrows()
        ]
        at = [counts.index(n) + (number - (len(names) - 1) / 2) * width for n in part.index]
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
        axes.plot(at, medians, linestyle="none", marker=style.marker, color=style.colour, label=series)
    axes.set_xticks(range(len(counts)), [f"{n:g}" for n in counts])
    axes.set_ylabel("lap time [s]")
    axes.set_ylim(bottom=0)
    return _finish(figure, axes, whole=False)


def decision_figure(decisions: pd.DataFrame, look: Mapping[str, Look]) -> Figure:
    """Draw median and 99th percentile of the decision time, from `compute_decision_time`."""
    figure, axes = _frame()
    for series, part in _parts(decisions, look):
        style = look[series]
        axes.plot(part[c.VEHICLES], part[c.DECISION_MEDIAN], label=f"{series}, median", **style.line())
        axes.plot(
            part[c.VEHICLES],
            part[c.DECISION_P99],
            label=f"{series}, 99 %",
            **{**style.line(), "linestyle": "dotted", "markerfacecolor": "white"},
        )
    axes.set_ylabel("decision time [µs]")
    axes.set_yscale("log")
    for which in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        which(LogFormatter(minor_thresholds=(2.0, 0.7)))
    return _finish(figure, axes)


def fundamental_figure(runs: pd.DataFrame, look: Mapping[str, Look]) -> Figure:
    """Draw flow over density, means over seeds, from `compute_fundamental`."""
    figure, axes = _frame()
    means = runs.groupby([SERIES, c.VEHICLES], observed=True)[[a.DENSITY, a.FLOW]].mean().reset_index()
    for series, part in _parts(means, look):
        axes.plot(part[a.DENSITY], part[a.FLOW], label=series, **look[series].line())
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


def _parts(table: pd.DataFrame, look: Mapping[str, Look]) -> list[tuple[str, pd.DataFrame]]:
    parts = [(series, table[table[SERIES] == series]) for series in look]
    return [(series, part) for series, part in parts if len(part)]


def _shifts(table: pd.DataFrame, look: Mapping[str, Look]) -> dict[str, float]:
    counts = table[c.VEHICLES].dropna()
    span = float(counts.max() - counts.min()) if len(counts) else 0.0
    # Round a single count there is room: its neighbours on the axis are no counts that were run.
    step = _SPREAD * span * min(1.0, 4 / max(len(look), 1)) if span else 0.8 / max(len(look), 1)
    names: Sequence[str] = list(look)
    return {series: (i - (len(names) - 1) / 2) * step for i, series in enumerate(names)}


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
