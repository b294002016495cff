"""The content of a report: series, tables and figures, before any page is laid out."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from loopgate import plots
from loopgate.analysis import (
    add_series,
    compute_blocked,
    compute_capacity,
    compute_causes,
    compute_deadlock_rate,
    compute_decision_time,
    compute_delayed,
    compute_edge_means,
    compute_flow,
    compute_fundamental,
    compute_lap_distribution,
    compute_longest_waits,
    compute_mean,
    compute_messages,
    compute_paired,
    compute_promises,
    compute_ranked,
    compute_rarest,
    compute_seen_within,
    compute_starving,
    compute_stop_phases,
    compute_stops,
    compute_stuck,
    compute_survival,
    compute_time_space,
    compute_time_to_deadlock,
    compute_trips,
    compute_worst_movements,
)
from loopgate.analysis.standing import edge_of
from loopgate.analysis.statistics import FEWEST, NO_INTERVAL
from loopgate.plots.charts import Chart
from loopgate.plots.course import CUMULATIVE
from loopgate.plots.style import MAX_SERIES, series_order
from loopgate.reading import counted
from loopgate.results import columns as c
from loopgate.results.columns import SERIES, TRUNCATED
from loopgate.results.table_reading import read_summary
from loopgate.runs.results import Results
from loopgate.runs.run import Run, read_run

_MOST_POINTS_OF_ONE = 6000
_BLOCKED = "compute_blocked(summary=run.summary)"
_STREETS = f'run.streets["{c.EDGE}"]'


def add_single_run(content: Content, folder: Path) -> str:
    """Add the items from the events of a run; return the line that loads it."""
    one = read_run(folder)
    content.known |= {
        "run.events": one.events,
        "run.vehicles": one.vehicles,
        "run.loops": one.loops,
    }
    times = [float(table[c.TIME].max()) for table in (one.events, one.flow) if len(table)]
    end_s = max(times, default=0.0)
    begin_s = max(0.0, end_s - float(one.summary["duration_s"]))
    if end_s > begin_s:
        options: dict[str, Any] = {"begin_s": begin_s, "end_s": end_s}
        of = {"events": "run.events"}
        causes = content.table("causes", "Waits by cause", compute_causes, of, **options)
        if len(causes):
            caption = "All waits for the gate, by the reason of the refusal."
            content.figure("causes", "Why vehicles wait", caption, plots.plot_ranked, label="vehicle-seconds")
        _add_watch(content, one, options)
    _add_standing(content, one, end_s)
    _add_junctions(content, one)
    _add_loop(content, one.vehicles, one.loops)
    of = {"vehicles": "run.vehicles", "events": "run.events"}
    content.table("stuck", "Vehicles that are stuck", compute_stuck, of, end_s=end_s)
    return f"\nrun = read_run({json.dumps(str(folder), ensure_ascii=False)})"


def _add_standing(content: Content, one: Run, end_s: float) -> None:
    """Add the places in which something stood, and the vehicles that starved."""
    content.known["run.summary"] = one.summary
    of = {"summary": "run.summary"}
    blocked = content.table("blocked", "What stood, and since when nobody was let in", compute_blocked, of)
    if len(blocked):
        _add_changed(content, one, end_s)
    content.table("starving", "Vehicles that starved, and behind which vehicle", compute_starving, of)
    content.table("messages", "Messages by which vehicles decided", compute_messages, of)


def _add_changed(content: Content, one: Run, end_s: float) -> None:
    """Add what it changed that some place was shut: who was led round or waited, and the stops by phase."""
    streets = one.edges if one.streets is None else one.streets
    content.known |= {_BLOCKED: compute_blocked(summary=one.summary), "run.streets": streets}
    title = "Who was led round what was closed or stood, or waited before it"
    of = {"events": "run.events", "vehicles": "run.vehicles", "loops": "run.loops"}
    of |= {"streets": "run.edges" if one.streets is None else "run.streets", "blocked": _BLOCKED}
    content.known["run.edges"] = one.edges
    if len(one.loops):
        content.table("delayed", title, compute_delayed, of, end_s=end_s)
    if len(one.visits):
        content.known["run.visits"] = one.visits
        title = "Stops before, during and after what was closed or stood"
        of = {"visits": "run.visits", "blocked": _BLOCKED}
        content.table("stop-phases", title, compute_stop_phases, of)


def _add_junctions(content: Content, one: Run) -> None:
    """Add the movements that cost most time, all movements, and the stops."""
    content.known |= {"run.junctions": one.junctions, "run.visits": one.visits, "run.persons": one.persons}
    if len(one.junctions):
        of = {"junctions": "run.junctions"}
        title = "Movements that cost most time"
        content.table("movements", title, compute_worst_movements, of)
        caption = "The delay of all vehicles on the edge and over the junction, against the speed limits."
        content.figure("movements", title, caption, plots.plot_ranked)
        every = "All movements with delay"
        content.table(
            "all-movements", every, compute_worst_movements, of, listed=False, first=len(one.junctions)
        )
    if len(one.visits):
        title = "Stops: headways and lateness by the timetable"
        of = {"visits": "run.visits"} | ({"waiting": "run.persons"} if len(one.persons) else {})
        content.table("stops", title, compute_stops, of)


def _add_watch(content: Content, one: Run, period: dict[str, Any]) -> None:
    """Add the unseen streets, the streets on no loop in view, and the revisit intervals."""
    streets = one.streets
    if streets is None or not (streets[c.VISITS] > 0).any():
        return
    content.known |= {"run.streets": streets, _STREETS: streets[c.EDGE]}
    if one.scenario.get("revisit_s"):
        content.table("promises", "Promises, by street", compute_promises, {"streets": "run.streets"})
    content.table("rarest", "Streets that went unseen longest", compute_rarest, {"streets": "run.streets"})
    of, since_s = {"events": "run.events", "streets": _STREETS}, float(one.summary.get(c.BEGINS, 0.0))
    content.table(
        "seen-within", "Seen within", compute_seen_within, of, listed=False, **period, since_s=since_s
    )
    never = int((streets[c.VISITS] == 0).sum())
    caption = "Broad and strong where a street went unseen for long."
    if never:
        caption += f" {never} of {len(streets)} were never seen: dashed."
    content.drop("idleness-map")
    title = "Which roads go unwatched"
    content.figure("unwatched", title, caption, plots.plot_unwatched, "rarest", source="run.streets")
    content.figure(
        "seen-within",
        "How soon streets are seen again",
        "The share of all streets, also never seen streets, that was seen within this time.",
        plots.plot_seen_within,
        bound_s=one.scenario.get("revisit_s") or None,
    )


def _add_loop(content: Content, vehicles: pd.DataFrame, loops: pd.DataFrame) -> None:
    """Add the loop with the most standing, over time."""
    driven = vehicles[vehicles[c.LOOP].isin(loops[c.LOOP])]
    if driven.empty or c.STOOD not in driven:
        return
    loop = str(driven.groupby(c.LOOP)[c.STOOD].sum().idxmax())
    points = content.table(
        "time-space",
        f"Loop {loop} over time",
        compute_time_space,
        {"events": "run.events", "vehicles": "run.vehicles", "loops": "run.loops"},
        listed=False,
        loop=loop,
    )
    if 0 < len(points) <= _MOST_POINTS_OF_ONE:
        content.figure(
            "time-space",
            f"Loop {loop}: its vehicles over time",
            "The loop on which vehicles stood longest. A line per vehicle and lap, straight between "
            "the beginnings of two edges; the flatter, the slower.",
            plots.plot_time_space,
            **content.clock,
        )


_RUNS = {"runs": "runs"}
_WATCH = ("promises", "unwatched", "seen-within", "rarest")
_THROUGHPUT = (
    *("over-time", "so-far", "flow", "throughput", "laps-per-hour", "laps", "capacity", "fundamental"),
    *("junctions", "streets", "map", "edges", "deadlocks", "time-to-deadlock", "speed", "standing"),
    *("decisions", "longest-waits", "revisits", "idleness", "worst-idleness", "trips", "time-space", "runs"),
)
"""Figures and tables that whoever watches a district did not ask for."""


@dataclass(frozen=True, slots=True)
class Command:
    """A call that makes a table; the report runs it and prints it."""

    function: Callable[..., pd.DataFrame]
    sources: Mapping[str, str]
    """Parameters, and the expressions that they are given: ``{"runs": "runs"}``."""
    options: Mapping[str, Any]
    """Parameters, and the plain values that they are given."""
    where: str = ""
    """Which of the runs, as a query."""
    columns: Sequence[str] = ()
    """Which columns of what is returned; all if empty."""

    def table(self, known: Mapping[str, Any]) -> pd.DataFrame:
        """Return the table; `known` has the values of the expressions."""
        given = {name: known[text] for name, text in self.sources.items()}
        if self.where:
            given["runs"] = given["runs"].query(self.where)
        made = self.function(**given, **self.options)
        return made[list(self.columns)] if self.columns else made

    def __str__(self) -> str:
        given = dict(self.sources)
        if self.where:
            given["runs"] = f"runs.query({json.dumps(self.where)})"
        parts = [f"{name}={text}" for name, text in given.items()]
        parts += [f"{name}={json.dumps(value, ensure_ascii=False)}" for name, value in self.options.items()]
        only = f"[{json.dumps(list(self.columns))}]" if self.columns else ""
        return f"{self.function.__name__}({', '.join(parts)}){only}"


def _literal(value: object) -> str:
    """Return a plain value as Python writes it, texts in double quotes."""
    if isinstance(value, str | list):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)


@dataclass(frozen=True, slots=True)
class TableItem:
    """A table with its caption."""

    name: str
    title: str
    table: pd.DataFrame
    code: str = ""
    """Python that makes it."""
    listed: bool = True
    """Whether its rows are on the page; all tables can be downloaded from it."""


@dataclass(frozen=True, slots=True)
class FigureItem:
    """A figure with its caption."""

    name: str
    title: str
    caption: str
    figure: Chart
    table: str
    """The name of the table that it shows."""
    code: str = ""
    """Python that draws it."""


@dataclass(frozen=True, slots=True)
class Section:
    """A section of a report: all tables and figures of one network."""

    network: str
    runs: pd.DataFrame
    count: int
    """The vehicle count at which series are compared where one must be chosen."""
    figures: Sequence[FigureItem]
    tables: Sequence[TableItem]
    names: Sequence[str]
    """The series that figures show, in their order."""
    hidden: Sequence[str]
    """Series that the figures leave out, since nobody could tell them apart."""
    load: str
    """Python after which the code of the tables can be run."""
    begins_s: float = 0.0
    """When the simulation began [s], of a single run."""
    watch: pd.DataFrame | None = None
    """Promises by street, of a run that was to see streets again in time."""


class Content:
    """Collects the tables and figures of a section."""

    def __init__(self, known: Mapping[str, Any], names: Sequence[str]) -> None:
        self._names = list(names)
        """All series: one looks the same in all figures."""
        self.known = dict(known)
        """The values of the expressions that commands are made of."""
        runs = self.known["runs"]
        cut = int(runs[TRUNCATED].eq(other=True).sum()) if TRUNCATED in runs else 0
        self._mark = (
            f"{cut} of {counted(len(runs), 'run')} stopped at {'its' if cut == 1 else 'their'} deadlock"
            if cut
            else ""
        )
        """What every figure and table says of runs that are compared with longer ones."""
        self.tables: dict[str, TableItem] = {}
        self.figures: list[FigureItem] = []
        self.begins_s = 0.0
        """When the simulation began [s]; above 0, times are times of day."""

    @property
    def clock(self) -> dict[str, Any]:
        """The option by which axes of time show times of day, where the run began at one."""
        return {"clock": True} if self.begins_s > 0.0 else {}

    def table(
        self,
        name: str,
        title: str,
        function: Callable[..., pd.DataFrame],
        sources: Mapping[str, str] = _RUNS,
        *,
        where: str = "",
        columns: Sequence[str] = (),
        listed: bool = True,
        **options: Any,  # noqa: ANN401 - options of any kind
    ) -> pd.DataFrame:
        """Add a table made by a function; a table without rows is left out."""
        command = Command(function, sources, options, where, columns)
        made = command.table(self.known)
        made.attrs["name"] = name
        if len(made):
            marked = f"{title} ({self._mark})" if self._mark else title
            self.tables[name] = TableItem(name, marked, made, str(command), listed)
        return made

    def figure(
        self,
        name: str,
        title: str,
        caption: str,
        plot: Callable[..., Chart],
        table: str = "",
        *,
        source: str = "",
        where: str = "",
        single: pd.DataFrame | None = None,
        **options: Any,  # noqa: ANN401 - options of any kind
    ) -> None:
        """Add a figure of a table, unless that table was left out.

        It shows the rows `where` a query holds, or the expression `source` in place of the table; `single`
        is the table of single runs.
        """
        item = self.tables.get(table or name)
        if item is None:
            return
        shown, code = (self.known[source], source) if source else (item.table, item.code)
        if where:
            shown, code = shown.query(where), f"{code}.query({json.dumps(where)})"
            shown.attrs.pop("name", None)  # the page has all rows under that name
        given = {name: value for name, value in options.items() if value not in (None, "", [])}
        parts = [f"{name}={_literal(value)}" for name, value in given.items()]
        if single is not None:
            parts.append("single=compute_fundamental(runs=runs)")
            given["single"] = single
        if SERIES in shown and series_order(shown[SERIES]) != self._names:
            parts.append(f"among={_literal(self._names)}")
        if SERIES in shown:
            given["among"] = self._names
        if plot is plots.plot_edges:  # every map has a panel for each series
            given.pop("among", None)
            parts = [part for part in parts if not part.startswith("among=")]
        marked = f"{caption} {self._mark}." if self._mark else caption
        drawn = f"{plot.__name__}({', '.join([code, *parts])})"
        self.figures.append(FigureItem(name, title, marked, plot(shown, **given), item.name, drawn))

    def watch_only(self) -> None:
        """Leave out figures of throughput, and put promises and idle streets first."""
        self.figures = [item for item in self.figures if item.name not in _THROUGHPUT]
        self.figures.sort(key=lambda item: _WATCH.index(item.name) if item.name in _WATCH else len(_WATCH))
        kept = [item for name, item in self.tables.items() if name not in _THROUGHPUT]
        kept.sort(key=lambda item: _WATCH.index(item.name) if item.name in _WATCH else len(_WATCH))
        shown = {item.table for item in self.figures}
        self.tables = {item.name: item for item in kept}
        missing = shown - self.tables.keys()
        self.figures = [item for item in self.figures if item.table not in missing]

    def operator_first(self) -> None:
        """Put first what an operator asks of one run: where vehicles lost time, and why."""
        for name in ("laps", "junctions", "streets", "so-far"):  # one bar each, or said by others
            self.drop(name)
        self.figures.sort(key=lambda item: _FIRST.index(item.name) if item.name in _FIRST else len(_FIRST))
        order = [name for name in _FIRST if name in self.tables]
        self.tables = {name: self.tables[name] for name in (*order, *self.tables)}

    def drop(self, name: str) -> None:
        """Remove a figure."""
        self.figures = [item for item in self.figures if item.name != name]


_FIRST = (
    *("stops", "blocked", "stop-phases", "delayed", "starving"),
    *("movements", "causes", "map", "time-space", "over-time"),
)
"""Tables and figures of a single run in the order of an operator's questions."""

_BY = [c.SERIES, c.VEHICLES]
_PERCENT = [0.05, 0.25, 0.5, 0.75, 0.95]
_MOST_PANELS = 6
_MOST_POINTS = 2000
"""Single runs are drawn up to so many."""

_MOST_FLOWS = 24
_RANKED = 10
_SINGLE = [*_BY, c.SEED, c.TRUNCATED, c.MEASURED, c.KM_PER_H, c.KM_PER_H_MEASURED, c.LAPS_PER_H]
_SINGLE += [c.STOOD, c.STOOD_SHARE, c.MEAN_REVISIT, c.IDLENESS]
_SINGLE += [c.CLOSURES, c.BREAKDOWNS, c.LED_ROUND]
_SINGLE += [
    c.ARRIVED,
    c.UNFINISHED,
    c.MEAN_TIME_LOSS,
    c.MEAN_DEPART_DELAY,
    c.MEAN_DELAY,
    c.WORST_DELAY,
    c.WORST_IDLENESS,
    c.DENSITY,
    c.FLOW,
    c.SPEED,
]

_MEANS = (
    ("throughput", "Throughput", c.KM_PER_H, ""),
    ("laps-per-hour", "Laps", c.LAPS_PER_H, ""),
    ("speed", "Mean speed", c.SPEED, "Over all vehicles and the whole time."),
    ("delay", "Delay of trips", c.MEAN_DELAY, "Time loss and wait to depart."),
    ("worst-delay", "Worst delay", c.WORST_DELAY, "Of any trip in a run."),
    ("unfinished", "Trips not finished", c.UNFINISHED, "When the run ended."),
    ("standing", "Time standing", c.STOOD_SHARE, "Slower than 0.1 m/s, whatever for."),
    ("revisits", "Revisit intervals", c.MEAN_REVISIT, "Between two visits of an edge."),
    ("idleness", "Idleness", c.IDLENESS, "Since an edge's last visit, mean over edges and time."),
    ("worst-idleness", "Worst idleness", c.WORST_IDLENESS, "Longest without a visit."),
)
"""Means against vehicles: name, title, column, what else the caption says."""

_FEWEST_POINTS = 3
"""A figure with fewer points says less than its table."""


def network_sections(results: Results) -> list[Section]:
    """Return a section for each network with a run that succeeded."""
    runs = add_series(results.runs)
    runs[c.SPEED] = 3.6 * runs[c.MEAN_SPEED].astype(float)  # one unit of speed in all of the page
    of = _networks(runs, results)
    networks = sorted(of.dropna().unique())
    short = [_short(str(network)) for network in networks]
    names = short if len(set(short)) == len(short) else [str(network) for network in networks]
    sections = []
    for network, name in zip(networks, names, strict=True):
        part = runs[of == network]
        load = _load(results, sorted(part[c.NETWORK].unique()) if len(networks) > 1 else [])
        sections.append(_section(name, part, results, load))
    return sections


def _networks(runs: pd.DataFrame, results: Results) -> pd.Series:
    """Return the network of each run, by one of its names; files of one content are one network."""
    known: dict[Path, str] = {}
    content = []
    for key, name, told in zip(runs[c.KEY], runs[c.NETWORK], runs[c.NETWORK_HASH], strict=True):
        file = Path(str(name))
        if (folder := results.run_folders.get(key)) and (folder / file.name).is_file():
            file = folder / file.name  # the run's own copy
        if file not in known and pd.isna(told) and file.is_file():
            known[file] = hashlib.sha256(file.read_bytes()).hexdigest()
        content.append(known.get(file, name) if pd.isna(told) else told)
    first: pd.Series = runs[c.NETWORK].groupby(pd.Series(content, index=runs.index)).transform("min")
    return first


def common_count(runs: pd.DataFrame) -> int:
    """Return the largest vehicle count that most series share."""
    series = runs.groupby(c.VEHICLES)[c.SERIES].nunique()
    return int(series.index[series == series.max()].max())


def _short(network: str) -> str:
    return re.sub(r"(\.net)?\.xml(\.gz)?$|\.sumocfg$", "", Path(network).name) or network


def _load(results: Results, networks: list[str]) -> str:
    names = [str(folder) for folder in results.folders]
    lines = [
        "from loopgate import read_results, read_run",
        "from loopgate.analysis import *",
        "from loopgate.plots import *",
        f"results = read_results({json.dumps(names if len(names) > 1 else names[0], ensure_ascii=False)})",
        "runs = add_series(results.runs)",
        f'runs["{c.SPEED}"] = 3.6 * runs["{c.MEAN_SPEED}"]',
    ]
    if networks:
        lines.append(f'runs = runs[runs["network"].isin({json.dumps(networks, ensure_ascii=False)})]')
    return "\n".join(lines)


def _section(network: str, runs: pd.DataFrame, results: Results, load: str) -> Section:
    names = series_order(runs[c.SERIES])
    content = Content({"runs": runs, "results.edge_sets": results.edge_sets}, names)
    if results.run_folders and len(runs) <= _MOST_FLOWS:
        load += _over_time(content, runs, results)
    _overall(content, runs, names)
    _deadlocks(content, runs)
    _laps_and_decisions(content)
    if len(runs) > 1:
        _longest_waits(content, runs)
    _roads(content, runs, _blocked_edges(results))
    folders = list(results.run_folders.values())
    if len(runs) == 1 and len(folders) == 1 and (folders[0] / "vehicles.parquet").is_file():
        load += add_single_run(content, folders[0])
        content.operator_first()
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
        begins_s=content.begins_s,
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
    for name, title, value, more in _MEANS:
        means = content.table(name, title, compute_mean, value=value, by=_BY)
        if not means[c.MEAN].notna().any():
            content.tables.pop(name, None)
        elif name != "laps-per-hour" and means[c.MEAN].notna().sum() >= _FEWEST_POINTS:
            content.figure(
                name, title, f"{more} {bars}".strip(), plots.plot_mean, single=points, **_value(value, points)
            )
    if counts > 1:
        content.table("fundamental", "Density, flow and speed", compute_fundamental, by=_BY)
        caption = "Means over seeds; small points are single runs." if several else "One run each."
        of: dict[str, Any] = {"table": "fundamental", "single": points}
        if counts * len(names) >= _FEWEST_POINTS:
            content.figure(
                "fundamental-diagram", "Fundamental diagram", caption, plots.plot_fundamental, **of
            )
            content.figure(
                "speed-density", "Speed over density", caption, plots.plot_fundamental, **of, y=c.SPEED
            )
    peaks = content.table("capacity", "Capacity", compute_capacity, by=[c.SERIES])
    if counts > 1 and len(names) >= _FEWEST_POINTS:
        caption = "The vehicle count at which throughput peaks"
        some = peaks[c.LOW].notna().any()
        caption += ", with its 95 % interval (bootstrap of the runs at each count)." if some else "."
        caption += " A triangle: the most vehicles that were tried, so it peaks beyond." * any(
            peaks[c.AT_BORDER]
        )
        content.figure("capacity", "Capacity", caption, plots.plot_capacity)
    if len(names) > 1 and not runs.duplicated([*_BY, c.SEED]).any():
        _paired(content, names[0])


def _value(column: str, points: pd.DataFrame | None) -> dict[str, str]:
    """Return the column of single runs, where there are any and it is not the usual one."""
    return {} if points is None or column == c.KM_PER_H else {"value": column}


def _paired(content: Content, baseline: str) -> None:
    title = f"Difference to {baseline} on the same seeds [vehicle-km/h]"
    paired = content.table("paired", title, compute_paired, baseline=baseline, of=c.SERIES, by=[c.VEHICLES])
    if len(paired) >= _FEWEST_POINTS:
        kinds = [kind for kind in paired[c.KIND].unique() if kind != NO_INTERVAL]
        bars = f", with 95 % intervals ({' or '.join(kinds)})" if kinds else ""
        few = "" if len(kinds) == paired[c.KIND].nunique() else f" No interval below {FEWEST} pairs."
        content.figure(
            "paired",
            title.partition(" [")[0],
            f"Mean difference of runs that agree in everything else{bars}.{few}",
            plots.plot_paired,
            label="difference [vehicle-km/h]",
        )


def _deadlocks(content: Content, runs: pd.DataFrame) -> None:
    rates = content.table("deadlocks", "Runs that lock up", compute_deadlock_rate, by=_BY)
    content.table("time-to-deadlock", "Time to the first deadlock", compute_time_to_deadlock, by=_BY)
    locking = np.unique(runs.loc[runs[c.DEADLOCKS] > 0, c.VEHICLES].to_numpy(dtype=int))
    if not len(locking):  # intervals alone would look like deadlocks; the headline and the table have them
        return
    if len(rates) >= _FEWEST_POINTS:
        caption = "Share of runs with a deadlock, with 95 % intervals (Wilson)."
        content.figure("deadlock-rate", "Runs that lock up", caption, plots.plot_deadlock_rate, "deadlocks")
    chosen = np.linspace(0, len(locking) - 1, min(len(locking), _MOST_PANELS)).round().astype(int)
    counts = [int(count) for count in locking[chosen]]
    which = (
        "each vehicle count" if len(counts) == len(locking) else f"{len(counts)} of the {len(locking)} counts"
    )
    title, where = "Survival: runs not yet locked up", f"{c.VEHICLES} in {counts}"
    content.table("survival", title, compute_survival, where=where, by=_BY)
    content.figure(
        "survival",
        "Time to the first deadlock",
        f"Kaplan-Meier curves with 95 % bands, for {which} with which runs lock up.",
        plots.plot_survival,
    )


def _longest_waits(content: Content, runs: pd.DataFrame) -> None:
    """Add the causes of the longest waits, at the vehicle count that the series share."""
    count = common_count(runs)
    title = "Causes of the longest waits"
    waits = content.table("longest-waits", title, compute_longest_waits, by=_BY)
    if not (waits[c.VEHICLES] == count).any():
        return
    caption = f"The longest time that one wait was for a cause, in any run with {count} vehicles; gates only."
    where = f"{c.VEHICLES} == {count}"
    content.figure("longest-waits", title, caption, plots.plot_ranked, where=where, label="longest wait [s]")


def _laps_and_decisions(content: Content) -> None:
    laps = content.table("laps", "Lap times", compute_lap_distribution, by=_BY, quantiles=_PERCENT)
    if len(laps):
        caption = "Bars hold the middle half of all laps, lines 5 to 95 %, markers the median."
        content.figure("laps", "Lap times", caption, plots.plot_laps)
    decided = f"{c.DECISIONS} > 0"
    decisions = content.table("decisions", "Decisions", compute_decision_time, where=decided, by=_BY)
    if len(decisions) >= _FEWEST_POINTS:
        caption = "From the median to the 99th percentile of a run's decisions, each the median over runs."
        content.figure("decision-time", "Decision time", caption, plots.plot_decision_time, "decisions")


def _blocked_edges(results: Results) -> set[str]:
    """Return the edges that were closed or blocked for a time in runs of which there are folders."""
    folders = list(results.run_folders.values())[:_MOST_FLOWS]
    summaries = [read_summary(folder) for folder in folders]
    return {edge_of(place) for summary in summaries for place in compute_blocked(summary=summary)[c.PLACE]}


def _roads(content: Content, runs: pd.DataFrame, blocked: Collection[str]) -> None:
    """Add maps and ranks of edges and junctions, at the vehicle count that the series share."""
    count = common_count(runs)
    of = {"runs": "runs", "edge_sets": "results.edge_sets"}
    where, by = f"{c.VEHICLES} == {count}", [c.SERIES]
    title = f"Edges with {count} vehicles"
    edges = content.table("edges", title, compute_edge_means, of, where=where, listed=False, by=by)
    if not len(edges):
        return
    if c.STOOD in edges and edges[c.STOOD].gt(0).any():
        for name, what in (("junctions", c.JUNCTION), ("streets", c.EDGE)):
            title = (
                f"{name.capitalize()} before which vehicles stand"
                if what == c.JUNCTION
                else "Streets on which vehicles stand"
            )
            content.table(name, title, compute_ranked, of, where=where, by=by, what=what, first=_RANKED)
            caption = f"The ten of each series with most of it, with {count} vehicles; means over runs."
            content.figure(name, title, caption, plots.plot_ranked, label="vehicle-seconds standing")
    for name, title, column, label in (
        ("map", "Where vehicles stand", c.STOOD, "vehicle-seconds standing per edge and run"),
        ("idleness-map", "Idleness of edges on loops", c.IDLENESS, "idleness per edge [s]"),
    ):
        if column in edges and edges[column].gt(0).any():
            caption = f"With {count} vehicles, mean over runs; broad and strong is much."
            caption += " Loops only." if runs[c.LOOPS].gt(0).any() else ""
            caption += " Dashed: closed or blocked for a time." if blocked else ""
            of_map: dict[str, Any] = {"value": column, "label": label, "blocked": sorted(blocked)}
            content.figure(name, title, caption, plots.plot_edges, "edges", **of_map)


def _over_time(content: Content, runs: pd.DataFrame, results: Results) -> str:
    """Add curves over time if there are run folders; return the expressions that load them."""
    flow = results.read_flow(runs) if len(set(runs[c.VEHICLES])) == 1 else pd.DataFrame()
    if flow.empty:
        return ""
    content.known["flow"] = flow
    begins = {float(read_summary(folder).get(c.BEGINS, 0.0)) for folder in results.run_folders.values()}
    content.begins_s = begins.pop() if len(begins) == 1 else 0.0
    longest = float(flow[c.TIME].max() - flow[c.TIME].min())
    every = max(60.0, round(longest / 120 / 60) * 60.0)
    of = {"flow": "flow"}
    table = content.table("flow", "Over time", compute_flow, of, every_s=every, by=[c.SERIES])
    if table.empty:
        return ""
    locked = sorted(runs[c.FIRST_DEADLOCK].dropna().tolist())[:_MOST_PANELS]
    upright = " Upright lines: deadlocks." if locked else ""
    for name, title, what, caption in (
        ("over-time", "Over time", [], f"Means over {every:g} s.{upright}"),
        ("so-far", "Totals so far", list(CUMULATIVE), f"Added up from the beginning.{upright}"),
    ):
        content.figure(
            name, title, caption, plots.plot_flow, "flow", what=what, deadlocks=locked, **content.clock
        )
    return "\nflow = results.read_flow(runs)"
