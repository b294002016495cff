"""``loopgate study montecarlo``: random rounds under a gate."""

from pathlib import Path
from time import perf_counter

import click

from loopgate.cli.terminal import print_json, show_progress


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--gate", default="collision", show_default=True, help="Gate, with options: name:option=value.")
@click.option(
    "--rounds", default=1000, show_default=True, type=click.IntRange(1, 10**9), help="Number of rounds."
)
@click.option("--seed", default=1, show_default=True, help="Seed of the random numbers.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
def montecarlo(file: Path, gate: str, *, rounds: int, seed: int, as_json: bool) -> None:
    """Run random rounds of the system in FILE, and count the rounds that all robots complete."""
    from loopgate.gates import make_gate
    from loopgate.model import read_system
    from loopgate.research.runs import run_rounds

    system = read_system(file)
    with show_progress("rounds", total=rounds) as report:
        found = run_rounds(
            system, lambda: make_gate(gate, system, perf_counter), rounds=rounds, seed=seed, progress=report
        )
    if as_json:
        print_json(found.as_dict())
        return
    low, high = found.confidence
    share = f"{found.live_rate:.4f} (95 %: {low:.4f} to {high:.4f})"
    click.echo(f"live rounds        {found.live} of {rounds}: {share}")
    click.echo(f"deadlocked rounds  {found.deadlocked}")
    click.echo(f"stuck rounds       {found.stuck}")
    lengths = found.transitions
    click.echo(f"transitions        {lengths['mean']:.2f} ({lengths['min']:g} to {lengths['max']:g})")
    for name, spent in found.decision_us.items():
        click.echo(f"decision [us]      {name}: mean {spent['mean']:.1f}, 99 % below {spent['p99']:.1f}")
