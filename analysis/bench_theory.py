"""Measure Algorithm 2's decisions, against their plain version, and the exhaustive exploration.

    python analysis/bench_theory.py [--quick] [--large]

Decisions are timed along random runs under the gate itself; those that capacity alone decides, or that lead
into a private state, are left out. The plain version lists circuits without a budget: it gives up beyond
5,000.
"""

from __future__ import annotations

import argparse
import json
import random
import time
from itertools import islice
from typing import Any

from loopgate.gates import Reason, make_gate
from loopgate.gates.algorithm2 import circuits_through, theorem1
from loopgate.model import Configuration, System
from loopgate.research.state_space import explore
from loopgate.research.theory.instances import instance
from loopgate.research.theory.random_systems import Shape, dense, random_system, sparse

_MOST_CIRCUITS = 5000
_PLAIN_S = 4.0


def questions(system: System, moves: int, seed: int) -> list[tuple[Configuration, int]]:
    """Return who asks to enter which shared state, and where, along a random run under Algorithm 2."""
    gate = make_gate("algorithm2", system)
    rng = random.Random(seed)
    here = system.initial
    asked: list[tuple[Configuration, int]] = []
    for _ in range(moves):
        admitted: list[int] = []
        for robot in range(len(system.robots)):
            state = system.next_state(here, robot)
            if state is None or not system.enabled(here, robot):
                continue
            if not system.private[state]:
                asked.append((here, robot))
            if gate.decide(here, robot).admitted:
                admitted.append(robot)
        if not admitted:
            break
        here = system.move(here, rng.choice(admitted))
    rng.shuffle(asked)
    return asked


def plain_decision(system: System, here: Configuration, robot: int) -> bool | None:
    """Decide with the plain theory; None beyond so many circuits."""
    after = system.moved(here, robot)
    state = system.state_at(after, robot)
    for count, circuit in enumerate(islice(circuits_through(system, after, state), _MOST_CIRCUITS + 1)):
        if count == _MOST_CIRCUITS:
            return None
        if not theorem1(system, after, circuit).live:
            return False
    return True


def spread(seconds: list[float]) -> dict[str, float]:
    """Return median, 99th percentile and maximum [microseconds]."""
    ordered = sorted(seconds)
    return {
        "median_us": round(1e6 * ordered[len(ordered) // 2], 1),
        "p99_us": round(1e6 * ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))], 1),
        "max_us": round(1e6 * ordered[-1], 1),
    }


def decisions(kind: str, robots: int, moves: int) -> dict[str, Any]:
    """Time both versions on systems of one kind and size."""
    fast: list[float] = []
    plain: list[float] = []
    budget = gave_up = asked = 0
    for seed in range(3):
        system = random_system({"sparse": sparse, "dense": dense}[kind](robots), seed)
        gate = make_gate("algorithm2", system)
        spent = 0.0
        for here, robot in questions(system, moves, seed):
            asked += 1
            began = time.perf_counter()
            decision = gate.decide(here, robot)
            fast.append(time.perf_counter() - began)
            budget += decision.reason is Reason.BUDGET
            if spent < _PLAIN_S / 3:
                began = time.perf_counter()
                gave_up += plain_decision(system, here, robot) is None
                plain.append(time.perf_counter() - began)
                spent += plain[-1]
    return {
        "kind": kind,
        "robots": robots,
        "decisions": asked,
        "out_of_budget": budget,
        "algorithm2": spread(fast),
        "plain": {**spread(plain), "decisions": len(plain), "gave_up": gave_up},
    }


def explorations(*, large: bool) -> list[dict[str, Any]]:
    """Time the exploration."""
    explore(
        instance("fig8"), make_gate("collision", instance("fig8"))
    )  # compiles, or loads what was compiled
    systems = {
        "fig10": instance("fig10"),
        "8 robots": random_system(Shape(robots=8, states=10, path=(4, 5)), 1),
        "10 robots": random_system(Shape(robots=10, states=14, path=(4, 5)), 2),
        "oneway8": instance("oneway8"),
    }
    if large:
        systems["round8"] = instance("round8")
    rows: list[dict[str, Any]] = []
    for name, system in systems.items():
        for gate in ("collision", "algorithm2"):
            if gate == "algorithm2" and name in ("oneway8", "round8"):
                continue  # about 20 us a move
            found = explore(system, make_gate(gate, system), memory_gb=8.0)
            row = {
                "system": name,
                "gate": gate,
                "configurations": found.configurations,
                "live": found.live,
                "seconds": round(found.seconds, 3),
                "configurations_per_s": round(found.configurations / found.seconds),
            }
            rows.append(row)
            print(json.dumps(row), flush=True)
    return rows


def main() -> None:
    """Run the measurements and print a line of JSON for each."""
    parser = argparse.ArgumentParser(description="Measure decisions of algorithm2 and the exploration.")
    parser.add_argument("--quick", action="store_true", help="fewer sizes and moves")
    parser.add_argument("--large", action="store_true", help="also explore 92 million configurations")
    arguments = parser.parse_args()
    for kind in ("sparse", "dense"):
        for robots in (4, 8, 16) if arguments.quick else (4, 8, 16, 32, 64):
            print(json.dumps(decisions(kind, robots, 100 if arguments.quick else 600)), flush=True)
    explorations(large=arguments.large)


if __name__ == "__main__":
    main()
