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


def _kept() -> deque[Any]:
    return deque(maxlen=_KEPT)


class Trails:
    """Remembers over which lanes vehicles came, and when gated ones were let go.

    Parameters
    ----------
    engine
        Drives the vehicles under the gate.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._changes = -1
        self._granted = np.zeros(0, dtype=np.int64)
        """The last legs granted to the gated vehicles by number, and the changes of the engine until then."""
        self._lanes: dict[str, deque[tuple[float, str]]] = defaultdict(_kept)
        self._grants: dict[str, deque[tuple[float, int]]] = defaultdict(_kept)

    def look(self, now: float, moved: Iterable[tuple[str, str]], gone: Iterable[str] = ()) -> None:
        """Take note of the lanes onto which vehicles have come, and of who is gone; once a step."""
        for vehicle in gone:
            del self._lanes[vehicle]
        for vehicle, lane in moved:
            self._lanes[vehicle].append((now, lane))
        drivers, granted = self._engine.drivers, self._engine.vehicles["granted"]
        known = self._engine.changes == self._changes
        for robot in np.flatnonzero(granted != self._granted).tolist() if known else range(len(drivers)):
            grants, leg = self._grants[drivers[robot].id], int(granted[robot])
            if not grants or grants[-1][1] != leg:  # else it has only been away
                grants.append((now, leg))
        self._changes, self._granted = self._engine.changes, granted.copy()

    def back(self, vehicle: str) -> Iterator[tuple[float, str]]:
        """Yield when a vehicle came onto which lanes, last one first, as far as that is remembered."""
        return reversed(self._lanes.get(vehicle, ()))

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
        grants = self._grants.get(vehicle, ())
        return max((at_s for at_s, _ in grants if at_s <= came_s), default=came_s)

    def last(self, vehicles: Iterable[str], lanes: Collection[str]) -> tuple[str, float]:
        """Return who of some vehicles came last onto some lanes, of those that are there, and when [s]."""
        there = [v for v in vehicles if v in self._lanes and self._lanes[v][-1][1] in lanes]
        at_s, vehicle = max((self.came_s(v, lanes), v) for v in there)
        return vehicle, at_s
