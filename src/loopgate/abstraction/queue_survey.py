"""Surveys loops as queues: which loops can be cut, and their places, crossings and slots."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from loopgate.abstraction.itinerary import Crossing, DrawnLeg, Itinerary
from loopgate.abstraction.movements import Stretch
from loopgate.abstraction.queue_layout import QueueLayout, lay_out_queues, why_not
from loopgate.abstraction.queues import most_at_start
from loopgate.errors import LoopRefusal, RefusedLoopError
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import VehicleType


@dataclass(frozen=True, slots=True)
class PlaceSurvey:
    """A place on which vehicles queue: a lane or a part of a lane."""

    id: str
    lane: str
    """`id` and `lane`: name of the place, and the lane on which it lies."""
    begin_m: float
    length_m: float
    """`begin_m` and `length_m`: position of its beginning on the lane, and its length."""
    capacity: int
    at_start: int
    """`capacity` and `at_start`: number of slots, and number of vehicles that may start there."""
    loops: tuple[str, ...]
    """Loops that visit the place."""


@dataclass(frozen=True, slots=True)
class ConflictSurvey:
    """A conflict between two movements, described for the first of them."""

    foe: str
    """The other movement; its own name where vehicles that make it exclude each other."""
    begin_m: float | None
    end_m: float | None
    """`begin_m` and `end_m`: the stretch shared with the other movement, in metres from this movement's
    beginning; None for all of it."""
    listed: bool
    """False for movements over one junction whose conflict the request matrix does not list: only the
    geometry shows it."""

    @property
    def shared_m(self) -> float | None:
        """Length of the shared stretch along this movement."""
        return None if self.begin_m is None or self.end_m is None else self.end_m - self.begin_m


@dataclass(frozen=True, slots=True)
class CrossingSurvey:
    """A movement over a junction, or over a stretch of an edge on which no vehicle waits."""

    id: str
    from_lane: str
    to_lane: str
    junction: str
    stretch: Stretch | None
    """`junction` and `stretch`: the junction or the edge over which it leads; the other is empty or None."""
    length_m: float
    loops: tuple[str, ...]
    """Loops that use the crossing."""
    conflicts: tuple[ConflictSurvey, ...]
    """Its conflicts with other movements of the loops, by name."""


@dataclass(frozen=True, slots=True)
class JoinedLane:
    """A lane too short to queue on, which belongs to the crossing it lies in."""

    lane: str
    length_m: float
    loops: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RefusedLoop:
    """A loop that cannot work, the reason, and the edge if an edge is the cause."""

    loop: Loop
    reason: str
    edge: str | None


@dataclass(frozen=True, slots=True)
class QueueSurvey:
    """The result of a survey: loops, places, crossings and slots."""

    itineraries: tuple[Itinerary, ...]
    """The loops that work, in the given order, with their places and crossings."""
    places: tuple[PlaceSurvey, ...]
    crossings: tuple[CrossingSurvey, ...]
    joined: tuple[JoinedLane, ...]
    """`places`, `crossings` and `joined`: in the order of first use."""
    refused: tuple[RefusedLoop, ...]
    """The loops that do not work, in the order given."""
    even: int
    """Number of vehicles that can start if they are dealt to the loops in turn."""

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The loops that work."""
        return tuple(way.loop for way in self.itineraries)

    @property
    def holds(self) -> int:
        """The number of slots of all places."""
        return sum(place.capacity for place in self.places)

    @property
    def at_start(self) -> int:
        """The number of vehicles that can start so that each can move, on the loops of their choice."""
        return sum(place.at_start for place in self.places)

    @property
    def conflicts(self) -> int:
        """The number of pairs of conflicting movements."""
        return len({frozenset((one.id, other.foe)) for one in self.crossings for other in one.conflicts})

    @property
    def unlisted(self) -> tuple[tuple[str, str], ...]:
        """Pairs of movements that conflict by geometry but not by SUMO's request matrix."""
        return tuple(
            (crossing.id, conflict.foe)
            for crossing in self.crossings
            for conflict in crossing.conflicts
            if not conflict.listed and crossing.id < conflict.foe
        )


def survey_queues(network: RoadNetwork, users: Sequence[tuple[Loop, VehicleType]]) -> QueueSurvey:
    """Cut loops into places and crossings; leave out loops that cannot be cut.

    A loop is refused for a fault of its own, or because long vehicles of other loops leave it no slots. It is
    then left out, and the rest is surveyed again.

    `users`: for each vehicle its loop and its type.
    """
    reasons = _alone(network, users)
    while True:
        fit = [(loop, kind) for loop, kind in users if loop.id not in reasons]
        try:
            layout = lay_out_queues(network, fit)
        except RefusedLoopError as error:
            reasons[error.loop] = error.refused[error.loop]
        else:
            break
    return _survey(network, layout, _refused(users, reasons))


def refused_queues(
    network: RoadNetwork, users: Sequence[tuple[Loop, VehicleType]]
) -> tuple[RefusedLoop, ...]:
    """Return the loops that cannot be cut into queues, alone or together.

    `network`, `users`: as for `survey_queues`, which takes several times as long and finds all.
    """
    reasons = _alone(network, users)
    if not reasons:
        try:
            lay_out_queues(network, users)
        except RefusedLoopError as error:
            reasons = dict(error.refused)
    return _refused(users, reasons)


def _alone(network: RoadNetwork, users: Sequence[tuple[Loop, VehicleType]]) -> dict[str, LoopRefusal]:
    """Return the fault of each loop that cannot work alone."""
    reasons: dict[str, LoopRefusal] = {}
    for loop, kind in users:
        if loop.id not in reasons and (refusal := why_not(network, loop, kind)):
            reasons[loop.id] = refusal
    return reasons


def _refused(
    users: Sequence[tuple[Loop, VehicleType]], reasons: Mapping[str, LoopRefusal]
) -> tuple[RefusedLoop, ...]:
    every = {loop.id: loop for loop, _ in users if loop.id in reasons}
    return tuple(RefusedLoop(loop, *reasons[name]) for name, loop in every.items())


def _survey(network: RoadNetwork, layout: QueueLayout, refused: tuple[RefusedLoop, ...]) -> QueueSurvey:
    itineraries = tuple(layout.itineraries.values())
    at_start = most_at_start(layout)
    return QueueSurvey(
        itineraries=itineraries,
        places=tuple(_places(itineraries, layout, at_start)),
        crossings=tuple(_crossings(network, itineraries, layout)),
        joined=_joined(itineraries, layout),
        refused=refused,
        even=_even(itineraries, at_start),
    )


def _places(
    itineraries: Sequence[Itinerary], layout: QueueLayout, at_start: Mapping[str, int]
) -> Iterator[PlaceSurvey]:
    legs: dict[str, tuple[Loop, DrawnLeg]] = {}
    visitors: dict[str, dict[str, None]] = {}
    for itinerary in itineraries:
        loop = itinerary.loop
        for leg in itinerary.legs:
            legs.setdefault(str(leg.state), (loop, leg))
            visitors.setdefault(str(leg.state), {})[loop.id] = None
    for name, (loop, leg) in legs.items():
        span, place = loop.span_at((leg.begin_m + leg.end_m) / 2), layout.places[name]
        yield PlaceSurvey(
            id=name,
            lane=f"{leg.line.edge}_{leg.line.lane}",
            begin_m=leg.begin_m - span.begin_m,
            length_m=place.length_m,
            capacity=place.capacity,
            at_start=at_start[name],
            loops=tuple(visitors[name]),
        )


def _crossings(
    network: RoadNetwork, itineraries: Sequence[Itinerary], layout: QueueLayout
) -> Iterator[CrossingSurvey]:
    users: dict[str, dict[str, None]] = {}
    made: dict[str, tuple[Loop, DrawnLeg, Crossing]] = {}
    for itinerary in itineraries:
        loop = itinerary.loop
        for leg in itinerary.legs:
            for crossing in leg.crossings:
                users.setdefault(crossing.id, {})[loop.id] = None
                made.setdefault(crossing.id, (loop, leg, crossing))
    known = {connection.id: connection for connection in network.connections}
    found = layout.conflicts
    unlisted = {*found.unlisted, *((other, one) for one, other in found.unlisted)}
    for name, (loop, leg, crossing) in made.items():
        if name in known:
            stretch, length, overlaps = None, found.lengths_m[name], found.overlaps[name]
        else:
            edge = network.lanes[crossing.from_lane].edge
            stretch = layout.stretches[edge]
            length = stretch.end_m - stretch.begin_m
            # In the itinerary they count from the end of the leg before.
            begin = next(span.begin_m for span in loop.spans if span.edge == edge) + stretch.begin_m
            ahead = (begin - leg.end_m) % loop.length_m
            overlaps = {foe: (low - ahead, high - ahead) for foe, (low, high) in crossing.overlaps.items()}
        conflicts = []
        for foe in sorted(crossing.foes):
            low, high = overlaps.get(foe, (None, None))
            conflicts.append(ConflictSurvey(foe, low, high, listed=(name, foe) not in unlisted))
        yield CrossingSurvey(
            id=name,
            from_lane=crossing.from_lane,
            to_lane=crossing.to_lane,
            junction=known[name].junction if name in known else "",
            stretch=stretch,
            length_m=length,
            loops=tuple(users[name]),
            conflicts=tuple(conflicts),
        )


def _joined(itineraries: Sequence[Itinerary], layout: QueueLayout) -> tuple[JoinedLane, ...]:
    """Return the lanes on which neither a place nor a stretch lies."""
    lengths: dict[str, float] = {}
    users: dict[str, dict[str, None]] = {}
    for itinerary in itineraries:
        loop = itinerary.loop
        used = {(leg.line.edge, leg.line.lane) for leg in itinerary.legs}
        for span in loop.roads:
            stretch = layout.stretches.get(span.edge)
            on_stretch = stretch is not None and stretch.covers(span.lane)
            if not on_stretch and (span.edge, span.lane) not in used:
                lengths[span.lane_id] = span.length_m
                users.setdefault(span.lane_id, {})[loop.id] = None
    return tuple(JoinedLane(lane, length, tuple(users[lane])) for lane, length in lengths.items())


def _even(itineraries: Sequence[Itinerary], at_start: Mapping[str, int]) -> int:
    """Return for how many vehicles, given to the loops in turn, there is a place each at the start.

    A flow leads from loops through their places to the sink; it must be as large as the number of vehicles.
    Fewer vehicles need no more places, so bisection finds the number. O(log n) maximum flows.
    """
    places = {state: k for k, state in enumerate(at_start)}
    count = len(itineraries)
    source, sink = count + len(places), count + len(places) + 1
    ways = sorted(
        {(k, count + places[str(leg.state)]) for k, way in enumerate(itineraries) for leg in way.legs}
    )
    exits = [(count + k, sink, most) for k, most in enumerate(at_start.values())]

    def fits(vehicles: int) -> bool:
        entries = [(source, k, (vehicles + count - 1 - k) // count) for k in range(count)]
        rows, columns, room = zip(*entries, *((a, b, vehicles) for a, b in ways), *exits, strict=True)
        graph = scipy.sparse.csr_array(
            (np.array(room, dtype=np.int32), (rows, columns)), shape=(sink + 1, sink + 1)
        )
        return int(scipy.sparse.csgraph.maximum_flow(graph, source, sink).flow_value) == vehicles

    low, high = 0, sum(at_start.values()) if count else 0
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if fits(middle) else (low, middle - 1)
    return low
