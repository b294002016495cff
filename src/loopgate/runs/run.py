"""One run: its figures, tables, charts and replay."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from loopgate.analysis import (
    compute_edge_means,
    compute_flow,
    compute_lap_distribution,
    compute_seen_within,
)
from loopgate.analysis.rows import run_row
from loopgate.errors import ResultsError
from loopgate.export import export_run, run_features
from loopgate.plots import plot_edges, plot_flow, plot_laps, plot_seen_within, plot_unwatched
from loopgate.plots.charts import Chart, figure_image
from loopgate.reading import as_path, read_toml, refusing
from loopgate.replay import Replay, make_replay
from loopgate.results import columns as c
from loopgate.results.columns import STRANGE
from loopgate.results.figures import summary_rows
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.results.table_reading import maker, read_summary, read_table


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """The results of one run; a notebook shows a table and figures.

    Attributes
    ----------
    summary
        The contents of ``summary.json``.
    events
        `EVENT_COLUMNS`: the events of vehicles, with place and time.
    vehicles
        `VEHICLE_COLUMNS`: a row for each vehicle.
    edges
        `EDGE_COLUMNS`: visits of each edge, and hold times there.
    streets
        `STREET_COLUMNS`: visits and idleness of every street, on a loop or not; None if not known.
    scenario
        The contents of ``scenario.toml``; empty where there is none.
    flow
        `FLOW_COLUMNS`: standing vehicles and distance, every ten seconds; may be empty.
    loops
        `LOOP_COLUMNS`: the edges of each loop; empty where there are none.
    junctions
        `JUNCTION_COLUMNS`: a row for each junction and movement; empty where edges are not recorded.
    stops
        `STOP_COLUMNS`: a row for each stop and loop; empty without stops.
    visits
        `VISIT_COLUMNS`: a row for each stop that a vehicle made; empty without stops.
    persons
        `WAITING_COLUMNS`: every ten seconds, how many persons wait at each bus stop; empty without persons.
    folder
        The run folder; None if no files were kept.

    Examples
    --------
    >>> from loopgate import Scenario, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> made = run(Scenario(**roads, duration_s=60), "out/figures")
    >>> made.summary["outcome"], made.vehicles["vehicle"].to_list()
    ('done', ['v1', 'v2', 'v3', 'v4', 'v5'])
    >>> sorted(made.figures)
    ['idleness', 'laps', 'over-time', 'seen', 'standing', 'unwatched']
    >>> made.replay().write("out/figures.html").name
    'figures.html'
    """

    summary: Mapping[str, Any] = field(repr=False)
    events: pd.DataFrame = field(repr=False)
    vehicles: pd.DataFrame = field(repr=False)
    edges: pd.DataFrame = field(repr=False)
    scenario: Mapping[str, Any] = field(repr=False)
    streets: pd.DataFrame | None = field(default=None, repr=False)
    folder: Path | None = None
    flow: pd.DataFrame = field(repr=False, default_factory=pd.DataFrame)
    loops: pd.DataFrame = field(repr=False, default_factory=pd.DataFrame)
    junctions: pd.DataFrame = field(repr=False, default_factory=pd.DataFrame)
    stops: pd.DataFrame = field(repr=False, default_factory=pd.DataFrame)
    visits: pd.DataFrame = field(repr=False, default_factory=pd.DataFrame)
    persons: pd.DataFrame = field(
        repr=False, default_factory=lambda: pd.DataFrame(columns=list(c.WAITING_COLUMNS))
    )

    def __repr__(self) -> str:
        told = {
            name: self.summary.get(name) for name in ("network", "gate", "vehicles", "outcome", "duration_s")
        }
        kept = f", in {self.folder}" if self.folder else ""
        text = "{network} under {gate}: {vehicles} vehicles, {duration_s} s, {outcome}".format(**told)
        return f"<Run of {text}{kept}>"

    @property
    def figures(self) -> dict[str, Chart]:
        """The charts of the run by name: over time, lap times, standing, unwatched streets.

        Charts without data are left out. Raises `ResultsError` if summary or tables have invalid values.
        """
        with refusing(self.folder or "run", "run", ResultsError, wrong=STRANGE):
            return self._figures()

    def _figures(self) -> dict[str, Chart]:
        row, edges = run_row(
            scenario=self.scenario, summary=self.summary, events=self.events, edges=self.edges
        )
        runs: pd.DataFrame = pa.Table.from_pylist([row], schema=ROW_SCHEMA).to_pandas()
        found: dict[str, Chart] = {}
        if len(self.flow):
            found["over-time"] = plot_flow(compute_flow(flow=self.flow))
        laps = compute_lap_distribution(runs=runs)
        if len(laps):
            found["laps"] = plot_laps(laps)
        means = compute_edge_means(runs=runs, edge_sets={row[c.EDGE_SET]: edges})
        for name, column, label in (
            ("standing", c.STOOD, "time stood per edge [s]"),
            ("idleness", c.IDLENESS, "idleness per edge [s]"),
        ):
            if means[column].gt(0).any():
                found[name] = plot_edges(means, column, label=label)
        if self.streets is not None and len(self.streets):
            found["unwatched"] = plot_unwatched(self.streets)
            found["seen"] = self._seen(self.streets)
        return found

    def _seen(self, streets: pd.DataFrame) -> Chart:
        since_s = float(self.summary.get(c.BEGINS, 0.0))
        begin_s = since_s + float(self.scenario.get("warmup_s", 0.0))
        seen = compute_seen_within(
            events=self.events,
            streets=streets[c.EDGE],
            begin_s=begin_s,
            end_s=begin_s + float(self.summary["duration_s"]),
            since_s=since_s,
        )
        return plot_seen_within(seen, bound_s=self.scenario.get("revisit_s") or None)

    def replay(self, beside: Run | None = None) -> Replay:
        """Return a replay of the run, alone or side by side with another run; a notebook shows it.

        Raises `ResultsError` if a run has no folder, or neither loops nor positions.
        """
        runs = (self,) if beside is None else (self, beside)
        return make_replay(*map(_kept, runs))

    def export(self, out: Path | str) -> list[Path]:
        """Write the run as files for maps (GeoJSON, GPX, KML) and spreadsheets (CSV); return their paths.

        GeoJSON of streets, loops and places, GPX and KML of each loop with its turns, CSV of each vehicle's
        day; see `loopgate.export.export_run`.

        Raises `ResultsError` if the run has no folder, `NetworkError` if its network has no projection.
        """
        return export_run(_kept(self), out)

    def geo(self, layer: str = "streets") -> Any:  # noqa: ANN401 - geopandas need not be there
        """Return a map layer of the run as a GeoPandas frame: ``streets``, ``loops`` or ``places``.

        Raises `ResultsError` if geopandas is not installed or the run has no folder, `NetworkError` if its
        network has no projection.
        """
        try:
            import geopandas  # noqa: PLC0415 - an extra
        except ImportError as error:
            msg = "a frame of places needs geopandas; pip install 'sumo-loopgate[geo]'"
            raise ResultsError(msg) from error
        return geopandas.GeoDataFrame.from_features(run_features(_kept(self), layer), crs="EPSG:4326")

    def _repr_html_(self) -> str | None:
        try:
            words, figures = summary_rows(self.summary), self.figures
        except ResultsError:  # another version made it, and knew less; a notebook then shows its name
            return None
        rows = "".join(
            f"<tr><th style='text-align:left'>{html.escape(what)}</th>"
            f"<td style='text-align:left'>{html.escape(much)}</td></tr>"
            for what, much in words
        )
        drawn = "".join(figure_image(figure, name) for name, figure in figures.items())
        title = f"{self.summary['network']}: {self.summary['gate']}, seed {self.summary['seed']}"
        return f"<h4>{html.escape(title)}</h4><table>{rows}</table>{drawn}"


def _kept(one: Run) -> Path:
    if one.folder is None:
        msg = "nothing was kept of the run; give it a folder: run(scenario, 'out/seen')"
        raise ResultsError(msg)
    return one.folder


def read_run(folder: Path | str) -> Run:
    """Read a run folder.

    Raises `ResultsError` if a file of it is missing, cannot be read, or lacks a column.

    Examples
    --------
    >>> from loopgate import Scenario, read_run, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> made = run(Scenario(**roads, gate="open", duration_s=60), "out/one")
    >>> read_run("out/one").events.equals(made.events)
    True
    """
    folder = as_path(folder, "run folder", ResultsError)
    with refusing(folder, "run folder", ResultsError):
        summary = read_summary(folder)
        made_by = maker(summary)
        events = read_table(folder / "events.parquet", c.EVENT_COLUMNS[:5], made_by=made_by)
        if c.STAGE not in events:  # there were no stages once
            events[c.STAGE] = ""
        scenario, streets = folder / "scenario.toml", folder / "streets.parquet"
        return Run(
            summary=summary,
            events=events,
            vehicles=read_table(folder / "vehicles.parquet", c.VEHICLE_COLUMNS, made_by=made_by),
            edges=read_table(folder / "edges.parquet", c.EDGE_COLUMNS, made_by=made_by),
            scenario=read_toml(scenario, "scenario", ResultsError) if scenario.is_file() else {},
            streets=read_table(streets, c.STREET_COLUMNS, made_by=made_by) if streets.is_file() else None,
            flow=_where_there(folder / "flow.parquet", c.FLOW_COLUMNS, made_by),
            loops=_where_there(folder / "loops.parquet", c.LOOP_COLUMNS, made_by),
            junctions=_where_there(folder / "junctions.parquet", c.JUNCTION_COLUMNS, made_by),
            stops=_where_there(folder / "stops.parquet", c.STOP_COLUMNS, made_by),
            visits=_where_there(folder / "visits.parquet", c.VISIT_COLUMNS, made_by),
            persons=_where_there(folder / "persons.parquet", c.WAITING_COLUMNS, made_by),
            folder=folder,
        )


def _where_there(file: Path, columns: Sequence[str], made_by: str) -> pd.DataFrame:
    """Return a table that not every version writes, and not every run."""
    return (
        read_table(file, columns, made_by=made_by) if file.is_file() else pd.DataFrame(columns=list(columns))
    )
