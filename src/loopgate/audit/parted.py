"""How far behind a lane vehicles on two drawn ways out of it follow each other."""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet

import numpy as np
import shapely

from loopgate.audit.drawn_bodies import LaneOnWay
from loopgate.audit.layout import Layout

_SEEN_M = 2.5
"""SUMO keeps a driver behind a vehicle that left the same lane another way while the rear of that vehicle is
where the two ways are nearer to each other than this [m]."""

_EVERY_M = 0.2
_GRAZE_M = 1.0
"""Corners of rectangles can touch a little beyond the point where the middle lines are far enough [m]."""


class Parted:
    """Finds up to where bodies on two ways out of a lane only follow each other.

    Parameters
    ----------
    names
        The names of the lanes, by number.
    roads
        The numbers of the lanes outside junctions.
    """

    def __init__(self, layout: Layout, names: Sequence[str], roads: AbstractSet[int]) -> None:
        self._layout, self._names, self._roads = layout, names, roads
        self._known: dict[tuple[tuple[int, ...], ...], float] = {}

    def behind_m(self, lane: int, one: LaneOnWay, other: LaneOnWay) -> float:
        """Return how far behind a lane the rear of the first is when the second no longer follows it [m].

        It has parted there; where the ways come nearer to each other again is farther on.
        """
        inside = self._inside(one, lane), self._inside(other, lane)
        if inside not in self._known:
            self._known[inside] = self._apart_from_m(inside, (one, other)) + _GRAZE_M
        return self._known[inside]

    def _inside(self, way: LaneOnWay, lane: int) -> tuple[int, ...]:
        """Return the lanes of a way inside the junction behind a lane."""
        ahead = sorted((at, other) for other, at in way.window.items() if at > way.window[lane])
        numbers = [number for _, number in ahead]
        last = next((k for k, number in enumerate(numbers) if number in self._roads), len(numbers))
        return tuple(numbers[:last])

    def _apart_from_m(self, inside: Sequence[tuple[int, ...]], ways: Sequence[LaneOnWay]) -> float:
        shapes = self._layout.shapes
        lines = [
            [point for number in lanes for point in shapes.get(self._names[number], ())] for lanes in inside
        ]
        if min(map(len, lines)) < 2:  # noqa: PLR2004  nothing is drawn there
            return 0.0
        drawn = [shapely.LineString(line) for line in lines]
        lengths = [sum(way.lengths[n] for n in lanes) for way, lanes in zip(ways, inside, strict=True)]
        found = []
        for mine, theirs, length_m in zip(drawn, reversed(drawn), lengths, strict=True):
            at = np.linspace(0.0, 1.0, 2 + int(length_m / _EVERY_M))
            gaps = shapely.distance(shapely.line_interpolate_point(mine, at, normalized=True), theirs)
            near = np.cumprod(gaps < _SEEN_M).astype(bool)
            found.append(float(at[near][-1]) * length_m if near.any() else 0.0)
        return min(max(found), *lengths)
