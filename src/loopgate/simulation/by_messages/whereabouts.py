"""Distances from vehicles to the posts of places on their paths, and between posts over crossings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

from loopgate.control.places import Leg, Place, Vehicle

__all__ = ["DistancesToPosts", "path_of"]

_BEHIND = 12
"""A vehicle may have to speak to the posts of so many places behind its last grant."""


def path_of(vehicle: Vehicle) -> list[Leg]:
    """Return the legs of a vehicle's closed path, from the first leg."""
    legs, leg = [vehicle.leg], vehicle.leg.after
    while leg is not None and leg is not vehicle.leg:
        legs.append(leg)
        leg = leg.after
    return sorted(legs, key=lambda one: one.number)


class _Loop:
    """The legs of a loop: where each begins and ends [m], the number of its place, and the lap length [m]."""

    def __init__(self, path: Sequence[Leg], lap_m: float, places: dict[Place, int]) -> None:
        self._begins_m, self._ends_m = [leg.begin_m for leg in path], [leg.end_m for leg in path]
        self.places = [places.setdefault(leg.place, len(places)) for leg in path]
        self._lap_m = lap_m

    def place(self, leg: int) -> int:
        """Return the number of a leg's place; `leg` counts on from round to round."""
        return self.places[leg % len(self.places)]

    def begin_m(self, leg: int) -> float:
        """Return where a leg on the endless path begins [m]."""
        lap, at = divmod(leg, len(self.places))
        return lap * self._lap_m + self._begins_m[at]

    def end_m(self, leg: int) -> float:
        """Return where a leg on the endless path ends [m]."""
        lap, at = divmod(leg, len(self.places))
        return lap * self._lap_m + self._ends_m[at]


class DistancesToPosts:
    """Distances along the path from a vehicle's front to the nearer end of a place [m].

    Posts have an antenna at each end of their place. Vehicles and places have numbers.

    Parameters
    ----------
    vehicles
        By number; all drive loops.
    """

    def __init__(self, vehicles: Sequence[Vehicle]) -> None:
        self._vehicles = vehicles
        self.number: dict[Place, int] = {}
        """Numbers of the places that vehicles visit."""
        self.paths: dict[Leg, list[Leg]] = {}
        """The paths of vehicles, each once, by its first leg."""
        made: dict[Leg, _Loop] = {}
        self._ways: list[_Loop] = []
        for vehicle in vehicles:
            path = path_of(vehicle)
            if path[0] not in made:
                self.paths[path[0]] = path
                made[path[0]] = _Loop(path, vehicle.lap_m, self.number)
            self._ways.append(made[path[0]])
        self.places = list(self.number)
        """The places, by number."""
        self.over_m: dict[tuple[int, int], float] = {}
        """The longest distance from the end of a place over the crossing to the next place [m]."""
        for way in made.values():
            for leg, place in enumerate(way.places):
                key = place, way.place(leg + 1)
                over_m = way.begin_m(leg + 1) - way.end_m(leg)
                self.over_m[key] = max(over_m, self.over_m.get(key, 0.0))

    def place(self, vehicle: int) -> int:
        """Return the place that was last granted to a vehicle."""
        return self._ways[vehicle].place(self._vehicles[vehicle].granted)

    def wanted(self, vehicle: int) -> int:
        """Return the place after the last place that was granted to a vehicle."""
        return self._ways[vehicle].place(self._vehicles[vehicle].granted + 1)

    def tail(self, vehicle: int) -> int:
        """Return the leg on its endless path in which the rear of a vehicle is."""
        one = self._vehicles[vehicle]
        return one.granted + 1 - len(one.bodies)

    def stand(self, vehicle: int) -> tuple[tuple[int, ...], int, tuple[int, ...]]:
        """Return the places of a vehicle's loop, the index of its own place, and the places with its rear."""
        way, granted = self._ways[vehicle], self._vehicles[vehicle].granted
        rears = tuple(way.place(leg) for leg in range(self.tail(vehicle), granted))
        return tuple(way.places), granted % len(way.places), rears

    def _legs(self, vehicle: int, place: int) -> Iterator[int]:
        way, granted = self._ways[vehicle], self._vehicles[vehicle].granted
        for leg in range(granted + 1, granted - _BEHIND, -1):
            if way.place(leg) == place:
                yield leg

    def to_m(self, vehicle: int, place: int) -> float:
        """Return the distance from a vehicle to the post of a place [m]; infinity if it is not near."""
        return min((self._leg_m(vehicle, leg) for leg in self._legs(vehicle, place)), default=inf)

    def _leg_m(self, vehicle: int, leg: int) -> float:
        way, front_m = self._ways[vehicle], self._vehicles[vehicle].front_m
        before_m, behind_m = way.begin_m(leg) - front_m, front_m - way.end_m(leg)
        if before_m >= 0.0:
            return before_m
        return behind_m if behind_m >= 0.0 else min(-before_m, -behind_m)

    def back_to_m(self, vehicle: int, place: int) -> list[float]:
        """Return the hops of a message back to a post: to the nearest post, then from post to post [m]."""
        way, front_m = self._ways[vehicle], self._vehicles[vehicle].front_m
        for leg in self._legs(vehicle, place):
            if way.end_m(leg) <= front_m:
                here = leg
                while way.begin_m(here + 1) <= front_m:
                    here += 1
                between = [way.begin_m(k + 1) - way.end_m(k) for k in range(leg, here)]
                return [self._leg_m(vehicle, here), *reversed(between)]
        return [self.to_m(vehicle, place)]
