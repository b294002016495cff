"""Places where vehicles wait, movements over junctions, and the conflicts and stretches between them."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from loopgate.abstraction.itinerary import CLEARANCE_M, Overlap, PlaceRoom, SizedOverlaps
from loopgate.abstraction.swept import BETWEEN_M, Touches
from loopgate.abstraction.swept_paths import SweptPath
from loopgate.arrays import Floats, Ints
from loopgate.network.contacts import lane_contacts
from loopgate.network.loop import HOLD_MARGIN_M, Loop
from loopgate.network.road import Connection, Edge, RoadNetwork
from loopgate.network.vehicle_type import VehicleType

REACH_M = 2.2
"""Centre lines nearer than this conflict [m]: cars are 1.8 m wide in SUMO, oncoming lanes lie 3.2 m apart."""

_BACK_M = 2 * BETWEEN_M
"""Distance that a waiting body keeps from the last touched body [m]; bodies are checked at this interval."""

_FIRST_M = 7.0
"""Space before the stop line at the start [m]: a vehicle drives one step before it can be held."""

_SPREAD_M = 0.3
"""Extra space between standing vehicles at the start, beyond their gaps [m]."""

_ROUNDING = 1e-9


class FreePart(NamedTuple):
    """A part of a lane [m]."""

    begin_m: float
    end_m: float


def waiting_parts(
    network: RoadNetwork, touches: Touches, tails: Mapping[str, float]
) -> Mapping[str, FreePart]:
    """Find, for each lane with touches, the longest part in which no body touches another path.

    A body in a part has its rear beyond the part's beginning and its front before its end. Stop lines move
    back where other vehicles swing out over them. A vehicle counts as under way until its rear is beyond all
    passing vehicles. Lanes that are not named are free in full length.

    Parameters
    ----------
    touches
        The touches of all paths.
    tails
        For each lane, how far vehicles that turn off swing back over it, see `tails_over` [m].
    """
    touched: dict[str, list[tuple[float, float]]] = {lane: [] for lane in tails}
    on_roads = np.array([not network.lanes[course.lane].internal for course in touches.paths], dtype=bool)
    sides = (
        (touches.one, touches.one_at_m, touches.one_length_m),
        (touches.other, touches.other_at_m, touches.other_length_m),
    )
    for course, at_m, length_m in sides:
        here = on_roads[course] & (at_m >= length_m - _BACK_M)
        rows = pd.DataFrame({"course": course[here], "at": at_m[here], "length": length_m[here]})
        for number, at, length in rows.drop_duplicates().itertuples(index=False):
            touched.setdefault(touches.paths[number].lane, []).append((at, length))
    ends_m = {lane: network.lanes[lane].length_m - tails.get(lane, 0.0) for lane in touched}
    return {lane: _longest(ends_m[lane], fronts) for lane, fronts in touched.items()}


def _longest(length_m: float, fronts: Iterable[tuple[float, float]]) -> FreePart:
    """Return the longest part without touches.

    Each touched body has its front beyond the part, or its rear before it.
    """
    rows = sorted(fronts)
    best = FreePart(0.0, 0.0)
    begin = 0.0
    for number in range(len(rows) + 1):
        end = min(rows[number][0] - _BACK_M, length_m) if number < len(rows) else length_m
        if end - begin > best.end_m - best.begin_m:
            best = FreePart(begin, end)
        if number < len(rows):
            front, length = rows[number]
            begin = max(begin, front - length + _BACK_M)
    return best


@dataclass(frozen=True, slots=True)
class QueuePlace:
    """A place where vehicles queue: a lane, or the part before or behind a change stretch."""

    name: str
    """The lane's id; with ``/1`` for the part before a stretch, ``/2`` for the part behind it."""
    length_m: float
    needs: tuple[tuple[float, int], ...]
    """Lengths of its visitors with their gaps [m], and the largest number of each, longest first."""
    away: bool = False
    """Whether it stands for the end of an open route, where vehicles have arrived, and is not on the road."""
    stays_m: float = math.inf
    """What the longest of those visitors needs that come round again [m], where vehicles keep their extra
    metres; infinite elsewhere."""
    stretch: Stretch | None = None
    """The stretch before it, if vehicles may stand there while nobody changes lanes."""

    @property
    def needed_m(self) -> float:
        """Length that the longest visitor takes in the queue [m]: its length and its gap."""
        return self.needs[0][0]

    @property
    def room(self) -> PlaceRoom | None:
        """The place as a room, with slots as long as most of its visitors need.

        None if all need the same, and there is no stretch before it.
        """
        if self.away or (len(self.needs) == 1 and self.stretch is None):
            return None
        half = sum(count for _, count in self.needs) / 2
        shorter = accumulate((count for _, count in reversed(self.needs)))
        needs_m = (need_m for need_m, _ in reversed(self.needs))
        slot_m = next(need_m for need_m, count in zip(needs_m, shorter, strict=True) if count >= half)
        length_m = self.length_m - HOLD_MARGIN_M - CLEARANCE_M
        two_fit = self._fitting >= LEAST_CAPACITY
        most_kept_m = math.inf if two_fit else length_m - LEAST_CAPACITY * slot_m
        if self.stretch is None:
            return PlaceRoom(length_m, slot_m, most_kept_m)
        overhang_m = self.stretch.end_m - self.stretch.begin_m
        return PlaceRoom(length_m, slot_m, most_kept_m, overhang_m, self.stretch.edge)

    @property
    def capacity(self) -> int:
        """The number of slots: how many of the longest visitors fit.

        There are two, too, if one of the longest fits beside another vehicle, and long vehicles come once
        only: then one of them comes at a time.
        """
        if self._fitting < LEAST_CAPACITY and (room := self.room) and self.stays_m <= room.slot_m:
            return LEAST_CAPACITY if self.needed_m - room.slot_m <= room.most_kept_m else self._fitting
        return self._fitting

    @property
    def _fitting(self) -> int:
        """How many of the longest visitors fit."""
        left_m = self.length_m - HOLD_MARGIN_M - CLEARANCE_M
        held = 0
        for need_m, count in self.needs:
            fitting = math.floor(left_m / need_m + _ROUNDING)
            if fitting < count:
                return held + fitting
            held += count
            left_m -= count * need_m
        return held + math.floor(left_m / self.needs[-1][0] + _ROUNDING)

    @property
    def at_start(self) -> int:
        """The number of vehicles that may start on the place: at most one less than its slots.

        Then no place is full at the start, so there is no circle of full places: the start is live.
        """
        return max(1, min(self.capacity - 1, int(self._first_slot_m / (self.needed_m + _SPREAD_M))))

    def slots_m(self, types: Sequence[VehicleType]) -> list[float]:
        """Return the start positions of the fronts, the head first [m]."""
        front = self._first_slot_m
        fronts: list[float] = []
        for number, kind in enumerate(types):
            if number:
                # The gap is that of the follower: SUMO counts less than that as a collision.
                front -= types[number - 1].length_m + kind.min_gap_m + _SPREAD_M
            fronts.append(front)
        return fronts

    @property
    def _first_slot_m(self) -> float:
        line_m = self.length_m - HOLD_MARGIN_M
        return line_m - min(_FIRST_M, line_m - self.needed_m)


LEAST_CAPACITY = 2
"""A lane with fewer slots belongs to the crossing in which it lies. Where every place has two slots, one walk
along full queues decides liveness (Reveliotis, Lawley, Ferreira 1997)."""

_SPARE_M = 2.5
"""The shortest stretch is this much longer than a vehicle with its gap [m]: a vehicle at its end then keeps
its gap to the vehicles that wait before the stretch, and can change lanes beside them."""

_ROOMY_M, _ROOMY_FAST_M = 5.0, 15.0
"""A stretch is longer by up to this where the edge has space [m], so that a vehicle can change lanes without
braking hard for the end of the stretch: on roads up to `_ROOMY_MPS`, and on faster ones, where that distance
grows with the square of the speed. With 15 m on slow roads too, there are fewer slots before and after it."""

_ROOMY_MPS = 14.0
"""The speed limit of slow roads [m/s]."""

_MOST_ROOMY = 1 / 3
"""A stretch grows with speed up to this share of what is free of its edge: the places before and after need
slots, and the stretch is shut while others are on it."""

_SLOTS_BEHIND = 5
"""On faster roads, the slots behind a stretch: as many as the vehicles of a stream hold that follow each
other within their braking distance. Those that must wait to change lanes wait before the stretch."""

_NARROW_M = 5.0
"""Lanes of two edges that lie near each other for longer than a car do not merely meet [m]."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of an edge on which none waits: vehicles change lanes there, or other lanes are too near."""

    edge: str
    begin_m: float
    end_m: float
    """`begin_m` and `end_m`: positions on the edge [m]; 0 and the edge's length where there is no place
    before or after."""
    first_m: float
    last_m: float
    """`first_m` and `last_m`: where the place before begins, and where the place after ends [m]."""
    lanes: frozenset[int]
    """The lanes over which it leads, by index."""

    def covers(self, lane: int) -> bool:
        """Return whether it leads over a lane."""
        return lane in self.lanes

    def passage(self, lane: int, to_lane: int) -> Passage:
        """Return the passage over the stretch from one lane to another, or along one lane."""
        return Passage(self.edge, lane, to_lane, self.end_m - self.begin_m)


@dataclass(frozen=True, slots=True)
class Passage:
    """A way over a stretch, from one lane to another or along one lane."""

    edge: str
    lane: int
    to_lane: int
    length_m: float

    @property
    def id(self) -> str:
        """``edge:lane>lane``, unique in the network."""
        return f"{self.edge}:{self.lane}>{self.to_lane}"

    @property
    def changes(self) -> bool:
        """Whether the passage leads to another lane."""
        return self.lane != self.to_lane

    @property
    def swept(self) -> range:
        """The lanes that the passage uses."""
        return range(min(self.lane, self.to_lane), max(self.lane, self.to_lane) + 1)


def least_change_m(needed_m: float) -> float:
    """Return the shortest stretch for lane changes of vehicles that need `needed_m` with their gap [m]."""
    return needed_m + _SPARE_M


def least_place_m(needed_m: float) -> float:
    """Return the length of the shortest possible place [m]."""
    return LEAST_CAPACITY * needed_m + CLEARANCE_M + HOLD_MARGIN_M


def least_apart_m(needed_m: float) -> float:
    """Return the length of the shortest edge with a place before a change stretch and one after [m]."""
    return 2.0 * least_place_m(needed_m) + least_change_m(needed_m)


def lay_stretches(
    network: RoadNetwork,
    users: Sequence[tuple[Loop, VehicleType]],
    parts: Mapping[str, FreePart],
    *,
    reach_m: float = REACH_M,
    near: Narrow | None = None,
) -> tuple[dict[str, Stretch], Narrow]:
    """Choose the stretches: on each edge on which a loop changes lanes, and on narrow edges.

    A stretch for lane changes lies in the middle of its edge, on fast roads farther on, with a place before
    and a place after. If the edge is too short for both, the place after stays if it fits. Otherwise the
    stretch takes the whole edge; so does a stretch on a narrow edge. It leads over the lanes only that a
    change leaves, passes or reaches, and on a narrow edge over those that are near lanes of other edges. If
    the whole edge is too short to change lanes, the caller must refuse the loop.

    An edge with a part long enough for a place is not narrow, however near other lanes come to the rest: a
    vehicle before or after that part is under way on the movement that leads there.

    Parameters
    ----------
    users
        For each vehicle its loop and its type.
    parts
        The parts of lanes on which vehicles may wait, where that is not the whole lane.
    reach_m
        Distance below which lanes of different edges make a street narrow [m].
    near
        The result of `narrow_lanes` for these lanes or more, if known.

    Returns
    -------
    tuple
        The stretches by edge, and the pairs of lanes of narrow edges that are near each other.
    """
    needed: dict[str, float] = {}
    changing: dict[str, set[int]] = {}
    lanes: dict[str, None] = {}
    for loop, kind in users:
        for span in loop.spans:
            if span.internal:
                continue
            needed[span.edge] = max(needed.get(span.edge, 0.0), kind.needed_m)
            low, high = sorted((span.lane, span.lane_in))
            lanes.update((network.edges[span.edge].lanes[k].id, None) for k in range(low, high + 1))
            if low != high:
                changing.setdefault(span.edge, set()).update(range(low, high + 1))
    if near is None:
        near = narrow_lanes(network, lanes, reach_m=reach_m)
    else:
        near = frozenset(pair for pair in near if pair[0] in lanes and pair[1] in lanes)
    beside = dict.fromkeys(network.lanes[lane].edge for lane, _ in sorted(near))
    free = {edge: _free(network.edges[edge], lanes, parts) for edge in (*changing, *beside)}
    whole = {e for e in beside if free[e].end_m - free[e].begin_m < least_place_m(needed[e])}
    narrow = frozenset(pair for pair in near if all(network.lanes[lane].edge in whole for lane in pair))
    near_lanes: dict[str, set[int]] = {}
    for lane, _ in near:
        near_lanes.setdefault(network.lanes[lane].edge, set()).add(network.lanes[lane].index)
    stretches = {
        edge: _whole(edge, network.edges[edge].length_m, changing.get(edge, set()) | near_lanes[edge])
        if edge in whole
        else _lay_stretch(network.edges[edge], needed[edge], free[edge], changing[edge])
        for edge in (*changing, *sorted(whole - changing.keys()))
    }
    return stretches, narrow


def _free(edge: Edge, lanes: Container[str], parts: Mapping[str, FreePart]) -> FreePart:
    """Return the part in which vehicles may wait on all used lanes of an edge."""
    own = [parts[lane.id] for lane in edge.lanes if lane.id in lanes and lane.id in parts]
    begin_m = max((part.begin_m for part in own), default=0.0)
    return FreePart(begin_m, min((part.end_m for part in own), default=edge.length_m))


def _whole(edge: str, length_m: float, lanes: Iterable[int]) -> Stretch:
    return Stretch(edge, 0.0, length_m, 0.0, length_m, frozenset(lanes))


def _lay_stretch(edge: Edge, needed_m: float, free: FreePart, lanes: Iterable[int]) -> Stretch:
    place_m = least_place_m(needed_m)
    least_m = least_change_m(needed_m)
    free_m = free.end_m - free.begin_m
    fast = (max(lane.speed_mps for lane in edge.lanes) / _ROOMY_MPS) ** 2
    roomy_m = least_m + _ROOMY_M
    if fast > 1.0:
        least_fast_m = least_m + _ROOMY_FAST_M
        roomy_m = max(least_fast_m, min(least_m + _ROOMY_FAST_M * fast, free_m * _MOST_ROOMY))
    if free_m >= least_apart_m(needed_m):
        stretch_m = min(roomy_m, free_m - 2 * place_m)
        behind_m = (free_m - stretch_m) / 2
        if fast > 1.0:
            behind_m = min(behind_m, _SLOTS_BEHIND * needed_m + CLEARANCE_M + HOLD_MARGIN_M)
        end_m = free.end_m - behind_m
        return Stretch(edge.id, end_m - stretch_m, end_m, *free, frozenset(lanes))
    if free_m >= least_m + place_m:
        end_m = free.begin_m + min(roomy_m, free_m - place_m)
        return Stretch(edge.id, 0.0, end_m, 0.0, free.end_m, frozenset(lanes))
    return _whole(edge.id, edge.length_m, lanes)


Narrow = frozenset[tuple[str, str]]
"""Pairs of lanes of two edges that are near each other; each pair in both orders."""


def narrow_lanes(network: RoadNetwork, lanes: Iterable[str], *, reach_m: float = REACH_M) -> Narrow:
    """Find the lanes of different edges that vehicles cannot use side by side.

    Edges that meet at a junction, or cross it at a sharp angle, are near each other for less than a car's
    length, which does not count. Heights are ignored, as in junctions. O(n log n + k), see `lane_contacts`.
    """
    shapes = {lane: network.lanes[lane].shape for lane in lanes}
    if not shapes:
        return frozenset()
    found = lane_contacts(shapes, reach_m)
    pairs: set[tuple[str, str]] = set()
    for k in range(len(found.one)):
        x, y = (network.lanes[found.lanes[n]] for n in (int(found.one[k]), int(found.other[k])))
        mine_m = float(found.one_end[k] - found.one_begin[k]) * x.length_m
        theirs_m = float(found.other_end[k] - found.other_begin[k]) * y.length_m
        if x.edge != y.edge and min(mine_m, theirs_m) > _NARROW_M:
            pairs |= {(x.id, y.id), (y.id, x.id)}
    return frozenset(pairs)


def find_foes(passages: Iterable[Passage], narrow: Narrow) -> dict[str, frozenset[str]]:
    """Find the conflicts among passages: for each the ids of its foes.

    Two passages of an edge conflict if they use a common lane, unless they come from one lane and one of them
    stays on it: then the second vehicle follows the first. Passages of two narrow edges conflict if their
    lanes are near each other.

    Vehicles that make the same change follow each other too. They have slots in one place after the stretch,
    in the order in which they come to the stretch, and `Steering` lets each change lanes only behind the one
    before. So they come to that place in this order, and the first can always go on: the only other vehicles
    in the lane to which it changes have changed before it, and each of them has a slot to drive into.

    A foe is in the way until it has left the crossing. A vehicle that changes lanes may have to stand, and on
    a narrow street SUMO does not see oncoming vehicles, so their times cannot be predicted.
    """
    by_id = {passage.id: passage for passage in passages}
    ids: dict[str, set[str]] = {name: set() for name in by_id}
    on_edge: dict[str, list[Passage]] = {}
    for passage in by_id.values():
        on_edge.setdefault(passage.edge, []).append(passage)
    for together in on_edge.values():
        for one in together:
            ids[one.id].update(other.id for other in together if _conflict(one, other))
    on_lane: dict[str, list[Passage]] = {}
    for passage in by_id.values():
        for lane in passage.swept:
            on_lane.setdefault(f"{passage.edge}_{lane}", []).append(passage)
    for x, y in narrow:
        for one in on_lane.get(x, ()):
            ids[one.id].update(other.id for other in on_lane.get(y, ()))
    return {name: frozenset(found) for name, found in ids.items()}


def _conflict(one: Passage, other: Passage) -> bool:
    if one.id == other.id or not (one.changes or other.changes):
        return False
    if one.lane == other.lane and not (one.changes and other.changes):
        return False
    return bool(set(one.swept) & set(other.swept))


_SIDE_M = 0.4
"""The least distance that two vehicles keep between their sides [m]."""


def reach_m(widths_m: Iterable[float]) -> float:
    """Return the distance of centre lines below which vehicles of these widths conflict [m]."""
    return max(REACH_M, max(widths_m, default=0.0) + _SIDE_M)


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
    sized: Mapping[str, Mapping[str, SizedOverlaps]] = field(default_factory=dict)
    """As `overlaps`, by the lengths of the two vehicles, where these make a difference."""
    with_others: frozenset[tuple[str, str]] = frozenset()
    """Conflicts of a movement with the next one that exist only for vehicles from another movement: vehicles
    that take both follow each other."""


def find_conflicts(
    network: RoadNetwork,
    movements: Iterable[Connection],
    touches: Touches,
    places: Mapping[str, FreePart],
    passages: Iterable[Passage] = (),
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
    passages
        The ways over stretches that begin where their edges do. Who changes lanes there is still under way
        on the movement that leads to the edge.
    """
    by_id = {movement.id: movement for movement in movements}
    lengths = {m.id: network.over_m(m) for m in by_id.values()}
    foes: dict[str, set[str]] = {name: set() for name in by_id}
    overlaps: dict[str, dict[str, Overlap]] = {name: {} for name in by_id}
    pairs = list(_pairs(network, by_id.values()))
    known = {frozenset(pair.ids) for pair in pairs if pair.listed or pair.certain}
    certain = {frozenset(pair.ids) for pair in pairs if pair.certain}
    for pair in pairs:
        if pair.certain:
            _add(foes, *pair.ids)
    unlisted: set[tuple[str, str]] = set()
    with_others: set[tuple[str, str]] = set()
    sized: dict[str, dict[str, SizedOverlaps]] = {name: {} for name in by_id}
    under_way = _UnderWay(network, by_id.values(), places, passages)
    sizes = tuple(np.unique((touches.one_length_m, touches.other_length_m)).tolist())
    for one, other, follows, found in _shared(under_way, touches, sizes):
        _add(foes, one, other)
        if by_id[one].to_id == by_id[other].from_id and not follows and one != other:
            with_others.add((one, other))
        if one != other and frozenset((one, other)) not in known:
            unlisted.add((one, other))
        line_m, clear_m = _between_places(network, by_id[one], lengths[one], places)
        joins = one != other and _same_end(by_id[one], by_id[other])
        least_m = lengths[one] if joins else -math.inf
        among = [
            [
                (max(begin - BETWEEN_M, line_m), min(max(end + BETWEEN_M, least_m), clear_m))
                if begin < math.inf
                else None
                for begin, end in row
            ]
            for row in found.tolist()
        ]
        every = among[-1][-1]
        if every is not None:
            overlaps[one][other] = every
        if frozenset((one, other)) in certain:
            among = [[overlap or every for overlap in row] for row in among]
        if any(overlap != every for row in among for overlap in row):
            sized[one][other] = SizedOverlaps(sizes, tuple(map(tuple, among)))
    return Conflicts(
        foes={name: frozenset(found) for name, found in foes.items()},
        overlaps=overlaps,
        lengths_m=lengths,
        speeds_mps={
            m.id: min(network.lanes[lane].speed_mps for lane in (*m.via, m.to_id)) for m in by_id.values()
        },
        unlisted=tuple(sorted(unlisted)),
        sized=sized,
        with_others=frozenset(with_others),
    )


def _between_places(
    network: RoadNetwork, movement: Connection, length_m: float, places: Mapping[str, FreePart]
) -> tuple[float, float]:
    """Return where a front leaves the place before a movement, and a rear enters the place after it [m].

    A vehicle that waits in a place is not in the way, however near a touch is, since fronts are checked at
    intervals.
    """
    before, behind = movement.from_id, movement.to_id
    line_m = places[before].end_m - network.lanes[before].length_m if before in places else -math.inf
    return line_m, length_m + places[behind].begin_m if behind in places else math.inf


def _shared(
    under_way: _UnderWay, touches: Touches, sizes: Sequence[float]
) -> Iterator[tuple[str, str, bool, Floats]]:
    """Yield for each movement and foe the positions between which they touch, in both orders.

    The third item tells whether vehicles on the foe may touch a vehicle that has come by the same movement.
    The last has the first front and the last rear of bodies up to each of `sizes` that touch foes up to each,
    of shape (sizes, sizes, 2); infinite where none do.
    """
    t = touches
    mine = under_way.rows(t.paths, t.one, t.one_at_m, t.one_length_m, t.one_touched_m)
    theirs = under_way.rows(t.paths, t.other, t.other_at_m, t.other_length_m, t.other_touched_m)
    met = mine.merge(theirs, on="touch")
    orders = (("x", "y"), ("y", "x"))
    columns = [
        [f"movement_{a}", f"movement_{b}", f"at_{a}", f"rear_{a}", f"by_{b}", f"size_{a}", f"size_{b}"]
        for a, b in orders
    ]
    names = ["one", "other", "at", "rear", "by", "mine", "theirs"]
    both = pd.concat(met[some].set_axis(names, axis=1) for some in columns)
    both["follows"] = (both["by"] == both["one"]) | (both["by"] == _UNKNOWN)
    found = both.groupby(["one", "other", "mine", "theirs"]).agg(
        begin=("at", "min"), end=("rear", "max"), follows=("follows", "any")
    )
    one, other, *size = (found.index.get_level_values(number).to_numpy() for number in range(4))
    firsts = np.flatnonzero((np.diff(one, prepend=-1) != 0) | (np.diff(other, prepend=-1) != 0))
    pair = np.repeat(np.arange(len(firsts)), np.diff(firsts, append=len(one)))
    tables = np.full((len(firsts), len(sizes), len(sizes), 2), (math.inf, -math.inf))
    tables[pair, *(np.searchsorted(sizes, some) for some in size)] = found[["begin", "end"]]
    for axis in (1, 2):
        tables[..., 0] = np.minimum.accumulate(tables[..., 0], axis=axis)
        tables[..., 1] = np.maximum.accumulate(tables[..., 1], axis=axis)
    follows = np.logical_or.reduceat(found["follows"].to_numpy(bool), firsts) if len(firsts) else ()
    for first, follow, table in zip(firsts, follows, tables, strict=True):
        yield under_way.names[one[first]], under_way.names[other[first]], bool(follow), table


class _UnderWay:
    """Finds the movement that a vehicle is on, from its path and the position of its front."""

    def __init__(
        self,
        network: RoadNetwork,
        movements: Iterable[Connection],
        places: Mapping[str, FreePart],
        passages: Iterable[Passage],
    ) -> None:
        self.names: list[str] = []
        self._network = network
        self._places = places
        self._inside: dict[str, tuple[int, float]] = {}
        self._between: dict[tuple[str, str], int] = {}
        self._out_of: dict[str, list[int]] = {}
        self._onto: dict[str, list[int]] = {}
        self._changed_from: dict[str, set[str]] = {}
        """By lane, the lanes from which vehicles change to it before the first place."""
        for passage in passages:
            before, lane = (f"{passage.edge}_{number}" for number in (passage.lane, passage.to_lane))
            if passage.changes:
                self._changed_from.setdefault(lane, set()).add(before)
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
            self._onto.setdefault(movement.to_id, []).append(number)

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
        size = length_m[touch]
        rear = at - size
        columns = {"touch": touch, "movement": movement, "at": at, "rear": rear, "by": by, "size": size}
        return pd.DataFrame(columns)

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
        came_by = [into] if into is not None else []
        if behind is None:
            came_by = [
                one
                for before in sorted(self._changed_from.get(lane, ()))
                for one in self._onto.get(before, ())
            ]
        entering = rows if place is None else rows[at_m <= place.begin_m + self._length[rows]]
        for movement in came_by:
            yield movement, self._length_m[movement] - begin_m, entering
        if into is not None and place is None:
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
