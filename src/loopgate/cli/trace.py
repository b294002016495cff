"""``loopgate study trace``: a run move by move, with the gate's answers."""

from pathlib import Path
from time import perf_counter

import click

from loopgate.cli.terminal import print_json


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--gate", default="algorithm2", show_default=True, help="Gate, with options: name:option=value."
)
@click.option("--moves", default="", help="Robots that move, in order, separated by commas.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
def trace(file: Path, gate: str, *, moves: str, as_json: bool) -> None:
    """Make MOVES in the system in FILE. Print the robots that the gate admits, and why it refuses others."""
    from loopgate.gates import make_gate
    from loopgate.model import RobotId, read_system
    from loopgate.research.runs import trace_moves

    system = read_system(file)
    names = [RobotId(name.strip()) for name in moves.split(",") if name.strip()]
    steps = trace_moves(system, make_gate(gate, system, perf_counter), names)
    if as_json:
        print_json([step.as_dict() for step in steps])
        return
    for step in steps:
        click.echo(f"{step.step:3}  {' '.join(step.configuration)}")
        click.echo(f"     admitted: {' '.join(step.admitted) or 'none'}")
        for name, refusal in step.refused.items():
            click.echo(f"     {name}: {refusal.reason}, {refusal.detail}")
        if step.moved is not None:
            click.echo(f"     {step.moved} moves")
