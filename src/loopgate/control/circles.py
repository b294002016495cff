"""Finds the places that lie in circles of the ways that vehicles have ahead.

Vehicles can lock up only in such circles. In all other places a long vehicle keeps its extra metres only
while it is there, and vehicles may stand where others change lanes (`docs/proofs/roads.md`).
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
    that stretch. A place that no longer lies in a circle counts as circled until the next `look`.

    Parameters
    ----------
    places
        The places for which it makes a difference.
    """

    def __init__(self, places: Iterable[Place]) -> None:
        self._places: Final = list(places)
        self._links: dict[Place, dict[Place, int]] = {}
        """How many ways ahead have each link."""
        self._round: set[Vehicle] = set()
        """The vehicles on loops: they keep their links."""
        self._changed = True
        self._look_s = 0.0

    def add(self, leg: Leg) -> None:
        """Add the links of a way, from a leg on."""
        for here, there in _links_from(leg):
            links = self._links.setdefault(here, {})
            links[there] = links.get(there, 0) + 1

    def drop(self, leg: Leg) -> None:
        """Drop the links of a way, from a leg on."""
        for here, there in _links_from(leg):
            self._drop(here, there)

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
            for here, there in _links_of(vehicle.leg):
                self._drop(here, there)

    def _drop(self, here: Place, there: Place) -> None:
        links = self._links[here]
        links[there] -= 1
        if not links[there]:
            del links[there]
            self._changed = True

    def closed_by(self, leg: Leg) -> list[Place]:
        """Return the places that would lie in circles, and do not yet, with one more way from a leg on."""
        new = [(here, there) for here, there in _links_from(leg) if there not in self._links.get(here, ())]
        if not new or all(place.circled for place in self._places):
            return []
        onward = {here: list(links) for here, links in self._links.items()}
        for here, there in new:
            onward.setdefault(here, []).append(there)
        circled = _circled(onward)
        return [place for place in self._places if not place.circled and place in circled]

    def allows(self, leg: Leg, vehicles: Iterable[Vehicle], may: Callable[[], bool]) -> bool:
        """Return whether a vehicle may take a way from a leg on, also as to the circles that this closes.

        `may`: whether it may if these places lie in circles.
        """
        return as_if_circled(self.closed_by(leg), vehicles, may)

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
        circled = _circled({here: list(links) for here, links in self._links.items()})
        for place in self._places:
            if place.circled and place not in circled:
                count_out(place, there, changed)


def _circled(onward: dict[Place, list[Place]]) -> set[Place]:
    """Return the places that lie in circles, given the next places of each."""
    for links in list(onward.values()):
        for there in links:
            onward.setdefault(there, [])
    found: set[Place] = set()
    for part in strong_parts(onward):
        if len(part) > 1:
            found |= part
    return found


def _links_of(leg: Leg) -> Iterator[tuple[Place, Place]]:
    """Yield the links out of the place of a leg."""
    if leg.after is not None:
        yield leg.place, leg.after.place
    if leg.change is not None:
        for place in leg.change.behind:
            if leg.after is None or place is not leg.after.place:
                yield leg.place, place


def _links_from(leg: Leg) -> Iterator[tuple[Place, Place]]:
    """Yield the links of a way from a leg on."""
    one: Leg | None = leg
    while one is not None:
        yield from _links_of(one)
        one = one.after
        if one is leg:
            return


def _is_closed(leg: Leg) -> bool:
    one = leg.after
    while one is not None and one is not leg:
        one = one.after
    return one is leg
