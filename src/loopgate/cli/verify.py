"""``loopgate verify``: does a gate keep its promise."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from loopgate.cli.progress import Report, show_progress

if TYPE_CHECKING:
    from loopgate.gates import Gate
    from loopgate.model import System
    from loopgate.untimed import Verification

__all__ = ["EXIT_BROKEN", "verify"]

EXIT_BROKEN = 1
"""A promise was seen broken."""

_SMALL = 5_000
"""Random systems with more configurations are walked, not explored."""


@click.command()
@click.argument("file", required=False, type=click.Path(path_type=Path, dir_okay=False))
@click.option("--random", "systems", type=click.IntRange(1), help="Check so many random systems instead.")
@click.option("--gate", default="certified", show_default=True, help="Gate, with options: name:option=value.")
@click.option("--seed", default=1, show_default=True, help="Of the random systems and walks.")
@click.option("--limit", default=100_000, show_default=True, help="Most configurations to explore.")
@click.option("--walks", default=20, show_default=True, help="Random walks where exploring does not fit.")
@click.option("--steps", default=500, show_default=True, help="Moves per walk.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
@click.pass_context
def verify(  # noqa: PLR0913 - one parameter per option
    ctx: click.Context,
    *,
    file: Path | None,
    systems: int | None,
    gate: str,
    seed: int,
    limit: int,
    walks: int,
    steps: int,
    as_json: bool,
) -> None:
    """Check every decision of a gate against the exact answer, on the system in FILE or on random ones.

    Exhaustively where the configurations fit, else along random walks. Exit code 1 if a promise is broken.
    """
    from loopgate.model import read_system

    if (file is None) == (systems is None):
        msg = "give either a system FILE or --random N"
        raise click.UsageError(msg)
    with show_progress("systems" if file is None else "configurations", total=systems) as report:
        if file is not None:
            system = read_system(file)
            found = _check(system, gate, seed=seed, limit=limit, walks=walks, steps=steps, report=report)
        else:
            limit = min(limit, _SMALL)
            found = _check_random(systems or 1, gate, seed=seed, limit=limit, steps=steps, report=report)
    if as_json:
        click.echo(json.dumps({"gate": gate, **found.as_dict()}))
    else:
        _print(gate, found)
    ctx.exit(0 if found.holds else EXIT_BROKEN)


def _check(
    system: System, gate: str, *, seed: int, limit: int, walks: int, steps: int, report: Report
) -> Verification:
    from loopgate.gates import make_gate
    from loopgate.theory.oracle import OracleLimitError
    from loopgate.untimed import verify_everywhere, verify_walks

    def make(system: System) -> Gate:
        return make_gate(gate, system)

    try:
        return verify_everywhere(system, make, limit=limit, progress=report)
    except OracleLimitError:
        return verify_walks(system, make, seed=seed, walks=walks, steps=steps, limit=limit, progress=report)


def _check_random(
    systems: int, gate: str, *, seed: int, limit: int, steps: int, report: Report
) -> Verification:
    from loopgate.untimed import Verification, any_system

    total = Verification("mixed", "mixed", systems=0)
    for number in range(seed, seed + systems):
        report(number - seed)
        system = any_system(number)
        total += _check(system, gate, seed=number, limit=limit, walks=1, steps=steps, report=_silent)
    return total


def _silent(done: int, total: int | None = None) -> None:
    del done, total


def _print(gate: str, found: Verification) -> None:
    rows: list[tuple[str, object]] = [
        ("gate", gate),
        ("method", f"{found.method}, judged by {found.judge}"),
        ("systems", found.systems),
        ("starts refused", f"{found.starts_refused} (live: {found.live_starts_refused})"),
        ("dead starts taken", found.dead_starts_accepted),
        ("configurations", found.configurations),
        ("decisions", found.decisions),
        ("unsafe admitted", found.unsafe_admitted),
        ("stuck", found.stuck),
        ("budget stops", found.budget_stops),
        ("permissiveness", "not judged" if found.permissiveness is None else f"{found.permissiveness:.6f}"),
        ("coverage", "not known" if found.coverage is None else f"{found.coverage:.6f}"),
    ]
    if found.disabled_admitted:
        rows.append(("disabled admitted", found.disabled_admitted))
    if found.counterexample:
        example = found.counterexample
        moves = " ".join(example.moves) or "no move"
        rows.append((example.kind, f"after {moves}: {' '.join(example.configuration)}"))
    for name, value in rows:
        click.echo(f"{name:18} {value}")
    if found.holds:
        click.echo("safe: no promise was broken")
    else:
        click.echo("NOT safe")
