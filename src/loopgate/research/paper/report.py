"""Run everything and write it down."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from loopgate.disk import writing
from loopgate.gates import make_gate
from loopgate.research.paper.figures import draw_fig11, draw_fig12, draw_live_rounds
from loopgate.research.paper.section5 import Row, circuits, evolution, live_rounds, table1, with_algorithm2
from loopgate.research.runs.counting import count_runs
from loopgate.research.theory.instances import instance


def reproduce(
    out: Path, *, quick: bool = False, seed: int = 1, progress: Callable[[int], None] = lambda _: None
) -> dict[str, Any]:
    """Reproduce Section 5 of the paper (Zhou et al. 2020), and write the results into folder `out`.

    Keys: ``rows`` (a list of ``what, printed, ours, why``), ``seconds`` and ``quick``.

    Writes ``table.md`` and ``table.json`` (printed, ours, why they differ), ``live_rounds.png``,
    ``fig11.png`` and ``fig12.png``.

    Raises `ResultsError` if a file cannot be written.

    Parameters
    ----------
    out
        The folder to write; it is made if it does not exist.
    quick
        Whether to run fewer experiments and rounds; the exact figures are the same.
    seed
        Seed of the random numbers.
    progress
        Called with the number of completed steps.
    """
    began = time.perf_counter()
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
    rows, means = live_rounds(10 if quick else 100, seed, progress)
    system = instance("fig10")
    exact = count_runs(system, make_gate("collision", system)).live_probability
    more, timed = with_algorithm2(100 if quick else 10_000, seed, progress)
    rows += more
    again, made = evolution()
    rows += again + circuits() + table1()
    draw_live_rounds(means, exact, out / "live_rounds.png")
    draw_fig11(timed, out / "fig11.png")
    draw_fig12(made, out / "fig12.png")
    data = {
        "rows": [
            {"what": row.what, "printed": row.printed, "ours": row.ours, "why": row.why} for row in rows
        ],
        "quick": quick,
        "seconds": round(time.perf_counter() - began, 1),
    }
    for name, text in (("table.json", json.dumps(data, indent=1) + "\n"), ("table.md", _markdown(rows))):
        with writing(out / name):
            (out / name).write_text(text, encoding="utf-8")
    return data


def _markdown(rows: list[Row]) -> str:
    lines = ["| what | printed | ours | why they differ |", "|---|---|---|---|"]
    lines += [
        f"| {row.what} | {row.printed} | {row.ours} | {row.why} |".replace("|SE", "\\|SE") for row in rows
    ]
    return "\n".join(lines) + "\n"
