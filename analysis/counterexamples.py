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

from loopgate.gates import make_gate
from loopgate.model import write_system
from loopgate.theory.random_systems import small_system
from loopgate.untimed.gated import Gated, judge_moves
from loopgate.untimed.space import Space

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
    space = Space(system, memory_gb=2.0)
    algorithm2 = make_gate("algorithm2", system)
    judged = judge_moves(space, algorithm2)
    banker = judge_moves(space, make_gate("banker", system))
    unsafe = blocked = 0
    if judged.unsafe_accepted or judged.blocked:
        # It would fail in some live configuration; does it let that come about?
        gated = Gated(space, algorithm2)
        gated.explore()
        unsafe, blocked = gated.count - gated.live, gated.stuck_live
    return {
        "seed": seed,
        "robots": len(system.robots),
        "states": sum(not private for private in system.private),
        "configurations": space.count,
        "live": space.live,
        "unsafe": unsafe,
        "blocked": blocked,
        "safe_moves": judged.safe,
        "algorithm2_moves": judged.accepted,
        "algorithm2_unsafe_moves": judged.unsafe_accepted,
        "banker_moves": banker.accepted,
    }


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
