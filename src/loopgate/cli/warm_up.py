"""``loopgate study warm-up``: compile in advance what exploration needs."""

from __future__ import annotations

import time
from collections.abc import Callable

import click

from loopgate.cli.terminal import print_json, show_progress


def compile_all(tell: Callable[[int], None] = lambda _: None) -> int:
    """Compile everything: explore a small system by each promise, and play random rounds.

    Parameters
    ----------
    tell
        Called with the number of functions compiled so far, after each.

    Returns
    -------
    int
        How many functions were compiled; those that are there already do not count.

    Raises
    ------
    LoopgateError
        If numba is not installed.
    """
    from loopgate.research.kernel_cache import listen_to_compiling

    compiled: list[str] = []

    def note(name: str) -> None:
        compiled.append(name)
        tell(len(compiled))

    listen_to_compiling(note)

    import numpy as np

    from loopgate.gates import make_gate
    from loopgate.research.runs.kernel_rounds import count_live_rounds
    from loopgate.research.state_space import StateSpace, explore
    from loopgate.research.state_space.encoding import Encoding
    from loopgate.research.theory.instances import instance

    system = instance("fig10")
    for gate in ("certified", "certified:promise=somebody"):
        explore(system, make_gate(gate, system), counterexample=True)
    StateSpace(system).number(system.initial)
    arrays, start = Encoding(system).arrays, np.array(system.initial.positions, np.int64)
    count_live_rounds(1, 1, start, arrays.after, arrays.state, arrays.room)
    return len(compiled)


@click.command(name="warm-up")
@click.option("--json", "as_json", is_flag=True, help="Print how many functions, and the time, as JSON only.")
def warm_up(*, as_json: bool) -> None:
    """Compile what exploration needs, once for each version.

    Runs and loops compile nothing. Without this command the first use compiles what it needs, and says so.
    """
    began = time.monotonic()
    with show_progress("functions compiled") as report:
        count = compile_all(report)
    wall_s = round(time.monotonic() - began, 1)
    if as_json:
        print_json({"compiled": count, "wall_s": wall_s})
    elif count:
        click.echo(f"{count} functions compiled in {wall_s:.0f} s; nothing is left to be compiled")
    else:
        click.echo("nothing was left to be compiled")
