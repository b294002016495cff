"""What a decision costs in messages: copies sent, hops, and the states actually looked ahead.

    python analysis/messages.py

Random runs under Algorithm 2 on sparse and dense systems; every robot that could enter a shared state asks by
messages, over a network without loss.
"""

from __future__ import annotations

import argparse
import json
import random
from collections import Counter

from loopgate.gates import make_gate
from loopgate.gates.walks import default_lookahead
from loopgate.research.agents import Kind, decide_by_messages
from loopgate.research.theory.random_systems import dense, random_system, sparse


def study(kind: str, robots: int, steps: int, seed: int) -> dict[str, object]:
    """Return mean and largest costs of a run's decisions."""
    system = random_system({"sparse": sparse, "dense": dense}[kind](robots), seed)
    gate = make_gate("algorithm2", system)
    rng = random.Random(seed)
    here = system.initial
    sent: Counter[Kind] = Counter()
    totals: list[int] = []
    hops: list[int] = []
    depths: list[int] = []
    for _ in range(steps):
        admitted = [i for i in range(robots) if gate.decide(here, i).admitted]
        if not admitted:
            break
        for robot in range(robots):
            state = system.next_state(here, robot)
            if state is None or system.private[state] or not system.enabled(here, robot):
                continue
            asked = decide_by_messages(system, here, robot)
            sent.update(asked.messages)
            totals.append(sum(asked.messages.values()))
            hops.append(asked.hops)
            depths.append(asked.depth)
        here = system.move(here, rng.choice(admitted))
    count = max(1, len(totals))
    return {
        "kind": kind,
        "robots": robots,
        "decisions": len(totals),
        "messages_mean": round(sum(totals) / count, 2),
        "messages_max": max(totals, default=0),
        "by_kind": {kind.value: round(number / count, 2) for kind, number in sorted(sent.items())},
        "hops_mean": round(sum(hops) / count, 2),
        "hops_max": max(hops, default=0),
        "depth_mean": round(sum(depths) / count, 2),
        "depth_max": max(depths, default=0),
        "depth_allowed": default_lookahead(system),
    }


def main() -> None:
    """Print a line of JSON per system."""
    parser = argparse.ArgumentParser(description="Count messages, hops and look-ahead of decisions.")
    parser.add_argument("--steps", type=int, default=100)
    arguments = parser.parse_args()
    for kind in ("sparse", "dense"):
        for robots in (4, 8, 12, 16):
            print(json.dumps(study(kind, robots, arguments.steps, 1)), flush=True)


if __name__ == "__main__":
    main()
