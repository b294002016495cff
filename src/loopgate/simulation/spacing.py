"""Even spacing of the vehicles on each loop: advice on speeds, for fleets driven by machine.

Without it vehicles bunch behind slow ones, and streets wait long for a bunch. Each vehicle is told to drive
slower while it is ahead of the middle between its neighbours, and faster while it is behind; so spacing
evens out without a timetable (Bartholdi and Eisenstein, "A self-coordinating bus route to resist bus
bunching", Transp. Res. B 46, 2012). It only steers speeds: who may move is decided as ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from loopgate.drive.engine import Engine
from loopgate.network import Loop, RoadNetwork, VehicleType
from loopgate.simulation.sumo_input import Start
from loopgate.traffic.base import Traffic

__all__ = ["SpeedAdvice", "advised_type", "lead"]

_EVERY_S = 5.0
_SLOWEST, _FASTEST = 0.8, 1.1
"""Shares of the speed limit; drivers of SUMO's own choice differ as much."""

_LEAST_CHANGE = 0.005


def advised_type(kind: VehicleType) -> VehicleType:
    """Return the type of vehicles that drive as fast as they are told, up to the fastest advice."""
    return replace(kind, attributes={**kind.attributes, "speedFactor": f"{_FASTEST}", "speedDev": "0"})


def lead(times_s: npt.NDArray[np.float64], lap_s: float) -> npt.NDArray[np.float64]:
    """Return how far each vehicle of a loop is ahead of the middle between its neighbours.

    Parameters
    ----------
    times_s
        Where each is, as time from the loop's beginning at the speeds allowed [s].
    lap_s
        Of a lap [s].

    Returns
    -------
    ndarray
        In units of even spacing: 0 in the middle, 1 where the one ahead is two spacings nearer than the one
        behind. All 0 for one vehicle alone.
    """
    count = len(times_s)
    if count == 1:
        return np.zeros(1)
    order = np.argsort(times_s % lap_s, kind="stable")
    places = (times_s % lap_s)[order]
    ahead = np.diff(places, append=places[0] + lap_s)
    found = np.empty(count)
    found[order] = (np.roll(ahead, 1) - ahead) / (2.0 * lap_s / count)
    return found


class SpeedAdvice:
    """Tells vehicles how fast to drive, every few seconds.

    Parameters
    ----------
    network, starts
        The roads, and the vehicles with their loops; in the engine's order.
    traffic, engine
        The running simulation.
    """

    def __init__(
        self, network: RoadNetwork, starts: Sequence[Start], traffic: Traffic, engine: Engine
    ) -> None:
        self._traffic, self._engine = traffic, engine
        self._next_s = 0.0
        self._told = np.full(len(starts), _FASTEST)
        members: dict[str, list[int]] = {}
        for number, start in enumerate(starts):
            members.setdefault(start.loop.id, []).append(number)
        self._loops = [_times(network, starts[robots[0]].loop) for robots in members.values()]
        self._members = list(members.values())

    def look(self) -> None:
        """Give advice if it is time; called after each step."""
        if self._traffic.now_s < self._next_s:
            return
        self._next_s = self._traffic.now_s + _EVERY_S
        drivers = self._engine.drivers
        for robots, (ends_m, ends_s) in zip(self._members, self._loops, strict=True):
            fronts = np.array([drivers[robot].front_m for robot in robots])
            early = lead(np.interp(fronts % ends_m[-1], ends_m, ends_s), float(ends_s[-1]))
            for robot, factor in zip(robots, np.clip(1.0 - early / 2.0, _SLOWEST, _FASTEST), strict=True):
                if abs(factor - self._told[robot]) > _LEAST_CHANGE:
                    self._told[robot] = factor
                    self._traffic.advise(drivers[robot].id, float(factor))


def _times(network: RoadNetwork, loop: Loop) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return arc lengths at the ends of a loop's lanes [m], and the times there at the speeds allowed [s]."""
    took = [span.length_m / network.lanes[span.lane_id].speed_mps for span in loop.spans]
    ends = [0.0, *(span.end_m for span in loop.spans)]
    return np.array(ends), np.concatenate(([0.0], np.cumsum(took)))
