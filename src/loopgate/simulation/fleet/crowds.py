"""Whether the roads on a way are so full that one more vehicle reduces the traffic."""

from typing import Any, cast

import numpy as np

from loopgate.abstraction.track import Track
from loopgate.arrays import Floats, Ints
from loopgate.drive.changing import ChangingEngine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.network import RoadNetwork

_TAKEN = 0.2
"""Share of the slots on a way from which on one more may make less traffic: with three times as many trips as
a grid of one-lane roads can take, most arrive in an hour where a fifth is taken; 3 % fewer where 0.15 or 0.25
is, 18 % fewer where a fifth of all slots in the network is looked at instead."""

_LOST = 0.09
"""And share of the slots on it that those who are slower than allowed lose together, each as much as it is
slower, who stands all of its slot: a dense stream that rolls is no crowd. With a share of 0.07 vehicles that
follow one another every three seconds wait to set out, with 0.11 trips on the grid take 5 % longer in all."""


class Crowds:
    """Tells of ways whether they are crowded now."""

    def __init__(self, network: RoadNetwork) -> None:
        self._network = network
        self._ways: dict[tuple[str, int], tuple[Ints, Floats]] = {}
        self._now_s = -1.0
        self._on: Floats = np.empty(0)
        self._speed_mps: Floats = np.empty(0)

    def hinder(self, track: Track, engine: ChangingEngine, now_s: float) -> bool:
        """Return whether too many slots are taken, and too much time is lost, on the way of a vehicle.

        Never where the network has lights that are obeyed: vehicles queue at red, and are no crowd.

        O(places on the way), and O(vehicles) once a step.
        """
        if engine.keeper.signals:
            return False
        places, limits_mps = self._way(track, engine.keeper)
        states = cast("Any", engine.tables.states)
        room = states["room"][places].sum()
        if states["queue"][places].sum() <= _TAKEN * room:
            return False
        if now_s != self._now_s:
            self._now_s = now_s
            self._count(engine)
        lost = np.maximum(0.0, self._on[places] - self._speed_mps[places] / limits_mps)
        return bool(lost.sum() > _LOST * room)

    def _way(self, track: Track, keeper: Gatekeeper) -> tuple[Ints, Floats]:
        """Return the places on the way of a vehicle, by number, and the speed limits there [m/s]."""
        key = track.loop, track.start_position
        way = self._ways.get(key)
        if way is None:
            limits: dict[int, float] = {}
            for leg in track.legs[track.start_position :]:
                number = None if leg.away else keeper.number(leg.state)
                if number is not None:
                    limits[number] = self._network.edges[leg.line.edge].lanes[leg.line.lane].speed_mps
            way = self._ways[key] = np.array([*limits], dtype=np.int64), np.array([*limits.values()])
        return way

    def _count(self, engine: ChangingEngine) -> None:
        """Count the vehicles in each state by their last grant, and sum their speeds."""
        v, legs = engine.vehicles, cast("Any", engine.tables.legs)
        number = len(engine.tables.states)
        self._on, self._speed_mps = np.zeros(number), np.zeros(number)
        states = legs["state"][v["leg_at"] + v["granted"] % v["legs"]]
        np.add.at(self._on, states, 1.0)
        np.add.at(self._speed_mps, states, v["speed"])
