"""The content of a report: series, tables and figures, before any page is laid out."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypedDict

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from loopgate import plots
from loopgate.analysis import columns as a
from loopgate.analysis import (
    compute_capacity,
    compute_deadlock_rate,
    compute_decision_time,
    compute_edge_means,
    compute_fundamental,
    compute_lap_distribution,
    compute_mean,
    compute_paired,
    compute_survival,
    compute_time_to_deadlock,
)
from loopgate.analysis.frames import succeeded
from loopgate.plots.style import Look, looks_of, series_order
from loopgate.report.items import SERIES, FigureItem, Section, TableItem
from loopgate.results import columns as run
from loopgate.results import row_columns as c
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.runs.results import Results

__all__ = ["add_series", "common_count", "network_sections"]

_BY = [SERIES, c.VEHICLES]
_PERCENT = (0.05, 0.25, 0.5, 0.75, 0.95)
_MOST_PANELS = 6


class _Style(TypedDict):
    series: str
    look: Mapping[str, Look]


def add_series(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs with a column `SERIES`: the gate, and what else tells runs of equal vehicles apart.

    How many loops are in use follows from the number of vehicles where a file has more loops than that, so
    it tells runs apart only where they differ in nothing else.
    """
    other = (c.ABSTRACTION, c.NEGOTIATION, c.LIGHTS, c.DURATION, c.WARMUP, *_extra(runs))
    by_gate = runs.groupby(c.GATE, dropna=False)
    parts = [c.GATE, *(name for name in other if by_gate[name].nunique(dropna=False).max() > 1)]
    alike = runs.groupby([c.NETWORK, c.VEHICLES, *parts], dropna=False)
    if alike[c.LOOPS].nunique(dropna=False).max() > 1:
        parts.append(c.LOOPS)
    settings = runs[parts].drop_duplicates()
    labels = [", ".join(map(_label, parts, row)) for row in settings.itertuples(index=False)]
    return runs.merge(settings.assign(**{SERIES: labels}), on=parts, how="left").set_axis(runs.index)


def _extra(runs: pd.DataFrame) -> list[str]:
    """Return the columns that come from scenario keys without a column of their own."""
    return [name for name in runs.columns if name not in ROW_SCHEMA.names and name != SERIES]


def _label(name: str, value: object) -> str:
    if value is None or value != value:  # noqa: PLR0124 - NaN is what differs from itself
        return "no gate" if name == c.GATE else f"no {name}"
    if isinstance(value, float):
        value = f"{value:g}"
    return str(value) if name in {c.GATE, c.ABSTRACTION, c.NEGOTIATION} else f"{name} {value}"


def network_sections(results: Results) -> list[Section]:
    """Return a section for each network with a run that succeeded."""
    runs = succeeded(results.runs)
    runs = runs[runs[c.VEHICLES].notna()]
    if runs.empty:
        return []
    runs = add_series(runs)
    runs = runs.assign(**{c.NETWORK: runs[c.NETWORK].fillna("unknown network").map(_short)})
    return [_section(str(network), part, results) for network, part in runs.groupby(c.NETWORK, sort=True)]


def common_count(runs: pd.DataFrame) -> int:
    """Return the largest vehicle count with which every series was run, or as many of them as any count."""
    series = runs.groupby(c.VEHICLES)[SERIES].nunique()
    return int(series.index[series == series.max()].max())


def _panels(runs: pd.DataFrame) -> list[int]:
    """Return the vehicle counts whose survival is drawn: where runs lock up, spread evenly if too many."""
    locking = np.unique(runs.loc[runs[c.DEADLOCKS] > 0, c.VEHICLES].to_numpy(dtype=int))
    if not len(locking):
        return [common_count(runs)]
    chosen = np.linspace(0, len(locking) - 1, min(len(locking), _MOST_PANELS)).round().astype(int)
    return [int(count) for count in locking[chosen]]


def _panels_in_words(runs: pd.DataFrame) -> str:
    locking = runs.loc[runs[c.DEADLOCKS] > 0, c.VEHICLES].nunique()
    if locking > _MOST_PANELS:
        return f"for {_MOST_PANELS} of the {locking} vehicle counts with which runs lock up"
    return "for each vehicle count with which runs lock up" if locking else "for the largest vehicle count"


def _short(network: str) -> str:
    return re.sub(r"(\.net)?\.xml(\.gz)?$|\.sumocfg$", "", Path(network).name) or network


def _section(network: str, runs: pd.DataFrame, results: Results) -> Section:
    look = looks_of(runs[SERIES])
    names = series_order(runs[SERIES])
    tables = _tables(runs, names)
    by_name = {item.name: item.table for item in tables}
    return Section(
        network=network,
        runs=runs,
        count=common_count(runs),
        figures=_figures(runs, by_name, look, results),
        tables=tables,
        hidden=names[len(look) :],
    )


def _tables(runs: pd.DataFrame, names: Sequence[str]) -> list[TableItem]:
    baseline = names[0]
    laps = compute_lap_distribution(runs=runs, by=_BY, quantiles=_PERCENT)
    wide = laps.pivot_table(index=[*_BY, c.LAPS], columns=a.QUANTILE, values=a.LAP_TIME, observed=True)
    wide.columns = pd.Index([f"{100 * float(str(q)):.0f} % [s]" for q in wide.columns])
    revisits = compute_mean(runs=runs, value=c.MEAN_REVISIT, by=_BY)
    gated = runs[runs[c.AUDIT].ne(c.NOT_GATED) & runs[c.HOLD].notna()]
    tables = [
        TableItem(
            "throughput",
            "Throughput [vehicle-km/h]",
            compute_mean(runs=runs, value=c.KM_PER_H, by=_BY),
            'compute_mean(runs=runs, value="km_per_h", by=["gate", "vehicles"])',
        ),
        TableItem(
            "laps-per-hour",
            "Throughput [laps/h]",
            compute_mean(runs=runs, value=c.LAPS_PER_H, by=_BY),
            'compute_mean(runs=runs, value="laps_per_h", by=["gate", "vehicles"])',
        ),
        TableItem(
            "capacity",
            "Vehicle count at which throughput peaks",
            compute_capacity(runs=runs, by=[SERIES]),
            'compute_capacity(runs=runs, by=["gate"])',
        ),
        TableItem(
            "paired",
            f"Difference to {baseline} on the same seeds [vehicle-km/h]",
            _paired(runs, baseline),
            f'compute_paired(runs=runs, baseline="{baseline}", by=["vehicles"])',
        ),
        TableItem(
            "deadlocks",
            "Runs that lock up",
            compute_deadlock_rate(runs=runs, by=_BY),
            'compute_deadlock_rate(runs=runs, by=["gate", "vehicles"])',
        ),
        TableItem(
            "time-to-deadlock",
            "Time to the first deadlock",
            compute_time_to_deadlock(runs=runs, by=_BY),
            'compute_time_to_deadlock(runs=runs, by=["gate", "vehicles"])',
        ),
        TableItem(
            "laps",
            "Lap times",
            wide.reset_index(),
            'compute_lap_distribution(runs=runs, by=["gate", "vehicles"])',
        ),
        TableItem(
            "hold",
            "Time standing at gates, all vehicles together [s]",
            compute_mean(runs=gated, value=c.HOLD, by=_BY),
            'compute_mean(runs=runs.dropna(subset="hold_s"), value="hold_s", by=["gate", "vehicles"])',
        ),
        TableItem(
            "decisions",
            "Decisions",
            compute_decision_time(runs=runs[runs[c.DECISIONS] > 0], by=_BY),
            'compute_decision_time(runs=runs, by=["gate", "vehicles"])',
        ),
        TableItem(
            "revisits",
            "Revisit interval, mean over edges [s]",
            revisits,
            'compute_mean(runs=runs, value="mean_revisit_s", by=["gate", "vehicles"])',
        ),
        TableItem(
            "idleness",
            "Idleness: time since an edge's last visit, mean over edges and time [s]",
            compute_mean(runs=runs, value=c.IDLENESS, by=_BY),
            'compute_mean(runs=runs, value="idleness_s", by=["gate", "vehicles"])',
        ),
        TableItem(
            "worst-idleness",
            "Worst idleness: longest time that some edge had no visit [s]",
            compute_mean(runs=runs, value=c.WORST_IDLENESS, by=_BY),
            'compute_mean(runs=runs, value="worst_idleness_s", by=["gate", "vehicles"])',
        ),
    ]
    return [item for item in tables if len(item.table)]


def _paired(runs: pd.DataFrame, baseline: str) -> pd.DataFrame:
    # What makes a pair is the seed and the vehicles; where runs still repeat, their mean stands for them.
    once = runs.groupby([SERIES, c.VEHICLES, c.SEED], dropna=False)[[c.KM_PER_H]].mean().reset_index()
    compared = compute_paired(runs=once.rename(columns={SERIES: c.GATE}), baseline=baseline)
    return compared.rename(columns={c.GATE: SERIES})


def _figures(
    runs: pd.DataFrame, tables: Mapping[str, pd.DataFrame], look: Mapping[str, Look], results: Results
) -> list[FigureItem]:
    several = tables["throughput"][a.RUNS].max() > 1
    bars = "Means over seeds with 95 % intervals (Student's t)." if several else "One run each: no intervals."
    style: _Style = {"series": SERIES, "look": look}
    items: list[FigureItem] = []

    def add(name: str, title: str, caption: str, figure: Callable[[], Figure], code: str) -> None:
        items.append(FigureItem(name, title, caption, figure(), code))

    add(
        "throughput",
        "Throughput",
        bars,
        lambda: plots.plot_mean(tables["throughput"], "throughput [vehicle-km/h]", **style),
        'compute_mean(runs=runs, value="km_per_h", by=["gate", "vehicles"])',
    )
    add(
        "deadlock-rate",
        "Runs that lock up",
        "Share of runs with a deadlock, with 95 % Wilson intervals.",
        lambda: plots.plot_deadlock_rate(tables["deadlocks"], **style),
        'compute_deadlock_rate(runs=runs, by=["gate", "vehicles"])',
    )
    add(
        "survival",
        "Time to the first deadlock",
        f"Kaplan-Meier curves with 95 % bands, {_panels_in_words(runs)}; a tick marks runs that ended "
        "without deadlock.",
        lambda: plots.plot_survival(
            compute_survival(runs=runs[runs[c.VEHICLES].isin(_panels(runs))], by=_BY), **style
        ),
        'compute_survival(runs=runs, by=["gate", "vehicles"])',
    )
    laps = compute_lap_distribution(runs=runs, by=_BY, quantiles=_PERCENT)
    if len(laps):
        add(
            "laps",
            "Lap times",
            "Boxes hold the middle half of all laps, whiskers 5 to 95 %, markers the median.",
            lambda: plots.plot_laps(laps, **style),
            'compute_lap_distribution(runs=runs, by=["gate", "vehicles"])',
        )
    count = common_count(runs)
    edges = compute_edge_means(runs=runs[runs[c.VEHICLES] == count], edge_sets=results.edge_sets, by=[SERIES])
    of_count = f'runs=runs[runs["vehicles"] == {count}], edge_sets=results.edge_sets, by=["gate"]'
    held = edges[edges[run.EDGE_HOLD].notna()]
    if len(held):
        add(
            "map",
            "Where vehicles are held",
            f"Hold time per edge with {count} vehicles, mean over runs; dark and thick is long. Roads on no "
            "loop are not drawn.",
            lambda: plots.plot_edges(held, run.EDGE_HOLD, label="hold time per edge and run [s]", **style),
            f"compute_edge_means({of_count})",
        )
    if "decisions" in tables:
        add(
            "decision-time",
            "Decision time",
            "Median and 99th percentile of a run's decisions, each the median over runs.",
            lambda: plots.plot_decision_time(tables["decisions"], **style),
            'compute_decision_time(runs=runs, by=["gate", "vehicles"])',
        )
    if tables["revisits"][a.MEAN].notna().any():
        add(
            "revisits",
            "Revisit intervals",
            f"Time between two visits of an edge, mean over edges. {bars}",
            lambda: plots.plot_mean(tables["revisits"], "revisit interval [s]", **style),
            'compute_mean(runs=runs, value="mean_revisit_s", by=["gate", "vehicles"])',
        )
    for name, title, what in (
        (
            "idleness",
            "Idleness",
            "Time since an edge's last visit, mean over the edges on loops and over time.",
        ),
        ("worst-idleness", "Worst idleness", "The longest time that some edge on a loop had no visit."),
    ):
        if tables[name][a.MEAN].notna().any():
            means = tables[name]
            add(
                name,
                title,
                f"{what} {bars}",
                partial(plots.plot_mean, means, f"{title.lower()} [s]", **style),
                f'compute_mean(runs=runs, value="{name.replace("-", "_")}_s", by=["gate", "vehicles"])',
            )
    if len(edges) and edges[run.IDLENESS].notna().any():
        add(
            "idleness-map",
            "Which roads go unwatched",
            f"Idleness per edge with {count} vehicles, mean over runs; dark and thick is long.",
            lambda: plots.plot_edges(edges, run.IDLENESS, label="idleness per edge [s]", **style),
            f"compute_edge_means({of_count})",
        )
    fundamental = compute_fundamental(runs=runs)
    if len(fundamental[c.VEHICLES].unique()) > 1:
        add(
            "fundamental-diagram",
            "Fundamental diagram",
            "Flow over density, means over seeds.",
            lambda: plots.plot_fundamental(fundamental, **style),
            "compute_fundamental(runs=runs)",
        )
    return items
