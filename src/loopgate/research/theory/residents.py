"""The condition on loops and numbers under which everyone can go on, written once more for checking."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from loopgate.model import System


@lru_cache(maxsize=16)
def keeps_everyone(system: System) -> bool:
    """Return whether every configuration of the system without a circle of full places is live for everyone.

    That is so where all paths are closed, all shared places are left in order of arrival and hold two or
    more, and (S) holds: no set of places that some loop enters and leaves has more robots who never leave it
    than its slots less two. A robot's own place never blocks: it counts as one that holds two.
    """
    closed = all(r.next_position(len(r.path) - 1) is not None for r in system.robots)
    shared = [s for s, own in enumerate(system.private) if not own]
    wide = all(system.room[s] > 1 for s in shared) and set(shared) == set(system.fifo_states)
    slots = [max(2, room) for room in system.room]
    return closed and wide and leaves_room_for_passers(system.paths, slots)


def leaves_room_for_passers(loops: Sequence[Sequence[int]], slots: Sequence[int]) -> bool:
    """Return whether condition (S) holds for robots on loops over places with given slots.

    By Hall's theorem: iff for each two places of which one follows the other on some loop, all robots can
    stand on their loops at once with two slots of the former empty and the latter without limit. A set that
    has the former, and not the latter, and too many residents is what makes that impossible.
    """
    steps = {(a, b) for loop in loops for a, b in zip(loop, (*loop[1:], loop[0]), strict=True)}
    return all(fits_with_two_empty(loops, slots, empty=a, endless=b) for a, b in sorted(steps))


def fits_with_two_empty(
    loops: Sequence[Sequence[int]], slots: Sequence[int], *, empty: int, endless: int
) -> bool:
    """Return whether all robots can stand on their loops at once, two slots of `empty` left."""
    room = list(slots)
    room[empty] -= 2
    room[endless] = len(loops)
    first = np.cumsum([0, *room])
    rows = [robot for robot, loop in enumerate(loops) for place in set(loop) for _ in range(room[place])]
    slots_of = [np.arange(first[place], first[place + 1]) for loop in loops for place in set(loop)]
    columns = np.concatenate(slots_of) if slots_of else np.zeros(0, dtype=np.int64)
    standing = csr_array((np.ones(len(rows)), (rows, columns)), shape=(len(loops), first[-1]))
    return bool((maximum_bipartite_matching(standing, perm_type="column") >= 0).all())
