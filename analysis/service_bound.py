"""Why no rule serves quickly in the worst case: where one slot is free in all, nothing can be chosen.

    python analysis/service_bound.py --loops 4

A line of loops, each over two places of four slots, one slot free in all. Every configuration without a
circle and without a crowd is looked at: how many safe moves there are, and how many it takes until the head
of a place has moved, at worst. The figures more than double with each loop; no gate or rule can do better.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import product

from road_oracle import Lines, Roads

SLOTS = 4


def configurations(loops: int) -> Iterator[Lines]:
    """Yield all with one slot free, without a circle and without a crowd; somebody is on each loop."""
    paths = tuple((k, k + 1) for k in range(loops))
    slots = (SLOTS,) * (loops + 1)
    crowded: dict[tuple[int, ...], bool] = {}
    entries = [[(k - 1, 1)] * (k > 0) + [(k, 0)] * (k < loops) for k in range(loops + 1)]
    for hole in range(loops + 1):
        for lines in product(*(product(some, repeat=SLOTS - (k == hole)) for k, some in enumerate(entries))):
            numbers = tuple(sum(entry[0] == k for line in lines for entry in line) for k in range(loops))
            roads = Roads(paths, slots, lines)
            if numbers not in crowded:
                crowded[numbers] = 0 in numbers or roads.crowded()
            if not crowded[numbers] and not roads.circle(lines):
                yield lines


def longest_service(loops: int) -> tuple[int, int, int]:
    """Return how many configurations there are, the most safe moves in one, and the longest service."""
    following: dict[Lines, list[tuple[int, Lines]]] = {}
    everywhere = list(configurations(loops))
    roads = Roads(tuple((k, k + 1) for k in range(loops)), (SLOTS,) * (loops + 1), everywhere[0])
    known = set(everywhere)
    for here in everywhere:
        following[here] = [(place, there) for place, there in roads.moves(here) if there in known]
    most = max(map(len, following.values()))
    longest = 0
    for place in range(loops + 1):
        moves: dict[Lines, int] = {}
        for begin in everywhere:
            way, here = [], begin
            while here not in moves:
                way.append(here)
                mover, there = following[here][0]
                if mover == place:
                    moves[here] = 1
                    way.pop()
                else:
                    here = there
            count = moves[here]
            for before in reversed(way):
                count += 1
                moves[before] = count
        longest = max(longest, *moves.values())
    return len(everywhere), most, longest


def main() -> None:
    """Print a line for each number of loops; exit code 1 if there was ever a choice."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--loops", type=int, default=4)
    choice = False
    for loops in range(1, parser.parse_args().loops + 1):
        count, most, longest = longest_service(loops)
        choice = choice or most > 1
        print(f"{loops} loops: {count} configurations, {most} safe move in each, {longest} moves at worst")
    sys.exit(int(choice))


if __name__ == "__main__":
    main()
