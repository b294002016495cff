"""Small hand-made roads and loops for tests, without SUMO."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from loopgate.network import Connection, Edge, Junction, Lane, LaneSpan, Loop, RoadNetwork

Point = tuple[float, float]


def polygon(name: str, corners: Sequence[Point], *, stretch: float = 1.0) -> Loop:
    """Make a closed loop along straight lanes from corner to corner; no junctions between.

    `stretch` is SUMO's length of a lane over its drawn length.
    """
    spans: list[LaneSpan] = []
    arc = 0.0
    for number, (here, there) in enumerate(zip(corners, [*corners[1:], corners[0]], strict=True)):
        length = math.dist(here, there) * stretch
        edge = f"{name}.e{number}"
        spans.append(
            LaneSpan(edge, 0, f"{edge}_0", False, arc, arc + length, (f"{edge}_0",), ((here, there),))  # noqa: FBT003
        )
        arc += length
    return Loop(name, tuple(span.edge for span in spans), tuple(spans))


def roads(
    edges: Mapping[str, tuple[float, int]],
    connections: Sequence[str],
    *,
    buses_only: Sequence[str] = (),
    speed_mps: float = 10.0,
) -> RoadNetwork:
    """Make a network without internal lanes.

    Parameters
    ----------
    edges
        Length [m] and number of lanes by name.
    connections
        Movements from lane to lane, as ``a_0>b_1``.
    buses_only
        Lanes that only buses may use.
    speed_mps
        The limit on all lanes [m/s].
    """
    made: dict[str, Edge] = {}
    for row, (name, (length, count)) in enumerate(edges.items()):
        lanes = tuple(
            Lane(
                id=f"{name}_{index}",
                edge=name,
                index=index,
                internal=False,
                length_m=length,
                speed_mps=speed_mps,
                width_m=3.2,
                shape=((0.0, 100.0 * row + 3.2 * index), (length, 100.0 * row + 3.2 * index)),
                allowed=frozenset({"bus"} if f"{name}_{index}" in buses_only else {"bus", "passenger"}),
            )
            for index in range(count)
        )
        made[name] = Edge(name, "J", "J", lanes)
    movements = []
    for number, text in enumerate(connections):
        start, end = text.split(">")
        (from_edge, _, from_lane), (to_edge, _, to_lane) = start.rpartition("_"), end.rpartition("_")
        movements.append(
            Connection(from_edge, int(from_lane), to_edge, int(to_lane), (), "s", "J", number, None)
        )
    return RoadNetwork(
        name="hand-made",
        file=Path("hand-made.net.xml"),
        edges=made,
        lanes={lane.id: lane for edge in made.values() for lane in edge.lanes},
        junctions={"J": Junction("J", "priority", 0.0, 0.0, (), (), ())},
        connections=tuple(movements),
    )
