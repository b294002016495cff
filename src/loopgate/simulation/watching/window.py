"""Shows a run in sumo-gui: fits the view to the loops, and colours vehicles by their state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np

from loopgate.control.places import STANDING_MPS
from loopgate.network import Loop
from loopgate.simulation.drive import Drive

__all__ = ["COLOURS", "Shown", "Window"]

COLOURS = ((22, 104, 184), (224, 138, 0), (107, 111, 118), (194, 18, 75))
"""Colours as in the replay: for vehicles that drive, are held at a gate, stand otherwise, and have stood for
long."""

_DRIVES, _HELD, _STANDS, _JAM = range(4)
_JAM_S = 180.0
_MARGIN_M = 40.0


class Shown(Protocol):
    """The interface of a simulation with a window (sumo-gui)."""

    @property
    def now_s(self) -> float:
        """Simulated time [s]."""
        ...

    @property
    def step_s(self) -> float:
        """Length of a step [s]."""
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
        The simulation with a window.
    drive
        Drives the vehicles.
    loops
        Loops that the view has to fit.
    """

    def __init__(self, traffic: Shown, drive: Drive, loops: Iterable[Loop]) -> None:
        self._traffic, self._drive = traffic, drive
        self._at_m: dict[str, float] = {}
        """The odometer of each vehicle at the last call of `look` [m]."""
        self._drove_s: dict[str, float] = {}
        self._painted: dict[str, int] = {}
        points = np.concatenate([loop.curve()[0] for loop in loops])
        west, south = (points.min(axis=0) - _MARGIN_M).tolist()
        east, north = (points.max(axis=0) + _MARGIN_M).tolist()
        traffic.show((west, south), (east, north))

    def look(self) -> None:
        """Update the colours of vehicles whose state has changed; once a step."""
        names, at_m = self._drive.odometers()
        here_m = dict(zip(names, at_m.tolist(), strict=True))
        state = {name: self._state(name, metres) for name, metres in here_m.items()}
        self._at_m = here_m
        self._drove_s = {name: self._drove_s[name] for name in names}
        self._painted = {name: self._painted[name] for name in names if name in self._painted}
        changed = [name for name, shown in state.items() if self._painted.get(name) != shown]
        on_road = set(self._traffic.vehicles()) if changed else set()
        for name in changed:
            if name in on_road:
                self._traffic.paint(name, COLOURS[state[name]])
                self._painted[name] = state[name]

    def _state(self, name: str, at_m: float) -> int:
        now_s, moved_m = self._traffic.now_s, at_m - self._at_m.get(name, at_m)
        since_s = self._drove_s.setdefault(name, now_s)
        if moved_m >= STANDING_MPS * self._traffic.step_s:
            self._drove_s[name] = now_s
            return _DRIVES
        if now_s - since_s >= _JAM_S:
            return _JAM
        return _STANDS if self._drive.refused(name) is None else _HELD
