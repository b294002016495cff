"""Bridges in networks without heights: roads that cross where no junction is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final

import numpy as np
import shapely
from numpy.typing import NDArray

from loopgate.arrays import Flags, Floats
from loopgate.network.road import Connection, Lane, RoadNetwork

NEAR_M: Final = 10.0
"""Bodies on the two roads touch up to this far from where the centre lines cross [m]."""

_AROUND_M: Final = 30.0
"""How far along the two roads they must not meet at a junction [m]; more than a body reaches."""

_STEEP: Final = 0.5
"""Sine of the smallest angle at which roads cross; lanes that cross at less are drawn over each other."""

_ASIDE_M: Final = 2.0
"""The direction of a lane is taken over this length before and behind a point [m]."""


StrArray = NDArray[np.str_]


@dataclass(frozen=True, slots=True)
class Bridge:
    """A point where one road leads over another.

    `x_m`, `y_m`: the point [m]. `one`, `other`: the driven lanes of the two roads near it, those inside
    junctions too.
    """

    x_m: float
    y_m: float
    one: tuple[str, ...]
    other: tuple[str, ...]

    def parts(self, lanes: StrArray, others: StrArray, x_m: Floats, y_m: Floats) -> Flags:
        """Return which pairs of bodies the bridge keeps apart, all as arrays of one length.

        `lanes`, `others`: the lanes of their fronts. `x_m`, `y_m`: the points where they touch [m].
        """
        found = np.hypot(x_m - self.x_m, y_m - self.y_m) <= NEAR_M
        mine, theirs = lanes[found], others[found]
        upon = np.isin(mine, self.one) & np.isin(theirs, self.other)
        found[found] = upon | (np.isin(mine, self.other) & np.isin(theirs, self.one))
        return found


def find_bridges(network: RoadNetwork, lanes: Iterable[str]) -> tuple[Bridge, ...]:
    """Find where lanes outside junctions lead over each other.

    Where roads meet on the ground, a network of SUMO has a junction: beyond junctions SUMO lets vehicles on
    different edges pass through each other. So two lanes that cross, and meet at no junction near there, lie
    one above the other. Lanes with heights are left out, and lanes that cross at a small angle.

    O(n log n) for n lanes of which few cross.
    """
    driven = set(lanes)
    known = (network.lanes[name] for name in sorted(driven))
    roads = [one for one in known if not (one.internal or one.heights) and len(one.shape) > 1]
    if not roads:
        return ()
    lines = np.array([shapely.LineString(road.shape) for road in roads], dtype=np.object_)
    pairs = shapely.STRtree(lines).query(lines, predicate="crosses")
    onto: dict[str, list[Connection]] = {}
    for connection in network.connections if pairs.size else ():
        onto.setdefault(connection.to_edge, []).append(connection)
    found = []
    for a, b in sorted(zip(*pairs.tolist(), strict=True)):
        if a > b or roads[a].edge == roads[b].edge:
            continue
        for point in shapely.get_parts(shapely.intersection(lines[a], lines[b])):
            if point.geom_type != "Point" or not _steep(lines[a], lines[b], point):
                continue
            sides = [
                _around(network, onto, roads[k], shapely.line_locate_point(lines[k], point, normalized=True))
                for k in (a, b)
            ]
            if sides[0][1].isdisjoint(sides[1][1]):
                one, other = (tuple(sorted(side[0] & driven)) for side in sides)
                found.append(Bridge(float(point.x), float(point.y), one, other))
    return tuple(found)


def _steep(one: Any, other: Any, point: Any) -> bool:  # noqa: ANN401  shapely has no types
    """Return whether two lines cross at a point at more than the smallest angle."""
    ahead = []
    for line in (one, other):
        at_m = shapely.line_locate_point(line, point)
        ends = shapely.line_interpolate_point(line, [max(0.0, at_m - _ASIDE_M), at_m + _ASIDE_M])
        x, y = np.diff(shapely.get_coordinates(ends), axis=0)[0]
        ahead.append((x / np.hypot(x, y), y / np.hypot(x, y)))
    (ax, ay), (bx, by) = ahead
    return bool(abs(ax * by - ay * bx) >= _STEEP)


def _around(
    network: RoadNetwork, onto: Mapping[str, list[Connection]], lane: Lane, share: float
) -> tuple[set[str], set[str]]:
    """Return the lanes of a road, and its junctions, up to `_AROUND_M` from a point before and behind.

    `onto`: the movements onto each edge. `share`: where the point is on the lane, as a share of its length.
    """
    edges, movements, junctions = {lane.edge}, set[Connection](), set[str]()
    for forward in (True, False):
        left_m = {lane.edge: _AROUND_M - lane.length_m * (1.0 - share if forward else share)}
        todo = [lane.edge]
        while todo:
            edge = todo.pop()
            if left_m[edge] <= 0.0:
                continue
            here = network.edges[edge]
            junctions.add(here.to_junction if forward else here.from_junction)
            for c in network.outgoing(edge) if forward else onto.get(edge, ()):
                movements.add(c)
                after = c.to_edge if forward else c.from_edge
                edges.add(after)
                over_m = network.over_m(c) + network.edges[after].length_m
                if left_m[edge] - over_m > left_m.get(after, -np.inf):
                    left_m[after] = left_m[edge] - over_m
                    todo.append(after)
    inside = chain.from_iterable(c.via for c in movements)
    return {*inside, *(one.id for edge in edges for one in network.edges[edge].lanes)}, junctions
