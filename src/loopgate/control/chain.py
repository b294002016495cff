"""The chain rule: never close a circle of full places, each of whose first vehicle wants the next.

`follow` is the one walk. The gate asks it through `closes`, newcomers through `closes_by_entering`,
service through `next_mover`, the recognition of deadlocks through `circle_from`.

Sound and, where no set of places is crowded, admits whatever lets every vehicle go on for ever
(`loopgate.gates.certified.crowding`); places hold two or more.
"""

from __future__ import annotations

from typing import Final

from loopgate.control.places import Leg, Place, Vehicle


class Chain:
    """Full places, each of whose first vehicle wants the next.

    `places`: in the order of the walk, each once. `end`: the place that the last one's first vehicle wants:
    it has room, or it is one of `places`; None where that vehicle's path ends.
    """

    __slots__ = ("end", "places")

    def __init__(self, places: list[Place], end: Place | None) -> None:
        self.places: Final = places
        self.end: Final = end

    def circle(self) -> list[Place]:
        """Return the places that wait for one another in a circle; none if the chain ends elsewhere."""
        for number, place in enumerate(self.places):
            if place is self.end:
                return self.places[number:]
        return []


def follow(first: Place | None, entered: Leg | None = None, left: Place | None = None) -> Chain:
    """Follow full places from `first`, each to the place that its first vehicle wants.

    All is seen as if one more vehicle were last in line on the leg `entered`, and the first in line had gone
    from the place `left`. O(places on the way).
    """
    filled = None if entered is None else entered.place
    places: list[Place] = []
    place = first
    while place is not None and place not in places:
        held = len(place.line) + (place is filled) - (place is left)
        if held < place.slots:
            break
        places.append(place)
        leg = place.line[0].leg if place.line else entered
        after = None if leg is None else leg.after
        place = None if after is None else after.place
    return Chain(places, place)


def after_move(mover: Vehicle) -> Chain:
    """Return the full places from the one that `mover` wants next, as they are after its move."""
    return follow(mover.wanted(), mover.leg.after, mover.leg.place)


def closes(mover: Vehicle) -> list[Place]:
    """Return the full places of the circle that the next move of `mover` leads into, if any."""
    return after_move(mover).circle()


def closes_by_entering(leg: Leg) -> list[Place]:
    """Return the full places of the circle that one more vehicle, last in line on `leg`, closes."""
    return follow(leg.place, leg).circle()


def circle_from(place: Place) -> list[Place]:
    """Return the circle of full places that `place` waits for; none if its vehicles can move some day."""
    return follow(place).circle()


def next_mover(served: Vehicle) -> Vehicle:
    """Return the vehicle to move next, so that `served` moves after finitely many such moves.

    Ask again after each move until `served` has moved. `served` is on a path that goes on. The vehicle is the
    first of the last full place that its place leads to; where the move of that vehicle closes a circle, the
    first of the circle's last place, which wants the same place and closes none. It ends where no set of
    places is crowded.

    Raises `ValueError` where full places wait for one another in a circle already.
    """
    first = served.leg.place.line[0]
    chain = follow(first.wanted())
    if chain.circle():
        msg = f"full places wait for one another in a circle through {chain.places[-1].name}"
        raise ValueError(msg)
    mover = chain.places[-1].line[0] if chain.places else first
    circle = closes(mover)
    return circle[-1].line[0] if circle else mover
