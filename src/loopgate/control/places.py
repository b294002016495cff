"""Places, legs and vehicles, as plain objects that know one another."""

from __future__ import annotations

from typing import Final


class Place:
    """A piece of road where vehicles stand in line; the first in line leaves it first.

    `slots`: how many vehicles fit. `line`: the vehicles that hold a slot, first in line first. `waiting`:
    vehicles elsewhere whose request is looked at again when a vehicle leaves this place. `length_before`: how
    long the line was before it changed in the turn `changed` of the ledger.
    """

    __slots__ = ("changed", "length_before", "line", "name", "slots", "waiting")

    def __init__(self, name: str, slots: int) -> None:
        self.name: Final = name
        self.slots: Final = slots
        self.line: list[Vehicle] = []
        self.waiting: list[Vehicle] = []
        self.changed = -1
        self.length_before = 0

    def is_full(self) -> bool:
        """Return whether no slot is free."""
        return len(self.line) >= self.slots


class Leg:
    """A place on a path. `after`: the leg that follows it; None where the path ends."""

    __slots__ = ("after", "place")

    def __init__(self, place: Place) -> None:
        self.place: Final = place
        self.after: Leg | None = None


def path_of(places: list[Place], *, closed: bool) -> list[Leg]:
    """Return the legs over `places`, at least one; on a `closed` path the first follows the last."""
    legs = [Leg(place) for place in places]
    for number in range(1, len(legs)):
        legs[number - 1].after = legs[number]
    if closed:
        legs[-1].after = legs[0]
    return legs


class Vehicle:
    """A vehicle, and the last leg that was granted to it.

    `asks`: whether it waits for an answer. `reason`: why it was refused last, or "". `since`: the turn of the
    ledger in which it asked. `woken`: whether it is to be looked at in the next answer.
    """

    __slots__ = ("asks", "leg", "name", "number", "reason", "since", "woken")

    def __init__(self, number: int, name: str, leg: Leg) -> None:
        self.number: Final = number
        self.name: Final = name
        self.leg = leg
        self.asks = False
        self.woken = False
        self.reason = ""
        self.since = 0

    def wanted(self) -> Place | None:
        """Return the place that it wants next; None where its path ends."""
        after = self.leg.after
        return None if after is None else after.place
