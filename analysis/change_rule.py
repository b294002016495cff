"""Tells whether all vehicles can go on for ever after a change of loops, and while some vehicles stand.

Suppose that places have two slots or more and are left in order of arrival. Then the answer depends on the
vehicles' positions only through circles of full places, and on their loops only through condition (S) (proof:
docs/proofs/Change.v). So one walk for each place whose first vehicle has another loop, and (S), decide a
change of loops. If the first vehicle in a place stands for good, every vehicle outside that place goes on if
and only if no other loop leads there, and the other vehicles close no circle and keep (S).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import StrEnum

from loopgate.gates.certified import chain
from loopgate.gates.certified.crowding import find_crowd


class Why(StrEnum):
    """The reason why some vehicle cannot go on for ever."""

    LEADS_THERE = "a loop leads to a place whose first vehicle stands"
    CIRCLE = "full places wait for one another in a circle"
    CROWD = "a crossed set of places has too many residents"


@dataclass(frozen=True, slots=True)
class Hindrance:
    """The reason why some vehicle cannot go on for ever.

    Attributes
    ----------
    why
        The condition that fails.
    places
        The places with a vehicle that stands; the places of the circle, in its order; or the crowded
        places, ascending.
    vehicles
        The vehicles whose loops lead there; the first vehicles of the circle's places; or the residents.
    """

    why: Why
    places: tuple[int, ...]
    vehicles: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Standing:
    """The positions of vehicles on their loops.

    Attributes
    ----------
    loops
        The places of each vehicle's loop, in driving order, once round.
    positions
        Where on its loop each vehicle stands.
    lines
        The vehicles in each place, first in line first.
    slots
        How many vehicles each place holds, two or more.
    """

    loops: Sequence[Sequence[int]]
    positions: Sequence[int]
    lines: Sequence[Sequence[int]]
    slots: Sequence[int]

    def free(self, place: int) -> int:
        """Return the number of free slots of a place."""
        return self.slots[place] - len(self.lines[place])

    def first(self, place: int) -> int | None:
        """Return the first vehicle in line; None if the place is empty."""
        line = self.lines[place]
        return line[0] if line else None

    def wanted(self, vehicle: int) -> int:
        """Return the next place of a vehicle."""
        loop = self.loops[vehicle]
        return loop[(self.positions[vehicle] + 1) % len(loop)]


def find_hindrance(
    there: Standing, *, changed: Collection[int] | None = None, stands: Collection[int] = ()
) -> Hindrance | None:
    """Return why some vehicle outside blocked places cannot go on for ever; None if all can.

    Parameters
    ----------
    there
        All vehicles, with their loops after the change.
    changed
        The vehicles with other loops than before, if there was no circle before; None if not known. Only
        circles through places where these vehicles are first are looked for.
    stands
        The places whose first vehicle stands for good.

    Examples
    --------
    Two vehicles fill place 0 and two fill place 1. Only the first vehicle of place 0 wants place 1:

    >>> loops, lines = [[0, 1], [0, 2], [1, 2], [1, 2]], [[0, 1], [2, 3], []]
    >>> find_hindrance(Standing(loops, [0] * 4, lines, [2, 2, 2])) is None
    True

    Once the first vehicle of place 1 wants place 0, the two places wait for each other:

    >>> loops[2] = [1, 0]
    >>> find_hindrance(Standing(loops, [0] * 4, lines, [2, 2, 2]), changed=[2]).places
    (1, 0)

    Notes
    -----
    O(places) for each changed vehicle that is first in its place, and the cost of `find_crowd`.
    """
    lost = {vehicle for place in stands for vehicle in there.lines[place]}
    others = [vehicle for line in there.lines for vehicle in line if vehicle not in lost]
    astray = sorted(vehicle for vehicle in others if not set(stands).isdisjoint(there.loops[vehicle]))
    if astray:
        return Hindrance(Why.LEADS_THERE, tuple(sorted(stands)), tuple(astray))
    for place, line in enumerate(there.lines):
        if line and place not in stands and (changed is None or line[0] in changed):
            circle = chain.circle_from(there, place)
            if circle:
                return Hindrance(Why.CIRCLE, tuple(circle), tuple(there.lines[p][0] for p in circle))
    crowd = find_crowd([there.loops[vehicle] for vehicle in others], there.slots) if others else None
    if crowd is None:
        return None
    return Hindrance(Why.CROWD, crowd.places, tuple(sorted(others[k] for k in crowd.residents)))
