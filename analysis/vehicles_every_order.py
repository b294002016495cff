"""Vehicles that decide by messages: every order in which these can come, on small systems.

    python analysis/vehicles_every_order.py                  # some minutes
    python analysis/vehicles_every_order.py --limit 2000

A row per system, number of messages in flight, and whether posts see who goes (``seen``) or are told. Then
crossings that are leased: a row for ways in conflict, number of messages in flight, how often grants are
given back, and whether all have waited for long.
"""

from __future__ import annotations

import argparse
import sys
import time

from loopgate.research.vehicles import crossing
from loopgate.research.vehicles.exploring import explore
from loopgate.research.vehicles.world import World, begin

SYSTEMS: dict[str, World] = {
    "ring of 2, 3 vehicles": begin([(0, 1)], [2, 2], [[(0, 0), (0, 0)], [(0, 1)]]),
    "ring of 3, 5 vehicles": begin([(0, 1, 2)], [2, 2, 2], [[(0, 0), (0, 0)], [(0, 1), (0, 1)], [(0, 2)]]),
    "two loops, one shared place, 4": begin(
        [(0, 1), (0, 2)], [2, 2, 2], [[(0, 0), (1, 0)], [(0, 1)], [(1, 1)]]
    ),
    "two last slots at a time, 4": begin(
        [(2, 0, 1), (3, 1, 0)], [2, 2, 2, 2], [[(0, 1)], [(1, 1)], [(0, 0)], [(1, 0)]]
    ),
    "round both ways, 4": begin([(0, 1, 2), (2, 1, 0)], [2, 2, 2], [[(0, 0), (1, 2)], [(0, 1)], [(0, 2)]]),
}

CROSSINGS: dict[str, crossing.CrossingModel] = {
    "two ways": crossing.begin([(0, 1)], (1, 1)),
    "two ways, one goes twice": crossing.begin([(0, 1)], (2, 1)),
    "three ways, the middle one crosses both": crossing.begin([(0, 1), (1, 2)], (1, 1, 1)),
    "three ways, all cross": crossing.begin([(0, 1), (1, 2), (0, 2)], (1, 1, 1)),
}


def crossings(limit: int) -> int:
    """Print a table of crossings; return how many states and groups are wrong."""
    wrong = 0
    print("\n| ways | flight | given back | waited | states | all | unsafe | stuck | leases | time |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name, start in CROSSINGS.items():
        for most, gives_back, late in (
            (1, 0, False),
            (1, 0, True),
            (2, 0, False),
            (2, 0, True),
            (2, 1, False),
        ):
            began = time.perf_counter()
            one = crossing.explore(start, limit=limit, most=most, gives_back=gives_back, late=late)
            wrong += one.unsafe + one.stuck
            cells = (
                *(name, most, gives_back, "long" if late else "-", f"{one.states:,}"),
                *("yes" if one.complete else "no", one.unsafe, one.stuck if one.complete else "-"),
                *(one.most_leases, f"{time.perf_counter() - began:.0f}"),
            )
            print("| " + " | ".join(map(str, cells)) + " |", flush=True)
    return wrong


def main() -> None:
    """Print a table; exit code 1 if anything is wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--limit", type=int, default=60_000, help="most states of each")
    options = parser.parse_args()
    wrong = 0
    print("| system | posts | flight | states | steps | all | circles | overfull | misled | stuck | time |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, start in SYSTEMS.items():
        for seen, most in ((True, 2), (True, 3), (False, 4)):
            began = time.perf_counter()
            one = explore(start, limit=options.limit, most=most, seen=seen)
            wrong += one.wrong
            cells = (
                *(name, "see" if seen else "are told", most, f"{one.states:,}", f"{one.transitions:,}"),
                *("yes" if one.complete else "no", one.circles, one.overfull, one.misled),
                one.stuck if one.complete else "-",
                f"{time.perf_counter() - began:.0f}",
            )
            print("| " + " | ".join(map(str, cells)) + " |", flush=True)
    wrong += crossings(options.limit)
    sys.exit(int(wrong > 0))


if __name__ == "__main__":
    main()
