"""Places where vehicles queue, and the crossings between them: the plan of the queues abstraction."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Crossing, Itinerary, Leg
from loopgate.abstraction.movements import Conflicts, find_conflicts
from loopgate.errors import RefusedLoopError, RouteError
from loopgate.model import StateId
from loopgate.network.loop import HOLD_MARGIN_M, LaneSpan, Loop
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

__all__ = ["CLEARANCE_M", "LEAST_CAPACITY", "QueueLayout", "lay_out_queues", "why_not"]

CLEARANCE_M = 1.0
"""What a lane is longer than the vehicles and gaps it holds [m]: vehicles stop centimetres off a line."""

LEAST_CAPACITY = 2
"""A lane that holds fewer joins the crossing it lies in: where every place holds two, one walk along the
heads of full queues decides liveness (Reveliotis, Lawley, Ferreira 1997)."""


@dataclass(frozen=True, slots=True)
class QueueLayout:
    """Loops cut into places and crossings, before vehicles are placed.

    Attributes
    ----------
    capacity
        How many vehicles a place holds, by lane id; in the order of first use.
    itineraries
        By loop id.
    conflicts
        Among all movements that the loops use.
    needed_m
        Length of the longest vehicle that visits a place, with its gap, by lane id.
    """

    capacity: Mapping[str, int]
    itineraries: Mapping[str, Itinerary]
    conflicts: Conflicts
    needed_m: Mapping[str, float]


def lay_out_queues(network: RoadNetwork, users: Sequence[tuple[Loop, VehicleType]]) -> QueueLayout:
    """Cut loops into places (lanes) and crossings (movements, with the lanes too short to wait on).

    Parameters
    ----------
    network
        The roads.
    users
        For each vehicle its loop and its type; capacities are those for the longest visitor of a lane.

    Raises
    ------
    RefusedLoopError
        If a loop cannot work as queues; the text says why.
    """
    loops = {loop.id: loop for loop, _ in users}
    classes = {loop.id: kind.vclass for loop, kind in users}
    movements = {name: _movements(network, loop) for name, loop in loops.items()}
    needed: dict[str, float] = {}
    for loop, kind in users:
        for span in loop.spans:
            if not span.internal:
                needed[span.lane_id] = max(needed.get(span.lane_id, 0.0), kind.length_m + kind.min_gap_m)
    capacity = {
        span.lane_id: _capacity(span, needed[span.lane_id])
        for loop in loops.values()
        for span in loop.spans
        if not span.internal
    }
    for name, loop in loops.items():
        reason = _why_not(network, loop, movements[name], capacity, classes[name])
        if reason:
            raise RefusedLoopError(name, reason, abstraction="queues")
    conflicts = find_conflicts(network, (m for chain in movements.values() for m in chain))
    return QueueLayout(
        capacity={lane: room for lane, room in capacity.items() if room >= LEAST_CAPACITY},
        itineraries={
            name: _itinerary(loop, movements[name], capacity, conflicts) for name, loop in loops.items()
        },
        conflicts=conflicts,
        needed_m=needed,
    )


def why_not(network: RoadNetwork, loop: Loop, kind: VehicleType = DEFAULT_TYPE) -> str:
    """Return why a loop cannot work as queues, as the end of a sentence; empty if it can."""
    spans = [span for span in loop.spans if not span.internal]
    capacity = {span.lane_id: _capacity(span, kind.length_m + kind.min_gap_m) for span in spans}
    return _why_not(network, loop, _movements(network, loop), capacity, kind.vclass)


def _capacity(span: LaneSpan, needed_m: float) -> int:
    return math.floor((span.length_m - HOLD_MARGIN_M - CLEARANCE_M) / needed_m)


def _why_not(
    network: RoadNetwork,
    loop: Loop,
    movements: Sequence[Connection],
    capacity: Mapping[str, int],
    vclass: str,
) -> str:
    """Vehicles keep their lanes here, so a loop must neither need a change nor leave SUMO a choice."""
    spans = [span for span in loop.spans if not span.internal]
    for before, movement, span in zip((movements[-1], *movements[:-1]), movements, spans, strict=True):
        if before.to_lane != span.lane:
            return (
                f"must change from lane {before.to_lane} to lane {span.lane} on edge {span.edge}; "
                "vehicles in queues keep their lanes: lead it another way"
            )
        ways = [c for c in network.between(span.edge, movement.to_edge, vclass) if c.from_lane == span.lane]
        if len(ways) > 1:
            return (
                f"leads from lane {span.lane_id} to edge {movement.to_edge}, where SUMO may choose among "
                f"lanes {', '.join(str(c.to_lane) for c in ways)}; lead it another way"
            )
    if len({span.lane_id for span in spans if capacity[span.lane_id] >= LEAST_CAPACITY}) < LEAST_CAPACITY:
        return "has fewer than two lanes on which two vehicles can queue; make it longer"
    return ""


def _movements(network: RoadNetwork, loop: Loop) -> list[Connection]:
    """Return the movement that follows each edge of the loop."""
    found: list[Connection] = []
    spans = loop.spans
    for number, span in enumerate(spans):
        if span.internal:
            continue
        via = []
        k = number + 1
        while k < len(spans) and spans[k].internal:
            via.append(spans[k].lane_id)
            k += 1
        following = spans[k % len(spans)]
        for c in network.outgoing(span.edge):
            if c.to_edge == following.edge and c.from_lane == span.lane and c.via == tuple(via):
                found.append(c)
                break
        else:
            msg = f"loop {loop.id}: no movement leads from lane {span.lane_id} to edge {following.edge}"
            raise RouteError(msg)
    return found


def _itinerary(
    loop: Loop, movements: Sequence[Connection], capacity: Mapping[str, int], conflicts: Conflicts
) -> Itinerary:
    spans = [span for span in loop.spans if not span.internal]
    count = len(spans)
    legs: list[Leg] = []
    for k, span in enumerate(spans):
        if capacity[span.lane_id] < LEAST_CAPACITY:
            continue
        end = span.end_m - HOLD_MARGIN_M
        crossings: list[Crossing] = []
        ahead = HOLD_MARGIN_M
        j = k
        while True:
            movement = movements[j % count]
            crossings.append(_crossing(movement.id, ahead, conflicts))
            ahead += conflicts.lengths_m[movement.id]
            j += 1
            following = spans[j % count]
            if capacity[following.lane_id] >= LEAST_CAPACITY:
                break
            ahead += following.length_m
        legs.append(Leg(StateId(span.lane_id), span.begin_m, end, tuple(crossings)))
    return Itinerary(loop.id, loop.length_m, tuple(legs))


def _crossing(movement: str, ahead_m: float, conflicts: Conflicts) -> Crossing:
    return Crossing(
        movement,
        conflicts.foes[movement],
        {
            foe: (ahead_m + begin, ahead_m + end)
            for foe, (begin, end) in sorted(conflicts.overlaps[movement].items())
        },
        conflicts.speeds_mps[movement],
    )
