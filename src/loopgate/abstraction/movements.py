"""Conflicts between movements over junctions: by geometry, and by SUMO's request matrix."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from loopgate.abstraction.places import Part
from loopgate.abstraction.swept import BETWEEN_M, Touches
from loopgate.abstraction.swept_paths import SweptPath
from loopgate.arrays import Floats, Ints
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork

REACH_M = 2.2
"""Centre lines nearer than this conflict [m]: cars are 1.8 m wide in SUMO, oncoming lanes lie 3.2 m apart."""

_SIDE_M = 0.4
"""The least distance that two vehicles keep between their sides [m]."""


def reach_m(widths_m: Iterable[float]) -> float:
    """Return the distance of centre lines below which vehicles of these widths conflict [m]."""
    return max(REACH_M, max(widths_m, default=0.0) + _SIDE_M)


Overlap = tuple[float, float]

_UNKNOWN = -1
"""Stands for an unknown movement: the path does not reach back to it."""


@dataclass(frozen=True, slots=True)
class Conflicts:
    """The conflicts among movements."""

    foes: Mapping[str, frozenset[str]]
    """By movement id, the movements in conflict with it. Symmetric."""
    overlaps: Mapping[str, Mapping[str, Overlap]]
    """By movement id, then foe: position of the front where it can first touch the foe, and position of the
    rear where it no longer can, from the beginning of the movement [m]. Negative positions are on the lane
    before. Missing where geometry does not show the conflict."""
    lengths_m: Mapping[str, float]
    speeds_mps: Mapping[str, float]
    """`lengths_m` and `speeds_mps`, by movement id: length, and lowest speed limit until the rear is past,
    with that of the next lane."""
    unlisted: tuple[tuple[str, str], ...]
    """Conflicts that the geometry shows and SUMO's request matrix does not list."""
    with_others: frozenset[tuple[str, str]] = frozenset()
    """Conflicts of a movement with the next one that exist only for vehicles from another movement: vehicles
    that take both follow each other."""


def find_conflicts(
    network: RoadNetwork,
    movements: Iterable[Connection],
    touches: Touches,
    places: Mapping[str, Part],
) -> Conflicts:
    """Find the conflicts among movements.

    A vehicle is under way on a movement from the end of the place before it until its rear is in the place
    after it; lanes too short to wait on and stretches belong to it. Two movements conflict if bodies on them
    touch, unless one only follows the other, and if they end on one lane. In the latter case they touch until
    the end, since the second vehicle must find the first ahead of it, not beside. A movement that bends back
    to its own beginning conflicts with itself.

    The junction's request matrix lists more conflicts, mostly of movements to neighbouring lanes of one edge,
    which never come near each other. Gated vehicles do not change lanes there, and SUMO's drivers stop only
    for vehicles that they could meet. In a network without internal lanes, all movements over a junction
    conflict.

    O(n log n) for n touches.

    Parameters
    ----------
    movements
        All movements that vehicles drive.
    places
        By lane, the beginning of its first place and the end of its last place; lanes without a place are
        missing.
    """
    by_id = {movement.id: movement for movement in movements}
    lengths = {m.id: network.over_m(m) for m in by_id.values()}
    foes: dict[str, set[str]] = {name: set() for name in by_id}
    overlaps: dict[str, dict[str, Overlap]] = {name: {} for name in by_id}
    pairs = list(_pairs(network, by_id.values()))
    known = {frozenset(pair.ids) for pair in pairs if pair.listed or pair.certain}
    for pair in pairs:
        if pair.certain:
            _add(foes, *pair.ids)
    unlisted: set[tuple[str, str]] = set()
    with_others: set[tuple[str, str]] = set()
    for one, other, begin, end, follows in _shared(_UnderWay(network, by_id.values(), places), touches):
        _add(foes, one, other)
        if by_id[one].to_id == by_id[other].from_id and not follows and one != other:
            with_others.add((one, other))
        if one != other and frozenset((one, other)) not in known:
            unlisted.add((one, other))
        line_m, clear_m = _between_places(network, by_id[one], lengths[one], places)
        joins = one != other and _same_end(by_id[one], by_id[other])
        far_m = max(end + BETWEEN_M, lengths[one] if joins else -math.inf)
        overlaps[one][other] = max(begin - BETWEEN_M, line_m), min(far_m, clear_m)
    return Conflicts(
        foes={name: frozenset(found) for name, found in foes.items()},
        overlaps=overlaps,
        lengths_m=lengths,
        speeds_mps={
            m.id: min(network.lanes[lane].speed_mps for lane in (*m.via, m.to_id)) for m in by_id.values()
        },
        unlisted=tuple(sorted(unlisted)),
        with_others=frozenset(with_others),
    )


def _between_places(
    network: RoadNetwork, movement: Connection, length_m: float, places: Mapping[str, Part]
) -> tuple[float, float]:
    """Return where a front leaves the place before a movement, and a rear enters the place after it [m].

    A vehicle that waits in a place is not in the way, however near a touch is, since fronts are checked at
    intervals.
    """
    before, behind = movement.from_id, movement.to_id
    line_m = places[before].end_m - network.lanes[before].length_m if before in places else -math.inf
    return line_m, length_m + places[behind].begin_m if behind in places else math.inf


def _shared(under_way: _UnderWay, touches: Touches) -> Iterator[tuple[str, str, float, float, bool]]:
    """Yield for each movement and foe the positions between which they touch, in both orders.

    The last item tells whether vehicles on the foe may touch a vehicle that has come by the same movement.
    """
    t = touches
    mine = under_way.rows(t.paths, t.one, t.one_at_m, t.one_length_m, t.one_touched_m)
    theirs = under_way.rows(t.paths, t.other, t.other_at_m, t.other_length_m, t.other_touched_m)
    met = mine.merge(theirs, on="touch")
    orders = (("x", "y"), ("y", "x"))
    columns = [[f"movement_{a}", f"movement_{b}", f"at_{a}", f"rear_{a}", f"by_{b}"] for a, b in orders]
    names = ["one", "other", "at", "rear", "by"]
    both = pd.concat(met[some].set_axis(names, axis=1) for some in columns)
    both["follows"] = (both["by"] == both["one"]) | (both["by"] == _UNKNOWN)
    found = both.groupby(["one", "other"]).agg(
        begin=("at", "min"), end=("rear", "max"), follows=("follows", "any")
    )
    for one, other, begin, end, follows in found.reset_index().itertuples(index=False):
        yield under_way.names[one], under_way.names[other], float(begin), float(end), bool(follows)


class _UnderWay:
    """Finds the movement that a vehicle is on, from its path and the position of its front."""

    def __init__(
        self, network: RoadNetwork, movements: Iterable[Connection], places: Mapping[str, Part]
    ) -> None:
        self.names: list[str] = []
        self._network = network
        self._places = places
        self._inside: dict[str, tuple[int, float]] = {}
        self._between: dict[tuple[str, str], int] = {}
        self._out_of: dict[str, list[int]] = {}
        self._begins: list[str] = []
        self._length_m: list[float] = []
        self._at = self._length = self._touched = np.empty(0)
        """Positions, lengths and touched points of the bodies that `rows` handles."""
        for number, movement in enumerate(movements):
            self.names.append(movement.id)
            self._begins.append(movement.from_id)
            driven = 0.0
            for lane in movement.via:
                self._inside[lane] = number, driven
                driven += network.lanes[lane].length_m
            self._length_m.append(driven)
            self._between[movement.from_id, movement.to_id] = number
            self._out_of.setdefault(movement.from_id, []).append(number)

    def rows(
        self, paths: Sequence[SweptPath], path: Ints, at_m: Floats, length_m: Floats, touched_m: Floats
    ) -> pd.DataFrame:
        """Return for each touch the movement, positions of front and rear on it [m], and the movement before.

        `path`, `at_m`, `length_m`, `touched_m`: for each touch, the index of the path, position of the front
        on its lane, length of the body, and its touched point [m].
        """
        order = np.argsort(path, kind="stable")
        firsts = np.flatnonzero(np.diff(path[order], prepend=-1))
        self._at, self._length, self._touched = at_m, length_m, touched_m
        parts = [
            (
                np.full(len(here), movement),
                here,
                at_m[here] + add,
                np.full(len(here), self._came_by(paths[path[touches[0]]], movement)),
            )
            for touches in np.split(order, firsts[1:])
            if len(touches)
            for movement, add, here in self._of(paths[path[touches[0]]], touches)
        ]
        movement, touch, at, by = (
            (np.concatenate(column) for column in zip(*parts, strict=True))
            if parts
            else np.empty((4, 0), int)
        )
        rear = at - length_m[touch]
        return pd.DataFrame({"touch": touch, "movement": movement, "at": at, "rear": rear, "by": by})

    def _came_by(self, path: SweptPath, movement: int) -> int:
        """Return the index of the movement before the given one on a path, or `_UNKNOWN`."""
        lanes = (path.lane, *path.before)
        if self._begins[movement] not in lanes[:-1]:
            return _UNKNOWN
        before = lanes[lanes.index(self._begins[movement]) + 1]
        return self._inside[before][0] if before in self._inside else _UNKNOWN

    def _of(self, path: SweptPath, rows: Ints) -> Iterator[tuple[int, float, Ints]]:
        """Yield movements, offsets of positions [m], and the touches on each movement.

        A body can lie on several movements; it belongs to the movement on which it is touched.
        """
        lanes = (path.lane, *path.before)
        begin_m, above = 0.0, self._touched[rows] >= 0.0
        for number, lane in enumerate(lanes):
            if number:
                begin_m -= self._network.lanes[lane].length_m
                above = self._touched[rows] >= begin_m
            last = number + 1 == len(lanes) or self._is_place(lanes[number + 1])
            here = rows if last else rows[above]
            if len(here):
                yield from self._on(lanes[number:], begin_m, here)
            if last:
                return
            rows = rows[~above]

    def _is_place(self, lane: str) -> bool:
        return lane in self._places

    def _on(self, lanes: Sequence[str], begin_m: float, rows: Ints) -> Iterator[tuple[int, float, Ints]]:
        """Yield as `_of` does, for bodies touched on the first of `lanes`, which begins at `begin_m`."""
        lane = lanes[0]
        inside = self._inside.get(lane)
        if inside is not None:
            yield inside[0], inside[1] - begin_m, rows
            return
        place = self._places.get(lane)
        behind = next((name for name in lanes[1:] if not self._network.lanes[name].internal), None)
        into = None if behind is None else self._between.get((behind, lane))
        at_m = self._at[rows] - begin_m
        if into is not None:
            entering = rows if place is None else rows[at_m <= place.begin_m + self._length[rows]]
            yield into, self._length_m[into] - begin_m, entering
            if place is None:
                return  # all of a lane without a place belongs to the movement onto it
        leaving = rows if place is None else rows[at_m > place.end_m]
        for movement in self._out_of.get(lane, ()):
            yield movement, -begin_m - self._network.lanes[lane].length_m, leaving


class _Pair(NamedTuple):
    """Two movements that may meet: whether the junction's matrix lists them; whether they surely conflict."""

    ids: tuple[str, str]
    listed: bool
    certain: bool


def _pairs(network: RoadNetwork, movements: Iterable[Connection]) -> Iterator[_Pair]:
    at: dict[str, list[Connection]] = {}
    for movement in movements:
        at.setdefault(movement.junction, []).append(movement)
    for together in at.values():
        for one, other in combinations(together, 2):
            if _may_meet(one, other):
                listed = network.are_foes(one, other) or network.are_foes(other, one)
                # Networks without internal lanes have no geometry and often no matrix: be safe.
                certain = _same_end(one, other) or not one.via or not other.via
                yield _Pair((one.id, other.id), listed, certain)


def _add(foes: Mapping[str, set[str]], one: str, other: str) -> None:
    foes[one].add(other)
    foes[other].add(one)


def _may_meet(one: Connection, other: Connection) -> bool:
    same_origin = one.from_edge == other.from_edge and one.from_lane == other.from_lane
    return one.junction == other.junction and not same_origin


def _same_end(one: Connection, other: Connection) -> bool:
    return one.to_edge == other.to_edge and one.to_lane == other.to_lane
