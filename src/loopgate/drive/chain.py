"""The chain rule in the drive: `loopgate.gates.certified.chain.follow`, compiled, over the tables.

`follow` is the one walk along full places. The gate's decision asks it through `last_of_circle`, service
(`loopgate.drive.service`) for the vehicle that must move next.
"""

from __future__ import annotations

from loopgate.drive.codes import NOBODY
from loopgate.drive.occupancy import last_state, wanted_state
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner

__all__ = ["follow", "last_of_circle"]


@inner
def follow(i: int, left: int, entered: int, served: int, t: Tables) -> tuple[int, int]:
    """Follow full places from the one that a vehicle wants, each to the place that its first wants.

    All is seen as if one more were last in line in the state `entered`, and the first had gone from `left`;
    `NOBODY`: as it is. All fit into a private state, and there are two at least: so none is full here, and a
    state with one more is not empty.

    Parameters
    ----------
    served
        The vehicle for which the states on the way, but for the end, are marked; the walk ends with `NOBODY`
        where one of them is kept for another vehicle. `NOBODY`: none are marked.

    Returns
    -------
    tuple of int
        The first of the last full place, or `i` if there is none. The state at the end: one with room; else
        the one from which the walk began, after a circle.
    """
    first, here, begin = i, last_state(i, t), wanted_state(i, t)
    place = begin
    for _ in range(len(t.states) + 1):
        if served != NOBODY:
            if t.states[here].mover != NOBODY or t.states[place].mover != NOBODY:
                return int(first), int(NOBODY)
            t.states[here].served = served
        if t.states[place].queue + int(place == entered) - int(place == left) < t.states[place].room:
            return int(first), int(place)
        here = place
        first = int(t.lists[t.states[place].line])
        place = wanted_state(first, t)
        if place == begin:
            break
    return int(first), int(begin)  # or a circle elsewhere: the gate lets none come about


@inner
def last_of_circle(i: int, t: Tables) -> int:
    """Return the first of the last place of the circle of full places that the vehicle's move would close.

    `NOBODY` if it closes none.
    """
    entered = wanted_state(i, t)
    first, end = follow(i, last_state(i, t), entered, NOBODY, t)
    return int(first) if end == entered and first != i else int(NOBODY)
