"""Checks that the lanes inside junctions fit the movements and requests of a network.

SUMO crashes without a message on many networks in which they do not fit. Nets and connections are objects of
sumolib.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

from loopgate.errors import NetworkError


def check_inside(
    net: Any,  # noqa: ANN401  sumolib has no types
    file: Path,
    waiting: Collection[tuple[str, int]],
    between: Collection[str],
) -> None:
    """Raise `NetworkError` if the lanes inside junctions do not fit.

    Parameters
    ----------
    waiting
        Requests with ``cont``, as junction and index: a vehicle may wait on the first of two internal lanes.
    between
        Junctions between two internal lanes, each named like the second.
    """
    _check_named(net, file)
    _check_led_over(net, file)
    _check_waiting(net, file, waiting)
    _check_between(net, file, between)
    _check_listed(net, file)


def lanes_over(net: Any, connection: Any, file: Path) -> tuple[str, ...]:  # noqa: ANN401  sumolib has no types
    """Return the internal lanes of a movement, through internal junctions too.

    Raises `NetworkError` if the last of them does not lead to the movement's end: SUMO crashes without a
    message on some of these networks.
    """
    chain: list[str] = []
    lane_id, outgoing = connection.getViaLaneID(), []
    while lane_id and lane_id not in chain:
        chain.append(lane_id)
        outgoing = net.getLane(lane_id).getOutgoing()
        lane_id = outgoing[0].getViaLaneID() if outgoing else ""
    to = connection.getTo()
    if chain and not any(one.getTo() is to for one in outgoing):
        leads = f"leads to {outgoing[0].getTo().getID()}" if outgoing else "leads nowhere"
        begin, _, lane = chain[-1].rpartition("_")
        msg = (
            f"{file}: connection {connection.getFrom().getID()} to {to.getID()}: its internal lane "
            f'{chain[-1]} {leads}; a <connection from="{begin}" fromLane="{lane}" to="{to.getID()}" .../> is '
            f"missing: build the network anew with netconvert"
        )
        raise NetworkError(msg)
    return tuple(chain)


def _check_named(net: Any, file: Path) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if no connection leads over the internal lanes of a junction that has some."""
    used = {c.getViaLaneID() for edge in net.getEdges() for some in edge.getOutgoing().values() for c in some}
    inside = {edge.getID() for edge in net.getEdges() if edge.getFunction() == "internal"}
    if inside and not any(used):
        msg = (
            f"{file}: no connection names the internal lane that it leads over (via), though there are "
            f"{len(inside)} internal edges, such as {min(inside)}: build the network anew with netconvert"
        )
        raise NetworkError(msg)


def _check_led_over(net: Any, file: Path) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if no connection leads over an internal lane, or a junction lists too few."""
    used = {c.getViaLaneID() for edge in net.getEdges() for some in edge.getOutgoing().values() for c in some}
    inside = sorted(edge.getID() for edge in net.getEdges() if edge.getFunction() == "internal")
    lanes = (lane.getID() for name in inside for lane in net.getEdge(name).getLanes())
    if lane := next((lane for lane in lanes if lane not in used), ""):
        what = f"no connection leads over the internal lane {lane}"
        msg = f"{file}: {what}: build the network anew with netconvert"
        raise NetworkError(msg)
    for node in net.getNodes():
        has, needs = sum(map(bool, node.getInternal())), len(node._prohibits)  # noqa: SLF001  they have no other name
        if node.getType() != "internal" and 0 < has < needs:
            what = f"junction {node.getID()}: {has} lanes in intLanes for {needs} requests"
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)


def _check_waiting(net: Any, file: Path, waiting: Collection[tuple[str, int]]) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if there is no second internal lane for a movement that may wait on the first."""
    inside = [edge for edge in net.getEdges() if edge.getFunction() == "internal"]
    second = {c.getViaLaneID() for edge in inside for some in edge.getOutgoing().values() for c in some}
    for name, index in sorted(waiting):
        lanes = net.getNode(name).getInternal()
        lane = lanes[index] if index < len(lanes) else ""
        if lane and lane not in second:
            what = (
                f"junction {name}: request {index} has cont, but its movement only the internal lane {lane}"
            )
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)


def _check_between(net: Any, file: Path, between: Collection[str]) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if there is no junction between the two internal lanes of a movement.

    SUMO crashes when a vehicle would wait there.
    """
    for first in (edge for edge in net.getEdges() if edge.getFunction() == "internal"):
        movements = (c for some in first.getOutgoing().values() for c in some)
        seconds = (c.getViaLaneID() for c in movements)
        if lane := next((lane for lane in seconds if lane and lane not in between), ""):
            what = f"there is no internal junction {lane} between edge {first.getID()} and lane {lane}"
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)


def _check_listed(net: Any, file: Path) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if a junction with requests does not list a lane that leads over it."""
    for node in net.getNodes():
        if node.getType() == "internal" or not node._prohibits:  # noqa: SLF001 - it has no other name
            continue
        listed = set(node._incLanes)  # noqa: SLF001 - as above
        roads = [edge for edge in node.getIncoming() if edge.getFunction() == ""]
        lanes = (lane for edge in roads for lane in edge.getLanes() if lane.getOutgoing())
        if lane := next((lane.getID() for lane in lanes if lane.getID() not in listed), ""):
            what = f"junction {node.getID()}: incLanes lacks {lane}, from which a connection leads over it"
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)
