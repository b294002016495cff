"""Finds the places that lie in circles of the ways that vehicles have ahead.

Vehicles can lock up only in such circles, and only where enough vehicles come to fill each place of one. In
all other places a long vehicle keeps its extra metres only while it is there, and vehicles may stand where
others change lanes (`docs/proofs/roads.md`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from loopgate.control.credits import as_if_circled, count_in, count_out
from loopgate.control.places import Leg, Place, Vehicle
from loopgate.network.road_graph import strong_parts

_EVERY_S: Final = 5.0
"""How often places are looked for that lie in no circle any more [s]."""


class Circles:
    """The ways ahead as links between places, and the places that lie in circles of these links.

    A link leads from a place to the next on a way; from a place before a change of lanes to all places after
    that stretch. Places that have slots for all who are there or come do not count: nobody waits for them.
    A place that no longer lies in a circle counts as circled until the next `look`.

    Parameters
    ----------
    places
        The places for which it makes a difference.
    """

    def __init__(self, places: Iterable[Place]) -> None:
        self._places: Final = list(places)
        self._links: dict[Place, dict[Place, int]] = {}
        """How many ways ahead have each link."""
        self._visits: dict[Place, int] = {}
        """How often ways come to each place."""
        self._round: set[Vehicle] = set()
        """The vehicles on loops: they keep their links."""
        self._changed = True
        self._look_s = 0.0

    def add(self, leg: Leg) -> None:
        """Add the links of a way, from a leg on."""
        for one in _legs_from(leg):
            self._visits[one.place] = self._visits.get(one.place, 0) + 1
            for there in _next_of(one):
                links = self._links.setdefault(one.place, {})
                links[there] = links.get(there, 0) + 1

    def drop(self, leg: Leg) -> None:
        """Drop the links of a way, from a leg on."""
        for one in _legs_from(leg):
            self._drop(one)

    def comes(self, vehicle: Vehicle) -> None:
        """Add the way of a vehicle."""
        self.add(vehicle.leg)
        if _is_closed(vehicle.leg):
            self._round.add(vehicle)

    def goes(self, vehicle: Vehicle) -> None:
        """Drop the way of a vehicle."""
        self.drop(vehicle.leg)
        self._round.discard(vehicle)

    def passes(self, vehicle: Vehicle) -> None:
        """Drop the links out of the place that a vehicle leaves."""
        if vehicle not in self._round:
            self._drop(vehicle.leg)

    def _drop(self, leg: Leg) -> None:
        visits = self._visits[leg.place] = self._visits[leg.place] - 1
        self._changed = self._changed or visits == leg.place.least - 1
        links = self._links.get(leg.place, {})
        for there in _next_of(leg):
            links[there] -= 1
            if not links[there]:
                del links[there]
                self._changed = True

    def closed_by(self, leg: Leg) -> list[Place]:
        """Return the places that would lie in circles, and do not yet, with one more way from a leg on."""
        if not self._is_new(leg):
            return []
        self.add(leg)
        circled = self._circled()
        changed = self._changed
        self.drop(leg)
        self._changed = changed
        return [place for place in self._places if not place.circled and place in circled]

    def _is_new(self, leg: Leg) -> bool:
        """Return whether a way from a leg on adds a link, or as many visits as some place has slots."""
        visits: dict[Place, int] = {}
        for one in _legs_from(leg):
            place = one.place
            there = visits[place] = visits.get(place, self._visits.get(place, 0)) + 1
            links = self._links.get(place, ())
            if there == place.least or any(after not in links for after in _next_of(one)):
                return True
        return False

    def _circled(self) -> set[Place]:
        """Return the places that lie in circles. O(links)."""
        full = {place for place, visits in self._visits.items() if visits >= place.least}
        onward = {here: [there for there in self._links.get(here, ()) if there in full] for here in full}
        return {place for part in strong_parts(onward) if len(part) > 1 for place in part}

    def allows(self, leg: Leg, vehicles: Iterable[Vehicle], may: Callable[[], bool]) -> bool:
        """Return whether a vehicle may take a way from a leg on, also as to the circles that this closes.

        `may`: whether it may, as circles are when it is called. It is asked first, since it takes less time.
        """
        return may() and as_if_circled(self.closed_by(leg), vehicles, may)

    def close(self, leg: Leg, vehicles: Iterable[Vehicle], changed: Callable[[Place], None]) -> None:
        """Mark the places that a new way from a leg on puts into circles. Call it before `add`."""
        there = list(vehicles)
        for place in self.closed_by(leg):
            count_in(place, there, changed)

    def look(self, now_s: float, vehicles: Iterable[Vehicle], changed: Callable[[Place], None]) -> None:
        """Find the places that lie in no circle any more."""
        if not self._changed or now_s < self._look_s:
            return
        self._changed, self._look_s = False, now_s + _EVERY_S
        there = list(vehicles)
        circled = self._circled()
        for place in self._places:
            if place.circled and place not in circled:
                count_out(place, there, changed)


def _next_of(leg: Leg) -> Iterator[Place]:
    """Yield the places for which a vehicle at the end of a leg may have to wait."""
    if leg.after is not None:
        yield leg.after.place
    if leg.change is not None:
        for place in leg.change.behind:
            if leg.after is None or place is not leg.after.place:
                yield place


def _legs_from(leg: Leg) -> Iterator[Leg]:
    """Yield the legs of a way from a leg on, each once."""
    yield leg
    one = leg.after
    while one is not None and one is not leg:
        yield one
        one = one.after


def _is_closed(leg: Leg) -> bool:
    one = leg.after
    while one is not None and one is not leg:
        one = one.after
    return one is leg
