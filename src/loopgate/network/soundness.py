"""Checks lengths, speeds and references of a network once, so that later code can rely on them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from loopgate.errors import NetworkError
from loopgate.network.records import Connection, Points

if TYPE_CHECKING:
    from loopgate.network.road import RoadNetwork

_LARGEST_COORDINATE_M = 1e8
"""Larger than the Earth in any projection; squares of differences stay finite and exact to the millimetre
[m]."""
_LONGEST_LANE_M = 1e6
_SHORTEST_LANE_M = 1e-6
"""Far below what SUMO writes; shorter lanes would give directions that are no finite numbers [m]."""
_WIDEST_LANE_M = 1e3
_FASTEST_MPS = 1e4
_FEWEST_POINTS = 2


def check_sound(network: RoadNetwork) -> None:
    """Check lengths, speeds, widths and shapes of a network, and that connections lead from lane to lane.

    Raises `NetworkError` if something makes no sense; the text names the file and the lane, edge, junction or
    connection. O(size of the network).
    """
    file = network.file
    for lane in network.lanes.values():
        _within(file, f"lane {lane.id}: its length", lane.length_m, _LONGEST_LANE_M, least=_SHORTEST_LANE_M)
        _within(file, f"lane {lane.id}: its speed", lane.speed_mps, _FASTEST_MPS, or_zero=True)
        _within(file, f"lane {lane.id}: its width", lane.width_m, _WIDEST_LANE_M)
        _drawn(file, f"lane {lane.id}", lane.shape, _FEWEST_POINTS)
        for height in lane.heights:
            _within(
                file, f"lane {lane.id}: how high it lies", abs(height), _LARGEST_COORDINATE_M, or_zero=True
            )
    for edge in network.edges.values():
        if not edge.lanes:
            _fail(file, f"edge {edge.id}: it has no lanes")
        for end in (edge.from_junction, edge.to_junction):
            if end not in network.junctions:
                _fail(file, f"edge {edge.id}: its junction {end} is not in the network")
    for junction in network.junctions.values():
        _drawn(file, f"junction {junction.id}", ((junction.x, junction.y), *junction.shape), 1)
    for connection in network.connections:
        _leads(network, connection)


def _leads(network: RoadNetwork, connection: Connection) -> None:
    what = f"connection {connection.id}"
    for edge, lane in (
        (connection.from_edge, connection.from_lane),
        (connection.to_edge, connection.to_lane),
    ):
        if edge not in network.edges or not 0 <= lane < len(network.edges[edge].lanes):
            _fail(network.file, f"{what}: there is no lane {lane} on edge {edge}")
    for via in connection.via:
        if via not in network.lanes:
            _fail(network.file, f"{what}: it leads over lane {via}, which is not in the network")


def _within(
    file: Path, what: str, number: float, most: float, *, or_zero: bool = False, least: float = 0.0
) -> None:
    if not (least < number <= most or (or_zero and number == 0.0)):
        above = "from 0" if or_zero else f"above {least:g}"
        _fail(file, f"{what} is {number:g}; expected a number {above} and up to {most:g}")


def _drawn(file: Path, what: str, shape: Points, fewest: int) -> None:
    if len(shape) < fewest:
        _fail(file, f"{what}: its shape has {len(shape)} points; expected at least {fewest}")
    for x, y in shape:
        if not (abs(x) <= _LARGEST_COORDINATE_M and abs(y) <= _LARGEST_COORDINATE_M):
            _fail(file, f"{what}: it is drawn through {x:g},{y:g}; expected metres up to 1e8")


def _fail(file: Path, what: str) -> None:
    msg = f"{file}: {what}"
    raise NetworkError(msg)
