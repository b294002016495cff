"""Results that were spoiled, and all that is made of them: report, tables, figures, words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any
from unittest import mock

import pandas as pd
from fuzz_readers import Reader

from loopgate import analysis, plots, read_results, read_run, write_report
from loopgate.plots.charts import figure_spec
from loopgate.report import page
from loopgate.results import columns as c
from loopgate.results.figures import summary_rows
from loopgate.runs.results import Results
from loopgate.runs.run import Run

_DRAWN = 0.03
"""Share of the reports that are written with all their files, which takes a second or two each."""

_WAYS = ("report", "rows", "words", "figures", "tables")

_OF_RUNS: Mapping[str, Callable[..., Any] | None] = {
    "compute_mean": plots.plot_mean,
    "compute_fundamental": None,
    "compute_capacity": plots.plot_capacity,
    "compute_lap_distribution": plots.plot_laps,
    "compute_decision_time": plots.plot_decision_time,
    "compute_deadlock_rate": plots.plot_deadlock_rate,
    "compute_survival": plots.plot_survival,
    "compute_time_to_deadlock": None,
    "compute_safety": None,
    "compute_trips": None,
    "compute_longest_waits": None,
    "add_series": None,
}
"""What takes runs, and the figure of its table where it needs nothing else."""

_OF_EVENTS = (
    *(
        "compute_causes",
        "compute_revisit_intervals",
        "compute_revisits",
        "compute_edge_holds",
        "compute_laps",
    ),
    *("compute_holds", "compute_waits", "compute_vehicle_holds", "compute_throughput", "compute_wait_causes"),
)


def _undrawn() -> AbstractContextManager[object]:
    """Let a report be written without its figures being drawn."""
    undrawn = SimpleNamespace(svg_to_png=lambda _svg, scale: bytes(int(scale)), svg_to_pdf=lambda _svg: b"")
    return mock.patch.multiple(page, spec_svg=lambda _spec: "<svg/>", vl_convert=undrawn)


def _report(folder: Path, random: Random) -> None:
    results = read_results(folder)
    if random.random() < _DRAWN:
        write_report(results, folder.parent / "page.html")
        return
    with _undrawn():
        write_report(results, folder.parent / "page.html")


def _of_runs(results: Results, random: Random) -> None:
    name = random.choice(("compute_paired", "compute_edge_means", "compute_ranked", *_OF_RUNS, *_OF_RUNS))
    compute = getattr(analysis, name)
    if name == "compute_paired":
        table = compute(runs=results.runs, baseline="open", of=random.choice(("gate", "negotiation")))
        figure_spec(plots.plot_paired(table))
    elif name in {"compute_edge_means", "compute_ranked"}:
        table = compute(runs=results.runs, edge_sets=results.edge_sets)
        if name == "compute_edge_means":
            figure_spec(plots.plot_edges(table, c.STOOD))
    else:
        table = compute(runs=results.runs)
        plot = _OF_RUNS[name]
        if plot is not None:
            figure_spec(plot(table))


def _of_one(one: Run, random: Random) -> None:
    end_s = random.choice((90.0, 30.0, 1e6))
    name = random.choice((*_OF_EVENTS, *_OF_EVENTS, "flow", "streets", "space", "stuck", "edges"))
    if name == "flow":
        figure_spec(plots.plot_flow(analysis.compute_flow(flow=one.flow)))
    elif name == "streets" and one.streets is not None:
        streets = one.streets[c.EDGE]
        seen = analysis.compute_seen_within(events=one.events, streets=streets, end_s=end_s)
        figure_spec(plots.plot_seen_within({"": seen}, bound_s=60.0))
        figure_spec(plots.plot_unwatched(one.streets))
        analysis.compute_rarest(streets=one.streets)
        watch = analysis.compute_watch(events=one.events, streets=streets, end_s=end_s, bound_s=60.0)
        analysis.compute_districts(watch=watch, districts={"all": streets})
    elif name == "space":
        tables: dict[str, pd.DataFrame] = {"events": one.events, "vehicles": one.vehicles, "loops": one.loops}
        figure_spec(plots.plot_time_space(analysis.compute_time_space(**tables, loop="loop1")))
    elif name == "stuck":
        analysis.compute_stuck(vehicles=one.vehicles, events=one.events, end_s=end_s)
    elif name == "edges":
        analysis.compute_edges(events=one.events, edges=one.edges, end_s=end_s)
    elif name in _OF_EVENTS:
        getattr(analysis, name)(events=one.events, end_s=end_s)


def _run(folder: Path, random: Random) -> None:
    use = random.choices(_WAYS, (1, 4, 4, 2, 8))[0]
    if use == "report":
        _report(folder, random)
        return
    if use == "rows":
        _of_runs(read_results(folder), random)
        return
    one = read_run(folder)
    if use == "words":
        summary_rows(one.summary)
    elif use == "figures":
        for figure in one.figures.values():
            figure_spec(figure)
        if random.random() < _DRAWN:
            one._repr_html_()
    else:
        _of_one(one, random)


def _sweep(folder: Path, random: Random) -> None:
    if random.random() < 0.1:  # noqa: PLR2004  a share
        _report(folder, random)
    else:
        _of_runs(read_results(folder), random)


def _several(folder: Path, random: Random) -> None:
    use = partial(_report, random=random) if random.random() < 0.1 else read_results  # noqa: PLR2004  a share
    use(folder)
    read_results([folder, folder / "one"])


RESULTS = (
    Reader("run, used", 12, "run", ("summary.json", "scenario.toml", "*.parquet"), _run),
    Reader("sweep, used", 10, "results", ("sweep.json", "rows/*", "edges/*"), _sweep),
    Reader("runs, together", 3, "runs", ("*/summary.json", "*/scenario.toml", "*/*.parquet"), _several),
)
"""Folders of results, one file of each spoiled."""
