"""Finds where vehicles on different paths would touch, from the ground that their bodies sweep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from loopgate.abstraction.parting import Partings
from loopgate.abstraction.rectangles import Overlaps, find_overlaps
from loopgate.abstraction.swept_paths import Bodies, SweptPath, SweptPaths, drawn
from loopgate.arrays import Flags, Floats, Ints
from loopgate.cache import Cache
from loopgate.network.bridges import find_bridges
from loopgate.network.road import RoadNetwork

SIDE_M = 0.2
"""Margin on either side of a body [m]: two bodies keep twice this distance."""

END_M = 0.25
"""Margin before and behind a body [m], since bodies are checked at intervals along their path."""

_EVERY_M = 1.0
"""Distance between fronts at which bodies are checked [m]; half of it near the ends of lanes."""

BETWEEN_M = _EVERY_M / 4
"""Half of the distance between checked fronts near the ends of lanes [m]."""

_ENDS_M = 15.0
"""Near the ends of a lane, up to this distance, bodies are checked at the shorter interval [m]."""

_FOLLOWS_M = 4.0
"""A vehicle this near behind another on one path follows it, and keeps its own gap [m]."""


@dataclass(frozen=True)
class Touches:
    """All touches as columns: indices of the paths, positions of the fronts [m], lengths of the vehicles [m].

    The touched point of a body is also a position on the lane of its front, negative on the lanes before.
    Each touch is listed once. Bodies that only follow one another do not touch.
    """

    paths: tuple[SweptPath, ...]
    one: Ints
    other: Ints
    one_at_m: Floats
    other_at_m: Floats
    one_length_m: Floats
    other_length_m: Floats
    one_touched_m: Floats
    other_touched_m: Floats


class _Rows(NamedTuple):
    """Bodies, or parts of bodies, as columns.

    `at_m`, `middle_m`: positions of the whole body's front and of the part's centre on the front's lane [m].
    `length_m`: length of the whole body [m]. The other columns describe the part: centre, direction, half of
    its length and width, and height [m].
    """

    at_m: Floats
    middle_m: Floats
    length_m: Floats
    x: Floats
    y: Floats
    ahead_x: Floats
    ahead_y: Floats
    half_m: Floats
    wide_m: Floats
    z: Floats


_Laid = dict[tuple[SweptPath, tuple[tuple[tuple[float, bool], float], ...]], _Rows]
"""Bodies by path, with lengths, joints and widths."""


def find_touches(network: RoadNetwork, paths: SweptPaths) -> Touches:
    """Find all pairs of positions at which the bodies of two vehicles touch, unless one follows the other.

    A body is a rectangle from its front to its rear on its path, as SUMO draws it, with a margin. A jointed
    body is one rectangle for each lane on which it lies. Left out are bodies on one lane or on lanes of one
    edge, bodies that follow each other closely on one path, and bodies that leave one lane one after the
    other: SUMO keeps these apart. A bridge does not touch the road below: heights tell it where the network
    has them, otherwise `find_bridges` does.

    O(n log n + k) for n bodies, one for each metre of all paths, and k pairs of near bodies.
    """
    none, zero = np.zeros(0, dtype=np.int64), np.zeros(0)
    if not paths:
        return Touches((), none, none, *[zero] * 6)
    ways = _Ways(network, paths)
    laid, overlaps = _overlaps(network, paths, ways)
    body = _Rows(*(np.concatenate(columns) for columns in zip(*laid.values(), strict=True)))
    path = np.repeat(np.arange(len(laid)), np.diff(overlaps.begins))
    a, b = overlaps.one, overlaps.other
    keep = ~ways.follow(path[a], path[b], body, a, b)
    a, b = a[keep], b[keep]
    touched = _touched(body, a, b), _touched(body, b, a)
    names = np.array([one.lane for one in paths])
    ahead_m = touched[0] - body.middle_m[a]
    x, y = body.x[a] + body.ahead_x[a] * ahead_m, body.y[a] + body.ahead_y[a] * ahead_m
    ground = np.ones(len(a), dtype=bool)
    for bridge in find_bridges(network, names.tolist()):
        ground &= ~bridge.parts(names[path[a]], names[path[b]], x, y)
    a, b, touched = a[ground], b[ground], (touched[0][ground], touched[1][ground])
    at, length = body.at_m, body.length_m
    return Touches(tuple(paths), path[a], path[b], at[a], at[b], length[a], length[b], *touched)


_MOST_KEPT = 4_000_000
"""More overlaps than this are not kept, to save memory."""

_LAST: Cache[list[tuple[_Laid, Overlaps]]] = Cache(2)
"""For each network, the bodies and overlaps of the last call, in a list with at most one item."""


def _overlaps(network: RoadNetwork, paths: SweptPaths, ways: _Ways) -> tuple[_Laid, Overlaps]:
    """Return the bodies of each path, and the pairs of all bodies that overlap.

    If most paths were checked in the last call, only the other paths are compared with all. This is so when
    vehicles of an owner's simulation join one after the other.
    """
    kept: list[tuple[_Laid, Overlaps]] = _LAST.get(network.content, list) if network.content else []
    before, known = (*kept, ({}, None))[0]
    keys = {(path, tuple(sorted(bodies.widths_m.items()))): bodies for path, bodies in paths.items()}
    laid = {key: before[key] if key in before else _lay(network, key[0], keys[key]) for key in keys}
    if 2 * len(before.keys() & laid.keys()) < len(laid):
        known = None
    groups = [np.column_stack(rows[3:]) for rows in laid.values()]
    overlaps = find_overlaps(tuple(laid), groups, ways.lane, ways.edge, known)
    kept[:] = [(laid, overlaps)] if len(overlaps.one) <= _MOST_KEPT else []
    return laid, overlaps


def _touched(body: _Rows, one: Ints, other: Ints) -> Floats:
    """Return where the first bodies of pairs are touched, as positions on the lanes of their fronts [m]."""
    x, y = body.x[other] - body.x[one], body.y[other] - body.y[one]
    along = x * body.ahead_x[one] + y * body.ahead_y[one]
    half = body.half_m[one] - END_M
    return np.asarray(body.middle_m[one] + np.clip(along, -half, half))


def _lay(network: RoadNetwork, path: SweptPath, bodies: Bodies) -> _Rows:
    """Return the bodies of a path, one for each front position and each length."""
    lane = network.lanes[path.lane]
    xy, arc, height, begins = drawn(network, path)
    fronts = _fronts(lane.length_m)
    # Without lanes inside junctions vehicles jump from lane to lane: they have no direction meanwhile.
    whole = bool(path.before) and (lane.internal or network.lanes[path.before[0]].internal)
    found = []
    for (length, jointed), width_m in sorted(bodies.widths_m.items()):
        at = fronts if whole else fronts[fronts >= length]
        rear = np.maximum(at - length, arc[0])
        joints = begins if jointed else []
        for first, last in _parts(at, rear, joints):
            known = first > last
            ahead_m, behind_m = first[known], last[known]
            front_x, front_y = np.interp(ahead_m, arc, xy[:, 0]), np.interp(ahead_m, arc, xy[:, 1])
            dx = front_x - np.interp(behind_m, arc, xy[:, 0])
            dy = front_y - np.interp(behind_m, arc, xy[:, 1])
            norm = np.hypot(dx, dy)
            straight = norm < 1e-6  # noqa: PLR2004  a lane that is drawn as one point has no direction
            dx = np.where(straight, 1.0, dx / np.maximum(norm, 1e-6))
            dy = np.where(straight, 0.0, dy / np.maximum(norm, 1e-6))
            size = norm if jointed else np.full(len(norm), length)
            found.append(
                _Rows(
                    at[known],
                    ahead_m - size / 2,
                    np.full(len(size), length),
                    front_x - dx * size / 2,
                    front_y - dy * size / 2,
                    dx,
                    dy,
                    size / 2 + END_M,
                    np.full(len(size), width_m / 2 + SIDE_M),
                    np.interp(ahead_m, arc, height),
                )
            )
    return _Rows(*(np.concatenate(columns) for columns in zip(*found, strict=True)))


def _parts(front: Floats, rear: Floats, joints: Sequence[float]) -> Iterator[tuple[Floats, Floats]]:
    """Yield where parts of bodies begin and end, from the front; some bodies have fewer parts.

    `joints`: where lanes begin, from the front's lane backwards; there SUMO bends a jointed vehicle.
    """
    ahead = front
    for joint in joints:
        behind = np.maximum(rear, joint)
        yield ahead, behind
        ahead = behind
    if not joints:
        yield front, rear


def _fronts(length_m: float) -> Floats:
    """Return positions on a lane [m], at shorter intervals near its ends."""
    finely = np.linspace(0.0, length_m, max(2, math.ceil(2 * length_m / _EVERY_M) + 1))
    middle = (finely > _ENDS_M) & (finely < length_m - _ENDS_M)
    middle[::2] = False
    return np.asarray(finely[~middle])


class _Ways:
    """Which vehicles follow each other, from the lanes that paths have in common."""

    def __init__(self, network: RoadNetwork, paths: SweptPaths) -> None:
        self._network, self._paths = network, tuple(paths)
        self._length_m = {lane: network.lanes[lane].length_m for c in paths for lane in (c.lane, *c.before)}
        lanes = {lane: number for number, lane in enumerate(self._length_m)}
        roads = {
            network.lanes[lane].edge: k for k, lane in enumerate(lanes) if not network.lanes[lane].internal
        }
        self.lane = np.array([lanes[c.lane] for c in paths], dtype=np.int64)
        self.edge = np.array([roads.get(network.lanes[c.lane].edge, -1) for c in paths], dtype=np.int64)
        self._partings = Partings(network)
        self._leads: dict[str, dict[str, float]] = {}
        """For each lane, the lanes ahead that every vehicle on it reaches, and how far ahead each begins [m].
        """
        for path in paths:
            ahead_m = 0.0
            for lane in path.before:
                ahead_m += self._length_m[lane]
                known = self._leads.setdefault(lane, {})
                known[path.lane] = min(ahead_m, known.get(path.lane, ahead_m))
        for lane, elsewhere in self._elsewhere(paths).items():
            for other in elsewhere:
                del self._leads[lane][other]

    def _elsewhere(self, paths: SweptPaths) -> dict[str, set[str]]:
        """Return for each lane the lanes ahead that some vehicles do not reach."""
        found: dict[str, set[str]] = {}
        for path, bodies in paths.items():
            passed = {path.lane, *path.before}
            ahead_m = 0.0
            for lane in path.before:
                ahead_m += self._length_m[lane]
                found.setdefault(lane, set()).update(
                    other
                    for other, at_m in self._leads[lane].items()
                    if other not in passed and (at_m <= ahead_m or bodies.arrive)
                )
        return found

    def follow(self, one: Ints, other: Ints, body: _Rows, a: Ints, b: Ints) -> Flags:
        """Return the pairs in which one body follows the other closely."""
        count = len(self._paths)
        pairs, number = np.unique(one * count + other, return_inverse=True)
        known = [divmod(int(pair), count) for pair in pairs]
        follows = np.zeros(len(a), dtype=bool)
        for relation in (self._along, self._split):
            rows = np.array([relation(*pair) for pair in known], dtype=np.float64).reshape(-1, 3)
            mine_m, theirs_m, common_m = rows[number.reshape(-1)].T
            # Fronts as metres behind a point that both pass; not a number where there is none.
            s, t = body.at_m[a] + mine_m, body.at_m[b] + theirs_m
            first = np.where(s >= t, a, b)
            gap = np.abs(s - t) - body.length_m[first]
            if relation == self._along:
                # Where ways join, one is followed only once all of it is on the common way.
                ordered = body.at_m[first] + common_m >= body.length_m[first]
            else:
                ordered = np.maximum(s, t) - body.length_m[first] <= common_m
            follows |= ordered & (gap < _FOLLOWS_M)
        return follows

    def _along(self, one: int, other: int) -> tuple[float, float, float]:
        """Return the offsets of both fronts' positions [m], and the length of the common path [m].

        One of the two paths leads onto the lane of the other.
        """
        mine, theirs = self._paths[one], self._paths[other]
        for metres, lane in self._behind(mine):
            if lane == theirs.lane:
                return metres, 0.0, math.inf
        for metres, lane in self._behind(theirs):
            if lane == mine.lane:
                return 0.0, metres, math.inf
        ahead = self._leads.get(mine.lane, {})
        if theirs.lane in ahead:
            return 0.0, ahead[theirs.lane], self._common_m(theirs, ahead)
        ahead = self._leads.get(theirs.lane, {})
        if mine.lane in ahead:
            return ahead[mine.lane], 0.0, self._common_m(mine, ahead)
        return math.nan, math.nan, 0.0

    def _split(self, one: int, other: int) -> tuple[float, float, float]:
        """Return the offsets of both fronts' positions [m], and where rears leave the common lane [m].

        The two paths come from one lane. A vehicle that leaves it follows the one before it until their
        movements part; bodies that touch farther on conflict. This holds only while both are inside the
        junction, and only where there is right of way: SUMO computes where lanes part together with the
        request matrix.
        """
        mine, theirs = self._paths[one], self._paths[other]
        behind = {lane: metres for metres, lane in self._behind(mine)}
        common = [(behind[c], metres, c) for metres, c in self._behind(theirs) if c in behind]
        if not common:
            return math.nan, math.nan, 0.0
        mine_m, theirs_m, lane = min(common, key=lambda one: one[0] + one[1])
        kept_m = min(self._inside_m(mine, lane), self._inside_m(theirs, lane))
        if lane not in (mine.lane, theirs.lane):
            parted_m = self._partings.parted_m(_after(mine, lane), _after(theirs, lane))
            kept_m = min(kept_m, parted_m + _EVERY_M)
            if not self._network.is_regulated(lane):
                kept_m = 0.0
        return mine_m, theirs_m, self._length_m[lane] + kept_m

    def _inside_m(self, path: SweptPath, lane: str) -> float:
        """Return how far a path leads through the junction after a lane [m]; infinite if it ends there."""
        lanes = list(reversed((path.lane, *path.before)))
        lanes = lanes[lanes.index(lane) + 1 :]
        for number, name in enumerate(lanes):
            if not name.startswith(":"):
                return sum(self._length_m[inside] for inside in lanes[:number])
        return math.inf

    def _common_m(self, path: SweptPath, ahead: Mapping[str, float]) -> float:
        """Return the length of the lanes behind the front's own that are also ahead of another lane [m]."""
        metres = 0.0
        for lane in path.before:
            if lane not in ahead:
                break
            metres += self._length_m[lane]
        return metres

    def _behind(self, path: SweptPath) -> Iterator[tuple[float, str]]:
        """Yield the lanes of a path, and how far each begins behind the beginning of the front's lane [m]."""
        yield 0.0, path.lane
        metres = 0.0
        for lane in path.before:
            metres += self._length_m[lane]
            yield metres, lane


def _after(path: SweptPath, lane: str) -> str:
    """Return the lane of a path that follows a lane behind its front."""
    lanes = (path.lane, *path.before)
    return lanes[lanes.index(lane) - 1]
