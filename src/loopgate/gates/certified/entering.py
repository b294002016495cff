"""Whether who comes into a place from outside closes a circle of full places."""

from collections.abc import Sequence
from typing import Protocol


class Standing(Protocol):
    """The places in which robots stand, and those that they want next."""

    def line(self, state: int, /) -> Sequence[int]:
        """Return the robots whose last grant is a state, first one first."""
        ...

    def slots(self, state: int, /) -> int:
        """Return how many robots fit into a state."""
        ...

    def wanted(self, robot: int, /) -> int:
        """Return the state behind the last that was granted to a robot."""
        ...


def closes_by_entering(standing: Standing, state: int, *, room: int, wanted: int | None) -> bool:
    """Return whether one more, last in line in a state, closes a circle of full places.

    Parameters
    ----------
    standing
        The robots that are there already.
    state
        The state that is entered.
    room
        How many robots fit into it.
    wanted
        The state that the newcomer wants next; None for one that is empty.
    """
    line = standing.line(state)
    if len(line) + 1 < room:
        return False
    return leads_round(standing, standing.wanted(line[0]) if line else wanted, state)


def leads_round(standing: Standing, first: int | None, state: int) -> bool:
    """Return whether full places lead from `first` to `state` or into a circle, each by what its head wants.

    O(places on the way).
    """
    seen = {state}
    while first is not None and first not in seen:
        line = standing.line(first)
        if len(line) < standing.slots(first):
            return False
        seen.add(first)
        first = standing.wanted(line[0])
    return first is not None
