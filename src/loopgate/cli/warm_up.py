"""``loopgate study warm-up``: compile in advance what covering loops and exploration need."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from queue import SimpleQueue
from threading import Thread

import click

from loopgate.cli.terminal import print_json, show_progress
from loopgate.errors import LoopgateError

_PRINTED = "compiled:"
"""Begins a line of a process that compiles, about one function."""


def _cover() -> None:
    """Cover a few streets with loops, and join two tours: one assignment may be a tour already."""
    import numpy as np

    from loopgate.abstraction.covering import cover_streets
    from loopgate.network import RoadNetwork
    from loopgate.network.cover.design import CoverTask
    from loopgate.network.cover.tours import joined

    cover_streets(RoadNetwork.open("sumo:square"), CoverTask(), 2)
    joined(np.ones((4, 4)), (np.array([0, 1]), np.array([2, 3])))


def _study() -> None:
    """Explore a small system by each promise, and play random rounds."""
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


PARTS: dict[str, Callable[[], None]] = {
    "covering loops": _cover,
    "exploration": _study,
}
"""What is compiled, by what needs it."""

_SHARES = (tuple(PARTS)[::2], tuple(PARTS)[1::2])
"""Which parts each of two processes compiles."""


def compile_parts(names: Iterable[str]) -> None:
    """Compile some parts of loopgate, and print the name of each compiled function."""
    from loopgate.kernel_cache import listen_to_compiling

    listen_to_compiling(lambda name: print(_PRINTED, name, flush=True))  # noqa: T201  the process before reads it
    for name in names:
        PARTS[name]()


def compile_all(tell: Callable[[int], None] = lambda _: None) -> int:
    """Compile everything in two processes at once.

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
        If one of the processes fails; with its last line.
    """
    lines: SimpleQueue[str | None] = SimpleQueue()
    code = "import sys; from loopgate.cli.warm_up import compile_parts; compile_parts(sys.argv[1:])"
    started = [
        subprocess.Popen(  # noqa: S603  this interpreter
            [sys.executable, "-c", code, *share],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for share in _SHARES
    ]
    for process in started:
        Thread(target=_read, args=(process, lines), daemon=True).start()
    count, left, last = 0, len(started), "a process that compiles has ended"
    while left:
        line = lines.get()
        if line is None:
            left -= 1
        elif line.startswith(_PRINTED):
            count += 1
            tell(count)
        else:
            last = line.strip() or last
    if any(process.wait() for process in started):
        msg = f"warm-up: {last}"
        raise LoopgateError(msg)
    return count


def _read(process: subprocess.Popen[str], lines: SimpleQueue[str | None]) -> None:
    with process:
        for line in process.stdout or ():
            lines.put(line)
    lines.put(None)


@click.command(name="warm-up")
@click.option("--json", "as_json", is_flag=True, help="Print how many functions, and the time, as JSON only.")
def warm_up(*, as_json: bool) -> None:
    """Compile what covering loops and exploration need, once for each version.

    Runs compile nothing. Without this command the first use of either compiles what it needs, and says so.
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
