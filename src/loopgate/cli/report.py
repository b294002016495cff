"""`loopgate report`: a page from a results folder."""

from __future__ import annotations

from pathlib import Path

import click

__all__ = ["report"]


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), help="The page [default: RESULTS/report.html].")
@click.option(
    "--files", type=click.Path(path_type=Path), help="Folder for figures and tables [default: PAGE-files]."
)
def report(*, results: Path, out: Path | None, files: Path | None) -> None:
    """Write the throughput report on RESULTS: a sweep, a run folder, or a folder of runs.

    The page opens offline and prints; figures (SVG, PNG) and tables (CSV, LaTeX) go beside it.
    """
    from loopgate.analysis.load import read_results
    from loopgate.cli.progress import show_progress
    from loopgate.report.page import write_report

    with show_progress("report") as note:
        loaded = read_results(results)
        for text in loaded.notes:
            click.echo(f"loopgate: {text}", err=True)
        made = write_report(loaded, out or results / "report.html", files=files, report=note)
    beside = f", {made.figures} figures and {made.tables} tables in {made.files}" if made.files else ""
    click.echo(f"{made.page}{beside}")
