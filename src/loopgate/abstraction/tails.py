"""Finds how far the rear of a turning vehicle swings over the lane that it has left."""

import math
from collections.abc import Mapping

import numpy as np

from loopgate.abstraction.swept_paths import SweptPath, SweptPaths, drawn
from loopgate.arrays import Floats
from loopgate.network.road import RoadNetwork

_BEHIND_M = np.arange(0.0, 1.6, 0.25)
"""Rears are checked up to this far beyond the lane [m]; farther on they are out of the way."""

_TURNED_BEHIND_M = np.arange(0.0, 5.1, 0.25)
"""The same where the movement is shorter than a vehicle, as in a U-turn [m]."""

_BACK = -0.7
"""Cosine of the angle from which a turn leads back."""

_BESIDE_M = 0.1
"""Space on either side of a waiting vehicle [m]."""

_LEAST_M = 0.1
"""Stop lines are at least this far before the end of a lane [m]."""


def tails_over(network: RoadNetwork, paths: SweptPaths) -> Mapping[str, float]:
    """Return for each lane how far before its end [m] a vehicle that has left it can still reach over it.

    In SUMO, a vehicle that stops at the end of a lane keeps no gap to vehicles beyond it. So stop lines must
    be farther back where paths turn sharply. Lanes with the usual stop line are left out.
    """
    found: dict[str, float] = {}
    for path, bodies in paths.items():
        inside = network.lanes[path.lane].internal
        if not (path.before and (inside or _turns_round(network, path))):
            continue
        behind_m = _BEHIND_M if inside else _TURNED_BEHIND_M
        xy, arc, _, begins = drawn(network, path)
        last_m = network.lanes[path.lane].length_m
        half_m = bodies.width_m / 2
        stiff = np.array([length for length, jointed in bodies.looked_at_m() if not jointed])
        # Of a lane that comes twice, the nearer one.
        lanes = dict(reversed([*zip((path.lane, *path.before), begins, strict=True)]))
        for lane, begin_m in lanes.items():
            if network.lanes[lane].internal:
                continue
            end_m = begin_m + network.lanes[lane].length_m
            rear = np.repeat(end_m + behind_m, len(stiff))
            front = rear + np.tile(stiff, len(behind_m))
            on_it = (front >= 0.0) & (front <= last_m)
            swing = _swing_m(xy, arc, front[on_it], rear[on_it], end_m, half_m)
            if swing > max(found.get(lane, 0.0), _LEAST_M):
                found[lane] = swing
    return found


def _turns_round(network: RoadNetwork, path: SweptPath) -> bool:
    """Return whether the lane leads back beside the lane before it, over one junction."""
    lanes = [network.lanes[name] for name in path.before]
    roads = [lane for lane in lanes if not lane.internal]
    if not (lanes[0].internal and roads):
        return False
    (ax, ay), (bx, by) = network.lanes[path.lane].shape[:2]
    (cx, cy), (dx, dy) = roads[0].shape[-2:]
    along = (bx - ax) * (dx - cx) + (by - ay) * (dy - cy)
    return along < _BACK * math.hypot(bx - ax, by - ay) * math.hypot(dx - cx, dy - cy)


def _swing_m(xy: Floats, arc: Floats, front: Floats, rear: Floats, end_m: float, half_m: float) -> float:
    """Return how far before the end of a lane bodies swing over it [m]."""

    def at(metres: Floats) -> Floats:
        return np.stack([np.interp(metres, arc, xy[:, axis]) for axis in (0, 1)], axis=-1)

    end, before = at(np.array([end_m, end_m - 1.0]))
    along = (end - before) / max(np.hypot(*(end - before)), 1e-6)
    tail = at(rear)
    ahead = at(front) - tail
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-6)[:, None]
    side = half_m * np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
    corners = np.concatenate([tail + side, tail - side]) - end
    beside = np.abs(corners @ np.array([-along[1], along[0]]))
    return float(np.max(-(corners @ along), where=beside <= half_m + _BESIDE_M, initial=0.0))
