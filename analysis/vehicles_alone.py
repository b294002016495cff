"""Vehicles that decide for themselves, by messages, beside the central chain rule: random systems.

    python analysis/vehicles_alone.py                    # 5,000 systems: some minutes
    python analysis/vehicles_alone.py --systems 200 --loss 0.3

Messages come in any order, and some do not come; posts lose patience, vehicles give grants back. Each grant
and each refusal is compared with what a central gate says that sees all. At the end all messages get through:
somebody has to go on.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from random import Random

from everyone import draw

from loopgate.cli.terminal import show_progress
from loopgate.research.vehicles.walk import RandomWalk
from loopgate.research.vehicles.world import Receive, begin
from loopgate.vehicles import post as posts

WRONG = ("unsafe", "circles", "overfull", "books misled", "blocked")
"""What must be 0."""
STEPS = 250


def walk_through(
    seed: int, *, loss: float, receive: Receive = posts.receive, steps: int = STEPS, forgets: float = 0.0
) -> Counter[str]:
    """Return what was found on one system; nothing if a circle is there from the beginning."""
    roads = draw(seed, narrow=False)
    if not any(roads.start) or roads.circle(roads.start):
        return Counter()
    start = begin(roads.loops, roads.slots, roads.start)
    return judged(RandomWalk(start, Random(seed), loss=loss, receive=receive, forgets=forgets), steps)


def judged(walk: RandomWalk, steps: int = STEPS) -> Counter[str]:
    """Return what was found on a walk of so many steps, after which all messages get through."""
    for _ in range(steps):
        before = walk.found["moves"]
        walk.step()
        if walk.found["moves"] > before:
            walk.judge()
    walk.found["blocked"] += not walk.goes_on()
    walk.judge()
    walk.found["systems"] += 1
    return walk.found


def main() -> None:
    """Print what was found; exit code 1 if anything is not as it should be."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--systems", type=int, default=5_000)
    parser.add_argument("--loss", type=float, default=0.1, help="share of messages that are lost")
    parser.add_argument("--forgets", type=float, default=0.0, help="share of steps that are losses of memory")
    options = parser.parse_args()
    began = time.perf_counter()
    total: Counter[str] = Counter()
    seed = 0
    with show_progress("systems", total=options.systems) as report:
        while total["systems"] < options.systems:
            seed += 1
            total += walk_through(seed, loss=options.loss, forgets=options.forgets)
            report(total["systems"])
    for key in sorted({*total, *WRONG}):
        print(f"{key:28} {total[key]:>12,}")
    print(f"{'seconds':28} {time.perf_counter() - began:>12,.0f}")
    sys.exit(int(any(total[key] for key in WRONG)))


if __name__ == "__main__":
    main()
