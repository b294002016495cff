"""The table at the end of a run."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from loopgate.results.summary_rows import summary_rows


def print_summary(summary: Mapping[str, Any], out: Path | None) -> None:
    """Print the table, warnings, and where the results are."""
    console = Console(highlight=False, width=None if Console().is_terminal else 110)
    gate = summary["gate"] if summary["gate"] == "open" else f"{summary['gate']} on {summary['abstraction']}"
    table = Table(title=f"{summary['network']}: {gate}, seed {summary['seed']}", show_header=False)
    table.add_column(style="bold")
    table.add_column()
    for what, much in summary_rows(summary):
        table.add_row(what, much)
    console.print(table)
    for warning in summary["warnings"]:
        console.print(f"warning: {warning}", style="yellow")
    for deadlock in summary["deadlocks"][:3]:
        chain = " -> ".join(
            f"{vehicle} (wants {place})"
            for vehicle, place in zip(deadlock["vehicles"], deadlock["places"], strict=True)
        )
        console.print(f"deadlock at {deadlock['at_s']:.0f} s: {chain} -> {deadlock['vehicles'][0]}")
    if out is not None:
        console.print(f"results in {out}")
