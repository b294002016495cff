"""Tables on the terminal: tables of many rows, and the summary of a run."""

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from loopgate.reading import counted
from loopgate.results.figures import closed_at_s, summary_rows
from loopgate.versions import ledger_kind, ledger_words

_LANE = re.compile(r"_\d+$")
_STREETS, _SMALL = 6, 4
"""So many streets of a deadlock are named, and the vehicles of a circle of so many."""
_LONG_S = 2.0
"""A run whose gate took this long says what a plain ledger costs [s]."""


def console(width: int = 120) -> Console:
    """Return a console as wide as the terminal, or of a fixed width without a terminal."""
    made = Console(highlight=False)
    return made if made.is_terminal else Console(highlight=False, width=width)


def print_table(
    to: Console,
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str | float]],
    *,
    left: Iterable[str] = (),
    most: int | None = None,
) -> None:
    """Print a table. Columns in `left` are flush left. At most `most` rows are printed (None: all)."""
    every = list(rows)
    to.print(title, style="bold", markup=False)
    table = Table()
    for column in columns:
        table.add_column(escape(column), justify="left" if column in left else "right", overflow="fold")
    for row in every[:most]:
        table.add_row(*(escape(f"{cell:.1f}" if isinstance(cell, float) else str(cell)) for cell in row))
    to.print(table)
    if most is not None and len(every) > most:
        to.print(f"... and {len(every) - most} more rows (--json lists all)")


def deadlock_text(deadlock: Mapping[str, Any]) -> str:
    """Return a line about a deadlock: number of vehicles and streets; all vehicles of a small circle."""
    vehicles = deadlock["vehicles"]
    # A place is a lane, EDGE_NUMBER, or a state of a gate that has a name of its own.
    streets = list(dict.fromkeys(_LANE.sub("", place) for place in deadlock["places"]))
    more = f" and {len(streets) - _STREETS} more" if len(streets) > _STREETS else ""
    where = f"{', '.join(streets[:_STREETS])}{more}"
    text = f"{counted(len(vehicles), 'vehicle')} on {counted(len(streets), 'street')}: {where}"
    if len(vehicles) <= _SMALL:
        text += f" ({' -> '.join([*vehicles, vehicles[0]])})"
    behind = deadlock.get("held_up", len(vehicles)) - len(vehicles)
    return f"{text}; {behind} more stand behind them" if behind else text


def print_summary(summary: Mapping[str, Any], out: Path | None) -> None:
    """Print the table, the warnings and the folder of the results."""
    to = console(110)
    gate = summary["gate"] if summary["gate"] == "open" else f"{summary['gate']} on {summary['abstraction']}"
    rules = f"read from {summary['source']}" if "source" in summary else f"{gate}, seed {summary['seed']}"
    table = Table(title=escape(f"{summary['network']}: {rules}"), show_header=False)
    table.add_column(style="bold")
    table.add_column()
    for what, much in summary_rows(summary):
        table.add_row(what, much)
    to.print(table)
    for warning in summary["warnings"]:
        to.print(f"warning: {warning}", style="yellow", markup=False)
    for deadlock in summary["deadlocks"][:3]:
        to.print(f"deadlock at {closed_at_s(deadlock):.0f} s: {deadlock_text(deadlock)}", markup=False)
    if summary["wall_s"]["gate"] >= _LONG_S and summary["gate"] != "open" and ledger_kind() == "plain":
        to.print(ledger_words(), markup=False)
    if out is not None:
        there = shlex.quote(str(out))
        words = f"results in {out}; next: loopgate report {there}, or loopgate replay {there}"
        to.print(words, soft_wrap=True, markup=False)
    elif "source" not in summary:
        to.print("nothing was kept; with -o FOLDER the run can be reported, replayed and read in Python")
