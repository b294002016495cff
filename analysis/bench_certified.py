"""Decision time of the certified gate over long random walks.

    python analysis/bench_certified.py
    python analysis/bench_certified.py --robots 8,100 --moves 500 --json out/bench-certified.json

At every step a random robot that can move asks; if it is admitted it moves. p99_cpu_us is the 99th percentile
of processor time, which other programs on the machine do not disturb.
"""

from __future__ import annotations

import argparse
import json
import random
import time
from collections import Counter
from pathlib import Path
from statistics import median

from loopgate.gates.certified import CertifiedGate
from loopgate.research.theory.random_systems import dense, random_system, sparse


def measure(kind: str, robots: int, moves: int, seed: int) -> dict[str, object]:
    """Walk `moves` moves in one random system; times are in microseconds."""
    system = random_system((sparse if kind == "sparse" else dense)(robots), seed)
    gate = CertifiedGate(system)
    rng, here = random.Random(seed), system.initial
    times, busy, stages = list[float](), list[float](), Counter[str]()
    refused = moved = asked = 0
    while moved < moves and asked < 20 * moves:
        robot = rng.choice([i for i in range(robots) if system.enabled(here, i)])
        worked, began = time.thread_time(), time.perf_counter()
        decision = gate.decide(here, robot)
        times.append(time.perf_counter() - began)
        busy.append(time.thread_time() - worked)
        asked += 1
        stages[decision.stage] += 1
        if decision.admitted:
            here = system.moved(here, robot)
            gate.moved(here, robot)
            moved += 1
        else:
            refused += 1
    times.sort()
    busy.sort()
    return {
        "kind": kind,
        "robots": robots,
        "decisions": len(times),
        "refused": refused,
        "median_us": round(median(times) * 1e6, 1),
        "p99_us": round(times[int(0.99 * len(times))] * 1e6, 1),
        "p99_cpu_us": round(busy[int(0.99 * len(busy))] * 1e6, 1),
        "max_us": round(times[-1] * 1e6, 1),
        "budget_stops": stages["budget"],
        "stages": {name: round(count / len(times), 4) for name, count in sorted(stages.items())},
    }


def main() -> None:
    """Run the benchmark and print a table."""
    parser = argparse.ArgumentParser(description="Time the certified gate.")
    parser.add_argument("--robots", default="8,20,50,100,200")
    parser.add_argument("--moves", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    rows = []
    columns = (
        "robots",
        "decisions",
        "median_us",
        "p99_us",
        "p99_cpu_us",
        "max_us",
        "budget_stops",
    )
    print(f"{'kind':7}" + "".join(f"{name:>14}" for name in columns) + "  share by stage")
    for kind in ("sparse", "dense"):
        for robots in map(int, arguments.robots.split(",")):
            row = measure(kind, robots, arguments.moves, arguments.seed)
            rows.append(row)
            print(
                f"{kind:7}" + "".join(f"{row[name]!s:>14}" for name in columns) + f"  {row['stages']}",
                flush=True,
            )
    if arguments.json:
        arguments.json.parent.mkdir(parents=True, exist_ok=True)
        arguments.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
