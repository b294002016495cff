"""Circular waits in a wait-for graph with alternatives (AND-OR model of resource deadlocks)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

__all__ = ["WaitFor", "circular_wait"]

WaitFor = Mapping[str, Sequence[Sequence[str]]]
"""For each standing vehicle, sets of vehicles: of *every* set, *some* vehicle must move before it can.

A vehicle that is no key moves, or stands for a reason that passes."""


def circular_wait(waits: WaitFor, stuck: AbstractSet[str]) -> list[str]:
    """Return a circle of `stuck` vehicles: each waits for the next, and the last for the first.

    Parameters
    ----------
    waits
        The wait-for graph.
    stuck
        The vehicles in a deadlock, from `loopgate.gates.deadlocks.deadlocked`; not empty.

    Notes
    -----
    The circle begins at its smallest vehicle id, and ties go to the smallest id, so that the result is always
    the same.
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
