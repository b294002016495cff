"""Vehicles on covering loops: their numbers, their starts, and the time between two visits."""

import heapq
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from loopgate.errors import RouteError
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork


@dataclass(frozen=True, slots=True)
class Patrol:
    """Loops with evenly spaced vehicles, at the speed limits."""

    laps_s: tuple[float, ...]
    """Time of a lap on each loop [s]."""
    vehicles: tuple[int, ...]
    """Number of vehicles on each loop."""
    intervals_s: Mapping[str, float]
    """Mean time between two visits of each street on the loops [s]."""


def patrol(network: RoadNetwork, loops: Sequence[Loop], vehicles: Sequence[int]) -> Patrol:
    """Return lap times, and the mean time between visits of each street [s]; O(edges of the loops)."""
    laps = laps_s(network, loops)
    visits: dict[str, float] = {}
    for loop, lap, number in zip(loops, laps, vehicles, strict=True):
        for edge in loop.edges:
            visits[edge] = visits.get(edge, 0.0) + number / lap
    return Patrol(laps, tuple(vehicles), {edge: 1.0 / rate for edge, rate in visits.items() if rate > 0.0})


def laps_s(network: RoadNetwork, loops: Sequence[Loop]) -> tuple[float, ...]:
    """Return the time of a lap on each loop at the speed limits [s]."""
    return tuple(_times_s(network, loop)[-1] for loop in loops)


def _times_s(network: RoadNetwork, loop: Loop) -> list[float]:
    """Return the time at the end of each span [s]."""
    return list(accumulate(span.length_m / network.lanes[span.lane_id].speed_mps for span in loop.spans))


def allot(laps: Sequence[float], vehicles: int) -> tuple[int, ...]:
    """Distribute vehicles over loops so that the longest time between two vehicles is as short as possible.

    Each next vehicle goes to the loop with the longest such time; weights count as longer laps. O(n log n).

    Raises `RouteError` if there are fewer vehicles than loops.
    """
    if vehicles < len(laps):
        msg = f"{vehicles} vehicles are too few: each of the {len(laps)} loops needs one; take fewer loops"
        raise RouteError(msg)
    given = [1] * len(laps)
    queue = [(-lap, k) for k, lap in enumerate(laps)]
    heapq.heapify(queue)
    for _ in range(vehicles - len(laps)):
        _, k = queue[0]
        given[k] += 1
        heapq.heapreplace(queue, (-laps[k] / given[k], k))
    return tuple(given)


def vehicles_needed(laps: Sequence[float], revisit_s: float) -> tuple[int, ...]:
    """Return the number of evenly spaced vehicles that each loop needs for a time between visits."""
    return tuple(max(1, math.ceil(lap / revisit_s - 1e-9)) for lap in laps)


def even_starts_m(network: RoadNetwork, loop: Loop, vehicles: int) -> tuple[float, ...]:
    """Return arc lengths of fronts that are evenly spaced in time at the speed limits [m].

    A vehicle cannot start inside a junction; it then starts at the beginning of the lane after it.
    """
    times = np.array([0.0, *_times_s(network, loop)])
    ends = np.array([0.0, *(span.end_m for span in loop.spans)])
    at = np.interp(np.arange(vehicles) / vehicles * times[-1], times, ends)
    return tuple(loop.hold_after(float(arc)) % loop.length_m for arc in at)
