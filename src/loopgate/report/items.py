"""The parts of a report: figures and tables with their captions, by network."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from loopgate.analysis.columns import SERIES
from loopgate.plots.charts import Chart
from loopgate.results.row_columns import TRUNCATED

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
    watch: pd.DataFrame | None = None
    """Promises by street, of a run that was to see streets again in time."""


class Content:
    """Collects the tables and figures of a section."""

    def __init__(self, known: Mapping[str, Any], names: Sequence[str]) -> None:
        self.style: dict[str, Any] = {"series": SERIES, "among": names}
        """The arguments of figures that concern series."""
        self.known = dict(known)
        """The values of the expressions that commands are made of."""
        runs = self.known["runs"]
        cut = int(runs[TRUNCATED].eq(other=True).sum()) if TRUNCATED in runs else 0
        self._mark = f"{cut} of {len(runs)} runs stopped at their deadlock" if cut else ""
        """What every figure and table says of runs that are compared with longer ones."""
        self.tables: dict[str, TableItem] = {}
        self.figures: list[FigureItem] = []

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

    def figure(self, name: str, title: str, caption: str, chart: Chart, table: str = "") -> None:
        """Add a figure of a table, unless that table was left out."""
        if (table or name) in self.tables:
            marked = f"{caption} {self._mark}." if self._mark else caption
            self.figures.append(FigureItem(name, title, marked, chart, table or name))

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

    def drop(self, name: str) -> None:
        """Remove a figure."""
        self.figures = [item for item in self.figures if item.name != name]
