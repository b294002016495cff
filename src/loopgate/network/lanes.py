"""Which lanes a vehicle takes round a closed route."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from loopgate.errors import RouteError
from loopgate.network.loop import LaneSpan, Loop
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork

__all__ = ["make_loop"]

_CHANGE_COST = 1.0
_SHORT_M = 60.0
"""A lane change takes SUMO's vehicles some tens of metres; changing on shorter edges costs more."""

_ANTICIPATION_M = 150.0
"""How far ahead of the edge where it must change lanes a vehicle may change already, if the lanes allow."""


@dataclass(frozen=True, slots=True)
class _Step:
    """Passing one edge: lane on which it is entered, lane on which it is left, movement that follows."""

    enter: int
    leave: int
    onward: Connection


def make_loop(
    network: RoadNetwork, name: str, edges: Sequence[str], *, vclass: str = "passenger", source: str = ""
) -> Loop:
    """Make the loop over these edges; the last must lead to the first.

    Lanes are chosen so that the vehicle changes lanes as little as possible over the round: the lanes that
    make the turns, by dynamic programming round the loop. Where a change cannot be avoided, the span of that
    edge names all lanes swept; so do edges up to 150 m before it on which the vehicle could change early.

    Parameters
    ----------
    network
        The roads.
    name
        The loop's name.
    edges
        Normal edges in driving order; an edge may come twice.
    vclass
        SUMO vehicle class that must be allowed.
    source
        File the route comes from, for messages.

    Raises
    ------
    RouteError
        If an edge is missing or closed to the class, two edges are not connected, the last does not lead
        to the first, or no lanes lead round.
    """
    what = f"{source}: route {name}" if source else f"route {name}"
    if not edges:
        msg = f"{what}: it has no edges; a loop needs at least one"
        raise RouteError(msg)
    for edge in edges:
        _check_edge(network, edge, vclass, what)
    for number, edge in enumerate(edges):
        _check_pair(network, edges, number, vclass, what, edge)
    steps = _choose(network, edges, vclass)
    if steps is None:
        msg = (
            f"{what}: no lanes open to {vclass} lead all the way round, though its edges are connected; "
            f"add edges where the vehicle can change lanes, or connections in netedit"
        )
        raise RouteError(msg)
    return Loop(name, tuple(edges), tuple(_spans(network, edges, steps, vclass)))


def _check_edge(network: RoadNetwork, edge: str, vclass: str, what: str) -> None:
    if edge not in network.edges:
        msg = f"{what}: edge {edge} is not in the network {network.name}; correct it or draw the route again"
        raise RouteError(msg)
    if not network.edges[edge].allows(vclass):
        classes = sorted(set().union(*(lane.allowed for lane in network.edges[edge].lanes)))
        most = 5
        for_whom = ", ".join(classes[:most]) + (", ..." if len(classes) > most else "") or "nobody"
        msg = f"{what}: edge {edge} is closed to {vclass} (open to {for_whom}); lead the route round it"
        raise RouteError(msg)


def _check_pair(
    network: RoadNetwork, edges: Sequence[str], number: int, vclass: str, what: str, edge: str
) -> None:
    last = number + 1 == len(edges)
    following = edges[0] if last else edges[number + 1]
    if network.between(edge, following, vclass):
        return
    ways = list(dict.fromkeys(c.to_edge for c in network.outgoing(edge) if network.allows(c, vclass)))
    onward = f"from {edge} a {vclass} can go to {', '.join(ways)}" if ways else f"{edge} leads nowhere"
    if last:
        msg = (
            f"{what}: not a loop: its last edge {edge} does not lead to its first edge {following} "
            f"({onward}); add the edges that lead back"
        )
    else:
        msg = f"{what}: edge {edge} does not lead to edge {following} ({onward}); add the edges between"
    raise RouteError(msg)


def _choose(network: RoadNetwork, edges: Sequence[str], vclass: str) -> list[_Step] | None:
    """Return the cheapest lanes round the loop, or None; O(edges * lanes^3)."""
    best: tuple[float, list[_Step]] | None = None
    for enter in range(len(network.edges[edges[0]].lanes)):
        found = _choose_from(network, edges, vclass, enter)
        if found and (best is None or found[0] < best[0]):
            best = found
    return best[1] if best else None


def _choose_from(
    network: RoadNetwork, edges: Sequence[str], vclass: str, first: int
) -> tuple[float, list[_Step]] | None:
    """Return cost and steps of the cheapest round that begins on lane `first`, or None."""
    reached: dict[int, tuple[float, list[_Step]]] = {first: (0.0, [])}
    for number, edge in enumerate(edges):
        following = edges[(number + 1) % len(edges)]
        onward: dict[int, tuple[float, list[_Step]]] = {}
        for enter, (cost, steps) in reached.items():
            for connection in network.between(edge, following, vclass):
                change = _change_cost(network, edge, enter, connection.from_lane, vclass)
                total = cost + change
                known = onward.get(connection.to_lane)
                if total < math.inf and (known is None or total < known[0]):
                    step = _Step(enter, connection.from_lane, connection)
                    onward[connection.to_lane] = (total, [*steps, step])
        reached = onward
    return reached.get(first)


def _change_cost(network: RoadNetwork, edge: str, enter: int, leave: int, vclass: str) -> float:
    lanes = network.edges[edge].lanes
    low, high = sorted((enter, leave))
    if not all(vclass in lanes[index].allowed for index in range(low, high + 1)):
        return math.inf
    changes = high - low
    return changes * _CHANGE_COST * (1.0 + _SHORT_M * changes / max(lanes[0].length_m, 1.0))


def _sweeps(
    network: RoadNetwork, edges: Sequence[str], steps: Sequence[_Step], vclass: str
) -> list[set[int]]:
    """Return for each edge the lanes on which the vehicle may be."""
    swept = [set(range(min(s.enter, s.leave), max(s.enter, s.leave) + 1)) for s in steps]
    for number, step in enumerate(steps):
        if step.enter == step.leave:
            continue
        far, ahead, back = 0.0, swept[number], number
        while far < _ANTICIPATION_M and back > number - len(edges):
            back -= 1
            lanes = network.edges[edges[back]].lanes
            early = {
                c.from_lane
                for c in network.between(edges[back], edges[(back + 1) % len(edges)], vclass)
                if c.to_lane in ahead
            } | {steps[back].leave}
            # Only lanes side by side: the vehicle gets from one to the other on this edge.
            near = {steps[back].leave}
            for direction in (1, -1):
                index = steps[back].leave + direction
                while index in early and vclass in lanes[index].allowed:
                    near.add(index)
                    index += direction
            if len(near) == 1:
                break
            swept[back % len(edges)] |= near
            far += lanes[0].length_m
            ahead = near
    return swept


def _spans(network: RoadNetwork, edges: Sequence[str], steps: Sequence[_Step], vclass: str) -> list[LaneSpan]:
    sweeps = _sweeps(network, edges, steps, vclass)
    spans: list[LaneSpan] = []
    arc = 0.0
    for number, (edge, step) in enumerate(zip(edges, steps, strict=True)):
        lanes = network.edges[edge].lanes
        end = arc + lanes[0].length_m
        others = sorted(sweeps[number] - {step.leave})
        indices = (step.leave, *others)
        spans.append(
            LaneSpan(
                edge=edge,
                lane=step.leave,
                lane_id=lanes[step.leave].id,
                internal=False,
                begin_m=arc,
                end_m=end,
                lanes=indices,
                shapes=tuple(lanes[index].shape for index in indices),
            )
        )
        arc = end
        following = edges[(number + 1) % len(edges)]
        arc = _add_internal(network, spans, step, arc, sweeps[number], following, vclass)
    return spans


def _add_internal(
    network: RoadNetwork,
    spans: list[LaneSpan],
    step: _Step,
    arc: float,
    sweep: set[int],
    following: str,
    vclass: str,
) -> float:
    """Append the internal lanes after an edge; movements from other lanes it may be on are swept too."""
    others = [
        c
        for c in network.between(step.onward.from_edge, following, vclass)
        if c.from_lane in sweep and c is not step.onward and len(c.via) == len(step.onward.via)
    ]
    for k, lane_id in enumerate(step.onward.via):
        lane = network.lanes[lane_id]
        beside = [network.lanes[c.via[k]] for c in others]
        end = arc + lane.length_m
        spans.append(
            LaneSpan(
                edge=lane.edge,
                lane=lane.index,
                lane_id=lane.id,
                internal=True,
                begin_m=arc,
                end_m=end,
                lanes=(lane.index, *(other.index for other in beside)),
                shapes=(lane.shape, *(other.shape for other in beside)),
            )
        )
        arc = end
    return arc
