"""Bridges in networks without heights: where roads cross, and no junction is near."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from loopgate.network import Connection, Edge, Lane, RoadNetwork
from loopgate.network.bridges import Bridge, find_bridges

Points = tuple[tuple[float, float], ...]
Road = tuple[str, str, str, Points]
"""Name, junction at the beginning, junction at the end, and shape."""

EAST: Road = ("east", "w", "e", ((-100.0, 0.0), (100.0, 0.0)))


def roads(*given: Road, high: str = "") -> RoadNetwork:
    """Return roads of one lane, joined where they meet; `high` names one with heights."""
    lanes, edges = {}, {}
    for name, begin, end, shape in given:
        length = sum(math.dist(a, b) for a, b in pairwise(shape))
        lane = Lane(
            id=f"{name}_0",
            edge=name,
            index=0,
            internal=False,
            length_m=length,
            speed_mps=14.0,
            width_m=3.2,
            shape=shape,
            allowed=frozenset({"passenger"}),
            heights=(6.0,) * len(shape) if name == high else (),
        )
        lanes[lane.id], edges[name] = lane, Edge(name, begin, end, (lane,))
    joined = tuple(
        Connection(one[0], 0, other[0], 0, (), "s", one[2], -1, None)
        for one in given
        for other in given
        if one[2] == other[1]
    )
    return RoadNetwork(
        name="made", file=Path("made"), edges=edges, lanes=lanes, junctions={}, connections=joined
    )


def north(at: float = 0.0, lean: float = 0.0) -> Road:
    """Return a road that crosses the one to the east, apart from it."""
    return ("north", "s", "n", ((at - lean, -50.0), (at + lean, 50.0)))


def found(network: RoadNetwork) -> tuple[Bridge, ...]:
    """Return the bridges among all lanes."""
    return find_bridges(network, network.lanes)


def test_roads_that_cross_where_no_junction_is_lie_one_above_the_other() -> None:
    """The point is where they cross, and each side has its own lanes."""
    (bridge,) = found(roads(EAST, north(20.0)))
    assert (bridge.x_m, bridge.y_m) == (20.0, 0.0)
    assert {bridge.one, bridge.other} == {("east_0",), ("north_0",)}


@pytest.mark.parametrize(
    "network",
    [
        pytest.param(roads(EAST, north(), high="north"), id="heights tell"),
        pytest.param(roads(EAST, north(lean=200.0)), id="drawn over each other"),
        pytest.param(
            roads(EAST, ("north", "s", "e", ((90.0, -50.0), (90.0, 10.0), (100.0, 0.0)))),
            id="they meet just beyond",
        ),
        pytest.param(
            roads(
                EAST,
                ("on", "e", "a", ((100.0, 0.0), (110.0, 8.0))),
                ("north", "s", "a", ((95.0, -50.0), (95.0, 8.0), (110.0, 8.0))),
            ),
            id="they meet after one more road",
        ),
    ],
)
def test_other_roads_are_no_bridges(network: RoadNetwork) -> None:
    """Roads with heights, roads at a small angle, and roads that meet near where they cross."""
    assert found(network) == ()


def test_a_road_goes_on_over_its_junctions() -> None:
    """A body on the bridge may have its front on the next road already."""
    onward: Road = ("onward", "n", "far", ((0.0, 12.0), (0.0, 80.0)))
    short: Road = ("north", "s", "n", ((0.0, -50.0), (0.0, 12.0)))
    (bridge,) = found(roads(EAST, short, onward))
    assert ("north_0", "onward_0") in (bridge.one, bridge.other)


def test_only_bodies_near_the_point_are_apart() -> None:
    """The same two roads may come near each other elsewhere."""
    (bridge,) = found(roads(EAST, north()))
    east, other = np.array(["east_0"] * 3), np.array(["north_0", "north_0", "elsewhere_0"])
    x, y = np.array([1.0, 40.0, 1.0]), np.zeros(3)
    for pair in ((east, other), (other, east)):
        assert bridge.parts(*pair, x, y).tolist() == [True, False, False]
