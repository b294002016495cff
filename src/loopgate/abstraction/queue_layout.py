"""The abstraction queues, first part: cuts loops into places and crossings."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from loopgate.abstraction.itinerary import Crossing, DrawnLeg, Guide, Itinerary
from loopgate.abstraction.movements import (
    LEAST_CAPACITY,
    Conflicts,
    FreePart,
    Narrow,
    Passage,
    QueuePlace,
    Stretch,
    find_conflicts,
    find_foes,
    lay_stretches,
    least_change_m,
    reach_m,
    waiting_parts,
)
from loopgate.abstraction.swept import find_touches
from loopgate.abstraction.swept_paths import SweptPath, SweptPaths, drawn, swept_paths_of
from loopgate.arrays import Floats
from loopgate.cache import Cache
from loopgate.errors import LoopRefusal, RefusedLoopError
from loopgate.model import StateId
from loopgate.network.loop import AWAY_M, HOLD_MARGIN_M, LaneSpan, Loop
from loopgate.network.road import Connection, RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

_SHORTEST_M = 0.5
"""The shortest lane on which SUMO accepts a stop [m]."""


@dataclass(frozen=True, slots=True)
class LaneTurn:
    """A movement between two places, and the distance from the first place to its end [m]."""

    movement: Connection
    ahead_m: float


@dataclass(frozen=True, slots=True)
class LaneTarget:
    """A lane to reach: the lane of the next place, or a lane from which to change."""

    edge: str
    lane: int
    """`edge` and `lane`: the lane."""
    end_m: float
    """Where the place, or the change stretch, ends on the lane [m]."""
    ahead_m: float
    """Distance from the place before to its beginning [m]."""
    stops_m: float
    """Distance from the place before to that end [m]."""
    to_lane: int | None = None
    """The lane to change to; None for a place."""

    def guide(self) -> Guide:
        """Return the stop that leads a vehicle to the target lane."""
        position_m, stop_m = self.end_m - HOLD_MARGIN_M, self.stops_m - HOLD_MARGIN_M
        return Guide(self.edge, self.lane, position_m, self.ahead_m, self.to_lane, stop_m)


def find_guides(
    network: RoadNetwork, course: Sequence[LaneTurn | LaneTarget], vclass: str
) -> tuple[Guide, ...] | Connection:
    """Find the stops that keep a vehicle on the lanes of its loop from place to place.

    Without stops, SUMO chooses among the lanes after a movement by the part of the route that it sees. A
    vehicle with a stop on a lane takes the lanes that lead there. Where several sequences of lanes lead
    there, each lane in question gets a stop.

    `course`: the movements and lanes ahead, in order; the last is the next place.

    Returns
    -------
    tuple of Guide, or Connection
        The stops; or the movement whose next lane is too short for a stop.
    """
    guides: list[Guide] = []
    turns: list[LaneTurn] = []
    for item in course:
        if isinstance(item, LaneTurn):
            turns.append(item)
            continue
        choices = [turn for turn in turns if _ways(network, turn.movement, vclass) > 1]
        leads = bool(choices)
        if choices and _ways_round(network, turns, item.lane, vclass) > 1:
            leads = choices[-1] is turns[-1]
            for turn in choices[:-1] if leads else choices:
                c = turn.movement
                length_m = network.edges[c.to_edge].length_m
                if length_m < _SHORTEST_M:
                    return c
                guides.append(
                    LaneTarget(c.to_edge, c.to_lane, length_m, turn.ahead_m, turn.ahead_m + length_m).guide()
                )
        if leads or item.to_lane is not None:
            guides.append(item.guide())
        turns = []
    return tuple(guides)


def _ways(network: RoadNetwork, movement: Connection, vclass: str) -> int:
    """Return the number of lanes of the next edge to which the movement's lane leads."""
    between = network.between(movement.from_edge, movement.to_edge, vclass)
    return sum(c.from_lane == movement.from_lane for c in between)


def _ways_round(network: RoadNetwork, turns: Sequence[LaneTurn], lane: int, vclass: str) -> int:
    """Return the number of sequences of lanes over which the turns lead to a lane without lane changes."""
    ways = Counter({turns[0].movement.from_lane: 1})
    for turn in turns:
        onward: Counter[int] = Counter()
        for c in network.between(turn.movement.from_edge, turn.movement.to_edge, vclass):
            onward[c.to_lane] += ways[c.from_lane]
        ways = onward
    return ways[lane]


_BEHIND_M = np.arange(0.0, 1.6, 0.25)
"""Rears are checked up to this far beyond the lane [m]; farther on they are out of the way."""

_TURNED_BEHIND_M = np.arange(0.0, 5.1, 0.25)
"""The same where the movement is shorter than a vehicle, as in a U-turn [m]."""

_BACK = -0.7
"""Cosine of the angle from which a turn leads back."""

_BESIDE_M = 0.1
"""Space on either side of a waiting vehicle [m]."""

_LEAST_M = 0.1
"""Stop lines are at least this far before the end of a lane [m]."""


def tails_over(network: RoadNetwork, paths: SweptPaths) -> Mapping[str, float]:
    """Return for each lane how far before its end [m] a vehicle that has left it can still reach over it.

    In SUMO, a vehicle that stops at the end of a lane keeps no gap to vehicles beyond it. So stop lines must
    be farther back where paths turn sharply. Lanes with the usual stop line are left out.
    """
    found: dict[str, float] = {}
    for path, bodies in paths.items():
        inside = network.lanes[path.lane].internal
        if not (path.before and (inside or _turns_round(network, path))):
            continue
        behind_m = _BEHIND_M if inside else _TURNED_BEHIND_M
        xy, arc, _, begins = drawn(network, path)
        last_m = network.lanes[path.lane].length_m
        stiff = np.array(sorted(length for length, jointed in bodies.widths_m if not jointed))
        widths_m = np.array([bodies.widths_m[length, False] for length in stiff.tolist()])
        # Of a lane that comes twice, the nearer one.
        lanes = dict(reversed([*zip((path.lane, *path.before), begins, strict=True)]))
        for lane, begin_m in lanes.items():
            if network.lanes[lane].internal:
                continue
            end_m = begin_m + network.lanes[lane].length_m
            rear = np.repeat(end_m + behind_m, len(stiff))
            front = rear + np.tile(stiff, len(behind_m))
            on_it = (front >= 0.0) & (front <= last_m)
            half_m = np.tile(widths_m / 2, len(behind_m))
            beside_m = max(bodies.widths_m.values()) / 2 + _BESIDE_M
            swing = _swing_m(xy, arc, front[on_it], rear[on_it], half_m[on_it], end_m, beside_m)
            if swing > max(found.get(lane, 0.0), _LEAST_M):
                found[lane] = swing
    return found


def _turns_round(network: RoadNetwork, path: SweptPath) -> bool:
    """Return whether the lane leads back beside the lane before it, over one junction."""
    lanes = [network.lanes[name] for name in path.before]
    roads = [lane for lane in lanes if not lane.internal]
    if not (lanes[0].internal and roads):
        return False
    (ax, ay), (bx, by) = network.lanes[path.lane].shape[:2]
    (cx, cy), (dx, dy) = roads[0].shape[-2:]
    along = (bx - ax) * (dx - cx) + (by - ay) * (dy - cy)
    return along < _BACK * math.hypot(bx - ax, by - ay) * math.hypot(dx - cx, dy - cy)


def _swing_m(
    xy: Floats, arc: Floats, front: Floats, rear: Floats, half_m: Floats, end_m: float, beside_m: float
) -> float:
    """Return how far before the end of a lane bodies swing over it, up to `beside_m` from its middle [m]."""

    def at(metres: Floats) -> Floats:
        return np.stack([np.interp(metres, arc, xy[:, axis]) for axis in (0, 1)], axis=-1)

    end, before = at(np.array([end_m, end_m - 1.0]))
    along = (end - before) / max(np.hypot(*(end - before)), 1e-6)
    tail = at(rear)
    ahead = at(front) - tail
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-6)[:, None]
    side = half_m[:, None] * np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
    corners = np.concatenate([tail + side, tail - side]) - end
    beside = np.abs(corners @ np.array([-along[1], along[0]]))
    return float(np.max(-(corners @ along), where=beside <= beside_m, initial=0.0))


_MANY = 1_000_000
"""Stands for any number of vehicles."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a loop: a place, a passage over a stretch, a movement, or a lane too short to wait on.

    `begin_m`: arc length on the loop [m]. `at_m`: position on its edge where the piece ends [m].
    """

    begin_m: float
    length_m: float
    edge: str
    lane: int
    at_m: float
    place: QueuePlace | None = None
    passage: Passage | None = None
    movement: Connection | None = None


@dataclass(frozen=True, slots=True)
class QueueLayout:
    """Loops cut into places and crossings, before vehicles are placed."""

    places: Mapping[str, QueuePlace]
    """The places, by name, in the order of first use."""
    itineraries: Mapping[str, Itinerary]
    """The paths, by loop id."""
    conflicts: Conflicts
    """The conflicts among all movements that the loops use."""
    stretches: Mapping[str, Stretch]
    """Stretches where loops change lanes, and narrow streets, by edge."""


def lay_out_queues(
    network: RoadNetwork,
    users: Sequence[tuple[Loop, VehicleType]],
    *,
    counted: bool = False,
    own_lengths: bool = False,
) -> QueueLayout:
    """Cut loops into places (lanes) and crossings (movements, and lanes too short to wait on).

    Raises `RefusedLoopError` if a loop cannot be cut into queues; the text says why.

    Parameters
    ----------
    users
        The loop and the type of each vehicle; further vehicles of the same loops and types may come.
    counted
        Whether no further vehicles come. Then a place has as many slots as any of the vehicles on its loops
        fit; otherwise as many as vehicles of the longest type on its lane fit. Of vehicles that drive once
        any number may come to a place, since they choose lanes as they drive.
    own_lengths
        Whether vehicles keep their extra metres ahead. Then two slots are enough for a place where one of the
        longest vehicles fits beside another.
    """
    counts = Counter(users)
    if not counted or len({kind.needed_m for _, kind in users}) == 1:
        counts = Counter(dict.fromkeys(counts, _MANY))  # how many there are of a kind makes no difference
    counts.update({(loop, kind): _MANY for loop, kind in counts if not loop.closed})
    if not network.content:
        return _lay_out(network, counts, own_lengths=own_lengths)
    key = network.content, tuple(counts.items()), own_lengths
    return _KEPT.get(key, lambda: _lay_out(network, counts, own_lengths=own_lengths))


_KEPT: Cache[QueueLayout] = Cache(8)


def _lay_out(
    network: RoadNetwork, counts: Mapping[tuple[Loop, VehicleType], int], *, own_lengths: bool
) -> QueueLayout:
    users = tuple(counts)
    courses = swept_paths_of(network, users)
    touches = find_touches(network, courses)
    parts = waiting_parts(network, touches, tails_over(network, courses))
    plan = _Plan(network, counts, parts, own_lengths=own_lengths)
    loops = {loop.id: loop for loop, _ in users}
    chains = {name: plan.chain(loop) for name, loop in loops.items()}
    classes: dict[str, dict[str, None]] = {}
    refused: dict[str, LoopRefusal] = {}
    for loop, kind in {(loop.id, kind): (loop, kind) for loop, kind in users}.values():
        classes.setdefault(loop.id, {})[kind.vclass] = None
        refusal = plan.why_not(loop, chains[loop.id], kind)
        if refusal:
            refused.setdefault(loop.id, refusal)
    if refused:
        raise RefusedLoopError(refused)
    pieces = [piece for chain in chains.values() for piece in chain]
    movements = [p.movement for p in pieces if p.movement is not None]
    passages = [p.passage for p in pieces if p.passage is not None]
    at_once = [passage for passage in passages if not plan.stretches[passage.edge].begin_m]
    conflicts = find_conflicts(network, movements, touches, _places_on(pieces), at_once)
    legs = _Legs(network, conflicts, find_foes(passages, plan.narrow))
    return QueueLayout(
        places={p.place.name: p.place for p in pieces if p.place is not None},
        itineraries={
            name: Itinerary(loop, tuple(legs.of(loop, chains[name], tuple(classes[name]))), keeps_lane=True)
            for name, loop in loops.items()
        },
        conflicts=conflicts,
        stretches=plan.stretches,
    )


def _places_on(pieces: Iterable[Piece]) -> dict[str, FreePart]:
    """Return the beginning of the first place and the end of the last place on each lane."""
    found: dict[str, FreePart] = {}
    for piece in pieces:
        if piece.place is not None and not piece.place.away:
            lane, begin_m = f"{piece.edge}_{piece.lane}", piece.at_m - piece.length_m
            known = found.get(lane, FreePart(begin_m, piece.at_m))
            found[lane] = FreePart(min(known.begin_m, begin_m), max(known.end_m, piece.at_m))
    return found


def why_not(
    network: RoadNetwork, loop: Loop, kind: VehicleType = DEFAULT_TYPE, near: Narrow | None = None
) -> LoopRefusal | None:
    """Return why a loop cannot be cut into queues; None if it can.

    The loop is checked alone; together with other loops its places may be shorter. `near`: as in
    `lay_stretches`.
    """
    plan = _Plan(network, {(loop, kind): _MANY}, near=near)
    try:
        return plan.why_not(loop, plan.chain(loop), kind)
    except RefusedLoopError as error:
        return error.refused[loop.id]


class _Plan:
    """The stretches of a set of loops, and the lengths of the vehicles on each lane."""

    def __init__(
        self,
        network: RoadNetwork,
        counts: Mapping[tuple[Loop, VehicleType], int],
        parts: Mapping[str, FreePart] | None = None,
        near: Narrow | None = None,
        *,
        own_lengths: bool = False,
    ) -> None:
        self._network, users = network, tuple(counts)
        self._parts = parts or {}
        wide_m = reach_m(kind.width_m for _, kind in users)
        self.stretches, self.narrow = lay_stretches(network, users, self._parts, reach_m=wide_m, near=near)
        needs: dict[str, Counter[float]] = {}
        self._stays: dict[str, float] = {}
        for (loop, kind), count in counts.items():
            for span in loop.roads:
                # A stretch cuts its lanes at the same places, so the longest on the edge counts.
                on = self._on(span)
                needs.setdefault(on, Counter())[kind.needed_m] += count
                stays_m = (kind.needed_m if loop.closed else 0.0) if own_lengths else math.inf
                self._stays[on] = max(self._stays.get(on, 0.0), stays_m)
        self._needed = {on: tuple(sorted(some.items(), reverse=True)) for on, some in needs.items()}

    def chain(self, loop: Loop) -> list[Piece]:
        """Cut a loop into pieces, in driving order from its beginning."""
        pieces: list[Piece] = []
        for made, span in zip(loop.movements, loop.roads, strict=loop.closed):
            leaving = self._network.outgoing(span.edge)
            movement = next((c for c in leaving if (c.id, c.via) == (made.id, made.via)), None)
            if movement is None:  # the loop was made for other roads
                why = LoopRefusal(
                    f"has no movement from lane {span.lane_id} to edge {made.to_edge}", span.edge
                )
                raise RefusedLoopError({loop.id: why})
            pieces += self._on_edge(span)
            length = self._network.over_m(movement)
            pieces.append(Piece(span.end_m, length, span.edge, span.lane, span.length_m, movement=movement))
        if loop.closed:
            return pieces
        last = loop.roads[-1]
        pieces += self._on_edge(last)
        first = next((k for k, piece in enumerate(pieces) if piece.place is not None), len(pieces))
        return [*pieces[first:], self._away(last, pieces[-1])]

    def _away(self, last: LaneSpan, piece: Piece) -> Piece:
        """Return the piece beyond the last one, where vehicles arrive.

        If the last piece is a place, vehicles arrive at its stop line, where no other vehicle can touch them.
        """
        at_m = piece.at_m if piece.place is not None else last.length_m
        place = QueuePlace(f"away {last.lane_id}", AWAY_M, self._needs(last), away=True)
        return Piece(last.begin_m + at_m, AWAY_M, last.edge, last.lane, at_m, place=place)

    def _needs(self, span: LaneSpan) -> tuple[tuple[float, int], ...]:
        return self._needed[self._on(span)]

    def _on(self, span: LaneSpan) -> str:
        return span.edge if self._stretch(span) else span.lane_id

    def _stretch(self, span: LaneSpan) -> Stretch | None:
        """Return the stretch on a lane, if there is one."""
        stretch = self.stretches.get(span.edge)
        return stretch if stretch is not None and stretch.covers(span.lane) else None

    def _on_edge(self, span: LaneSpan) -> Iterator[Piece]:
        stretch = self._stretch(span)
        # The road's own length: that of a span is a difference of arc lengths, rounded by loop.
        length_m = self._network.lanes[span.lane_id].length_m
        if stretch is None:
            part = self._parts.get(span.lane_id, FreePart(0.0, length_m))
            yield self._waiting(span, span.lane, *part, span.lane_id)
            return
        if stretch.begin_m > 0:
            name = f"{span.edge}_{span.lane_in}/1"
            yield self._waiting(span, span.lane_in, stretch.first_m, stretch.begin_m, name)
        yield Piece(
            span.begin_m + stretch.begin_m,
            stretch.end_m - stretch.begin_m,
            span.edge,
            span.lane_in,
            stretch.end_m,
            passage=stretch.passage(span.lane_in, span.lane),
        )
        if stretch.end_m < length_m:
            yield self._waiting(span, span.lane, stretch.end_m, stretch.last_m, f"{span.lane_id}/2", stretch)

    def _waiting(
        self, span: LaneSpan, lane: int, begin: float, end: float, name: str, behind: Stretch | None = None
    ) -> Piece:
        """Return a piece with a place, if two vehicles fit. `behind`: the stretch before it, if any."""
        before = behind if behind is not None and behind.begin_m > 0 else None
        place = QueuePlace(
            name, end - begin, self._needs(span), stays_m=self._stays[self._on(span)], stretch=before
        )
        return Piece(
            span.begin_m + begin,
            end - begin,
            span.edge,
            lane,
            end,
            place=place if place.capacity >= LEAST_CAPACITY else None,
        )

    def why_not(self, loop: Loop, chain: Sequence[Piece], kind: VehicleType) -> LoopRefusal | None:
        """Return the reason why a loop cannot be cut into queues, or None."""
        least_m = least_change_m(kind.needed_m)
        for span in loop.roads:
            if span.lane_in != span.lane and span.length_m < least_m:
                return LoopRefusal(
                    f"must change from lane {span.lane_in} to lane {span.lane} on edge {span.edge}, which is "
                    f"{span.length_m:.1f} m long; that takes {least_m:.1f} m: "
                    "lead it another way",
                    span.edge,
                )
        if len({piece.place.name for piece in chain if piece.place is not None}) < LEAST_CAPACITY:
            return LoopRefusal("has fewer than two places in which two vehicles can queue; make it longer")
        for here, between, after in _ways_on(chain):
            if here.place is not None and here.place == after.place:
                return LoopRefusal(
                    f"comes back from lane {here.edge}_{here.lane} to itself, and vehicles can queue nowhere "
                    "between; lead it another way",
                    here.edge,
                )
            guides = find_guides(self._network, list(_course(loop, here, between, after)), kind.vclass)
            if isinstance(guides, Connection):
                return LoopRefusal(
                    f"leads from lane {guides.from_id} to edge {guides.to_edge}, which "
                    f"is too short to tell SUMO on which of its lanes to go on; lead it another way",
                    guides.from_edge,
                )
        return None


def _ways_on(chain: Sequence[Piece]) -> Iterator[tuple[Piece, list[Piece], Piece]]:
    """Yield each place of a loop, the crossing after it, and the next place."""
    first = next(k for k, piece in enumerate(chain) if piece.place is not None)
    here, between = chain[first], list[Piece]()
    for piece in (*chain[first + 1 :], *chain[: first + 1]):
        if piece.place is None:
            between.append(piece)
            continue
        yield here, between, piece
        here, between = piece, []


def _ahead_m(loop: Loop, here: Piece, piece: Piece) -> float:
    """Return how far after the stop line of a place a piece begins [m]."""
    line_m = here.begin_m + here.length_m - HOLD_MARGIN_M
    return round((piece.begin_m - line_m) % loop.lap_m, 6)


def _course(
    loop: Loop, here: Piece, between: Sequence[Piece], after: Piece
) -> Iterator[LaneTurn | LaneTarget]:
    """Yield the movements and lanes between two places, for `find_guides`."""
    for piece in between:
        passage, ahead = piece.passage, _ahead_m(loop, here, piece)
        if piece.movement is not None:
            yield LaneTurn(piece.movement, ahead + piece.length_m)
        elif passage is not None and passage.changes:
            yield LaneTarget(
                piece.edge, piece.lane, piece.at_m, ahead, ahead + piece.length_m, passage.to_lane
            )
    # A vehicle that arrives stays on its last lane, so guides to that lane end where the lane begins.
    ahead, away = _ahead_m(loop, here, after), after.place is not None and after.place.away
    from_m, stops_m = (ahead - after.at_m, ahead) if away else (ahead, ahead + after.length_m)
    yield LaneTarget(after.edge, after.lane, after.at_m, from_m, stops_m)


class _Legs:
    """Makes the legs of loops; loops share the objects of equal crossings."""

    def __init__(
        self, network: RoadNetwork, conflicts: Conflicts, foes: Mapping[str, frozenset[str]]
    ) -> None:
        self._network, self._conflicts, self._foes = network, conflicts, foes
        self._made: dict[object, Crossing] = {}

    def of(self, loop: Loop, chain: Sequence[Piece], classes: Sequence[str]) -> Iterator[DrawnLeg]:
        """Yield the legs of a loop on which vehicles of these classes drive."""
        for here, between, after in _ways_on(chain):
            crossings: list[Crossing] = []
            limits: list[tuple[float, float]] = []
            before: Connection | None = None
            for piece in between:
                ahead = _ahead_m(loop, here, piece)
                limits += self._limits(piece, ahead)
                if piece.movement is not None:
                    crossings.append(self._over_junction(piece.movement, ahead, tuple(limits), before))
                    before = piece.movement
                elif piece.passage is not None:
                    crossings.append(self._over_stretch(piece.passage, ahead))
            course = list(_course(loop, here, between, after))
            # An unnecessary stop does no harm: it lies on the loop's own lane.
            guides = max((find_guides(self._network, course, vclass) for vclass in classes), key=_number)
            end_m = here.begin_m + here.length_m - HOLD_MARGIN_M
            yield DrawnLeg(
                StateId(here.place.name if here.place else ""),
                here.begin_m,
                end_m,
                tuple(crossings),
                loop.locate(end_m)._replace(lane=here.lane),
                guides=() if isinstance(guides, Connection) else guides,
                slot_m=here.place.needed_m if here.place else 0.0,
                away=bool(here.place and here.place.away),
            )

    def _limits(self, piece: Piece, ahead_m: float) -> Iterator[tuple[float, float]]:
        """Yield the speed limits on a piece and where each begins."""
        if piece.movement is None:
            yield ahead_m, self._network.edges[piece.edge].lanes[piece.lane].speed_mps
            return
        for lane in piece.movement.via:
            yield ahead_m, self._network.lanes[lane].speed_mps
            ahead_m += self._network.lanes[lane].length_m

    def _over_junction(
        self,
        made: Connection,
        ahead_m: float,
        limits: tuple[tuple[float, float], ...],
        before: Connection | None,
    ) -> Crossing:
        """Return the crossing of a movement; `before` is the crossing before it on the same leg."""
        with_others = before is not None and (before.id, made.id) in self._conflicts.with_others
        followed = before.id if before is not None and with_others else ""
        key = made.id, ahead_m, limits, followed
        if key not in self._made:
            overlaps = sorted(self._conflicts.overlaps[made.id].items())
            self._made[key] = Crossing(
                made.id,
                self._conflicts.foes[made.id] - {followed},
                {foe: (ahead_m + begin, ahead_m + end) for foe, (begin, end) in overlaps if foe != followed},
                self._conflicts.speeds_mps[made.id],
                ahead_m,
                # SUMO may let it wait before the last of its lanes inside, or before all.
                ahead_m + sum(self._network.lanes[lane].length_m for lane in made.via[:-1]),
                limits,
                made.from_id,
                made.to_id,
                {
                    foe: table.shifted(ahead_m)
                    for foe, table in sorted(self._conflicts.sized.get(made.id, {}).items())
                    if foe != followed
                },
            )
        return self._made[key]

    def _over_stretch(self, passage: Passage, ahead_m: float) -> Crossing:
        lanes = self._network.edges[passage.edge].lanes
        return Crossing(
            passage.id,
            self._foes[passage.id],
            speed_mps=lanes[passage.lane].speed_mps,
            ahead_m=ahead_m,
            from_lane=lanes[passage.lane].id,
            to_lane=lanes[passage.to_lane].id,
            stretch=passage.edge if passage.changes else "",
        )


def _number(guides: tuple[Guide, ...] | Connection) -> int:
    return 0 if isinstance(guides, Connection) else len(guides)
