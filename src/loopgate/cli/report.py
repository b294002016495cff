"""`loopgate report`: a page from a results folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from loopgate.cli.terminal import open_page, print_json

if TYPE_CHECKING:
    from loopgate.runs.results import Results


@click.command()
@click.argument("results", type=click.Path(path_type=Path), nargs=-1, required=True)
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), help="The page [default: in the first RESULTS]."
)
@click.option(
    "--files", type=click.Path(path_type=Path), help="Folder for figures and tables [default: PAGE-files]."
)
@click.option(
    "--export",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for GeoJSON, GPX, KML and CSV of each run folder among RESULTS.",
)
@click.option(
    "--pdf",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Print the page, without its tables, to this file; needs Chromium, Chrome or Edge.",
)
@click.option("--open", "opened", is_flag=True, help="Open the page in a browser.")
@click.option("--json", "as_json", is_flag=True, help="Print what was written as JSON.")
def report(
    *,
    results: tuple[Path, ...],
    out: Path | None,
    files: Path | None,
    export: Path | None,
    pdf: Path | None,
    opened: bool,
    as_json: bool,
) -> None:
    """Write a page about RESULTS: sweeps, run folders, or folders of runs.

    Several become one report; a run that is in more than one of them counts once.

    The page opens offline and prints; figures (SVG, PNG) and tables (CSV, LaTeX) go beside it.
    """
    from loopgate.cli.terminal import show_progress
    from loopgate.report.page import write_report
    from loopgate.runs.results import read_results

    with show_progress("report") as note:
        loaded = read_results(results)
        for text in loaded.notes:
            click.echo(f"loopgate: {text}", err=True)
        made = write_report(loaded, out or results[0] / "report.html", files=files, report=note)
    if not as_json:
        beside = f", {made.figures} figures and {made.tables} tables in {made.files}" if made.files else ""
        click.echo(f"{made.page}{beside}")
    if pdf is not None:
        from loopgate.report.printing import print_page

        print_page(made.page, pdf)
        if not as_json:
            click.echo(pdf)
    if opened:
        open_page(made.page)
    exported = [] if export is None else _export(loaded, export)
    if as_json:
        written = {"page": str(made.page), "files": str(made.files) if made.files else None}
        written |= {"export": str(export) if exported else None, "pdf": str(pdf) if pdf else None}
        print_json(written | {"figures": made.figures, "tables": made.tables})
    elif exported:
        click.echo(f"{export}, {len(exported)} files")


def _export(results: Results, folder: Path) -> list[Path]:
    """Write the maps of runs; several runs get a folder each."""
    from loopgate.errors import ResultsError
    from loopgate.export import export_run

    runs = sorted(results.run_folders.values())
    if not runs:
        msg = (
            f"{', '.join(map(str, results.folders))}: --export needs run folders, and a sweep keeps rows only"
        )
        raise ResultsError(msg)
    return [file for one in runs for file in export_run(one, folder if len(runs) == 1 else folder / one.name)]
