"""When vehicles came where they are: who came last into a circle of roads."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable

from loopgate.drive.engine import Engine

__all__ = ["Trails"]

_KEPT = 64
"""So many lanes, and grants, of a vehicle are remembered."""


class Trails:
    """Remembers over which lanes vehicles came, and when gated ones were let go.

    Parameters
    ----------
    engine
        Drives the vehicles under the gate.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._granted: dict[str, int] = {}
        """The last legs granted when it was looked last."""
        self._lanes: dict[str, deque[tuple[float, str]]] = {}
        self._grants: dict[str, deque[tuple[float, int]]] = {}

    def look(self, now: float, moved: Iterable[tuple[str, str]], gone: Iterable[str] = ()) -> None:
        """Take note of the lanes onto which vehicles have come, and of who is gone; once a step."""
        for vehicle in gone:
            del self._lanes[vehicle]
        for vehicle, lane in moved:
            self._lanes.setdefault(vehicle, deque(maxlen=_KEPT)).append((now, lane))
        granted = self._engine.vehicles["granted"].tolist()
        names = (driver.id for driver in self._engine.drivers)
        before, self._granted = self._granted, dict(zip(names, granted, strict=True))
        for name, leg in self._granted.items():
            if before.get(name) != leg:
                grants = self._grants.setdefault(name, deque(maxlen=_KEPT))
                if not grants or grants[-1][1] != leg:  # else it has only been away
                    grants.append((now, leg))

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
