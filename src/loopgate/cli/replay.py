"""`loopgate replay`: a page that plays finished runs."""

from pathlib import Path

import click

from loopgate.cli.terminal import open_page


@click.command(
    epilog="""
    \b
    Examples:
      loopgate run sumo:DRT --loops 60 --vehicles 400 -o out/ours
      loopgate replay out/ours -o replay.html
      loopgate replay out/sumo out/ours -o both.html
    """
)
@click.argument("runs", type=click.Path(path_type=Path), nargs=-1, required=True, metavar="RUN [RUN2]")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), help="The page [default: replay.html in the last RUN]."
)
@click.option(
    "--export",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for GeoJSON, GPX, KML and CSV of the last RUN.",
)
@click.option("--open", "opened", is_flag=True, help="Open the page in a browser.")
def replay(*, runs: tuple[Path, ...], out: Path | None, export: Path | None, opened: bool) -> None:
    """Write a page that replays RUN, or two runs side by side on one clock.

    RUN is a run folder. The page opens offline, in any browser of 2023 or later: play it, click a vehicle to
    follow it and read why it waits, step to the next refusal, deadlock or lap. Vehicles are drawn on the
    lanes of their loops; runs made with --positions show the lanes they took, and vehicles on no loop.
    """
    from loopgate.cli.terminal import show_progress
    from loopgate.replay import make_replay

    with show_progress("replay, percent") as report:
        made = make_replay(*runs, report=report)
        page = made.write(out or runs[-1] / "replay.html")
    if opened:
        open_page(page)
    if export is not None:
        from loopgate.export import export_run

        click.echo(f"{export}, {len(export_run(runs[-1], export))} files")
    click.echo(f"{page}, {page.stat().st_size / 1e6:.1f} MB")
