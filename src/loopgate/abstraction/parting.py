"""Finds where movements out of one lane part: up to there, vehicles on them follow each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from loopgate.network.road import Connection, RoadNetwork

_APART_M = 2.5
"""Of two vehicles that leave a lane by different movements, SUMO counts the first as a vehicle ahead of the
second while its rear is where the movements are nearer to each other than this [m]."""

_EVERY_M = 0.25
"""Distance between the points at which two movements are compared [m]."""


class Partings:
    """Finds where two movements out of one lane part, once for each pair.

    Parameters
    ----------
    network
        Its movements lead over lanes inside junctions.
    """

    def __init__(self, network: RoadNetwork) -> None:
        self._network = network
        self._over = {c.via[0]: c for c in network.connections if c.via}
        self._known: dict[tuple[str, str], float] = {}

    def parted_m(self, one: str, other: str) -> float:
        """Return how far behind the end of their common lane two movements part [m].

        They may come nearer again farther on: a leader that turns back crosses its follower's way. If they
        part nowhere in the junction, it is the length of the shorter movement. Where both lead over points at
        which vehicles wait inside, SUMO lets them follow each other up to there only.

        `one`, `other`: the first lanes of the movements inside the junction; if one is no such lane, 0 is
        returned.
        """
        key = (min(one, other), max(one, other))
        if key not in self._known:
            ways = [self._over[lane] for lane in key if lane in self._over]
            self._known[key] = self._parted_m(ways) if len(ways) > 1 else 0.0
        return self._known[key]

    def _parted_m(self, ways: Sequence[Connection]) -> float:
        lines = [self._drawn(way) for way in ways]
        lengths = [self._network.over_m(way) for way in ways]
        waits_m = [self._network.lanes[way.via[0]].length_m for way in ways if len(way.via) > 1]
        shares = [_first_apart(*some) for some in (lines, lines[::-1])]
        parted_m = max(share * length for share, length in zip(shares, lengths, strict=True))
        return min(parted_m, *lengths, *(waits_m if len(waits_m) == len(ways) else ()))

    def _drawn(self, way: Connection) -> shapely.LineString:
        return shapely.LineString([p for lane in way.via for p in self._network.lanes[lane].shape])


def _first_apart(line: shapely.LineString, other: shapely.LineString) -> float:
    """Return the share of a line up to the first point that is far from another line; 1 if none is."""
    count = max(1, round(line.length / _EVERY_M))
    shares = np.arange(count + 1) / count
    points = shapely.line_interpolate_point(line, shares, normalized=True)
    far = shapely.distance(points, other) >= _APART_M
    return float(shares[np.argmax(far)]) if far.any() else 1.0
