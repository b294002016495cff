"""The chain rule: never close a circle of full places in which each first vehicle wants the next place.

`follow` is the one walk along full places. Its callers are: the gate (`closes`), vehicles that join
(`closes_by_entering`), vehicles that change to another path (`leads_round`), service (`next_mover`) and the
detection of deadlocks (`circle_from`). All of them see places and vehicles through `PlaceLines`.

The rule is sound where places have two slots or more. Where no set of places is crowded
(`loopgate.gates.certified.crowding`), each admitted move lets every vehicle go on for ever.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Final, Generic, Protocol, TypeVar

P = TypeVar("P", bound=Hashable)
V = TypeVar("V")


class PlaceLines(Protocol[P, V]):
    """The places of vehicles, and the next place of each."""

    def free(self, place: P, /) -> int:
        """Return the number of free slots of a place."""
        ...

    def first(self, place: P, /) -> V | None:
        """Return the vehicle that leaves a place next; None if the place is empty or this is not known."""
        ...

    def wanted(self, vehicle: V, /) -> P | None:
        """Return the next place of a vehicle; None at the end of its path."""
        ...


class Chain(Generic[P]):
    """A chain of full places: the first vehicle of each place wants the next place.

    `places`: in the order of the walk, each once. `end`: the place that the first vehicle of the last place
    wants: it has a free slot, or is one of `places`. It is None if that vehicle's path ends or the vehicle is
    not known.
    """

    __slots__ = ("end", "places")

    def __init__(self, places: list[P], end: P | None) -> None:
        self.places: Final = places
        self.end: Final = end

    def circle(self) -> list[P]:
        """Return the places of a circle in the chain; empty if the chain ends at a place with a free slot."""
        if self.end is None or self.end not in self.places:
            return []
        return self.places[self.places.index(self.end) :]


def follow(
    standing: PlaceLines[P, V],
    begin: P | None,
    *,
    entered: P | None = None,
    onward: P | None = None,
    left: P | None = None,
) -> Chain[P]:
    """Follow full places from `begin`, each to the next place of its first vehicle.

    The walk assumes that one more vehicle, which wants `onward`, is last in line in `entered`, and that the
    first vehicle has left the line of `left`. O(places on the walk).
    """
    seen: set[P] = set()
    places: list[P] = []
    place = begin
    while place is not None and place not in seen:
        if standing.free(place) - (place == entered) + (place == left) > 0:
            break
        seen.add(place)
        places.append(place)
        first = standing.first(place)
        wanted = onward if place == entered else None
        place = wanted if first is None else standing.wanted(first)
    return Chain(places, place)


def closes(standing: PlaceLines[P, V], here: P, target: P | None, onward: P | None = None) -> list[P]:
    """Return the circle of full places that arises when the first vehicle in `here` moves to `target`.

    `onward`: the place that this vehicle wants next.
    """
    return follow(standing, target, entered=target, onward=onward, left=here).circle()


def closes_by_entering(standing: PlaceLines[P, V], place: P, *, free: int, onward: P | None) -> bool:
    """Return whether a circle of full places arises when a vehicle joins the line in `place`.

    `free`: the free slots before. `onward`: the place that the vehicle wants next; None for a place that is
    empty.
    """
    if free > 1:
        return False
    first = standing.first(place)
    return leads_round(standing, onward if first is None else standing.wanted(first), place)


def leads_round(standing: PlaceLines[P, V], begin: P | None, place: P) -> bool:
    """Return whether the chain of full places from `begin` leads to `place`, or to a circle."""
    chain = follow(standing, begin)
    return place in chain.places or chain.end == place or bool(chain.circle())


def circle_from(standing: PlaceLines[P, V], place: P) -> list[P]:
    """Return the circle of full places that the vehicles of `place` wait for; empty if there is none."""
    return follow(standing, place).circle()


def next_mover(standing: PlaceLines[P, V], place: P) -> V | None:
    """Return the vehicle to move next so that the first vehicle in `place` moves in the end.

    Call it again after each move, until that vehicle has moved. None if full places already wait for one
    another in a circle, or the place has no first vehicle.

    It is the first vehicle of the last full place to which `place` leads. If the move of that vehicle closes
    a circle, it is the first vehicle of the circle's last place, which wants the same place and closes no
    circle. So no move closes a circle. The moves come to an end where no set of places is crowded.
    """
    first = standing.first(place)
    if first is None:
        return None
    chain = follow(standing, standing.wanted(first))
    if chain.circle():
        return None
    last = chain.places[-1] if chain.places else place
    circle = closes(standing, last, chain.end)
    return standing.first(circle[-1] if circle else last)
