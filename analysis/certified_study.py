"""The certified gate against the exact answer on many random systems, one row of figures per system.

    python analysis/certified_study.py --systems 20000 -o out/certified-study.csv

Resumable: systems that have a row already are not checked again. Seeds are 0, 1, 2, ...
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

from loopgate.gates import make_gate
from loopgate.research.state_space import ExplorationLimitError, verify_everywhere, verify_walks
from loopgate.research.theory.random_systems import any_shape, any_system

_EXPLORED = 400
_WALKED = 20_000
_STEPS = 150
_COLUMNS = (
    *("seed", "robots", "private", "closed", "capacity", "fifo", "method", "judge"),
    *("configurations", "decisions", "safe", "safe_admitted", "unsafe_admitted", "stuck", "budget_stops"),
    *(
        "starts_refused",
        "live_starts_refused",
        "dead_starts_accepted",
        "explored",
        "reachable_live",
        "seconds",
    ),
)


def row(seed: int, gate: str) -> dict[str, object]:
    """Check one system: everywhere if it is small, else along a walk of 150 moves."""
    began = time.perf_counter()
    system, shape = any_system(seed), any_shape(seed)
    try:
        found = verify_everywhere(system, lambda s: make_gate(gate, s), limit=_EXPLORED)
    except ExplorationLimitError:
        found = verify_walks(system, lambda s: make_gate(gate, s), seed=seed, steps=_STEPS, limit=_WALKED)
    figures = found.as_dict()
    figures.update(
        seed=seed,
        robots=shape.robots,
        private=shape.private,
        closed=int(shape.closed),
        capacity="-".join(map(str, shape.capacity)),
        fifo=shape.fifo,
        seconds=round(time.perf_counter() - began, 3),
    )
    return {name: figures[name] for name in _COLUMNS}


def summary(rows: list[dict[str, str]]) -> str:
    """Add up the rows."""

    def total(name: str) -> int:
        return sum(int(r[name]) for r in rows)

    safe, admitted = total("safe"), total("safe_admitted")
    judged = {name: sum(r["judge"] == name for r in rows) for name in sorted({r["judge"] for r in rows})}
    return "\n".join(
        [
            f"systems               {len(rows)}, judged by {judged}",
            f"  explored to the end {sum(r['method'] == 'exhaustive' for r in rows)}",
            f"starts refused        {total('starts_refused')}, of them live {total('live_starts_refused')}",
            f"dead starts accepted  {total('dead_starts_accepted')}",
            f"configurations        {total('configurations')}",
            f"decisions             {total('decisions')}",
            f"unsafe moves admitted {total('unsafe_admitted')}",
            f"live but blocked      {total('stuck')}",
            f"budget stops          {total('budget_stops')}",
            f"permissiveness        {admitted} of {safe} = {admitted / max(1, safe):.7f}",
            f"seconds               {sum(float(r['seconds']) for r in rows):.0f}",
        ]
    )


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--systems", type=int, default=500)
    parser.add_argument("--gate", default="certified:promise=everyone,budget=200000")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/certified-study.csv"))
    arguments = parser.parse_args()
    file: Path = arguments.output
    file.parent.mkdir(parents=True, exist_ok=True)
    done: set[int] = set()
    if file.exists():
        with file.open(encoding="utf-8", newline="") as stream:
            done = {int(r["seed"]) for r in csv.DictReader(stream)}
    with file.open("a", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, _COLUMNS)
        if not done:
            writer.writeheader()
        for seed in range(arguments.systems):
            if seed not in done:
                writer.writerow(row(seed, arguments.gate))
                stream.flush()
    with file.open(encoding="utf-8", newline="") as stream:
        print(summary([r for r in csv.DictReader(stream) if int(r["seed"]) < arguments.systems]))


if __name__ == "__main__":
    main()
