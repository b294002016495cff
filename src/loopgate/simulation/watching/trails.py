"""Records when vehicles came onto their lanes, to find the last one that entered a circle of roads."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Collection, Iterable, Iterator
from itertools import compress, count
from operator import ne
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from loopgate.simulation.drive import Drive
from loopgate.traffic.base import Whereabouts

__all__ = ["Trails"]

_KEPT = 64
"""Number of lanes, and of grants, that are remembered for each vehicle."""

_TOGETHER: Final = 32
"""Steps are added to the trails in groups of this size, which is faster: a step of SUMO empties the
processor's caches."""


def _kept() -> deque[Any]:
    return deque(maxlen=_KEPT)


class Trails:
    """Records the lanes that vehicles came over, and the times of grants of gated vehicles.

    Parameters
    ----------
    drive
        Drives the vehicles under the gate.
    """

    def __init__(self, drive: Drive) -> None:
        self._drive = drive
        self._changes = -1
        self._names: list[str] = []
        """The names of the gated vehicles, as of `_changes`."""
        self._seen: list[tuple[float, Whereabouts, NDArray[np.int64]]] = []
        """Steps not yet added to the trails: time [s], lanes of all vehicles, and last legs granted."""
        self._here = Whereabouts()
        self._granted = np.zeros(0, dtype=np.int64)
        """Lanes and last legs granted in the last step that was added."""
        self._lanes: dict[str, deque[tuple[float, str]]] = defaultdict(_kept)
        self._grants: dict[str, deque[tuple[float, int]]] = defaultdict(_kept)

    def look(self, now: float, here: Whereabouts) -> None:
        """Record the lanes of all vehicles; call once a step."""
        drive = self._drive
        if drive.changes != self._changes:
            self.catch_up()
            self._changes, self._names = drive.changes, [*drive.names()]
            self._granted = np.full(len(self._names), -1)
        self._seen.append((now, here, drive.granted()))
        if len(self._seen) == _TOGETHER:
            self.catch_up()

    def catch_up(self) -> tuple[list[tuple[str, str, str]], list[str]]:
        """Return each vehicle's lane changes since the last call, and the vehicles that have left."""
        moved: list[tuple[str, str, str]] = []
        gone: list[str] = []
        for now, here, granted in self._seen:
            was = self._here
            if here.vehicles == was.vehicles:
                rows = compress(count(), map(ne, was.lanes, here.lanes))
                moves = [(here.vehicles[row], was.lanes[row], here.lanes[row]) for row in rows]
            else:
                left = dict(zip(was.vehicles, was.lanes, strict=True))
                pairs = zip(here.vehicles, here.lanes, strict=True)
                moves = [
                    (v, was_on or "", lane) for v, lane in pairs if (was_on := left.pop(v, None)) != lane
                ]
                for vehicle in left:
                    del self._lanes[vehicle]
                    gone.append(vehicle)
            for vehicle, _, lane in moves:
                self._lanes[vehicle].append((now, lane))
            for robot in np.flatnonzero(granted != self._granted).tolist():
                grants, leg = self._grants[self._names[robot]], int(granted[robot])
                if not grants or grants[-1][1] != leg:  # otherwise it has only been absent
                    grants.append((now, leg))
            self._here, self._granted = here, granted
            moved += moves
        self._seen.clear()
        return moved, gone

    def back(self, vehicle: str) -> Iterator[tuple[float, str]]:
        """Yield the lanes of a vehicle with the times when it came onto them, latest first."""
        self.catch_up()
        return reversed(self._lanes.get(vehicle, ()))

    def came_s(self, vehicle: str, lanes: Collection[str]) -> float:
        """Return since when a vehicle has been on some lanes, or in their junctions [s].

        For a gated vehicle, the time of its last grant before counts.
        """
        came_s = 0.0
        for at_s, lane in self.back(vehicle):
            if lane not in lanes and not lane.startswith(":"):
                break
            came_s = at_s
        grants = self._grants.get(vehicle, ())
        return max((at_s for at_s, _ in grants if at_s <= came_s), default=came_s)

    def last(self, vehicles: Iterable[str], lanes: Collection[str]) -> tuple[str, float]:
        """Return the vehicle that came last onto some lanes, and the time when it came [s]."""
        self.catch_up()
        there = [v for v in vehicles if v in self._lanes and self._lanes[v][-1][1] in lanes]
        at_s, vehicle = max((self.came_s(v, lanes), v) for v in there)
        return vehicle, at_s
