"""How far it is from a vehicle to the posts of places on its way, and over crossings from post to post."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import Any, NamedTuple, cast

from loopgate.drive.tables import Tables

__all__ = ["Way", "Whereabouts"]

_BEHIND = 12
"""So many places behind its last grant a vehicle may have to speak to a post."""


class Way(NamedTuple):
    """The legs of a loop: where each begins and ends [m], its place; length of a lap [m]."""

    begins_m: list[float]
    ends_m: list[float]
    places: list[int]
    lap_m: float

    def begin_m(self, leg: int) -> float:
        """Return where a leg of the endless way begins [m]."""
        lap, at = divmod(leg, len(self.places))
        return lap * self.lap_m + self.begins_m[at]

    def end_m(self, leg: int) -> float:
        """Return where a leg of the endless way ends [m]."""
        lap, at = divmod(leg, len(self.places))
        return lap * self.lap_m + self.ends_m[at]


class Whereabouts:
    """Distances along the way, from the front of a vehicle to the nearer end of a place [m].

    Posts have an antenna at each end of their places.
    """

    def __init__(self, tables: Tables) -> None:
        v, legs = cast("Any", tables.vehicles), cast("Any", tables.legs)
        self._front, self._granted, self._tail = v["front"], v["granted"], v["tail"]
        made: dict[int, Way] = {}
        self.ways: list[Way] = []
        """By vehicle."""
        for at, many, lap_m in zip(
            v["leg_at"].tolist(), v["legs"].tolist(), v["lap_m"].tolist(), strict=True
        ):
            if at not in made:
                some = legs[at : at + many]
                begins_m, ends_m, places = (some[name].tolist() for name in ("begin_m", "end_m", "state"))
                made[at] = Way(begins_m, ends_m, places, lap_m)
            self.ways.append(made[at])
        self.over_m: dict[tuple[int, int], float] = {}
        """From the end of a place over the crossing to the beginning of the next; the longest way [m]."""
        for way in made.values():
            for leg, place in enumerate(way.places):
                key = place, way.places[(leg + 1) % len(way.places)]
                over_m = way.begin_m(leg + 1) - way.end_m(leg)
                self.over_m[key] = max(over_m, self.over_m.get(key, 0.0))

    def place(self, vehicle: int) -> int:
        """Return the place of the last grant to a vehicle."""
        return self._place(vehicle, int(self._granted[vehicle]))

    def wanted(self, vehicle: int) -> int:
        """Return the place behind the last that was granted to a vehicle."""
        return self._place(vehicle, int(self._granted[vehicle]) + 1)

    def _place(self, vehicle: int, leg: int) -> int:
        places = self.ways[vehicle].places
        return places[leg % len(places)]

    def stand(self, vehicle: int) -> tuple[tuple[int, ...], int, tuple[int, ...]]:
        """Return the places of its loop, the position of its own there, and those that its rear is in."""
        granted, tail = int(self._granted[vehicle]), int(self._tail[vehicle])
        places = self.ways[vehicle].places
        rears = tuple(self._place(vehicle, leg) for leg in range(tail, granted))
        return tuple(places), granted % len(places), rears

    def _legs(self, vehicle: int, place: int) -> Iterator[int]:
        way, granted = self.ways[vehicle], int(self._granted[vehicle])
        for leg in range(granted + 1, granted - _BEHIND, -1):
            if way.places[leg % len(way.places)] == place:
                yield leg

    def to_m(self, vehicle: int, place: int) -> float:
        """Return how far it is to the post of a place, infinity if that is nowhere near."""
        return min((self._leg_m(vehicle, leg) for leg in self._legs(vehicle, place)), default=inf)

    def _leg_m(self, vehicle: int, leg: int) -> float:
        way, front_m = self.ways[vehicle], float(self._front[vehicle])
        before_m, behind_m = way.begin_m(leg) - front_m, front_m - way.end_m(leg)
        if before_m >= 0.0:
            return before_m
        return behind_m if behind_m >= 0.0 else min(-before_m, -behind_m)

    def back_to_m(self, vehicle: int, place: int) -> list[float]:
        """Return the stretches to a post left behind: to the nearest post, and from post to post [m]."""
        way, front_m = self.ways[vehicle], float(self._front[vehicle])
        for leg in self._legs(vehicle, place):
            if way.end_m(leg) <= front_m:
                here = leg
                while way.begin_m(here + 1) <= front_m:
                    here += 1
                between = [way.begin_m(k + 1) - way.end_m(k) for k in range(leg, here)]
                return [self._leg_m(vehicle, here), *reversed(between)]
        return [self.to_m(vehicle, place)]
