"""Why no rule serves quickly in the worst case: where one slot is free in all, nothing can be chosen.

    python analysis/service_bound.py --loops 4

A line of loops, each over two places of four slots, one slot free in all. Every configuration without a
circle and without a crowd is looked at: how many safe moves there are, and how many it takes until the head
of a place has moved, at worst. Beside it stands what `slow_line` takes; that it is 4 * 2**k - 3 * k - 4
moves for k loops is proved in docs/proofs/roads.md; no gate or rule can do better.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import count, product

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


def slow_line(loops: int) -> Roads:
    """Return a start from which the head of the last place waits longest, the free slot in the first place.

    The free slot goes to and fro as the heads of the places say that it comes through: twice back for each
    time on.
    """
    on, back = [(k, 0) for k in range(loops)], [(k, 1) for k in range(loops)]
    between = tuple((back[k], back[k], back[k], on[k + 1]) for k in range(loops - 1))
    lines = ((on[0],) * (SLOTS - 1), *between, (back[-1],) * SLOTS)
    return Roads(tuple((k, k + 1) for k in range(loops)), (SLOTS,) * (loops + 1), lines)


def moves_until(roads: Roads, place: int) -> int:
    """Return how many moves it takes until the head of a place has moved.

    Raises
    ------
    ValueError
        If ever more or less than one move closes no circle.
    """
    here = roads.start
    for moves in count(1):
        (mover, here), *others = [move for move in roads.moves(here) if not roads.circle(move[1])]
        if others:
            msg = f"there is a choice after {moves - 1} moves"
            raise ValueError(msg)
        if mover == place:
            return moves
    return 0


def main() -> None:
    """Print a line for each number of loops; exit code 1 if there was ever a choice."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--loops", type=int, default=4)
    choice = False
    for loops in range(1, parser.parse_args().loops + 1):
        number, most, longest = longest_service(loops)
        choice = choice or most > 1
        line = moves_until(slow_line(loops), loops)
        print(
            f"{loops} loops: {number} configurations, {most} safe move in each, {longest} moves at worst, ",
            end="",
        )
        print(f"{line} on the slow line")
    sys.exit(int(choice))


if __name__ == "__main__":
    main()
