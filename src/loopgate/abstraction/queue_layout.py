"""Places where vehicles queue, and the crossings between them: the plan of the queues abstraction."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from loopgate.abstraction.courses import courses_of
from loopgate.abstraction.guides import Target, Turn, find_guides
from loopgate.abstraction.itinerary import Crossing, Guide, Itinerary, Leg
from loopgate.abstraction.movements import Conflicts, Overlap, find_conflicts, reach_m
from loopgate.abstraction.stretches import (
    CLEARANCE_M,
    LEAST_CAPACITY,
    Narrow,
    Passage,
    Stretch,
    find_foes,
    lay_stretches,
    least_change_m,
)
from loopgate.abstraction.swept import find_touches
from loopgate.abstraction.tails import tails_over
from loopgate.abstraction.waiting import Part, waiting_parts
from loopgate.errors import RefusedLoopError, RouteError
from loopgate.keeping import Kept
from loopgate.model import StateId
from loopgate.network.loop import AWAY_M, HOLD_MARGIN_M, LaneSpan, Loop
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

AWAY = "away "
"""Names of the places of those who have arrived begin with it; the lane follows on which they did."""

_ROUNDING = 1e-9

_MANY = 1_000_000
"""As many vehicles as anybody may have."""


@dataclass(frozen=True, slots=True)
class QueuePlace:
    """Where vehicles queue: a lane, or the part of it before or behind a stretch for changing lanes."""

    name: str
    """The lane's id; with ``/1`` for the part before a stretch, ``/2`` for the part behind it."""
    length_m: float
    needs: tuple[tuple[float, int], ...]
    """Lengths of the vehicles that visit it, with their gaps [m], and how many there are of each at most,
    longest first."""

    @property
    def needed_m(self) -> float:
        """Length of the longest vehicle that visits it, with its gap [m]."""
        return self.needs[0][0]

    @property
    def capacity(self) -> int:
        """How many vehicles it holds, whichever they are: the longest first."""
        left_m = self.length_m - HOLD_MARGIN_M - CLEARANCE_M
        held = 0
        for need_m, count in self.needs:
            fitting = math.floor(left_m / need_m + _ROUNDING)
            if fitting < count:
                return held + fitting
            held += count
            left_m -= count * need_m
        return held + math.floor(left_m / self.needs[-1][0] + _ROUNDING)


@dataclass(frozen=True, slots=True)
class QueueLayout:
    """Loops cut into places and crossings, before vehicles are placed."""

    places: Mapping[str, QueuePlace]
    """By name; in the order of first use."""
    itineraries: Mapping[str, Itinerary]
    """By loop id."""
    conflicts: Conflicts
    """Among all movements over junctions that the loops use."""
    stretches: Mapping[str, Stretch]
    """By edge: where loops change lanes, and narrow streets."""


def lay_out_queues(
    network: RoadNetwork, users: Sequence[tuple[Loop, VehicleType]], *, counted: bool = False
) -> QueueLayout:
    """Cut loops into places (lanes) and crossings (movements, with what lies between that nobody waits on).

    Raises `RefusedLoopError` if a loop cannot work as queues; the text says why.

    Parameters
    ----------
    users
        For each vehicle its loop and its type; there may be any number of vehicles like it.
    counted
        Whether these are all vehicles that there ever are. Then a place holds as many as fit whichever they
        are, else as many as the longest visitor of its lane leaves room for.
    """
    counts = Counter(users)
    if not counted or len({kind.length_m + kind.min_gap_m for _, kind in users}) == 1:
        counts = Counter(dict.fromkeys(counts, _MANY))  # how many there are of a kind makes no difference
    if not network.content:
        return _lay_out(network, counts)
    return _KEPT.get((network.content, tuple(counts.items())), lambda: _lay_out(network, counts))


_KEPT: Kept[QueueLayout] = Kept(8)


def _lay_out(network: RoadNetwork, counts: Mapping[tuple[Loop, VehicleType], int]) -> QueueLayout:
    users = tuple(counts)
    courses = courses_of(network, users)
    touches = find_touches(network, courses)
    plan = _Plan(network, counts, waiting_parts(network, touches, tails_over(network, courses)))
    loops = {loop.id: loop for loop, _ in users}
    chains = {name: plan.chain(loop) for name, loop in loops.items()}
    classes: dict[str, dict[str, None]] = {}
    refused: dict[str, str] = {}
    for loop, kind in {(loop.id, kind): (loop, kind) for loop, kind in users}.values():
        classes.setdefault(loop.id, {})[kind.vclass] = None
        reason = plan.why_not(loop, chains[loop.id], kind)
        if reason:
            refused.setdefault(loop.id, reason)
    if refused:
        raise RefusedLoopError(*next(iter(refused.items())), abstraction="queues", refused=refused)
    pieces = [piece for chain in chains.values() for piece in chain]
    conflicts = find_conflicts(
        network,
        (p.movement for p in pieces if p.movement is not None),
        touches,
        _places_on(pieces),
    )
    foes = find_foes((p.passage for p in pieces if p.passage is not None), plan.narrow)
    alike: dict[object, Crossing] = {}
    return QueueLayout(
        places={p.place.name: p.place for p in pieces if p.place is not None},
        itineraries={
            name: Itinerary(
                name,
                loops[name].lap_m,
                tuple(_legs(network, loops[name], chain, conflicts, foes, tuple(classes[name]), alike)),
            )
            for name, chain in chains.items()
        },
        conflicts=conflicts,
        stretches=plan.stretches,
    )


def _places_on(pieces: Iterable[_Piece]) -> dict[str, Part]:
    """Return where on each lane the first place begins and the last one ends."""
    found: dict[str, Part] = {}
    for piece in pieces:
        if piece.place is not None and not piece.away:
            lane, begin_m = f"{piece.edge}_{piece.lane}", piece.at_m - piece.length_m
            known = found.get(lane, Part(begin_m, piece.at_m))
            found[lane] = Part(min(known.begin_m, begin_m), max(known.end_m, piece.at_m))
    return found


def why_not(
    network: RoadNetwork, loop: Loop, kind: VehicleType = DEFAULT_TYPE, near: Narrow | None = None
) -> str:
    """Return why a loop cannot work as queues, as the end of a sentence; empty if it can.

    It is looked at by itself: where its ways and those of other loops touch there can be less room. `near`
    is as in `lay_stretches`.
    """
    plan = _Plan(network, {(loop, kind): _MANY}, near=near)
    return plan.why_not(loop, plan.chain(loop), kind)


@dataclass(frozen=True, slots=True)
class _Piece:
    """A part of a loop: a place, a passage over a stretch, a movement, or a lane too short to wait on.

    `begin_m` is an arc length on the loop, `at_m` where on its edge the piece ends [m]. Behind the end of a
    route that is driven once all are `away`: a place that is never full.
    """

    begin_m: float
    length_m: float
    edge: str
    lane: int
    at_m: float
    place: QueuePlace | None = None
    passage: Passage | None = None
    movement: Connection | None = None
    away: bool = False


class _Plan:
    """What of the network a set of loops uses as stretches, and how long their vehicles are."""

    def __init__(
        self,
        network: RoadNetwork,
        counts: Mapping[tuple[Loop, VehicleType], int],
        parts: Mapping[str, Part] | None = None,
        near: Narrow | None = None,
    ) -> None:
        self._network, users = network, tuple(counts)
        self._parts = parts or {}
        wide_m = reach_m(kind.width_m for _, kind in users)
        self.stretches, self.narrow = lay_stretches(network, users, self._parts, reach_m=wide_m, near=near)
        needs: dict[str, Counter[float]] = {}
        for (loop, kind), count in counts.items():
            for span in loop.spans:
                if not span.internal:
                    # A stretch cuts all lanes of its edge at the same places, so the edge's longest counts.
                    on = span.edge if span.edge in self.stretches else span.lane_id
                    needs.setdefault(on, Counter())[kind.length_m + kind.min_gap_m] += count
        self._needed = {on: tuple(sorted(some.items(), reverse=True)) for on, some in needs.items()}

    def chain(self, loop: Loop) -> list[_Piece]:
        """Cut a loop into pieces, in driving order from its beginning."""
        pieces: list[_Piece] = []
        movements, roads = _movements(self._network, loop), _roads(loop)
        for movement, span in zip(movements, roads, strict=loop.closed):
            pieces += self._on_edge(span)
            length = sum(self._network.lanes[lane].length_m for lane in movement.via)
            pieces.append(_Piece(span.end_m, length, span.edge, span.lane, span.length_m, movement=movement))
        if loop.closed:
            return pieces
        pieces += self._on_edge(roads[-1])
        first = next((k for k, piece in enumerate(pieces) if piece.place is not None), len(pieces))
        return [*pieces[first:], self._away(roads[-1], pieces[-1])]

    def _away(self, last: LaneSpan, piece: _Piece) -> _Piece:
        """Return where those are who have arrived on a lane, from the end of the last piece of it on.

        In a place nobody arrives beyond its line, where others could touch those who do.
        """
        at_m = piece.at_m if piece.place is not None else last.length_m
        place = QueuePlace(f"{AWAY}{last.lane_id}", AWAY_M, self._needs(last))
        return _Piece(last.begin_m + at_m, AWAY_M, last.edge, last.lane, at_m, place=place, away=True)

    def _needs(self, span: LaneSpan) -> tuple[tuple[float, int], ...]:
        return self._needed[span.edge if span.edge in self.stretches else span.lane_id]

    def _on_edge(self, span: LaneSpan) -> Iterator[_Piece]:
        stretch = self.stretches.get(span.edge)
        # The road's own length: that of a span is a difference of arc lengths, rounded by loop.
        length_m = self._network.lanes[span.lane_id].length_m
        if stretch is None:
            part = self._parts.get(span.lane_id, Part(0.0, length_m))
            yield self._waiting(span, span.lane, *part, span.lane_id)
            return
        if stretch.begin_m > 0:
            name = f"{span.edge}_{span.lane_in}/1"
            yield self._waiting(span, span.lane_in, stretch.first_m, stretch.begin_m, name)
        yield _Piece(
            span.begin_m + stretch.begin_m,
            stretch.end_m - stretch.begin_m,
            span.edge,
            span.lane_in,
            stretch.end_m,
            passage=stretch.passage(span.lane_in, span.lane),
        )
        if stretch.end_m < length_m:
            yield self._waiting(span, span.lane, stretch.end_m, stretch.last_m, f"{span.lane_id}/2")

    def _waiting(self, span: LaneSpan, lane: int, begin: float, end: float, name: str) -> _Piece:
        place = QueuePlace(name, end - begin, self._needs(span))
        return _Piece(
            span.begin_m + begin,
            end - begin,
            span.edge,
            lane,
            end,
            place=place if place.capacity >= LEAST_CAPACITY else None,
        )

    def why_not(self, loop: Loop, chain: Sequence[_Piece], kind: VehicleType) -> str:
        """Return what keeps a loop from working as queues; empty if nothing does."""
        for span in _roads(loop):
            needed = kind.length_m + kind.min_gap_m
            if span.lane_in != span.lane and span.length_m < least_change_m(needed):
                return (
                    f"must change from lane {span.lane_in} to lane {span.lane} on edge {span.edge}, which is "
                    f"{span.length_m:.1f} m long; that takes {least_change_m(needed):.1f} m: "
                    "lead it another way"
                )
        if len({piece.place.name for piece in chain if piece.place is not None}) < LEAST_CAPACITY:
            return "has fewer than two places in which two vehicles can queue; make it longer"
        for here, between, after in _ways_on(chain):
            if here.place is not None and here.place == after.place:
                return (
                    f"comes back from lane {here.edge}_{here.lane} to itself, and vehicles can queue nowhere "
                    "between; lead it another way"
                )
            guides = find_guides(self._network, list(_course(loop, here, between, after)), kind.vclass)
            if isinstance(guides, Connection):
                return (
                    f"leads from lane {guides.from_edge}_{guides.from_lane} to edge {guides.to_edge}, which "
                    f"is too short to tell SUMO on which of its lanes to go on; lead it another way"
                )
        return ""


def _roads(loop: Loop) -> list[LaneSpan]:
    return [span for span in loop.spans if not span.internal]


def _movements(network: RoadNetwork, loop: Loop) -> list[Connection]:
    """Return the movement that follows each edge of the loop; none follows the last of an open one."""
    found: list[Connection] = []
    spans = loop.spans
    for number, span in enumerate(spans):
        if span.internal or (number + 1 == len(spans) and not loop.closed):
            continue
        via = []
        k = number + 1
        while k < len(spans) and spans[k].internal:
            via.append(spans[k].lane_id)
            k += 1
        following = spans[k % len(spans)]
        for c in network.outgoing(span.edge):
            if (c.from_lane, c.to_edge, c.to_lane) == (span.lane, following.edge, following.lane_in) and (
                c.via == tuple(via)
            ):
                found.append(c)
                break
        else:
            msg = f"loop {loop.id}: no movement leads from lane {span.lane_id} to edge {following.edge}"
            raise RouteError(msg)
    return found


def _ways_on(chain: Sequence[_Piece]) -> Iterator[tuple[_Piece, list[_Piece], _Piece]]:
    """Yield each place of a loop, what lies between it and the next, and the next."""
    first = next(k for k, piece in enumerate(chain) if piece.place is not None)
    here, between = chain[first], list[_Piece]()
    found: list[tuple[_Piece, list[_Piece], _Piece]] = []
    for piece in (*chain[first + 1 :], *chain[: first + 1]):
        if piece.place is None:
            between.append(piece)
            continue
        found.append((here, between, piece))
        here, between = piece, []
    yield from found


def _ahead_m(loop: Loop, here: _Piece, piece: _Piece) -> float:
    """Return how far after the stop line of a place a piece begins [m]."""
    line_m = here.begin_m + here.length_m - HOLD_MARGIN_M
    return round((piece.begin_m - line_m) % loop.lap_m, 6)


def _course(loop: Loop, here: _Piece, between: Sequence[_Piece], after: _Piece) -> Iterator[Turn | Target]:
    """Yield what `find_guides` has to know of the way from one place to the next."""
    for piece in between:
        passage, ahead = piece.passage, _ahead_m(loop, here, piece)
        if piece.movement is not None:
            yield Turn(piece.movement, ahead + piece.length_m)
        elif passage is not None and passage.changes:
            yield Target(piece.edge, piece.lane, piece.at_m, ahead, passage.to_lane)
    # Who arrives is never past its last lane: what leads to that has done its work where the lane begins.
    on_lane_m = after.at_m if after.away else 0.0
    yield Target(after.edge, after.lane, after.at_m, _ahead_m(loop, here, after) - on_lane_m)


def _legs(
    network: RoadNetwork,
    loop: Loop,
    chain: Sequence[_Piece],
    conflicts: Conflicts,
    foes: Mapping[str, frozenset[str]],
    classes: Sequence[str],
    alike: dict[object, Crossing],
) -> Iterator[Leg]:
    """Yield the legs of a loop; crossings that are the same on several are one object, found in `alike`."""
    for here, between, after in _ways_on(chain):
        crossings: list[Crossing] = []
        limits: list[tuple[float, float]] = []
        for piece in between:
            ahead = _ahead_m(loop, here, piece)
            limits += _limits(network, piece, ahead)
            if piece.movement is not None:
                name = piece.movement.id
                key = name, ahead, tuple(limits)
                if key not in alike:
                    alike[key] = Crossing(
                        name,
                        conflicts.foes[name],
                        _moved(conflicts.overlaps[name], ahead),
                        conflicts.speeds_mps[name],
                        ahead,
                        _wait_m(network, piece.movement, ahead),
                        tuple(limits),
                    )
                crossings.append(alike[key])
            elif piece.passage is not None:
                name = piece.passage.id
                speed = network.edges[piece.edge].lanes[piece.lane].speed_mps
                crossings.append(Crossing(name, foes[name], speed_mps=speed, ahead_m=ahead))
        course = list(_course(loop, here, between, after))
        # A stop too many does no harm: it lies on the loop's own lane.
        guides = max((find_guides(network, course, vclass) for vclass in classes), key=_number)
        yield Leg(
            StateId(here.place.name if here.place else ""),
            here.begin_m,
            here.begin_m + here.length_m - HOLD_MARGIN_M,
            tuple(crossings),
            lane=here.lane,
            guides=() if isinstance(guides, Connection) else guides,
            slot_m=here.place.needed_m if here.place else 0.0,
        )


def _number(guides: tuple[Guide, ...] | Connection) -> int:
    return 0 if isinstance(guides, Connection) else len(guides)


def _moved(overlaps: Mapping[str, Overlap], ahead_m: float) -> Mapping[str, Overlap]:
    return {foe: (ahead_m + begin, ahead_m + end) for foe, (begin, end) in sorted(overlaps.items())}


def _wait_m(network: RoadNetwork, movement: Connection, ahead_m: float) -> float:
    """Return where the last waiting point of a movement is: before the last of its lanes inside, or all."""
    return ahead_m + sum(network.lanes[lane].length_m for lane in movement.via[:-1])


def _limits(network: RoadNetwork, piece: _Piece, ahead_m: float) -> Iterator[tuple[float, float]]:
    """Yield from where on there is which speed limit on a piece."""
    if piece.movement is None:
        yield ahead_m, network.edges[piece.edge].lanes[piece.lane].speed_mps
        return
    for lane in piece.movement.via:
        yield ahead_m, network.lanes[lane].speed_mps
        ahead_m += network.lanes[lane].length_m
