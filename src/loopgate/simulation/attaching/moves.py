"""Finds vehicles that the owner of a simulation has put somewhere else."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from math import inf

from loopgate.control.diary import Diary
from loopgate.network import RoadNetwork
from loopgate.traffic.base import Traffic

MOVED_M = 3.0
"""A vehicle farther than this from the position that its odometer gives has been moved [m]."""

_ROUNDING_M = 0.5
"""A vehicle that has driven farther than it can, by more than this, has been moved [m]."""


class Moves:
    """Finds vehicles that their owner has moved, by comparing SUMO's positions with the odometers.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    """

    def __init__(self, network: RoadNetwork, traffic: Traffic) -> None:
        self._network, self._traffic = network, traffic
        self._seen_s = traffic.now_s
        self._inside: defaultdict[str, list[tuple[str, str, float, float]]] = defaultdict(list)
        """For each lane inside a junction: the edges before and after it, the share of the way across that
        lies before it, and the share of one metre of it."""
        for connection in network.connections:
            over_m, before_m = network.over_m(connection), 0.0
            for lane in connection.via:
                share = 1.0 / over_m if over_m else 0.0
                way = connection.from_edge, connection.to_edge
                self._inside[lane].append((*way, before_m * share, share))
                before_m += network.lanes[lane].length_m

    def find(self, diaries: Iterable[Diary]) -> list[str]:
        """Return the vehicles that were moved since the last call."""
        now = self._traffic.now_s
        elapsed_s, self._seen_s = now - self._seen_s, now
        return [diary.vehicle.name for diary in diaries if self._is_moved(diary, elapsed_s)]

    def _is_moved(self, diary: Diary, elapsed_s: float) -> bool:
        lane, at_m = self._traffic.lane(diary.vehicle.name)
        front_m = self._traffic.odometer(diary.vehicle.name) + diary.vehicle.offset_m
        driven_m = front_m - diary.vehicle.front_m
        if driven_m > _ROUNDING_M and diary.halted_s < inf:
            return True  # it was held at its stop line, and cannot have driven
        if driven_m > _reach_m(diary, diary.vehicle.make.accel, elapsed_s):
            can = self._traffic.dynamics(diary.vehicle.name)  # the owner may have set it in this step
            if driven_m > _reach_m(diary, can.accel_mps2, elapsed_s):
                return True  # the odometer counts what SUMO's `moveToXY` does
        if lane.startswith(":"):
            return not self._has_come_into(diary, lane, at_m, front_m)
        edge = lane.rpartition("_")[0]
        if all(name != edge for _, name in diary.track.edges):
            return True
        return abs(diary.track.near(edge, at_m, front_m) - front_m) > MOVED_M

    def _has_come_into(self, diary: Diary, lane: str, at_m: float, front_m: float) -> bool:
        """Return whether a vehicle that is inside a junction is as far across it as it has driven."""
        edges, lap_m = diary.track.edges, diary.track.lap_m
        ways = self._inside.get(lane, ())
        for number, (begin_m, name) in enumerate(edges):
            until_m, onto = edges[(number + 1) % len(edges)]
            for before, behind, part, each_m in ways:
                if (before, behind) != (name, onto):
                    continue
                end_m = begin_m + self._network.edges[name].lanes[0].length_m
                across_m = (until_m - end_m) % lap_m
                off_m = front_m - (end_m + across_m * (part + each_m * at_m))
                if abs((off_m + lap_m / 2.0) % lap_m - lap_m / 2.0) <= MOVED_M:
                    return True
        return False


def _reach_m(diary: Diary, accel_mps2: float, elapsed_s: float) -> float:
    """Return the longest distance that a vehicle can have driven, from its speed before [m]."""
    return (diary.vehicle.speed + accel_mps2 * elapsed_s) * elapsed_s + _ROUNDING_M
