"""The paper's abstraction: collision segments become shared states, the rest private states."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from loopgate.abstraction.itinerary import CLEARANCE_M, Abstraction, DrawnLeg, Itinerary
from loopgate.arrays import Floats, Ints
from loopgate.cache import Cache
from loopgate.errors import RouteError, ScenarioError
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.network.contacts import LaneContacts, lane_contacts, lanes_of, merge_intervals
from loopgate.network.loop import HOLD_MARGIN_M, Loop
from loopgate.reading import listed

if TYPE_CHECKING:
    from networkx.utils import UnionFind


_TOUCH_M = 1e-6


@dataclass(frozen=True, slots=True)
class ZoneVisit:
    """The passage of a path through a zone, in arc length [m]; ``end_m`` may exceed the loop's length."""

    begin_m: float
    end_m: float
    zone: int

    @property
    def length_m(self) -> float:
        """Length on the path [m]."""
        return self.end_m - self.begin_m


@dataclass(frozen=True, slots=True)
class Zones:
    """The collision states of all paths."""

    visits: tuple[tuple[ZoneVisit, ...], ...]
    """For each loop its visits in driving order. Visits do not overlap, but may touch. Zones are numbered
    from 0 in the order in which the loops meet them."""
    merged: tuple[tuple[str, ...], ...]
    """Pairs of zones that followed each other on two paths and became one (Proposition 1), as the ids of the
    loops concerned."""


def make_zones(loops: Sequence[Loop], segments: CollisionSegments, need_m: float) -> Zones:
    """Merge collision segments into zones, and extend the zones so that vehicles can stop before them.

    Segments of a collision pair are one zone, and so are segments that overlap on one path (Zhou et al. 2020,
    Section 3.2, Step 1; union-find over all paths). Then, until nothing changes, each path's visits grow by
    the rules of `cover`, visits that overlap become one, and two zones that follow each other on two paths
    become one (Proposition 1). Zones only grow, so earlier results stay valid.

    `need_m`: length that a standing vehicle takes. Every visit, and every private stretch between visits, has
    at least this length. Raises `RouteError` if a loop is shorter than `need_m` or has no lane on which a
    vehicle can be held.
    """
    for loop in loops:
        if loop.length_m < need_m:
            msg = (
                f"loop {loop.id}: {loop.length_m:.1f} m are too short for a vehicle that needs {need_m:.1f} m"
            )
            raise RouteError(msg)
    union, paths = _overlaps(loops, segments)
    merged: list[tuple[str, ...]] = []
    while True:
        before = paths
        paths = [cover(loop, path, need_m, union) for loop, path in zip(loops, paths, strict=True)]
        merged += _proposition_1(loops, paths, union)
        names = [tuple(replace(v, zone=union[v.zone]) for v in path) for path in paths]
        if all(_same(one, other) for one, other in zip(names, before, strict=True)):
            return _numbered(names, merged)
        paths = names


def cover(
    loop: Loop, visits: Iterable[ZoneVisit], need_m: float, union: UnionFind[int]
) -> tuple[ZoneVisit, ...]:
    """Extend the zone visits on a path so that a vehicle can stop before each.

    A vehicle waits with its front at the end of a state, so states end where SUMO can hold a vehicle. A visit
    begins at or before its true beginning and ends at or after its true end, at such a point. Private road
    shorter than `need_m` goes to the visit after it. A visit shorter than `need_m` grows upstream into
    private road, then downstream; otherwise it joins the shorter of the visits that it touches. Visits that
    overlap become one.

    Parameters
    ----------
    visits
        In any order.
    need_m
        Length that a standing vehicle takes [m].
    union
        Knows which zones are one; gets the zones that become one.
    """
    path = sorted(visits, key=_where)
    while True:
        grown = _join(loop, path, union)
        for step in (_round_out, _close_gaps, _lengthen):
            grown = _join(loop, step(loop, grown, need_m, union), union)
        if _same(grown, path):
            return tuple(grown)
        path = grown


def _where(visit: ZoneVisit) -> tuple[float, float]:
    return visit.begin_m, visit.end_m


def _same(one: Sequence[ZoneVisit], other: Sequence[ZoneVisit]) -> bool:
    return len(one) == len(other) and all(
        a.zone == b.zone and abs(a.begin_m - b.begin_m) < _TOUCH_M and abs(a.end_m - b.end_m) < _TOUCH_M
        for a, b in zip(one, other, strict=True)
    )


def _overlaps(
    loops: Sequence[Loop], segments: CollisionSegments
) -> tuple[UnionFind[int], list[tuple[ZoneVisit, ...]]]:
    """Unite segments that overlap on one path, and the segments of each pair."""
    from networkx.utils import UnionFind  # noqa: PLC0415  most runs do without it

    # A negative distance: segments that merely touch, being related to different robots, stay two.
    row, begin, end, path = merge_intervals(
        segments.path, segments.begin_m, segments.end_m, join=-2.0 * _TOUCH_M
    )
    union = UnionFind(range(len(begin)))
    links = np.unique(row[segments.pairs], axis=0) if len(segments.pairs) else segments.pairs
    for one, other in links.tolist():
        union.union(one, other)
    paths: list[list[ZoneVisit]] = [[] for _ in loops]
    for k, (b, e, i) in enumerate(zip(begin.tolist(), end.tolist(), path.tolist(), strict=True)):
        paths[i].append(ZoneVisit(b, e, k))
    return union, [tuple(found) for found in paths]


def _join(loop: Loop, path: Iterable[ZoneVisit], union: UnionFind[int]) -> list[ZoneVisit]:
    """Merge visits that overlap, and visits of one zone that touch; sort by beginning."""
    lap = loop.length_m
    found: list[ZoneVisit] = []
    for visit in sorted((_first_lap(v, lap) for v in path), key=_where):
        if found and _belong(found[-1], visit, union):
            found[-1] = _united(found[-1], visit, union)
        else:
            found.append(visit)
    while len(found) > 1:  # the last may reach over the loop's beginning into the first ones
        first = replace(found[0], begin_m=found[0].begin_m + lap, end_m=found[0].end_m + lap)
        if not _belong(found[-1], first, union):
            break
        found[-1] = _united(found[-1], first, union)
        del found[0]
    if len(found) == 1 and found[0].length_m > lap - _TOUCH_M:
        end = loop.hold_before(lap)
        return [ZoneVisit(end - lap, end, union[found[0].zone])]
    return [replace(v, zone=union[v.zone]) for v in found]


def _first_lap(visit: ZoneVisit, lap_m: float) -> ZoneVisit:
    if visit.length_m > lap_m - _TOUCH_M or 0.0 <= visit.begin_m < lap_m:
        return visit
    shift = visit.begin_m % lap_m - visit.begin_m
    return replace(visit, begin_m=visit.begin_m + shift, end_m=visit.end_m + shift)


def _belong(one: ZoneVisit, following: ZoneVisit, union: UnionFind[int]) -> bool:
    if following.begin_m < one.end_m - _TOUCH_M:
        return True
    return following.begin_m <= one.end_m + _TOUCH_M and union[one.zone] == union[following.zone]


def _united(one: ZoneVisit, following: ZoneVisit, union: UnionFind[int]) -> ZoneVisit:
    union.union(one.zone, following.zone)
    return replace(one, end_m=max(one.end_m, following.end_m))


def _round_out(loop: Loop, path: list[ZoneVisit], need_m: float, union: UnionFind[int]) -> list[ZoneVisit]:
    del need_m, union
    return [replace(v, begin_m=loop.hold_before(v.begin_m), end_m=loop.hold_after(v.end_m)) for v in path]


def _close_gaps(loop: Loop, path: list[ZoneVisit], need_m: float, union: UnionFind[int]) -> list[ZoneVisit]:
    del union
    found = []
    for number, visit in enumerate(path):
        free = _free_before(loop, path, number)
        begin = visit.begin_m - free if _TOUCH_M < free < need_m else visit.begin_m
        found.append(replace(visit, begin_m=begin))
    return found


def _lengthen(loop: Loop, path: list[ZoneVisit], need_m: float, union: UnionFind[int]) -> list[ZoneVisit]:
    """Extend the first visit that is too short; the caller repeats this until none is."""
    for number, visit in enumerate(path):
        missing = need_m - visit.length_m
        if missing <= _TOUCH_M:
            continue
        free = _free_before(loop, path, number)
        if free > _TOUCH_M:
            begin = loop.hold_before(visit.begin_m - missing)
            if begin - (visit.begin_m - free) < need_m:  # what is left would be too short for a state
                begin = visit.begin_m - free
            return [*path[:number], replace(visit, begin_m=begin), *path[number + 1 :]]
        after = (number + 1) % len(path)
        free = _free_before(loop, path, after)
        if free > _TOUCH_M:
            end = loop.hold_after(visit.end_m + missing)
            if visit.end_m + free - end < need_m:
                end = visit.end_m + free
            return [*path[:number], replace(visit, end_m=end), *path[number + 1 :]]
        neighbour = min(path[number - 1], path[after], key=lambda v: v.length_m)
        union.union(visit.zone, neighbour.zone)
        return path
    return path


def _free_before(loop: Loop, path: list[ZoneVisit], number: int) -> float:
    """Return the length of private road between a visit and the visit before it [m]."""
    before = path[number - 1].end_m - (loop.length_m if number == 0 else 0.0)
    return path[number].begin_m - before


def _proposition_1(
    loops: Sequence[Loop], paths: Sequence[Sequence[ZoneVisit]], union: UnionFind[int]
) -> list[tuple[str, ...]]:
    """Unite zones that follow each other on two paths; return the loops concerned."""
    colours: dict[tuple[int, int], list[int]] = {}
    for i, (loop, path) in enumerate(zip(loops, paths, strict=True)):
        for number, visit in enumerate(path):
            one, other = sorted((union[path[number - 1].zone], union[visit.zone]))
            if one != other and _free_before(loop, list(path), number) <= _TOUCH_M:
                users = colours.setdefault((one, other), [])
                if i not in users:
                    users.append(i)
    merged = []
    for (one, other), users in colours.items():
        if len(users) > 1:
            union.union(one, other)
            merged.append(tuple(loops[i].id for i in users))
    return merged


def _numbered(paths: Sequence[Sequence[ZoneVisit]], merged: Sequence[tuple[str, ...]]) -> Zones:
    number: dict[int, int] = {}
    visits = tuple(
        tuple(replace(v, zone=number.setdefault(v.zone, len(number))) for v in path) for path in paths
    )
    return Zones(visits, tuple(merged))


class StartPosition(NamedTuple):
    """A vehicle's start: index on its path, and arc length of its front [m]."""

    position: int
    front_m: float


def choose_starts(
    itineraries: Sequence[Itinerary],
    *,
    names: Sequence[str],
    vehicle_length_m: float,
    rng: random.Random,
    given_m: Mapping[str, float],
) -> list[StartPosition]:
    """Choose a start state for each vehicle: a private state if possible.

    Raises `ScenarioError` if two vehicles would start in one zone, a given position lies across two states,
    or a loop has no state that is long enough.

    Parameters
    ----------
    itineraries, names
        One of each per vehicle.
    rng
        Chooses among the states.
    given_m
        Arc length of the front for vehicles with a given position, by name.
    """
    visitors: dict[StateId, set[int]] = {}
    for i, itinerary in enumerate(itineraries):
        for leg in itinerary.legs:
            visitors.setdefault(leg.state, set()).add(i)
    choices: list[list[StartPosition]] = []
    for itinerary, name in zip(itineraries, names, strict=True):
        loop = itinerary.loop
        if name in given_m:
            choices.append([_given(itinerary, name, given_m[name], vehicle_length_m)])
            continue
        places = [
            StartPosition(position, front)
            for position, leg in enumerate(itinerary.legs)
            if (front := _place_within(loop, leg, vehicle_length_m)) is not None
        ]
        if not places:
            msg = (
                f"loop {loop.id}: no lane on it has {vehicle_length_m:g} m within one state, so {name} "
                f"cannot start; use a shorter vehicle, longer private pieces, or another loop"
            )
            raise ScenarioError(msg)
        private = [s for s in places if len(visitors[itinerary.legs[s.position].state]) == 1]
        rng.shuffle(places)
        choices.append([rng.choice(private)] if private else places)
    return _match(itineraries, names, choices)


def _match(
    itineraries: Sequence[Itinerary], names: Sequence[str], choices: Sequence[Sequence[StartPosition]]
) -> list[StartPosition]:
    """Give each vehicle one of its choices so that no state is used twice (augmenting paths)."""
    holder: dict[StateId, int] = {}
    chosen: dict[int, StartPosition] = {}

    def state(i: int, start: StartPosition) -> StateId:
        return itineraries[i].legs[start.position].state

    def place(i: int, seen: set[StateId]) -> bool:
        for start in choices[i]:
            here = state(i, start)
            if here in seen:
                continue
            seen.add(here)
            if here not in holder or place(holder[here], seen):
                holder[here] = i
                chosen[i] = start
                return True
        return False

    for i, name in enumerate(names):
        if not place(i, set()):
            zone = state(i, choices[i][0])
            msg = (
                f"vehicles {names[holder[zone]]} and {name} both start in {zone}, which holds one; "
                f"start one elsewhere, leave one out, or use loops that share less (--max-shared)"
            )
            raise ScenarioError(msg)
    return [chosen[i] for i in range(len(names))]


def _given(itinerary: Itinerary, name: str, front_m: float, vehicle_length_m: float) -> StartPosition:
    lap = itinerary.loop.lap_m
    for position, leg in enumerate(itinerary.legs):
        for front in (front_m % lap, front_m % lap - lap):
            if leg.begin_m + vehicle_length_m <= front <= leg.end_m:
                return StartPosition(position, front)
    msg = (
        f"vehicle {name}: at {front_m:.1f} m on {itinerary.loop.id} it stands across two states; "
        f"move it by its length (departPos) or leave the place open"
    )
    raise ScenarioError(msg)


def _place_within(loop: Loop, leg: DrawnLeg, vehicle_length_m: float) -> float | None:
    """Return the middle position for the front within a leg and its longest lane, or None."""
    best: tuple[float, float] | None = None
    for span in loop.spans:
        if span.internal:
            continue
        for shift in (0.0, -loop.length_m):
            low = max(span.begin_m + shift + HOLD_MARGIN_M, leg.begin_m) + vehicle_length_m
            high = min(span.end_m + shift - HOLD_MARGIN_M, leg.end_m)
            if high >= low and (best is None or high - low > best[1] - best[0]):
                best = (low, high)
    return None if best is None else (best[0] + best[1]) / 2.0


_SWALLOWED = 0.5


def zone_warnings(loops: Sequence[Loop], zones: Zones, name: Callable[[int], StateId]) -> list[str]:
    """Warn of zones that swallow loops or most robots, loops without private road, and merges by Prop. 1.

    `name`: name of a zone's state.
    """
    metres: dict[int, dict[str, float]] = {}
    for loop, visits in zip(loops, zones.visits, strict=True):
        for visit in visits:
            of_zone = metres.setdefault(visit.zone, {})
            of_zone[loop.id] = of_zone.get(loop.id, 0.0) + visit.length_m
    laps = {loop.id: loop.length_m for loop in loops}
    found = []
    for zone, by_loop in metres.items():
        found += _of_zone(name(zone), by_loop, laps)
    homeless = [
        loop.id
        for loop, visits in zip(loops, zones.visits, strict=True)
        if len(visits) > 1 and sum(v.length_m for v in visits) > loop.length_m - 1.0
    ]
    if homeless:
        found.append(f"no private road on {listed(homeless)}: its vehicle always blocks others")
    found += [
        f"zones that follow each other on {listed(users)} were made one (Prop. 1)" for users in zones.merged
    ]
    return found


def _of_zone(zone: StateId, metres: dict[str, float], laps: dict[str, float]) -> list[str]:
    found = []
    swallowed = [loop for loop, m in metres.items() if m > _SWALLOWED * laps[loop]]
    if swallowed:
        share = sum(metres[loop] for loop in swallowed) / sum(laps[loop] for loop in swallowed)
        found.append(
            f"{zone} takes {share:.0%} of {listed(swallowed)}: one vehicle at a time there; "
            f"limit the shared length (--max-shared), or use --abstraction queues"
        )
    whole = [loop for loop in swallowed if metres[loop] > laps[loop] - 1.0]
    others = [loop for loop in metres if loop not in whole]
    if whole:
        verb = "lies in it all the way: its vehicle never leaves" if len(whole) == 1 else "never leave it"
        found.append(
            f"{zone}: {listed(whole)} {verb}" + (f", and {listed(others)} can never enter" if others else "")
        )
    if len(metres) >= max(3, len(laps) // 2 + 1):
        found.append(
            f"{zone} is shared by {len(metres)} of {len(laps)} loops, {sum(metres.values()):.0f} m in all: "
            f"they wait for one another"
        )
    return found


_JOIN_M = 1e-4
"""Stretches on neighbouring lanes meet at a lane's end up to rounding."""


@dataclass(frozen=True, slots=True)
class CollisionSegments:
    """The maximal continuous stretches of each path within 2 rho of another path, and which meet.

    Segment ``k`` lies on path ``path[k]``, is maximal with respect to path ``other[k]`` alone, and reaches
    from ``begin_m[k]`` to ``end_m[k]`` in arc length. A segment across the beginning of its path has an
    ``end_m`` beyond the path's length.

    `pairs`: collision pairs, shape (p, 2): numbers of segments on two paths that come within 2 rho of each
    other.
    """

    path: Ints
    other: Ints
    begin_m: Floats
    end_m: Floats
    pairs: Ints


def collision_segments(loops: Sequence[Loop], rho_m: float) -> CollisionSegments:
    """Find all collision segments and pairs of `loops` (Definition 1), exactly, by arc length.

    Every lane on which a vehicle may be counts as part of its path. A path that comes near itself does not
    conflict with itself.

    Lanes are compared once, however many loops use them. O(n log n) for n lane contacts times their users.

    Parameters
    ----------
    loops
        The paths; each has one robot (Assumption 3).
    rho_m
        Safe radius [m].
    """
    i, j, mine, theirs = _contacts_of_loops(loops, lane_contacts(lanes_of(loops), 2.0 * rho_m))
    n = len(loops)
    near_i, begin_i, end_i, group_i = merge_intervals(i * n + j, mine[:, 0], mine[:, 1], join=_JOIN_M)
    near_j, begin_j, end_j, group_j = merge_intervals(j * n + i, theirs[:, 0], theirs[:, 1], join=_JOIN_M)
    pairs = np.unique(np.stack((near_i, near_j + len(begin_i)), axis=1), axis=0)
    group = np.concatenate((group_i, group_j))
    begin, end = np.concatenate((begin_i, begin_j)), np.concatenate((end_i, end_j))
    return _round_the_beginning(loops, group // max(n, 1), group % max(n, 1), begin, end, pairs)


def _contacts_of_loops(loops: Sequence[Loop], contacts: LaneContacts) -> tuple[Ints, Ints, Floats, Floats]:
    """Return pairs of loops i < j, and for each the near stretches on i and on j, shape (n, 2) [m]."""
    number = {lane: k for k, lane in enumerate(contacts.lanes)}
    uses = sorted(
        (number[lane_id], i, span.begin_m, span.length_m)
        for i, loop in enumerate(loops)
        for span in loop.spans
        for lane_id in span.lane_ids
    )
    lane = np.array([use[0] for use in uses], dtype=np.int64)
    loop = np.array([use[1] for use in uses], dtype=np.int64)
    begin = np.array([use[2] for use in uses])
    length = np.array([use[3] for use in uses])
    first = np.searchsorted(lane, np.arange(len(contacts.lanes)))
    count = np.searchsorted(lane, np.arange(len(contacts.lanes)), side="right") - first
    # Every user of the one lane with every user of the other, as one flat table.
    rows = count[contacts.one] * count[contacts.other]
    row = np.repeat(np.arange(len(rows)), rows)
    local = np.arange(len(row)) - np.repeat(np.cumsum(rows) - rows, rows)
    width = count[contacts.other][row]
    a = first[contacts.one][row] + local // np.maximum(width, 1)
    b = first[contacts.other][row] + local % np.maximum(width, 1)
    same = contacts.one[row] == contacts.other[row]
    keep = np.where(same, loop[a] < loop[b], loop[a] != loop[b])
    row, a, b = row[keep], a[keep], b[keep]

    def stretch(use: Ints, low: Floats, high: Floats) -> Floats:
        return np.stack((begin[use] + low[row] * length[use], begin[use] + high[row] * length[use]), axis=1)

    on_a = stretch(a, contacts.one_begin, contacts.one_end)
    on_b = stretch(b, contacts.other_begin, contacts.other_end)
    turn = (loop[a] > loop[b])[:, None]
    i, j = np.minimum(loop[a], loop[b]), np.maximum(loop[a], loop[b])
    return i, j, np.where(turn, on_b, on_a), np.where(turn, on_a, on_b)


def _round_the_beginning(
    loops: Sequence[Loop], path: Ints, other: Ints, begin: Floats, end: Floats, pairs: Ints
) -> CollisionSegments:
    """Unite the last and the first segment of a path and its other where they meet at the beginning."""
    lap = np.array([loop.length_m for loop in loops])[path]
    key = path * len(loops) + other
    first = {int(key[k]): int(k) for k in np.flatnonzero(begin <= _JOIN_M)}
    last = {int(key[k]): int(k) for k in np.flatnonzero(end >= lap - _JOIN_M)}
    becomes = np.arange(len(path))
    end = end.copy()
    for pair, k in first.items():
        before = last.get(pair, k)
        if before != k:
            becomes[k] = before
            end[before] = lap[k] + end[k]
    kept = np.flatnonzero(becomes == np.arange(len(path)))
    place = np.full(len(path), -1, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    pairs = np.unique(place[becomes[pairs]], axis=0) if len(pairs) else pairs
    return CollisionSegments(path[kept], other[kept], begin[kept], end[kept], pairs)


DEFAULT_RHO_M = 1.25
"""Safe radius [m]: oncoming lanes, 3.2 m apart, do not conflict; crossing, merging and shared lanes do."""


@dataclass(frozen=True, slots=True)
class SegmentLayout:
    """Loops cut into states, before vehicles are placed."""

    itineraries: tuple[Itinerary, ...]
    """One per robot."""
    warnings: tuple[str, ...]
    """Warnings for the user about loops that do not suit this abstraction."""


def lay_out_segments(
    loops: Sequence[Loop],
    *,
    rho_m: float = DEFAULT_RHO_M,
    vehicle_length_m: float = 5.0,
    min_gap_m: float = 2.5,
    piece_m: float = 100.0,
) -> SegmentLayout:
    """Cut loops into states (Zhou et al. 2020, Section 3.2): shared zones, and private pieces.

    Collision segments (Definition 1) are found on the loops' curves, merged into zones and fitted to the
    vehicles, see `loopgate.abstraction.segments`. The rest is private and cut into pieces. A zone that a path
    passes several times in one round has a leg for each visit.

    Raises `ScenarioError` if two robots have the same loop, or a length is not positive; `RouteError` if a
    loop is too short for the vehicle.

    Parameters
    ----------
    loops
        One per robot; ids are unique.
    rho_m
        Safe radius [m]: points of two paths conflict within 2 rho.
    vehicle_length_m, min_gap_m
        Of the longest vehicle, which fits into each state.
    piece_m
        Longest private state [m], as far as vehicles can be held where it would be cut.
    """
    for what, value in (("rho", rho_m), ("piece", piece_m), ("vehicle length", vehicle_length_m)):
        if not value > 0.0:
            msg = f"segments: {what} {value:g} m; expected more than 0"
            raise ScenarioError(msg)
    for name, count in Counter(loop.id for loop in loops).items():
        if count > 1:
            msg = (
                f"segments: {count} vehicles on loop {name}, which holds one (one path, one robot); "
                f"use fewer vehicles, more loops, or --abstraction queues"
            )
            raise ScenarioError(msg)
    key = (tuple(loops), rho_m, vehicle_length_m, min_gap_m, piece_m)
    return _KEPT.get(
        key, lambda: _lay_out(loops, rho_m, needed_length_m(vehicle_length_m, min_gap_m), piece_m)
    )


_KEPT: Cache[SegmentLayout] = Cache(8)


def _lay_out(loops: Sequence[Loop], rho_m: float, need_m: float, piece_m: float) -> SegmentLayout:
    zones = make_zones(loops, collision_segments(loops, rho_m), need_m)
    return SegmentLayout(
        itineraries=tuple(_itinerary(loop, k, zones, need_m, piece_m) for k, loop in enumerate(loops)),
        warnings=tuple(zone_warnings(loops, zones, zone_state)),
    )


def make_segments(
    loops: Sequence[Loop],
    *,
    rho_m: float = DEFAULT_RHO_M,
    vehicle_length_m: float = 5.0,
    min_gap_m: float = 2.5,
    piece_m: float = 100.0,
    seed: int = 1,
    names: Sequence[str] | None = None,
    starts_m: Mapping[str, float] | None = None,
) -> Abstraction:
    """Cut loops into states (zones and private states), and place one vehicle on each loop.

    Raises `ScenarioError` if two vehicles start in one zone, or a vehicle does not fit where it starts;
    `RouteError` if a loop is too short for the vehicle.

    Parameters
    ----------
    loops, rho_m, vehicle_length_m, min_gap_m, piece_m
        As for `lay_out_segments`.
    seed, names, starts_m
        As for `place_vehicles`.
    """
    layout = lay_out_segments(
        loops, rho_m=rho_m, vehicle_length_m=vehicle_length_m, min_gap_m=min_gap_m, piece_m=piece_m
    )
    return place_vehicles(
        layout, vehicle_length_m=vehicle_length_m, seed=seed, names=names, starts_m=starts_m
    )


def place_vehicles(
    layout: SegmentLayout,
    *,
    vehicle_length_m: float = 5.0,
    seed: int = 1,
    names: Sequence[str] | None = None,
    starts_m: Mapping[str, float] | None = None,
) -> Abstraction:
    """Choose a start state for the vehicle of each loop: a private state if possible.

    Raises `ScenarioError` if two vehicles start in one zone, or a vehicle does not fit where it starts.

    Parameters
    ----------
    seed
        Decides where vehicles start.
    names
        Names of the robots; the loops' ids by default.
    starts_m
        Arc length of the front of vehicles that start at a place of their own, by robot name.
    """
    names = [way.loop.id for way in layout.itineraries] if names is None else names
    starts = choose_starts(
        layout.itineraries,
        names=names,
        vehicle_length_m=vehicle_length_m,
        rng=random.Random(seed),
        given_m=starts_m or {},
    )
    robots = (
        Robot(RobotId(name), tuple(leg.state for leg in itinerary.legs), closed=True, start=start.position)
        for name, itinerary, start in zip(names, layout.itineraries, starts, strict=True)
    )
    return Abstraction(
        name="segments",
        system=System(robots),
        itineraries=layout.itineraries,
        starts_m=tuple(start.front_m for start in starts),
        warnings=layout.warnings,
    )


def needed_length_m(vehicle_length_m: float, min_gap_m: float) -> float:
    """Return the length that a state needs for a vehicle to stand in it [m]."""
    return vehicle_length_m + min_gap_m + CLEARANCE_M


def zone_state(zone: int) -> StateId:
    """Return the name of a zone's state."""
    return StateId(f"zone{zone + 1}")


def _itinerary(loop: Loop, number: int, zones: Zones, need_m: float, piece_m: float) -> Itinerary:
    lap = loop.length_m
    visits = zones.visits[number]
    legs = [DrawnLeg(zone_state(v.zone), v.begin_m, v.end_m) for v in visits]
    if visits:
        ends = [v.end_m for v in visits]
        gaps = list(zip(ends, [v.begin_m for v in visits[1:]] + [visits[0].begin_m + lap], strict=True))
    else:
        end = loop.hold_before(lap)
        gaps = [(end - lap, end)]
    private = [piece for gap in gaps for piece in _pieces(loop, *gap, need_m, piece_m)]
    legs += [DrawnLeg(StateId(""), begin, end) for begin, end in private]
    # Every leg ends within the lap; the one across the loop's beginning begins below 0 and comes first.
    placed = sorted(
        (
            DrawnLeg(leg.state, leg.begin_m - shift, leg.end_m - shift)
            for leg in legs
            if (shift := _shift(leg, lap)) >= 0
        ),
        key=lambda leg: leg.begin_m,
    )
    named = []
    count = 0
    for leg in placed:
        count += not leg.state
        state = leg.state or StateId(f"{loop.id}/{count}")
        named.append(DrawnLeg(state, leg.begin_m, leg.end_m, line=loop.locate(leg.end_m)))
    return Itinerary(loop, tuple(named))


def _shift(leg: DrawnLeg, lap_m: float) -> float:
    return lap_m if leg.end_m > lap_m else 0.0


def _pieces(
    loop: Loop, begin_m: float, end_m: float, need_m: float, piece_m: float
) -> list[tuple[float, float]]:
    """Cut private road into pieces of at most `piece_m`, where lanes and the vehicle's length allow."""
    length = end_m - begin_m
    if length < need_m / 2.0:  # visits that touch, up to rounding
        return []
    count = math.ceil(length / piece_m)
    cuts = [begin_m]
    for k in range(1, count):
        cut = loop.hold_before(begin_m + k * length / count)
        if cut - cuts[-1] >= need_m and end_m - cut >= need_m:
            cuts.append(cut)
    return list(zip(cuts, [*cuts[1:], end_m], strict=True))
