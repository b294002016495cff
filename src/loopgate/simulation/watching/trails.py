"""When vehicles came where they are: who came last into a circle of roads."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Collection, Iterable, Iterator
from typing import Any

import numpy as np

from loopgate.drive.engine import Engine

__all__ = ["Trails"]

_KEPT = 64
"""So many lanes, and grants, of a vehicle are remembered."""


def _pair() -> tuple[deque[Any], deque[Any]]:
    return deque(maxlen=_KEPT), deque(maxlen=_KEPT)


class Trails:
    """Remembers over which lanes vehicles came, and when gated ones were let go.

    Parameters
    ----------
    engine
        Drives the vehicles under the gate.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._names: list[str] = []
        self._granted = np.zeros(0, dtype=np.int64)
        """The gated vehicles by number, and the last legs granted to them, when it was looked last."""
        self._lanes: dict[str, tuple[deque[float], deque[str]]] = defaultdict(_pair)
        self._grants: dict[str, tuple[deque[float], deque[int]]] = defaultdict(_pair)

    def look(self, now: float, moved: Iterable[tuple[str, str]], gone: Iterable[str] = ()) -> None:
        """Take note of the lanes onto which vehicles have come, and of who is gone; once a step."""
        for vehicle in gone:
            del self._lanes[vehicle]
        for vehicle, lane in moved:
            times_s, lanes = self._lanes[vehicle]
            times_s.append(now)
            lanes.append(lane)
        names, granted = [driver.id for driver in self._engine.drivers], self._engine.vehicles["granted"]
        known = names == self._names
        for robot in np.flatnonzero(granted != self._granted).tolist() if known else range(len(names)):
            times_s, legs = self._grants[names[robot]]
            if not legs or legs[-1] != granted[robot]:  # else it has only been away
                times_s.append(now)
                legs.append(int(granted[robot]))
        self._names, self._granted = names, granted.copy()

    def back(self, vehicle: str) -> Iterator[tuple[float, str]]:
        """Yield when a vehicle came onto which lanes, last one first, as far as that is remembered."""
        times_s, lanes = self._lanes.get(vehicle, ((), ()))
        return zip(reversed(times_s), reversed(lanes), strict=True)

    def came_s(self, vehicle: str, lanes: Collection[str]) -> float:
        """Return since when a vehicle has been on some lanes, or inside junctions about them [s].

        For a gated one that is the grant on which it came, before which it could have been refused; of
        several the last.
        """
        came_s = 0.0
        for at_s, lane in self.back(vehicle):
            if lane not in lanes and not lane.startswith(":"):
                break
            came_s = at_s
        times_s, _ = self._grants.get(vehicle, ((), ()))
        return max((at_s for at_s in times_s if at_s <= came_s), default=came_s)

    def last(self, vehicles: Iterable[str], lanes: Collection[str]) -> tuple[str, float]:
        """Return who of some vehicles came last onto some lanes, of those that are there, and when [s]."""
        there = [v for v in vehicles if v in self._lanes and self._lanes[v][1][-1] in lanes]
        at_s, vehicle = max((self.came_s(v, lanes), v) for v in there)
        return vehicle, at_s
