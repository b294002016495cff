"""The lanes on which bodies lie: each lane of a loop with the lanes behind it, once for all loops."""

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from loopgate.arrays import Floats
from loopgate.network.loop import Loop, arc_lengths
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import VehicleType

_LOOK_BACK_M = 30.0
"""How far behind the longest body two paths are compared, to see whether they come from one lane [m]."""

_MOST_LENGTHS = 4
"""Most vehicle lengths that are checked."""


@dataclass(frozen=True, slots=True)
class SweptPath:
    """A lane with the lanes behind it on which a vehicle's body can lie."""

    lane: str
    """The lane of the front."""
    before: tuple[str, ...]
    """The lanes before it, nearest first, as far as the longest body and a close follower reach; none where
    vehicles have changed to this lane."""


@dataclass(slots=True)
class Bodies:
    """The bodies to check on a path: length [m] and whether it has joints, with the largest width [m].

    `arrive`: whether some vehicles arrive on its lane and go no further.
    """

    widths_m: dict[tuple[float, bool], float]
    arrive: bool = False


SweptPaths = dict[SweptPath, Bodies]


def sizes_of(kinds: Iterable[VehicleType]) -> tuple[float, ...]:
    """Return the lengths of bodies to check, ascending [m]: all, or a selection if they are many."""
    every = sorted({kind.length_m for kind in kinds})
    few = min(len(every), _MOST_LENGTHS)
    return tuple(every[round(k * (len(every) - 1) / max(1, few - 1))] for k in range(few))


def swept_paths_of(network: RoadNetwork, users: Sequence[tuple[Loop, VehicleType]]) -> SweptPaths:
    """Return the swept paths of all vehicles on loops. O(spans).

    A vehicle whose length is not checked counts as the next longer one, and as the next shorter one.
    """
    sizes = sizes_of(kind for _, kind in users)
    found: SweptPaths = {}
    for loop, kinds in _kinds(users):
        widths: dict[tuple[float, bool], float] = {}
        for kind in kinds:
            size = bisect_left(sizes, kind.length_m)
            for length in {sizes[size], sizes[size if sizes[size] == kind.length_m else size - 1]}:
                body = (length, kind.jointed)
                widths[body] = max(widths.get(body, 0.0), kind.width_m)
        for path in _along(network, loop, max(widths)[0]):
            bodies = found.setdefault(path, Bodies({}))
            for body, width_m in widths.items():
                bodies.widths_m[body] = max(bodies.widths_m.get(body, 0.0), width_m)
        bodies.arrive |= not loop.closed
    return found


def drawn(network: RoadNetwork, path: SweptPath) -> tuple[Floats, Floats, Floats, list[float]]:
    """Return the lanes of a path as one line in driving direction.

    The parts are its points, shape (n, 2); their positions on the front's lane, negative on the lanes before;
    their heights; and where the lanes begin, the front's lane first [m].
    """
    points, arcs, heights, begins = [], [], [], [0.0]
    for number, name in enumerate((path.lane, *path.before)):
        lane = network.lanes[name]
        if number:
            begins.append(begins[-1] - lane.length_m)
        shape = np.asarray(lane.shape, dtype=np.float64)
        points.append(shape)
        arcs.append(arc_lengths(shape, begins[-1], begins[-1] + lane.length_m))
        heights.append(np.asarray(lane.heights or np.zeros(len(shape)), dtype=np.float64))
    return np.concatenate(points[::-1]), np.concatenate(arcs[::-1]), np.concatenate(heights[::-1]), begins


def _kinds(users: Sequence[tuple[Loop, VehicleType]]) -> Iterator[tuple[Loop, list[VehicleType]]]:
    loops = {loop.id: loop for loop, _ in users}
    kinds: dict[str, dict[VehicleType, None]] = {name: {} for name in loops}
    for loop, kind in users:
        kinds[loop.id][kind] = None
    for name, loop in loops.items():
        yield loop, list(kinds[name])


def _along(network: RoadNetwork, loop: Loop, reach_m: float) -> Iterator[SweptPath]:
    lanes: list[tuple[str, bool]] = []  # lane, and whether vehicles change to it
    for span in loop.spans:
        if not span.internal and span.lane_in != span.lane:
            lanes.append((f"{span.edge}_{span.lane_in}", False))
            lanes.append((span.lane_id, True))
        else:
            lanes.append((span.lane_id, False))
    for number, (lane, changed) in enumerate(lanes):
        before: list[str] = []
        left_m = 0.0 if changed else reach_m + _LOOK_BACK_M
        back = number - 1
        first = number - len(lanes) + 1 if loop.closed else 0
        while (left_m > 0.0 or (before and before[-1].startswith(":"))) and back >= first:
            name, here_changed = lanes[back]
            before.append(name)
            left_m -= network.lanes[name].length_m
            if here_changed:
                break
            back -= 1
        yield SweptPath(lane, tuple(before))
