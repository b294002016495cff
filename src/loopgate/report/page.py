"""Write the report: one self-contained page, and its figures and tables as files."""

import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.resources import files as resources
from pathlib import Path
from typing import Any

import pandas as pd
import vl_convert
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from loopgate.disk import disk_error, writing
from loopgate.errors import LoopgateError, ResultsError
from loopgate.foreign import reason_of
from loopgate.plots.charts import figure_spec, spec_svg
from loopgate.plots.style import DARK, LIGHT
from loopgate.reading import as_path, listed, of_kind
from loopgate.replay.page import hash_of
from loopgate.report.content import network_sections
from loopgate.report.embed import column_spec, download, library, page_spec, rows_of, script_json
from loopgate.report.facts import commands, facts, failures, progress
from loopgate.report.headline import headline, lead, title
from loopgate.report.headline_table import caption, headline_table, write_headline
from loopgate.report.items import FigureItem, Section, TableItem
from loopgate.report.methods import methods
from loopgate.report.tables import cells, write_csv, write_latex
from loopgate.results.row_columns import EDGE_LISTS, EDGE_SET, STATUS, STATUS_FAILED, STRANGE
from loopgate.runs.results import Results
from loopgate.versions import versions

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
    if not page.name:
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

    def _first(self, section: Section, tables: dict[str, TableItem], prefix: str) -> dict[str, Any] | None:
        """Return the table that comes first, and write it for a paper: none of one run, or of a watch."""
        item = tables.get("throughput")
        if item is None or section.watch is not None or len(section.runs) == 1:
            return None
        headings, rows = headline_table(item.table)
        said = caption(item.table)
        write_headline(headings, rows, said, self._folder / f"{prefix}headline.tex")
        return {"headings": headings, "rows": rows, "caption": said, "code": item.code}

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
            "code": table.code,
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
