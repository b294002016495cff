"""``loopgate example``: the files that the first lines of the documentation use."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import as_file, files
from pathlib import Path

import click

from loopgate.disk import writing
from loopgate.errors import LoopgateError


@contextmanager
def example_files() -> Iterator[Path]:
    """Find the folder with the networks, loops and sweep of the documentation."""
    with as_file(files("loopgate")) as package:
        # Installed they lie in the package; in a checkout where everybody sees them.
        inside = package / "examples"
        yield inside if inside.is_dir() else package.parents[1]


_PATTERNS = ("networks/*.net.xml", "networks/town.osm", "routes/*.rou.xml", "analysis/first_sweep.toml")


@click.command(
    epilog="""
    \b
    Then the commands of the documentation work as they are printed:
      loopgate run sumo:DRT --routes routes/berlin60.rou.xml --vehicles 400
      loopgate sweep analysis/first_sweep.toml
    """
)
@click.argument("folder", default=".", type=click.Path(file_okay=False, path_type=Path))
def example(folder: Path) -> None:
    """Write the networks, loops and the first sweep of the documentation into FOLDER, or here.

    Files that are there already stay as they are.
    """
    written = kept = 0
    with example_files() as root:
        found = [file for pattern in _PATTERNS for file in sorted(root.glob(pattern))]
        if not found:
            msg = f"{root}: the examples are missing; install the package again"
            raise LoopgateError(msg)
        for file in found:
            copy = folder / file.relative_to(root)
            if copy.exists():
                kept += 1
                continue
            with writing(copy):
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, copy)
            written += 1
    there = f", {kept} were there already" if kept else ""
    click.echo(f"{folder}: {written} files written into networks, routes and analysis{there}")
    click.echo("Try: loopgate run sumo:DRT --routes routes/berlin60.rou.xml --vehicles 100 --duration 300")
