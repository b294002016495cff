"""A run in sumo-gui: the view fits the loops, vehicles are coloured by their state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from loopgate.drive.engine import Engine
from loopgate.drive.sense import STANDING_MPS
from loopgate.network import Loop

__all__ = ["COLOURS", "Shown", "Window"]

COLOURS = ((22, 104, 184), (224, 138, 0), (107, 111, 118), (194, 18, 75))
"""Of those who drive, are held at a gate, stand otherwise, and have stood for long: as in the replay."""

_DRIVES, _HELD, _STANDS, _JAM = range(4)
_JAM_S = 180.0
_MARGIN_M = 40.0


class Shown(Protocol):
    """The interface of a simulation with a window (sumo-gui)."""

    @property
    def now_s(self) -> float:
        """Simulated time [s]."""
        ...

    def vehicles(self) -> Sequence[str]:
        """Return the vehicles on the road."""
        ...

    def show(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        """Move the view to a part of the map between two corners [m]."""
        ...

    def paint(self, vehicle: str, colour: tuple[int, int, int]) -> None:
        """Set the colour of a vehicle."""
        ...


class Window:
    """Colours vehicles in sumo-gui by their state.

    Parameters
    ----------
    traffic
        Shown in a window.
    engine
        Drives the vehicles.
    loops
        Loops that the view has to fit.
    """

    def __init__(self, traffic: Shown, engine: Engine, loops: Sequence[Loop]) -> None:
        self._traffic = traffic
        self._engine = engine
        self._number()
        points = np.concatenate([loop.curve()[0] for loop in loops])
        west, south = (points.min(axis=0) - _MARGIN_M).tolist()
        east, north = (points.max(axis=0) + _MARGIN_M).tolist()
        traffic.show((west, south), (east, north))

    def _number(self) -> None:
        """Begin with the vehicles as the engine numbers them now."""
        self._changes = self._engine.changes
        self._ids = [driver.id for driver in self._engine.drivers]
        self._drove_s = np.full(len(self._ids), self._traffic.now_s)
        self._painted = np.full(len(self._ids), -1)

    def look(self) -> None:
        """Update the colours of vehicles whose state has changed."""
        if self._changes != self._engine.changes:
            self._number()
        table, now = self._engine.vehicles, self._traffic.now_s
        drives = table["speed"] >= STANDING_MPS
        self._drove_s[drives] = now
        state = np.where(table["held"] & ~np.isnan(table["halted_s"]), _HELD, _STANDS)
        state[now - self._drove_s >= _JAM_S] = _JAM
        state[drives] = _DRIVES
        changed = np.flatnonzero(state != self._painted)
        on_road = set(self._traffic.vehicles()) if len(changed) else set()
        for robot in changed.tolist():
            if self._ids[robot] in on_road:
                self._traffic.paint(self._ids[robot], COLOURS[state[robot]])
                self._painted[robot] = state[robot]
