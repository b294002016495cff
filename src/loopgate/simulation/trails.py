"""When vehicles came where they are: who came last into a circle of roads."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Mapping

from loopgate.drive.driver import Driver

__all__ = ["Trails"]

_KEPT = 64
"""So many lanes, and grants, of a vehicle are remembered."""


class Trails:
    """Remembers over which lanes vehicles came, and when gated ones were let go.

    Parameters
    ----------
    drivers
        Of all vehicles under the gate, by name.
    """

    def __init__(self, drivers: Mapping[str, Driver]) -> None:
        self._drivers = drivers
        self._lanes: dict[str, deque[tuple[float, str]]] = {}
        self._grants: dict[str, deque[tuple[float, int]]] = {}

    def look(self, now: float, lanes: Iterable[tuple[str, str]]) -> None:
        """Take note on which lanes vehicles are; once a step."""
        known, self._lanes = self._lanes, {}
        for vehicle, lane in lanes:
            trail = self._lanes[vehicle] = known.get(vehicle) or deque(maxlen=_KEPT)
            if not trail or trail[-1][1] != lane:
                trail.append((now, lane))
        for name, driver in self._drivers.items():
            grants = self._grants.setdefault(name, deque(maxlen=_KEPT))
            granted = driver.granted
            if not grants or grants[-1][1] != granted:
                grants.append((now, granted))

    def came_s(self, vehicle: str, lanes: Collection[str]) -> float:
        """Return since when a vehicle has been on some lanes, or inside junctions about them [s].

        For a gated one that is the grant on which it came, before which it could have been refused; of
        several the last.
        """
        came_s = 0.0
        for at_s, lane in reversed(self._lanes[vehicle]):
            if lane not in lanes and not lane.startswith(":"):
                break
            came_s = at_s
        grants = (at_s for at_s, _ in self._grants.get(vehicle, ()) if at_s <= came_s)
        return max(grants, default=came_s)

    def last(self, vehicles: Iterable[str], lanes: Collection[str]) -> tuple[str, float]:
        """Return who of some vehicles came last onto some lanes, of those that are there, and when [s]."""
        there = [v for v in vehicles if v in self._lanes and self._lanes[v][-1][1] in lanes]
        at_s, vehicle = max((self.came_s(v, lanes), v) for v in there)
        return vehicle, at_s
