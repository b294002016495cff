"""Tables of many rows on the terminal: the first ones, and how many more there are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

_MOST_ROWS = 40
_WIDTH = 120


def console() -> Console:
    """Return a console as wide as the terminal; of a fixed width where there is none."""
    made = Console(highlight=False)
    return made if made.is_terminal else Console(highlight=False, width=_WIDTH)


def print_table(
    to: Console,
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    left: Iterable[str] = (),
    most: int | None = _MOST_ROWS,
) -> None:
    """Print a table; the columns in `left` are flush left, rows beyond `most` only counted (None: all)."""
    every = list(rows)
    shown = every if most is None else every[:most]
    to.print(title, style="bold", markup=False)
    table = Table()
    for column in columns:
        table.add_column(escape(column), justify="left" if column in left else "right", overflow="fold")
    for row in shown:
        table.add_row(*map(escape, row))
    to.print(table)
    if len(every) > len(shown):
        to.print(f"... and {len(every) - len(shown)} more rows (--all prints all, --json lists all)")


def counted(number: int, what: str) -> str:
    """Return number and noun, as in ``3 loops``."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
