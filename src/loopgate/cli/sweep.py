"""`loopgate sweep`: run a grid of scenarios; each run makes a row."""

from __future__ import annotations

import contextlib
import shlex
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.cli.terminal import FiniteRange, print_json, show_progress
from loopgate.errors import SweepError
from loopgate.reading import counted

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from loopgate.sweep import Point, Progress, Sweep

_SHOWN = 12  # lines of a dry run


@click.command(
    epilog="""
    \b
    Exit codes: 0 done, 2 bad input or a full disk, 130 interrupted (Ctrl-C, SIGTERM, SIGHUP).
    """
)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), help="Results folder [default: out/NAME].")
@click.option(
    "-j", "--workers", type=click.IntRange(1, 10_000), help="Processes [default: one per processor]."
)
@click.option(
    "--executor",
    type=click.Choice(["local", "dask"]),
    default="local",
    show_default=True,
    help="Where the runs are made.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler, such as tcp://host:8786.")
@click.option(
    *("--timeout", "timeout_s"),
    type=FiniteRange(0.0, 1e8, min_open=True),
    help="Longest wall time of a local run [s].",
)
@click.option("--retry-failed", is_flag=True, help="Repeat runs that failed.")
@click.option("--keep-runs", is_flag=True, help="Keep every run folder in RESULTS/runs.")
@click.option("--dry-run", is_flag=True, help="List the runs and estimate the time. Run nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")
@click.option("--runner", hidden=True)
def sweep(
    *,
    file: Path,
    out: Path | None,
    workers: int | None,
    executor: str,
    scheduler: str | None,
    dry_run: bool,
    as_json: bool,
    runner: str | None,
    **options: Any,  # noqa: ANN401  the others, as `run_sweep` has them
) -> None:
    """Run each scenario of the sweep FILE (TOML) that has no row in the results folder.

    End it at any moment, by any means: the same command goes on where it stopped.
    """
    from loopgate.sweep import read_sweep, run_sweep

    described = read_sweep(file)
    folder = out or Path("out") / described.name
    points = described.points()
    if runner is None:
        _check(points, file)
    if dry_run:
        _show_plan(described, points, folder, workers, as_json=as_json)
        return
    options |= {"runner": runner} if runner else {}
    try:
        with _pool(executor, scheduler) as (pool, size), show_progress(described.name) as report:

            def note(p: Progress) -> None:
                report(p.present + p.done, p.total, f", {p.failed} failed" if p.failed else "")

            outcome = run_sweep(
                described, folder, executor=pool, workers=size or workers, report=note, **options
            )
    except KeyboardInterrupt:
        click.echo(f"\n{folder}: all rows so far are kept; the same command continues the sweep", err=True)
        raise
    if as_json:
        text = {name: getattr(outcome, name) for name in ("total", "present", "done", "failed", "seconds")}
        print_json({"results": str(folder), **text})
        return
    rate = f", {60 * outcome.done / outcome.seconds:.1f} runs/min" if outcome.done else ""
    failed = f", {outcome.failed} failed (see the column error)" if outcome.failed else ""
    click.echo(
        f"{folder}: {outcome.present + outcome.done} of {outcome.total} rows, "
        f"{outcome.done} made now in {_span(outcome.seconds)}{rate}{failed}"
    )
    click.echo(f"next: {shlex.join(['loopgate', 'report', str(folder), '-o', f'{folder}/report.html'])}")


def _check(points: list[Point], file: Path) -> None:
    """Before the first run, refuse keys, values, gates and negotiations that no run accepts."""
    from loopgate.simulation.scenario import Scenario
    from loopgate.sweep.description import with_files

    for point in points:
        Scenario.from_dict(with_files(point.scenario, point.files), source=str(file))


@contextlib.contextmanager
def _pool(executor: str, scheduler: str | None) -> Iterator[tuple[Executor | None, int | None]]:
    if executor == "local":
        if scheduler is not None:
            msg = "--scheduler is for --executor dask"
            raise SweepError(msg)
        yield None, None
        return
    if scheduler is None:
        msg = "--executor dask needs --scheduler tcp://host:port"
        raise SweepError(msg)
    from loopgate.sweep.cluster import dask_executor

    with dask_executor(scheduler) as (pool, size):
        yield pool, size


def _show_plan(
    described: Sweep, points: list[Point], folder: Path, workers: int | None, *, as_json: bool
) -> None:
    from loopgate.sweep.estimate import estimate

    plan = estimate(points, folder, workers)
    if as_json:
        runs = [{"key": point.key, **point.scenario} for point in points]
        print_json({**asdict(plan), "runs": runs}, default=str)
        return
    varying = [
        *described.grid,
        *sorted({k for rule in described.include for k in rule} - set(described.grid)),
    ]
    for point in points[:_SHOWN]:
        click.echo(point.key + "  " + "  ".join(f"{k}={point.scenario.get(k, '-')}" for k in varying))
    if len(points) > _SHOWN:
        click.echo(f"... and {len(points) - _SHOWN} more")
    counts = [f"{k}: {len(Counter(str(p.scenario.get(k)) for p in points))}" for k in varying]
    every = counted(len(points), "run")
    click.echo(f"{every} ({', '.join(counts)}); {plan.missing} to do, {plan.present} there already")
    click.echo(f"about {_span(plan.seconds)} on {plan.workers} processes ({plan.basis}); nothing was run")


def _span(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
