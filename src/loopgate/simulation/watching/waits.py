"""Circular waits in a wait-for graph with alternatives (the AND-OR model of resource deadlocks)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

__all__ = ["WaitFor", "circular_wait", "deadlocked"]

WaitFor = Mapping[str, Sequence[Sequence[str]]]
"""For each standing vehicle the sets of vehicles it waits for: of *every* set, *some* vehicle must move on
before it can. A vehicle that is no key moves, or stands for a reason that passes."""


def deadlocked(waits: WaitFor) -> set[str]:
    """Return the vehicles that can never move on by themselves: the greatest fixpoint.

    A vehicle may move on as soon as every set it waits for has a member that may. Those that remain wait
    for each other. O(vehicles times edges) at worst, a few passes in practice.
    """
    stuck = {vehicle for vehicle, sets in waits.items() if sets}
    while True:
        freed = {v for v in stuck if all(any(w not in stuck for w in some) for some in waits[v])}
        if not freed:
            return stuck
        stuck -= freed


def circular_wait(waits: WaitFor, stuck: AbstractSet[str]) -> list[str]:
    """Return one circle of `stuck` vehicles, each waiting for the next and the last for the first.

    Parameters
    ----------
    waits
        The wait-for graph.
    stuck
        The result of `deadlocked` for it; not empty.

    Notes
    -----
    The circle begins at its smallest vehicle id, and ties go to the smallest id, so that the answer never
    depends on hashing.
    """
    here = min(stuck)
    seen: dict[str, int] = {}
    while here not in seen:
        seen[here] = len(seen)
        all_stuck = next(some for some in waits[here] if all(w in stuck for w in some))
        here = min(all_stuck)
    circle = [vehicle for vehicle, at in seen.items() if at >= seen[here]]
    first = circle.index(min(circle))
    return circle[first:] + circle[:first]
