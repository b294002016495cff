"""Tables of many rows on the terminal: the first ones, and how many more there are."""

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

_WIDTH = 120


def console() -> Console:
    """Return a console as wide as the terminal; of a fixed width where there is none."""
    made = Console(highlight=False)
    return made if made.is_terminal else Console(highlight=False, width=_WIDTH)


def print_table(
    to: Console,
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str | float]],
    *,
    left: Iterable[str] = (),
    most: int | None = None,
) -> None:
    """Print a table; the columns in `left` are flush left, rows beyond `most` only counted (None: none)."""
    every = list(rows)
    to.print(title, style="bold", markup=False)
    table = Table()
    for column in columns:
        table.add_column(escape(column), justify="left" if column in left else "right", overflow="fold")
    for row in every[:most]:
        table.add_row(*(escape(f"{cell:.1f}" if isinstance(cell, float) else str(cell)) for cell in row))
    to.print(table)
    if most is not None and len(every) > most:
        to.print(f"... and {len(every) - most} more rows (--all prints all, --json lists all)")
