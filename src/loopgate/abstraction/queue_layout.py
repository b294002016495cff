"""Places where vehicles queue, and the crossings between them: the plan of the queues abstraction."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from loopgate.abstraction.courses import courses_of
from loopgate.abstraction.guides import find_guides
from loopgate.abstraction.itinerary import Crossing, Itinerary
from loopgate.abstraction.movements import Conflicts, find_conflicts, reach_m
from loopgate.abstraction.queue_legs import Piece, QueuePlace, course_of, legs_of, ways_on
from loopgate.abstraction.stretches import (
    LEAST_CAPACITY,
    Narrow,
    Stretch,
    find_foes,
    lay_stretches,
    least_change_m,
)
from loopgate.abstraction.swept import find_touches
from loopgate.abstraction.tails import tails_over
from loopgate.abstraction.waiting import Part, waiting_parts
from loopgate.errors import Refusal, RefusedLoopError
from loopgate.keeping import Kept
from loopgate.network.loop import AWAY_M, LaneSpan, Loop
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

_MANY = 1_000_000
"""As many vehicles as anybody may have."""


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
    refused: dict[str, Refusal] = {}
    for loop, kind in {(loop.id, kind): (loop, kind) for loop, kind in users}.values():
        classes.setdefault(loop.id, {})[kind.vclass] = None
        refusal = plan.why_not(loop, chains[loop.id], kind)
        if refusal:
            refused.setdefault(loop.id, refusal)
    if refused:
        raise RefusedLoopError(refused, abstraction="queues")
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
                tuple(legs_of(network, loops[name], chain, conflicts, foes, tuple(classes[name]), alike)),
            )
            for name, chain in chains.items()
        },
        conflicts=conflicts,
        stretches=plan.stretches,
    )


def _places_on(pieces: Iterable[Piece]) -> dict[str, Part]:
    """Return where on each lane the first place begins and the last one ends."""
    found: dict[str, Part] = {}
    for piece in pieces:
        if piece.place is not None and not piece.place.away:
            lane, begin_m = f"{piece.edge}_{piece.lane}", piece.at_m - piece.length_m
            known = found.get(lane, Part(begin_m, piece.at_m))
            found[lane] = Part(min(known.begin_m, begin_m), max(known.end_m, piece.at_m))
    return found


def why_not(
    network: RoadNetwork, loop: Loop, kind: VehicleType = DEFAULT_TYPE, near: Narrow | None = None
) -> Refusal | None:
    """Return why a loop cannot work as queues; None if it can.

    It is looked at by itself: where its ways and those of other loops touch there can be less room. `near`
    is as in `lay_stretches`.
    """
    plan = _Plan(network, {(loop, kind): _MANY}, near=near)
    try:
        return plan.why_not(loop, plan.chain(loop), kind)
    except RefusedLoopError as error:
        return error.refused[loop.id]


class _Plan:
    """The parts of the network that a set of loops uses as stretches, and how long their vehicles are."""

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
            for span in loop.roads:
                # A stretch cuts all lanes of its edge at the same places, so the edge's longest counts.
                on = span.edge if span.edge in self.stretches else span.lane_id
                needs.setdefault(on, Counter())[kind.length_m + kind.min_gap_m] += count
        self._needed = {on: tuple(sorted(some.items(), reverse=True)) for on, some in needs.items()}

    def chain(self, loop: Loop) -> list[Piece]:
        """Cut a loop into pieces, in driving order from its beginning."""
        pieces: list[Piece] = []
        for made, span in zip(loop.movements, loop.roads, strict=loop.closed):
            leaving = self._network.outgoing(span.edge)
            movement = next((c for c in leaving if (c.id, c.via) == (made.id, made.via)), None)
            if movement is None:  # the loop was made for other roads
                why = Refusal(f"has no movement from lane {span.lane_id} to edge {made.to_edge}", span.edge)
                raise RefusedLoopError({loop.id: why}, abstraction="queues")
            pieces += self._on_edge(span)
            length = sum(self._network.lanes[lane].length_m for lane in movement.via)
            pieces.append(Piece(span.end_m, length, span.edge, span.lane, span.length_m, movement=movement))
        if loop.closed:
            return pieces
        last = loop.roads[-1]
        pieces += self._on_edge(last)
        first = next((k for k, piece in enumerate(pieces) if piece.place is not None), len(pieces))
        return [*pieces[first:], self._away(last, pieces[-1])]

    def _away(self, last: LaneSpan, piece: Piece) -> Piece:
        """Return where those are who have arrived on a lane, from the end of the last piece of it on.

        In a place nobody arrives beyond its line, where others could touch those who do.
        """
        at_m = piece.at_m if piece.place is not None else last.length_m
        place = QueuePlace(f"away {last.lane_id}", AWAY_M, self._needs(last), away=True)
        return Piece(last.begin_m + at_m, AWAY_M, last.edge, last.lane, at_m, place=place)

    def _needs(self, span: LaneSpan) -> tuple[tuple[float, int], ...]:
        return self._needed[span.edge if span.edge in self.stretches else span.lane_id]

    def _on_edge(self, span: LaneSpan) -> Iterator[Piece]:
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
        yield Piece(
            span.begin_m + stretch.begin_m,
            stretch.end_m - stretch.begin_m,
            span.edge,
            span.lane_in,
            stretch.end_m,
            passage=stretch.passage(span.lane_in, span.lane),
        )
        if stretch.end_m < length_m:
            yield self._waiting(span, span.lane, stretch.end_m, stretch.last_m, f"{span.lane_id}/2")

    def _waiting(self, span: LaneSpan, lane: int, begin: float, end: float, name: str) -> Piece:
        place = QueuePlace(name, end - begin, self._needs(span))
        return Piece(
            span.begin_m + begin,
            end - begin,
            span.edge,
            lane,
            end,
            place=place if place.capacity >= LEAST_CAPACITY else None,
        )

    def why_not(self, loop: Loop, chain: Sequence[Piece], kind: VehicleType) -> Refusal | None:
        """Return what keeps a loop from working as queues; None if nothing does."""
        for span in loop.roads:
            needed = kind.length_m + kind.min_gap_m
            if span.lane_in != span.lane and span.length_m < least_change_m(needed):
                return Refusal(
                    f"must change from lane {span.lane_in} to lane {span.lane} on edge {span.edge}, which is "
                    f"{span.length_m:.1f} m long; that takes {least_change_m(needed):.1f} m: "
                    "lead it another way",
                    span.edge,
                )
        if len({piece.place.name for piece in chain if piece.place is not None}) < LEAST_CAPACITY:
            return Refusal("has fewer than two places in which two vehicles can queue; make it longer")
        for here, between, after in ways_on(chain):
            if here.place is not None and here.place == after.place:
                return Refusal(
                    f"comes back from lane {here.edge}_{here.lane} to itself, and vehicles can queue nowhere "
                    "between; lead it another way",
                    here.edge,
                )
            guides = find_guides(self._network, list(course_of(loop, here, between, after)), kind.vclass)
            if isinstance(guides, Connection):
                return Refusal(
                    f"leads from lane {guides.from_edge}_{guides.from_lane} to edge {guides.to_edge}, which "
                    f"is too short to tell SUMO on which of its lanes to go on; lead it another way",
                    guides.from_edge,
                )
        return None
