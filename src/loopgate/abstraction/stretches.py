"""Parts of edges on which no vehicle waits: change stretches and narrow streets."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

from loopgate.abstraction.itinerary import CLEARANCE_M
from loopgate.abstraction.movements import REACH_M
from loopgate.abstraction.places import Part
from loopgate.network.contacts import lane_contacts
from loopgate.network.loop import HOLD_MARGIN_M, Loop
from loopgate.network.records import Edge
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import VehicleType

LEAST_CAPACITY = 2
"""A lane with fewer slots belongs to the crossing in which it lies. Where every place has two slots, one walk
along full queues decides liveness (Reveliotis, Lawley, Ferreira 1997)."""

_SPARE_M = 2.5
"""The shortest stretch is this much longer than a vehicle with its gap [m]: a vehicle at its end then keeps
its gap to the vehicles that wait before the stretch, and can change lanes beside them."""

_ROOMY_M = 15.0
"""A stretch is longer by up to this where the edge has space [m], so that a vehicle can change lanes without
braking hard for the end of the stretch."""

_NARROW_M = 5.0
"""Lanes of two edges that lie near each other for longer than a car do not merely meet [m]."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of an edge, over all its lanes, that vehicles cross without waiting."""

    edge: str
    begin_m: float
    end_m: float
    """`begin_m` and `end_m`: positions on the edge [m]; 0 and the edge's length where there is no place
    before or after."""
    first_m: float
    last_m: float
    """`first_m` and `last_m`: where the place before begins, and where the place after ends [m]."""

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


def lay_stretches(
    network: RoadNetwork,
    users: Sequence[tuple[Loop, VehicleType]],
    parts: Mapping[str, Part],
    *,
    reach_m: float = REACH_M,
    near: Narrow | None = None,
) -> tuple[dict[str, Stretch], Narrow]:
    """Choose the stretches: on each edge on which a loop changes lanes, and on all of each narrow edge.

    A stretch for lane changes lies in the middle of its edge, with a place before and a place after. If the
    edge is too short for both, the place after stays if it fits. Otherwise the stretch takes the whole edge;
    so does a stretch on a narrow edge. If the whole edge is too short to change lanes, the caller must refuse
    the loop.

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
    changing: dict[str, None] = {}
    lanes: dict[str, None] = {}
    for loop, kind in users:
        for span in loop.spans:
            if span.internal:
                continue
            needed[span.edge] = max(needed.get(span.edge, 0.0), kind.needed_m)
            low, high = sorted((span.lane, span.lane_in))
            lanes.update((network.edges[span.edge].lanes[k].id, None) for k in range(low, high + 1))
            if low != high:
                changing[span.edge] = None
    if near is None:
        near = narrow_lanes(network, lanes, reach_m=reach_m)
    else:
        near = frozenset(pair for pair in near if pair[0] in lanes and pair[1] in lanes)
    beside = dict.fromkeys(network.lanes[lane].edge for lane, _ in sorted(near))
    free = {edge: _free(network.edges[edge], lanes, parts) for edge in (*changing, *beside)}
    whole = {e for e in beside if free[e].end_m - free[e].begin_m < least_place_m(needed[e])}
    narrow = frozenset(pair for pair in near if all(network.lanes[lane].edge in whole for lane in pair))
    stretches = {
        edge: _whole(edge, network.edges[edge].length_m)
        if edge in whole
        else _in_the_middle(edge, network.edges[edge].length_m, needed[edge], free[edge])
        for edge in (*changing, *sorted(whole - changing.keys()))
    }
    return stretches, narrow


def _free(edge: Edge, lanes: Container[str], parts: Mapping[str, Part]) -> Part:
    """Return the part in which vehicles may wait on all used lanes of an edge."""
    own = [parts[lane.id] for lane in edge.lanes if lane.id in lanes and lane.id in parts]
    begin_m = max((part.begin_m for part in own), default=0.0)
    return Part(begin_m, min((part.end_m for part in own), default=edge.length_m))


def _whole(edge: str, length_m: float) -> Stretch:
    return Stretch(edge, 0.0, length_m, 0.0, length_m)


def _in_the_middle(edge: str, length_m: float, needed_m: float, free: Part) -> Stretch:
    place_m = least_place_m(needed_m)
    least_m = least_change_m(needed_m)
    free_m = free.end_m - free.begin_m
    if free_m >= place_m + least_m + place_m:
        stretch_m = min(least_m + _ROOMY_M, free_m - 2 * place_m)
        begin_m = free.begin_m + (free_m - stretch_m) / 2
        return Stretch(edge, begin_m, begin_m + stretch_m, *free)
    if free_m >= least_m + place_m:
        end_m = free.begin_m + min(least_m + _ROOMY_M, free_m - place_m)
        return Stretch(edge, 0.0, end_m, 0.0, free.end_m)
    return _whole(edge, length_m)


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
