"""Write the report: one self-contained page, and its figures and tables as files."""

import base64
import copy
import gzip
import io
import json
import re
import shlex
from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files as resources
from pathlib import Path
from typing import Any

import pandas as pd
import vl_convert
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from loopgate.disk import disk_error, writing
from loopgate.errors import LoopgateError, ResultsError
from loopgate.plots.charts import figure_spec, records, spec_svg
from loopgate.plots.style import DARK, LIGHT, colours, config, series_order
from loopgate.plugins import reason_of
from loopgate.reading import as_path, listed, of_kind
from loopgate.replay.page import hash_of
from loopgate.report.content import FigureItem, Section, TableItem, network_sections
from loopgate.report.headline import DASH, headline, lead, number, title, with_interval
from loopgate.report.methods import assumed, methods
from loopgate.report.tables import Cells, cells, latex_text, write_csv, write_latex
from loopgate.results import columns as c
from loopgate.results.columns import EDGE_LISTS, EDGE_SET, SERIES, STATUS, STATUS_FAILED, STRANGE
from loopgate.results.table_reading import csv_of, plain
from loopgate.runs.results import Results
from loopgate.versions import versions

_COLUMN_PT = 245
"""3.4 inches: a column of a page with two."""
_SNIPPET = "window.vegaEmbed = vegaEmbed;"


@cache
def library() -> str:
    """Return Vega, Vega-Lite and Vega-Embed as one script that works offline."""
    version = vl_convert.get_vegalite_versions()[-1]
    script: str = vl_convert.javascript_bundle(_SNIPPET, vl_version=version)
    return script.replace("</script", "<\\/script")


def page_spec(spec: dict[str, Any], description: str, tables: Container[str]) -> dict[str, Any]:
    """Return a figure for the page; `spec` is not used any more.

    Its data are names of `tables`, which the page holds once; its colours follow the page; series that the
    reader switched off (the parameter ``off``) are left out.
    """
    spec = {**spec, "config": config(colours)}
    spec["description"] = description
    spec["params"] = [*spec.get("params", []), {"name": "off", "value": []}]
    spec.setdefault("datasets", {})
    for part in list(_parts(spec)):
        data = part.get("data")
        if isinstance(data, dict) and data.get("name") in tables:
            part["data"] = {"name": data["name"]}
        if "mark" in part:
            part["transform"] = [{"filter": "indexof(off, datum['series']) < 0"}, *part.get("transform", [])]
    return spec


def column_spec(spec: dict[str, Any]) -> dict[str, Any]:
    """Return a figure as broad as a column of a page with two (3.4 inches), its words 7 to 8 points high."""
    narrow: dict[str, Any] = copy.deepcopy(spec)
    look = narrow.setdefault("config", {})
    for part in ("axis", "legend", "header"):
        look[part] = {**look.get(part, {}), "labelFontSize": 7, "titleFontSize": 8}
    look["legend"] |= {"labelLimit": 110, "columnPadding": 6}
    look["title"] = {**look.get("title", {}), "fontSize": 8}
    if "spec" in narrow:
        inner, columns = narrow["spec"], 1 if "usermeta" in narrow else narrow.get("columns", 1)
        breadth = _COLUMN_PT - 12 if "usermeta" in narrow else _COLUMN_PT // max(columns, 1) - 40
        larger = breadth / inner["width"]
        narrow["columns"] = columns
        if "usermeta" in narrow:
            inner["height"] = round(inner["height"] * larger)
            for one in (inner, *inner.get("layer", ())):
                if projection := one.get("projection"):
                    projection["scale"] *= larger
                    projection["translate"] = [shift * larger for shift in projection["translate"]]
        inner["width"] = breadth
    elif "vconcat" in narrow:
        for panel in narrow["vconcat"]:
            panel |= {"width": _COLUMN_PT - 34, "height": 60}
            panel["title"] = {**panel["title"], "fontSize": 8}
    else:
        narrow |= {"width": _COLUMN_PT, "autosize": {"type": "fit-x", "contains": "padding"}}
        narrow["height"] = round(narrow.get("height", 200) * 0.6)
    return narrow


def _parts(part: Any) -> Iterator[dict[str, Any]]:  # noqa: ANN401 - any JSON
    """Yield the views of a figure, from the outermost on."""
    if isinstance(part, dict):
        yield part
        for name in ("layer", "vconcat", "spec"):
            for inner in part[name] if isinstance(part.get(name), list) else [part.get(name)]:
                yield from _parts(inner)


def download(table: pd.DataFrame) -> dict[str, str]:
    """Return the table as CSV (compressed) and Parquet, both as base64."""
    simple = plain(table)
    buffer = io.BytesIO()
    simple.to_parquet(buffer, index=False, compression="zstd")
    packed = gzip.compress(csv_of(table).encode(), mtime=0)
    return {"csv": base64.b64encode(packed).decode(), "parquet": base64.b64encode(buffer.getvalue()).decode()}


def script_json(value: object) -> Markup:
    """Return JSON that can stand inside a script element."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    text = text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    return Markup(text)  # noqa: S704 - it has no character that could end its element


def rows_of(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows for figures."""
    return records(plain(table))


_MOST_VALUES = 12
_MOST_COMMANDS = 60


def progress(results: Results) -> str:
    """Return one sentence on the progress of the sweep."""
    runs = results.runs
    planned = int(results.manifest.get("runs", len(runs)))
    failed = int((runs[c.STATUS] == c.STATUS_FAILED).sum())
    if runs.empty:
        return f"There are no runs yet, of {planned} planned." if planned else "There are no runs."
    there = f"{len(runs)} run{'s' if len(runs) != 1 else ''}"
    text = f"{there} of {planned} planned are there" if planned > len(runs) else f"{there}"
    if failed == len(runs):
        return f"{text}; all failed, so there is nothing to compare. The reasons are below."
    codes = len(runs[c.LOOPGATE_CODE].dropna().unique())
    mixed = f" They were made by {codes} different codes of loopgate: compare with care." if codes > 1 else ""
    return f"{text}{f'; {failed} failed' if failed else ', none failed'}.{mixed}"


def facts(results: Results) -> list[tuple[str, str]]:
    """Return the settings of the runs, as names and values."""
    runs = results.runs
    rows = [("Results", ", ".join(map(str, results.folders))), *(("Note", note) for note in results.notes)]
    for name, column in (
        ("Networks", c.NETWORK),
        ("Gates", c.GATE),
        ("Abstraction", c.ABSTRACTION),
        ("Negotiation", c.NEGOTIATION),
        ("Lights", c.LIGHTS),
        ("Vehicles", c.VEHICLES),
        ("Loops", c.LOOPS),
        ("Seeds", c.SEED),
        ("Simulated time [s]", c.DURATION),
        ("Warm-up [s]", c.WARMUP),
        ("loopgate", c.LOOPGATE_VERSION),
        ("loopgate, its code", c.LOOPGATE_CODE),
        ("SUMO", c.SUMO_VERSION),
        ("Python", c.PYTHON_VERSION),
    ):
        values = [v for v in runs[column].dropna().unique() if v != ""]
        if values:
            rows.append((name, _listed(values)))
    if runs[c.TOOK].notna().any():
        rows += [
            ("Computing time", f"{runs[c.TOOK].sum() / 3600:.2f} h in {runs[c.WORKER].nunique()} processes"),
            ("Peak memory of a process", f"{runs[c.PEAK_MEMORY].max():.0f} MiB"),
        ]
    finished = runs[c.FINISHED].dropna()
    if len(finished):
        rows.append(("Made", f"{finished.min():%Y-%m-%d %H:%M} to {finished.max():%Y-%m-%d %H:%M} UTC"))
    return rows


def failures(results: Results) -> TableItem | None:
    """Return the failed runs by reason, or None if none failed."""
    failed = results.runs[results.runs[c.STATUS] == c.STATUS_FAILED]
    if failed.empty:
        return None
    table = (
        failed.groupby(c.ERROR, dropna=False)
        .agg(runs=(c.KEY, "size"), example=(c.KEY, "first"), scenario=(c.SCENARIO, "first"))
        .reset_index()
        .sort_values("runs", ascending=False, kind="stable")
    )
    return TableItem("failures", "Runs that failed", table)


def commands(results: Results) -> dict[str, Any]:
    """Return the command of a sweep, and for each setting the command of its first run."""
    runs = results.runs
    known = runs[runs[c.COMMAND].notna()].sort_values([c.NETWORK, c.GATE, c.VEHICLES, c.SEED], kind="stable")
    first = known.drop_duplicates([c.NETWORK, c.GATE, c.VEHICLES])
    return {
        "sweep": results.manifest.get("command"),
        "runs": list(first[c.COMMAND].head(_MOST_COMMANDS)),
        "more": len(known) - min(len(first), _MOST_COMMANDS),
    }


def _listed(values: list[Any]) -> str:
    numbers = all(pd.api.types.is_number(value) for value in values)
    ordered = sorted(values) if numbers else sorted(map(str, values))
    texts = [f"{value:g}" if numbers else str(value) for value in ordered]
    if len(texts) <= _MOST_VALUES:
        return ", ".join(texts)
    return (
        f"{texts[0]} to {texts[-1]} ({len(texts)} values)"
        if numbers
        else f"{', '.join(texts[:5])}, ... ({len(texts)})"
    )


_OF_ONE = "Throughput [vehicle-km/h]"
_OF_MEANS = f"{_OF_ONE}: mean over runs"
_WITH_INTERVALS = f"{_OF_MEANS} with its 95 % interval (Student's t)"


def caption(means: pd.DataFrame) -> str:
    """Return the caption of a table of means; it explains brackets only if there are any."""
    if means[c.LOW].notna().any():
        return _WITH_INTERVALS
    return _OF_MEANS if (means[c.RUNS] > 1).any() else _OF_ONE


def headline_table(means: pd.DataFrame) -> Cells:
    """Return vehicles against rules from `compute_mean` by series and vehicles: headings and rows as text."""
    names = series_order(means[SERIES])
    by = means.set_index([c.VEHICLES, SERIES])
    counts = sorted(means[c.VEHICLES].unique())
    rows = [
        [
            f"{count:g}",
            *(_cell(by.loc[(count, name)]) if (count, name) in by.index else DASH for name in names),
        ]
        for count in counts
    ]
    return ["vehicles", *names], rows


def _cell(row: pd.Series) -> str:
    if pd.isna(row[c.LOW]):
        return number(float(row[c.MEAN]))
    return with_interval(*(float(row[name]) for name in (c.MEAN, c.LOW, c.HIGH)))


_STOPS = {
    c.STOP: "stop",
    c.LOOP: "loop",
    c.VISITS: "visits",
    c.HEADWAY: "headway [s]",
    c.LONGEST_HEADWAY: "longest headway [s]",
    c.LATENESS: "late, median [s]",
    c.WORST_LATENESS: "late, worst [s]",
    c.ON_TIME_60: "within a minute",
    c.PERSONS: "persons waiting",
    c.PERSONS_MOST: "most at once",
}


def stops_table(stops: pd.DataFrame) -> Cells:
    """Return the cells of the table of stops, as a reader wants them; a dash for what is not known."""
    names = [name for name in _STOPS if stops[name].notna().any()]
    rows = [
        [
            str(row[name])
            if name in {c.STOP, c.LOOP, c.VISITS}
            else DASH
            if pd.isna(row[name])
            else f"{row[name]:.0%}"
            if name == c.ON_TIME_60
            else number(float(row[name]))
            for name in names
        ]
        for _, row in stops.iterrows()
    ]
    return [_STOPS[name] for name in names], rows


def write_headline(headings: list[str], rows: list[list[str]], said: str, file: Path) -> None:
    """Write the table for a paper that loads the package booktabs, with `said` as its caption."""
    text = latex_text(pd.DataFrame(rows, columns=headings), [True] * len(headings), said, file.stem)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")


_LONGEST_TABLE = 400  # rows on the page; the files have all
_PNG_SCALE = 2.5


@dataclass(frozen=True, slots=True)
class ReportFiles:
    """The paths of a report's files, and its numbers of figures and tables."""

    page: Path
    files: Path | None
    """The folder with figures (SVG, PNG) and tables (CSV, LaTeX); None if there was nothing to draw."""
    figures: int
    tables: int


def write_report(
    results: Results,
    page: Path | str,
    *,
    files: Path | str | None = None,
    report: Callable[[int, int], None] | None = None,
) -> ReportFiles:
    """Write an HTML report on results, with its figures and tables as files beside it.

    Raises `ResultsError` if a file cannot be written, or the results have invalid values.

    Parameters
    ----------
    results
        From `read_results`: any number of runs, complete or failed.
    page
        The HTML file to write; it works offline.
    files
        Folder for figures and tables; default: beside the page, with ``-files`` after its name.
    report
        Called with the number of figures and tables written so far, and the number of all.

    Examples
    --------
    >>> from loopgate import Scenario, read_results, run, write_report
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> made = run(Scenario(**roads, gate="open", duration_s=60), "out/one")
    >>> write_report(read_results("out/one"), "out/report.html").page.name
    'report.html'
    """
    results = of_kind(
        Results, results, "write_report: the results", ResultsError, "Results, as read_results returns"
    )
    page = as_path(page, "page", ResultsError)
    if page.suffix.lower() == ".pdf":
        msg = f"{page}: the page is HTML; name it .html; loopgate report --pdf {page} prints it"
        raise ResultsError(msg)
    if not page.name or page.is_dir():
        msg = f"{page}: a folder; expected the name of a page, such as report.html"
        raise ResultsError(msg)
    folder = Path(files) if files is not None else page.with_name(f"{page.stem}-files")
    try:
        return _write(results, page, folder, report or (lambda _done, _total: None))
    except ResultsError:
        raise
    except OSError as error:
        msg = f"{error.filename or folder}: cannot be written ({disk_error(error)})"
        raise ResultsError(msg) from error
    except Exception as error:
        told = str(error) if isinstance(error, LoopgateError) else f"{STRANGE} ({reason_of(error)})"
        msg = f"{listed(map(str, results.folders))}: {told}"
        raise ResultsError(msg) from error


def _write(results: Results, page: Path, folder: Path, report: Callable[[int, int], None]) -> ReportFiles:
    page.parent.mkdir(parents=True, exist_ok=True)
    sections = network_sections(results)
    failed = failures(results)
    total = sum(len(s.figures) + len(s.tables) for s in sections) + 1
    writer = _Writer(folder, len(sections) > 1, lambda done: report(done, total))
    first = lead(sections) if sections else ""
    count = int((results.runs[STATUS] == STATUS_FAILED).sum())
    shown = [writer.section(section, first, count) for section in sections]
    if len(results.runs):
        folder.mkdir(parents=True, exist_ok=True)
        write_csv(results.runs.drop(columns=[EDGE_SET, *EDGE_LISTS.values()]), folder / "all-runs.csv")
    if failed is not None:
        writer.table(failed, "")
    script = resources("loopgate.report").joinpath("templates/report.js").read_text(encoding="utf-8")
    drawing = library() if sections else ""
    text = _template().render(
        title=title(sections) if sections else results.name,
        lead=first,
        name=results.name,
        made=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        version=versions()["loopgate"],
        facts=facts(results),
        progress=progress(results),
        sections=shown,
        failures=None if failed is None else {**_shown_table(failed), "id": "failures-table"},
        commands=commands(results),
        again=shlex.join(["loopgate", "report", *map(str, results.folders), "-o", str(page)]),
        files=folder.name if len(results.runs) else None,
        light=LIGHT,
        dark=DARK,
        content=script_json({"specs": writer.specs, "tables": writer.files}),
        scripts=[Markup(one) for one in (drawing, script) if one],  # noqa: S704 - ours and the library's
        hash_of=lambda style: Markup(hash_of(style)),  # noqa: S704 - a digest
        hashes=Markup(" ".join(hash_of(one) for one in (drawing, script) if one)),  # noqa: S704 - digests
    )
    with writing(page):
        page.write_text(text, encoding="utf-8")
    return ReportFiles(page, folder if len(results.runs) else None, writer.figures, writer.tables)


def phases_table(phases: pd.DataFrame) -> Cells:
    """Return headings and rows of stops, with visits and lateness before, during and after a closure."""
    kinds = list(dict.fromkeys(phases[c.PHASE]))
    headings = [
        "stop",
        "loop",
        *(f"visits {kind}" for kind in kinds),
        *(f"latest {kind} [s]" for kind in kinds),
    ]
    rows = []
    for (stop, loop), some in phases.groupby([c.STOP, c.LOOP], sort=False):
        by = some.set_index(c.PHASE)
        late = [
            DASH if pd.isna(by[c.WORST_LATENESS][kind]) else number(by[c.WORST_LATENESS][kind])
            for kind in kinds
        ]
        rows.append([str(stop), str(loop), *(str(by[c.VISITS][kind]) for kind in kinds), *late])
    return headings, rows


_FIRST_OF_ONE: Mapping[str, Callable[[pd.DataFrame], Cells]] = {
    "stops": stops_table,
    "stop-phases": phases_table,
    "delayed": cells,
}
"""Tables of a single run that an operator sees first, and how each is shown."""

_MOST_FIRST = 12


def _first_table(item: TableItem, make: Callable[[pd.DataFrame], Cells]) -> dict[str, Any]:
    headings, rows = make(item.table)
    more = f"; the first {_MOST_FIRST} of {len(rows)}" if len(rows) > _MOST_FIRST else ""
    return {"headings": headings, "rows": rows[:_MOST_FIRST], "caption": f"{item.title}{more}."}


class _Writer:
    """Writes figures and tables as files, and returns their part of the page."""

    def __init__(self, folder: Path, many: bool, report: Callable[[int], None]) -> None:  # noqa: FBT001
        self._folder = folder
        self._many = many
        self._report = report
        self.figures = self.tables = 0
        self.specs: dict[str, Any] = {}
        self.files: dict[str, Any] = {}

    def section(self, section: Section, said: str, failed: int) -> dict[str, Any]:
        """Write a section's files; the headline omits sentences in `said`."""
        prefix = re.sub(r"[^\w.-]+", "-", section.network) + "-" if self._many else ""
        tables = {item.name: item for item in section.tables}
        drawn = {name for item in section.figures for name in (item.table, "runs")} - {"edges"}
        known = {name: prefix + name for name in tables}
        return {
            "network": section.network,
            "headline": headline(section, said),
            "first": self._first(section, tables, prefix),
            "methods": methods(section, failed),
            "assumed": assumed(section),
            "watch": section.watch is not None,
            "names": section.names,
            "hidden": section.hidden,
            "load": section.load,
            "figures": [self.figure(item, tables[item.table], prefix) for item in section.figures],
            "tables": [
                shown
                for item in section.tables
                for shown in [self.table(item, prefix, rows=item.name in drawn)]
                if item.listed
            ],
            "known": known,
        }

    def _first(self, section: Section, tables: dict[str, TableItem], prefix: str) -> list[dict[str, Any]]:
        """Return the tables that come first, and write that of means for a paper.

        Of one run they are those of its stops, and what changed while some place was shut.
        """
        if section.watch is not None:
            return []
        if len(section.runs) == 1:
            return [
                _first_table(tables[name], make) for name, make in _FIRST_OF_ONE.items() if name in tables
            ]
        item = tables.get("throughput")
        if item is None:
            return []
        headings, rows = headline_table(item.table)
        said = caption(item.table)
        write_headline(headings, rows, said, self._folder / f"{prefix}headline.tex")
        return [{"headings": headings, "rows": rows, "caption": said}]

    def figure(self, item: FigureItem, table: TableItem, prefix: str) -> dict[str, Any]:
        """Write a figure as SVG and PNG."""
        self._folder.mkdir(parents=True, exist_ok=True)
        name = prefix + item.name
        spec = figure_spec(item.figure)
        svg = spec_svg(spec)
        (self._folder / f"{name}.svg").write_text(svg, encoding="utf-8")
        (self._folder / f"{name}.png").write_bytes(vl_convert.svg_to_png(svg, scale=_PNG_SCALE))
        narrow = spec_svg(column_spec(spec))
        (self._folder / f"{name}-column.pdf").write_bytes(vl_convert.svg_to_pdf(narrow))
        self.specs[name] = {
            "spec": page_spec(spec, f"{item.title}. {item.caption}", {table.name, "runs"} - {"edges"}),
            "prefix": prefix,
        }
        self._note(figure=True)
        return {
            "id": name,
            "title": item.title,
            "caption": item.caption,
            "code": item.code,
            "file": f"{prefix}{table.name}",
        }

    def table(self, item: TableItem, prefix: str, *, rows: bool = False) -> dict[str, Any]:
        """Write a table as CSV and LaTeX."""
        self._folder.mkdir(parents=True, exist_ok=True)
        name = prefix + item.name
        write_csv(item.table, self._folder / f"{name}.csv")
        write_latex(item.table.head(_LONGEST_TABLE), self._folder / f"{name}.tex", caption=item.title)
        self.files[name or "failures"] = {
            **download(item.table),
            **({"rows": rows_of(item.table)} if rows else {}),
        }
        self._note(figure=False)
        return {**_shown_table(item), "id": f"{name}-table", "file": name}

    def _note(self, *, figure: bool) -> None:
        self.figures += figure
        self.tables += not figure
        self._report(self.figures + self.tables)


def _shown_table(item: TableItem) -> dict[str, Any]:
    head = item.table.head(_LONGEST_TABLE)
    headings, rows = cells(head)
    numeric = [pd.api.types.is_numeric_dtype(item.table[name]) for name in item.table.columns]
    return {
        "id": item.name,
        "file": item.name,
        "title": item.title,
        "headings": headings,
        "rows": rows,
        "raw": [["" if v is None else v for v in row.values()] for row in rows_of(head)],
        "numeric": numeric,
        "more": max(0, len(item.table) - _LONGEST_TABLE),
        "code": item.code,
    }


def _template() -> Any:  # noqa: ANN401 - Jinja's own type is not exported
    environment = Environment(
        loader=PackageLoader("loopgate.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2")
