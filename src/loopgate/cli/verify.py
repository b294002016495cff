"""``loopgate study verify``: check whether a gate keeps its promise."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, TextIO

import click

from loopgate.cli.terminal import print_json, show_progress
from loopgate.disk import writing
from loopgate.errors import GateError
from loopgate.model import Configuration, System, system_to_dict
from loopgate.plugins import blaming, is_ours

if TYPE_CHECKING:
    from loopgate.gates import Gate
    from loopgate.research.state_space import Verification

EXIT_BROKEN = 1
"""Exit code if a promise was broken."""

_SMALL = 5_000
"""Random systems with more configurations are checked by random walks, not explored."""


@click.command()
@click.argument("file", required=False, type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--random",
    "systems",
    type=click.IntRange(1, 10**9),
    help="Number of random systems to check, in place of FILE.",
)
@click.option("--gate", default="certified", show_default=True, help="Gate, with options: name:option=value.")
@click.option("--seed", default=1, show_default=True, help="Seed of the random systems and walks.")
@click.option(
    "--limit",
    type=click.IntRange(0, 10**9),
    default=100_000,
    show_default=True,
    help="Most configurations to explore.",
)
@click.option(
    "--walks",
    type=click.IntRange(0, 10**9),
    default=20,
    show_default=True,
    help="Number of random walks through a system that is too large to explore.",
)
@click.option(
    "--steps", type=click.IntRange(0, 10**9), default=500, show_default=True, help="Moves per walk."
)
@click.option(
    "--certificates",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write a certificate for each decision, for `loopgate study check-certificate`.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
@click.pass_context
def verify(
    ctx: click.Context,
    /,
    file: Path | None,
    systems: int | None,
    certificates: Path | None,
    *,
    as_json: bool,
    **given: Any,  # noqa: ANN401  the other options, as `_Plan` has them
) -> None:
    """Compare every decision of a gate with the exact answer, on the system in FILE or on random systems.

    Exhaustively where the configurations fit, else along random walks. Exit code 1 if a promise is broken.
    """
    from loopgate.model import read_system

    if (file is None) == (systems is None):
        msg = "give either a system FILE or --random N"
        raise click.UsageError(msg)
    plan = _Plan(**given)
    with ExitStack() as stack:
        if certificates is not None:
            stack.enter_context(writing(certificates, keep=True))
            plan.stream = stack.enter_context(certificates.open("w", encoding="utf-8"))
        what = "systems" if file is None else "configurations"
        report = stack.enter_context(show_progress(what, total=systems))
        found = plan.check(read_system(file), report) if file else plan.check_random(systems or 1, report)
    if as_json:
        print_json({"gate": plan.gate, **found.as_dict()})
    else:
        _print(plan.gate, found)
    ctx.exit(0 if found.holds else EXIT_BROKEN)


@dataclass(slots=True)
class _Plan:
    gate: str
    seed: int
    limit: int
    walks: int
    steps: int
    stream: TextIO | None = None

    def check(self, system: System, report: Callable[[int], None]) -> Verification:
        """Check one system, exhaustively or by random walks; write certificates if asked to."""
        from loopgate.research.state_space import ExplorationLimitError, verify_everywhere, verify_walks

        self._write(json.dumps({"system": system_to_dict(system)}, separators=(",", ":")))
        try:
            return verify_everywhere(
                system, self._make, limit=self.limit, progress=report, each=self._certify
            )
        except ExplorationLimitError:
            return verify_walks(
                system,
                self._make,
                seed=self.seed,
                walks=self.walks,
                steps=self.steps,
                limit=self.limit,
                progress=report,
                each=self._certify,
            )

    def check_random(self, systems: int, report: Callable[[int], None]) -> Verification:
        """Check random systems with consecutive seeds; one random walk through each that is too large."""
        from loopgate.research.state_space import Verification
        from loopgate.research.theory.random_systems import any_system

        total = Verification("mixed", "mixed", systems=0)
        for number in range(systems):
            report(number)
            plan = replace(self, seed=self.seed + number, limit=min(self.limit, _SMALL), walks=1)
            total += plan.check(any_system(plan.seed), lambda _done: None)
        return total

    def _make(self, system: System) -> Gate:
        from loopgate.gates import make_gate

        return make_gate(self.gate, system, perf_counter)

    def _certify(self, gate: Gate, configuration: Configuration, robot: int) -> None:
        if self.stream is None:
            return
        if not hasattr(gate, "certificate"):
            msg = f"gate {self.gate}: it gives no certificates; the gate certified does"
            raise GateError(msg)
        who = blaming(f"gate {self.gate}: certificate", "plain data, or None")
        with nullcontext() if is_ours(gate) else who:
            certificate = gate.certificate(configuration, robot)
            line = None if certificate is None else json.dumps(certificate, separators=(",", ":"))
        if line is not None:
            self._write(line)

    def _write(self, line: str) -> None:
        if self.stream is not None:
            self.stream.write(line + "\n")


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
        ("deadlocks", found.deadlocks if found.method == "exhaustive" else "not counted"),
        ("not for everyone", found.starving if found.method == "exhaustive" else "not counted"),
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
