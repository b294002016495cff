"""The way of a loop from one place where vehicles queue to the next."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from loopgate.abstraction.guides import Target, Turn, find_guides
from loopgate.abstraction.itinerary import CLEARANCE_M, Crossing, Guide, Leg
from loopgate.abstraction.movements import Conflicts, Overlap
from loopgate.abstraction.stretches import Passage
from loopgate.model import StateId
from loopgate.network.loop import HOLD_MARGIN_M, Loop
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork

_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class QueuePlace:
    """Where vehicles queue: a lane, or the part of it before or behind a stretch for changing lanes."""

    name: str
    """The lane's id; with ``/1`` for the part before a stretch, ``/2`` for the part behind it."""
    length_m: float
    needs: tuple[tuple[float, int], ...]
    """Lengths of the vehicles that visit it, with their gaps [m], and how many there are of each at most,
    longest first."""
    away: bool = False
    """Whether it is no place on the road, but where all are who have driven a route to its end."""

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
class Piece:
    """A part of a loop: a place, a passage over a stretch, a movement, or a lane too short to wait on.

    `begin_m` is an arc length on the loop, `at_m` where on its edge the piece ends [m].
    """

    begin_m: float
    length_m: float
    edge: str
    lane: int
    at_m: float
    place: QueuePlace | None = None
    passage: Passage | None = None
    movement: Connection | None = None


def ways_on(chain: Sequence[Piece]) -> Iterator[tuple[Piece, list[Piece], Piece]]:
    """Yield each place of a loop, what lies between it and the next, and the next."""
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


def course_of(loop: Loop, here: Piece, between: Sequence[Piece], after: Piece) -> Iterator[Turn | Target]:
    """Yield what `find_guides` has to know of the way from one place to the next."""
    for piece in between:
        passage, ahead = piece.passage, _ahead_m(loop, here, piece)
        if piece.movement is not None:
            yield Turn(piece.movement, ahead + piece.length_m)
        elif passage is not None and passage.changes:
            yield Target(piece.edge, piece.lane, piece.at_m, ahead, passage.to_lane)
    # Who arrives is never past its last lane: what leads to that has done its work where the lane begins.
    on_lane_m = after.at_m if after.place and after.place.away else 0.0
    yield Target(after.edge, after.lane, after.at_m, _ahead_m(loop, here, after) - on_lane_m)


def legs_of(
    network: RoadNetwork,
    loop: Loop,
    chain: Sequence[Piece],
    conflicts: Conflicts,
    foes: Mapping[str, frozenset[str]],
    classes: Sequence[str],
    alike: dict[object, Crossing],
) -> Iterator[Leg]:
    """Yield the legs of a loop; crossings that are the same on several are one object, found in `alike`."""
    for here, between, after in ways_on(chain):
        crossings: list[Crossing] = []
        limits: list[tuple[float, float]] = []
        for piece in between:
            ahead = _ahead_m(loop, here, piece)
            limits += _limits(network, piece, ahead)
            if (made := piece.movement) is not None:
                name = made.id
                key = name, ahead, tuple(limits)
                if key not in alike:
                    alike[key] = Crossing(
                        name,
                        conflicts.foes[name],
                        _moved(conflicts.overlaps[name], ahead),
                        conflicts.speeds_mps[name],
                        ahead,
                        _wait_m(network, made, ahead),
                        tuple(limits),
                        f"{made.from_edge}_{made.from_lane}",
                        f"{made.to_edge}_{made.to_lane}",
                    )
                crossings.append(alike[key])
            elif (passage := piece.passage) is not None:
                lanes = network.edges[piece.edge].lanes
                crossings.append(
                    Crossing(
                        passage.id,
                        foes[passage.id],
                        speed_mps=lanes[piece.lane].speed_mps,
                        ahead_m=ahead,
                        from_lane=lanes[passage.lane].id,
                        to_lane=lanes[passage.to_lane].id,
                    )
                )
        course = list(course_of(loop, here, between, after))
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
            away=bool(here.place and here.place.away),
        )


def _number(guides: tuple[Guide, ...] | Connection) -> int:
    return 0 if isinstance(guides, Connection) else len(guides)


def _moved(overlaps: Mapping[str, Overlap], ahead_m: float) -> Mapping[str, Overlap]:
    return {foe: (ahead_m + begin, ahead_m + end) for foe, (begin, end) in sorted(overlaps.items())}


def _wait_m(network: RoadNetwork, movement: Connection, ahead_m: float) -> float:
    """Return where the last waiting point of a movement is: before the last of its lanes inside, or all."""
    return ahead_m + sum(network.lanes[lane].length_m for lane in movement.via[:-1])


def _limits(network: RoadNetwork, piece: Piece, ahead_m: float) -> Iterator[tuple[float, float]]:
    """Yield from where on there is which speed limit on a piece."""
    if piece.movement is None:
        yield ahead_m, network.edges[piece.edge].lanes[piece.lane].speed_mps
        return
    for lane in piece.movement.via:
        yield ahead_m, network.lanes[lane].speed_mps
        ahead_m += network.lanes[lane].length_m
