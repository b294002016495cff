"""The content of a report: series, tables and figures, before any page is laid out."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd

from loopgate import plots
from loopgate.analysis import (
    add_series,
    compute_capacity,
    compute_deadlock_rate,
    compute_decision_time,
    compute_edge_means,
    compute_flow,
    compute_fundamental,
    compute_lap_distribution,
    compute_longest_waits,
    compute_mean,
    compute_paired,
    compute_ranked,
    compute_survival,
    compute_time_to_deadlock,
    compute_trips,
)
from loopgate.analysis import columns as a
from loopgate.analysis.statistics import FEWEST, NO_INTERVAL
from loopgate.plots.course import CUMULATIVE, OVER_TIME
from loopgate.plots.style import MAX_SERIES, series_order
from loopgate.report.items import Content, Section
from loopgate.report.single import add_single_run
from loopgate.results import columns as run
from loopgate.results import row_columns as c
from loopgate.runs.results import Results

_BY = [a.SERIES, c.VEHICLES]
_PERCENT = [0.05, 0.25, 0.5, 0.75, 0.95]
_MOST_PANELS = 6
_MOST_POINTS = 2000
"""Single runs are drawn up to so many."""

_MOST_FLOWS = 24
_RANKED = 10
_SINGLE = [*_BY, c.SEED, c.TRUNCATED, c.MEASURED, c.KM_PER_H, c.KM_PER_H_MEASURED, c.LAPS_PER_H]
_SINGLE += [c.MEAN_SPEED, c.STOOD, c.STOOD_SHARE, c.MEAN_REVISIT, c.IDLENESS]
_SINGLE += [
    c.ARRIVED,
    c.UNFINISHED,
    c.MEAN_TIME_LOSS,
    c.MEAN_DEPART_DELAY,
    c.MEAN_DELAY,
    c.WORST_DELAY,
    c.WORST_IDLENESS,
    a.DENSITY,
    a.FLOW,
    a.SPEED,
]

_MEANS = (
    ("throughput", "Throughput", "throughput [vehicle-km/h]", c.KM_PER_H, ""),
    ("laps-per-hour", "Laps", "laps [1/h]", c.LAPS_PER_H, ""),
    ("speed", "Mean speed", "mean speed [m/s]", c.MEAN_SPEED, "Over all vehicles and the whole time."),
    ("delay", "Delay of trips", "mean delay [s]", c.MEAN_DELAY, "Time loss and wait to depart."),
    ("worst-delay", "Worst delay", "worst delay of a trip [s]", c.WORST_DELAY, "Of any trip in a run."),
    ("unfinished", "Trips not finished", "trips not at their ends", c.UNFINISHED, "When the run ended."),
    (
        "standing",
        "Time standing",
        "share of vehicle time standing",
        c.STOOD_SHARE,
        "Slower than 0.1 m/s, whatever for.",
    ),
    (
        "revisits",
        "Revisit intervals",
        "revisit interval [s]",
        c.MEAN_REVISIT,
        "Between two visits of an edge.",
    ),
    (
        "idleness",
        "Idleness",
        "idleness [s]",
        c.IDLENESS,
        "Since an edge's last visit, mean over edges and time.",
    ),
    ("worst-idleness", "Worst idleness", "worst idleness [s]", c.WORST_IDLENESS, "Longest without a visit."),
)
"""Means against vehicles: name, title, axis, column, what else the caption says."""


def network_sections(results: Results) -> list[Section]:
    """Return a section for each network with a run that succeeded."""
    runs = add_series(results.runs)
    networks = sorted(runs[c.NETWORK].dropna().unique())
    short = [_short(str(network)) for network in networks]
    names = short if len(set(short)) == len(short) else [str(network) for network in networks]
    sections = []
    for network, name in zip(networks, names, strict=True):
        load = _load(results, str(network) if len(networks) > 1 else "")
        sections.append(_section(name, runs[runs[c.NETWORK] == network], results, load))
    return sections


def common_count(runs: pd.DataFrame) -> int:
    """Return the largest vehicle count that most series share."""
    series = runs.groupby(c.VEHICLES)[a.SERIES].nunique()
    return int(series.index[series == series.max()].max())


def _short(network: str) -> str:
    return re.sub(r"(\.net)?\.xml(\.gz)?$|\.sumocfg$", "", Path(network).name) or network


def _load(results: Results, network: str) -> str:
    names = [str(folder) for folder in results.folders]
    lines = [
        "from loopgate import read_results, read_run",
        "from loopgate.analysis import *",
        f"results = read_results({json.dumps(names if len(names) > 1 else names[0], ensure_ascii=False)})",
        "runs = add_series(results.runs)",
    ]
    if network:
        lines.append(f'runs = runs[runs["network"] == {json.dumps(network, ensure_ascii=False)}]')
    return "\n".join(lines)


def _section(network: str, runs: pd.DataFrame, results: Results, load: str) -> Section:
    names = series_order(runs[a.SERIES])
    content = Content({"runs": runs, "results.edge_sets": results.edge_sets}, names)
    if results.run_folders and len(runs) <= _MOST_FLOWS:
        load += _over_time(content, runs, results)
    _overall(content, runs, names)
    _deadlocks(content, runs)
    _laps_and_decisions(content)
    if len(runs) > 1:
        _longest_waits(content, runs)
    _roads(content, runs)
    folders = list(results.run_folders.values())
    if len(runs) == 1 and len(folders) == 1 and (folders[0] / "vehicles.parquet").is_file():
        load += add_single_run(content, folders[0])
    promises = content.tables.get("promises")
    if promises is not None:
        content.watch_only()
    return Section(
        network=network,
        runs=runs,
        count=common_count(runs),
        figures=content.figures,
        tables=list(content.tables.values()),
        names=names[:MAX_SERIES],
        hidden=names[MAX_SERIES:],
        load=load,
        watch=None if promises is None else promises.table,
    )


def _overall(content: Content, runs: pd.DataFrame, names: list[str]) -> None:
    """Add means against vehicles, the fundamental diagram, capacity and paired differences."""
    counts = runs[c.VEHICLES].nunique()
    single = None
    if len(runs) <= _MOST_POINTS:
        known = [name for name in _SINGLE if name not in runs or runs[name].notna().any()]
        single = content.table("runs", "Single runs", compute_fundamental, columns=known)
    several = runs.groupby(_BY).size().max() > 1
    points = single if several else None
    bars = "Means over seeds with 95 % intervals (Student's t)." if several else "One run each: no intervals."
    if single is not None and several:
        bars += " Small points are single runs."
    content.table("trips", "Trips, means over runs", compute_trips, by=_BY)
    for name, title, axis, value, more in _MEANS:
        means = content.table(name, title, compute_mean, value=value, by=_BY)
        if means[a.MEAN].notna().any() and name != "laps-per-hour" and len(runs) > 1:
            chart = plots.plot_mean(means, axis, **content.style, single=points, value=value)
            content.figure(name, title, f"{more} {bars}".strip(), chart)
        elif not means[a.MEAN].notna().any():
            content.tables.pop(name, None)
    if counts > 1:
        diagram = content.table("fundamental", "Density, flow and speed", compute_fundamental, by=_BY)
        for name, title, y in (
            ("fundamental-diagram", "Fundamental diagram", a.FLOW),
            ("speed-density", "Speed over density", a.SPEED),
        ):
            chart = plots.plot_fundamental(diagram, y=y, **content.style, single=points)
            caption = "Means over seeds; small points are single runs."
            content.figure(name, title, caption, chart, "fundamental")
    peaks = content.table("capacity", "Capacity", compute_capacity, by=[a.SERIES])
    if counts > 1:
        caption = "The vehicle count at which throughput peaks"
        some = peaks[a.LOW].notna().any()
        caption += ", with its 95 % interval (bootstrap of the runs at each count)." if some else "."
        caption += " A triangle: the most vehicles that were tried, so it peaks beyond." * any(
            peaks[a.AT_BORDER]
        )
        content.figure("capacity", "Capacity", caption, plots.plot_capacity(peaks, **content.style))
    if len(names) > 1 and not runs.duplicated([*_BY, c.SEED]).any():
        _paired(content, names[0])


def _paired(content: Content, baseline: str) -> None:
    title = f"Difference to {baseline} on the same seeds [vehicle-km/h]"
    paired = content.table("paired", title, compute_paired, baseline=baseline, of=a.SERIES, by=[c.VEHICLES])
    if len(paired):
        kinds = [kind for kind in paired[a.KIND].unique() if kind != NO_INTERVAL]
        bars = f", with 95 % intervals ({' or '.join(kinds)})" if kinds else ""
        few = "" if len(kinds) == paired[a.KIND].nunique() else f" No interval below {FEWEST} pairs."
        content.figure(
            "paired",
            title.partition(" [")[0],
            f"Mean difference of runs that agree in everything else{bars}.{few}",
            plots.plot_paired(paired, **content.style, label="difference [vehicle-km/h]"),
        )


def _deadlocks(content: Content, runs: pd.DataFrame) -> None:
    rates = content.table("deadlocks", "Runs that lock up", compute_deadlock_rate, by=_BY)
    content.table("time-to-deadlock", "Time to the first deadlock", compute_time_to_deadlock, by=_BY)
    locking = np.unique(runs.loc[runs[c.DEADLOCKS] > 0, c.VEHICLES].to_numpy(dtype=int))
    if not len(locking):  # intervals alone would look like deadlocks; the headline and the table have them
        return
    if len(runs) > 1:
        caption = "Share of runs with a deadlock, with 95 % intervals (Wilson)."
        chart = plots.plot_deadlock_rate(rates, **content.style)
        content.figure("deadlock-rate", "Runs that lock up", caption, chart, "deadlocks")
    chosen = np.linspace(0, len(locking) - 1, min(len(locking), _MOST_PANELS)).round().astype(int)
    counts = [int(count) for count in locking[chosen]]
    which = (
        "each vehicle count" if len(counts) == len(locking) else f"{len(counts)} of the {len(locking)} counts"
    )
    title, where = "Survival: runs not yet locked up", f"{c.VEHICLES} in {counts}"
    survival = content.table("survival", title, compute_survival, where=where, by=_BY)
    content.figure(
        "survival",
        "Time to the first deadlock",
        f"Kaplan-Meier curves with 95 % bands, for {which} with which runs lock up.",
        plots.plot_survival(survival, **content.style),
    )


def _longest_waits(content: Content, runs: pd.DataFrame) -> None:
    """Add the causes of the longest waits, at the vehicle count that the series share."""
    count = common_count(runs)
    title = "Causes of the longest waits"
    waits = content.table("longest-waits", title, compute_longest_waits, by=_BY)
    if not (waits[c.VEHICLES] == count).any():
        return
    chart = plots.plot_ranked(
        waits, of=a.CAUSE, value=a.MOST, label="longest wait [s]", **content.style
    ).transform_filter(f"datum['{c.VEHICLES}'] == {count}")
    caption = f"The longest time that one wait was for a cause, in any run with {count} vehicles; gates only."
    content.figure("longest-waits", title, caption, chart)


def _laps_and_decisions(content: Content) -> None:
    laps = content.table("laps", "Lap times", compute_lap_distribution, by=_BY, quantiles=_PERCENT)
    if len(laps):
        caption = "Bars hold the middle half of all laps, lines 5 to 95 %, markers the median."
        content.figure("laps", "Lap times", caption, plots.plot_laps(laps, **content.style))
    decided = f"{c.DECISIONS} > 0"
    decisions = content.table("decisions", "Decisions", compute_decision_time, where=decided, by=_BY)
    if len(decisions) > 1:
        caption = "From the median to the 99th percentile of a run's decisions, each the median over runs."
        chart = plots.plot_decision_time(decisions, **content.style)
        content.figure("decision-time", "Decision time", caption, chart, "decisions")


def _roads(content: Content, runs: pd.DataFrame) -> None:
    """Add maps and ranks of edges and junctions, at the vehicle count that the series share."""
    count = common_count(runs)
    of = {"runs": "runs", "edge_sets": "results.edge_sets"}
    where, by = f"{c.VEHICLES} == {count}", [a.SERIES]
    title = f"Edges with {count} vehicles"
    edges = content.table("edges", title, compute_edge_means, of, where=where, listed=False, by=by)
    if not len(edges):
        return
    if run.STOOD in edges and edges[run.STOOD].gt(0).any():
        for name, what in (("junctions", run.JUNCTION), ("streets", run.EDGE)):
            title = (
                f"{name.capitalize()} before which vehicles stand"
                if what == run.JUNCTION
                else "Streets on which vehicles stand"
            )
            ranked = content.table(
                name, title, compute_ranked, of, where=where, by=by, what=what, first=_RANKED
            )
            chart = plots.plot_ranked(
                ranked, of=what, value=run.STOOD, label="vehicle-seconds standing", **content.style
            )
            caption = f"The ten with most of it, with {count} vehicles; means over runs."
            content.figure(name, title, caption, chart)
    for name, title, column, label in (
        ("map", "Where vehicles stand", run.STOOD, "vehicle-seconds standing per edge and run"),
        ("idleness-map", "Idleness of edges on loops", run.IDLENESS, "idleness per edge [s]"),
    ):
        if column in edges and edges[column].gt(0).any():
            caption = f"With {count} vehicles, mean over runs; broad and strong is much. Loops only."
            chart = plots.plot_edges(edges, column, label=label, series=a.SERIES)
            content.figure(name, title, caption, chart, "edges")


def _over_time(content: Content, runs: pd.DataFrame, results: Results) -> str:
    """Add curves over time if there are run folders; return the expressions that load them."""
    flow = results.read_flow(runs) if len(set(runs[c.VEHICLES])) == 1 else pd.DataFrame()
    if flow.empty:
        return ""
    content.known["flow"] = flow
    longest = float(flow[run.TIME].max() - flow[run.TIME].min())
    every = max(60.0, round(longest / 120 / 60) * 60.0)
    of = {"flow": "flow"}
    table = content.table("flow", "Over time", compute_flow, of, every_s=every, by=[a.SERIES])
    if table.empty:
        return ""
    locked = sorted(runs[c.FIRST_DEADLOCK].dropna().tolist())[:_MOST_PANELS]
    upright = " Upright lines: deadlocks." if locked else ""
    for name, title, what, caption in (
        ("over-time", "Over time", OVER_TIME, f"Means over {every:g} s.{upright}"),
        ("so-far", "Totals so far", CUMULATIVE, f"Added up from the beginning.{upright}"),
    ):
        chart = plots.plot_flow(table, **content.style, what=what, deadlocks=locked)
        content.figure(name, title, caption, chart, "flow")
    return "\nflow = results.read_flow(runs)"
