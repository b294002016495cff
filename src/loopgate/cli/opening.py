"""Opens pages in the user's browser."""

import webbrowser
from pathlib import Path

import click


def open_page(page: Path) -> None:
    """Open a page in the user's browser; where there is none, say on stderr which file to open."""
    if not webbrowser.open(page.resolve().as_uri()):
        click.echo(f"loopgate: no browser found; open {page} in one", err=True)
