"""How often Algorithm 2 fails, and how permissive it and VBanker are: a search over random systems.

    python analysis/counterexamples.py --systems 20000

Systems are numbered by their seed; the seed gives the shape (4 to 8 robots) and the system, so that any of
them can be drawn again with ``small_system(seed)``. Each is explored exhaustively without a gate, which gives
every live configuration, and under Algorithm 2 from its start. A run can be stopped and taken up again:
finished seeds are in the CSV file.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from loopgate.gates import make_gate
from loopgate.model import write_system
from loopgate.research.state_space import StateSpace
from loopgate.research.state_space.reach import Reach, asking
from loopgate.research.theory.random_systems import small_system

COLUMNS = (
    "seed",
    "robots",
    "states",
    "configurations",
    "live",
    "unsafe",
    "blocked",
    "safe_moves",
    "algorithm2_moves",
    "algorithm2_unsafe_moves",
    "banker_moves",
)


def study(seed: int) -> dict[str, int]:
    """Return the row of one seed."""
    system = small_system(seed)
    space = StateSpace(system)
    live = space.live
    asked = live[space.moves.sources]
    safe = asked & live[space.moves.targets]
    algorithm2, banker = (answers(space, name) for name in ("algorithm2", "banker"))
    reach = Reach(space, asking(space, make_gate("algorithm2", system)))
    return {
        "seed": seed,
        "robots": len(system.robots),
        "states": sum(not private for private in system.private),
        "configurations": space.count,
        "live": int(live.sum()),
        "unsafe": int((~live)[reach.order].sum()),
        "blocked": int((reach.stuck & live).sum()),
        "safe_moves": int(safe.sum()),
        "algorithm2_moves": int((safe & algorithm2).sum()),
        "algorithm2_unsafe_moves": int((asked & ~safe & algorithm2).sum()),
        "banker_moves": int((safe & banker).sum()),
    }


def answers(space: StateSpace, name: str) -> NDArray[np.bool_]:
    """Return which moves a gate admits, whether or not it lets their beginnings come about."""
    admitted = np.zeros(len(space.moves.targets), np.bool_)
    ask = asking(space, make_gate(name, space.system))
    if ask is not None:
        ask(np.arange(space.count, dtype=np.int32), admitted)
    return admitted


def summarise(rows: list[dict[str, int]]) -> dict[str, dict[str, float]]:
    """Return per number of robots, and for all: systems, how many fail and how, and permissiveness."""
    groups: dict[str, list[dict[str, int]]] = {"all": rows}
    for row in rows:
        groups.setdefault(str(row["robots"]), []).append(row)
    table: dict[str, dict[str, float]] = {}
    for name in sorted(groups):
        group = groups[name]
        safe = sum(row["safe_moves"] for row in group)
        table[name] = {
            "systems": len(group),
            "with_unsafe_configurations": sum(row["live"] < row["configurations"] for row in group),
            "unsound": sum(row["unsafe"] > 0 for row in group),
            "blocked": sum(row["blocked"] > 0 for row in group),
            "unsound_or_blocked": sum(row["unsafe"] > 0 or row["blocked"] > 0 for row in group),
            "algorithm2_permissiveness": round(sum(row["algorithm2_moves"] for row in group) / safe, 6),
            "banker_permissiveness": round(sum(row["banker_moves"] for row in group) / safe, 6),
        }
    return table


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--systems", type=int, default=1000, help="number of seeds, from 0 on")
    parser.add_argument("--out", type=Path, default=Path("analysis/out/counterexamples"))
    arguments = parser.parse_args()
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    file = out / "systems.csv"
    rows: list[dict[str, int]] = []
    if file.exists():
        with file.open(newline="", encoding="utf-8") as lines:
            rows = [{key: int(value) for key, value in row.items()} for row in csv.DictReader(lines)]
    done = {row["seed"] for row in rows}
    said = time.monotonic()
    with file.open("a", newline="", encoding="utf-8") as lines:
        writer = csv.DictWriter(lines, COLUMNS)
        if not done:
            writer.writeheader()
        for seed in range(arguments.systems):
            if seed in done:
                continue
            row = study(seed)
            rows.append(row)
            writer.writerow(row)
            if row["unsafe"] or row["blocked"]:
                kind = "unsound" if row["unsafe"] else "blocked"
                write_system(small_system(seed), out / f"{kind}_n{row['robots']}_seed{seed}.json")
            if time.monotonic() - said > 15:  # noqa: PLR2004 - seconds between lines
                said = time.monotonic()
                sys.stderr.write(f"{len(rows)} of {arguments.systems} systems\n")
    rows = [row for row in rows if row["seed"] < arguments.systems]
    table = summarise(rows)
    (out / "summary.json").write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(table, indent=1))


if __name__ == "__main__":
    main()
