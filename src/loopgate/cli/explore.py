"""``loopgate study explore``: every configuration that is reachable under a gate."""

from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import Any

import click

from loopgate.cli.terminal import FiniteRange, print_json, show_progress


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--gate", default="collision", show_default=True, help="Gate, with options: name:option=value.")
@click.option(
    "--counterexample",
    is_flag=True,
    help="Also print the shortest moves to an unsafe or stuck configuration.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
@click.option(
    "--memory-gb",
    type=FiniteRange(0.0, 1e6, min_open=True),
    default=4.0,
    show_default=True,
    help="Stop with a message before more memory is used [GB].",
)
def explore(file: Path, gate: str, *, counterexample: bool, as_json: bool, memory_gb: float) -> None:
    """Explore the system in FILE exhaustively from its start, under a gate."""
    from loopgate.gates import make_gate
    from loopgate.model import read_system
    from loopgate.research.state_space import explore as explore_all

    system = read_system(file)
    with show_progress("configurations") as report:
        made = make_gate(gate, system, perf_counter)
        found = explore_all(system, made, counterexample=counterexample, memory_gb=memory_gb, progress=report)
    data: dict[str, Any] = found.as_dict()
    if counterexample:
        data["counterexample"] = found.counterexample and asdict(found.counterexample)
    if as_json:
        print_json(data)
        return
    for key, value in data.items():
        click.echo(f"{key:16} {_text(key, value)}")


def _text(key: str, value: object) -> str:
    if value is None:
        return "none" if key == "counterexample" else "not counted: a robot has no private or terminal state"
    if key == "counterexample" and isinstance(value, dict):
        moves = " ".join(value["moves"]) or "no move"
        return f"{value['kind']} after {moves}: {' '.join(value['configuration'])}"
    if isinstance(value, dict):
        return ", ".join(f"order {k}: {count}" for k, count in value.items()) or "0"
    return str(value)
