"""Places, crossings and starts of the queues abstraction, on hand-made roads and on real networks."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from roads import roads

from loopgate.abstraction.movements import REACH_M, find_conflicts
from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.abstraction.queues import make_queues
from loopgate.errors import ScenarioError
from loopgate.gates import make_gate
from loopgate.network import RoadNetwork, VehicleType, generate_loops, make_loop
from loopgate.network.vehicle_type import DEFAULT_TYPE

GRID = Path(__file__).resolve().parents[3] / "networks" / "grid5-priority.net.xml"


def apart(network: RoadNetwork) -> RoadNetwork:
    """Give each movement a junction of its own."""
    return RoadNetwork(
        name=network.name,
        file=network.file,
        edges=network.edges,
        lanes=network.lanes,
        junctions={},
        connections=tuple(replace(c, junction=f"J{c.id}", link=-1) for c in network.connections),
    )


# b holds one vehicle: floor((10 - 1.1) / 7.5).
RING = apart(roads({"a": (80.0, 1), "b": (10.0, 1), "c": (40.0, 1)}, ["a_0>b_0", "b_0>c_0", "c_0>a_0"]))


def test_places_are_lanes_that_hold_two_and_short_ones_join_the_crossing() -> None:
    """80 m hold floor(78.9 / 7.5) = 10 vehicles and 40 m five; 10 m hold one, so b lies in a crossing."""
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    abstraction = make_queues(RING, [loop] * 3)
    assert dict(abstraction.system.capacity) == {"a_0": 10, "c_0": 5}
    legs = abstraction.itineraries[0].legs
    assert [leg.state for leg in legs] == ["a_0", "c_0"]
    assert [[crossing.id for crossing in leg.crossings] for leg in legs] == [
        ["a_0>b_0", "b_0>c_0"],
        ["c_0>a_0"],
    ]
    assert [(leg.begin_m, leg.end_m) for leg in legs] == [(0.0, 79.9), (90.0, 129.9)]


def test_the_longest_visitor_of_a_lane_says_how_many_it_holds() -> None:
    """A bus of 12 m with a gap of 3 m: floor(78.9 / 15) = 5."""
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    bus = VehicleType(id="bus", length_m=12.0, min_gap_m=3.0)
    assert lay_out_queues(RING, [(loop, DEFAULT_TYPE), (loop, bus)]).capacity == {"a_0": 5, "c_0": 2}


def test_more_vehicles_than_can_start_are_refused_with_the_number_that_can() -> None:
    """One slot stays free on each place: 9 and 4 of 10 and 5."""
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    assert len(make_queues(RING, [loop] * 13).starts_m) == 13
    with pytest.raises(ScenarioError, match="14 vehicles are too many for 1 loops; 13 can start"):
        make_queues(RING, [loop] * 14)


def test_loops_that_change_lanes_are_told_so() -> None:
    """Two lanes, entered on one and left on the other; and a fork where SUMO has the choice."""
    change = roads({"a": (80.0, 2), "b": (80.0, 1)}, ["a_0>b_0", "b_0>a_1"])
    fork = roads({"a": (80.0, 2), "b": (80.0, 1)}, ["a_0>b_0", "a_1>b_0", "b_0>a_0", "b_0>a_1"])
    assert "must change from lane 1 to lane 0 on edge a" in why_not(
        change, make_loop(change, "l", ["a", "b"])
    )
    assert "SUMO may choose among lanes 0, 1" in why_not(fork, make_loop(fork, "l", ["a", "b"]))
    with pytest.raises(ScenarioError, match="loop l must change"):
        make_queues(change, [make_loop(change, "l", ["a", "b"])])


@pytest.mark.parametrize("name", [str(GRID), "sumo:DRT", "sumo:bs3d"])
def test_conflicts_are_symmetric_and_hold_the_matrix_and_the_geometry(name: str) -> None:
    """Against a brute-force distance of the drawn curves, pair by pair, and the request matrix."""
    network = RoadNetwork.open(name)
    movements = [m for m in network.connections if network.allows(m)]
    found = find_conflicts(network, movements)
    curves = {
        m.id: shapely.LineString(np.concatenate([network.lanes[lane].shape for lane in m.via]))
        for m in movements
    }
    by_junction: dict[str, list[int]] = {}
    for k, m in enumerate(movements):
        by_junction.setdefault(m.junction, []).append(k)
    for one in movements:
        assert all(one.id in found.foes[foe] for foe in found.foes[one.id])
        for k in by_junction[one.junction]:
            other = movements[k]
            if (one.from_edge, one.from_lane) == (other.from_edge, other.from_lane):
                assert other.id not in found.foes[one.id]
            elif network.are_foes(one, other) or curves[one.id].distance(curves[other.id]) < REACH_M - 1e-6:
                assert other.id in found.foes[one.id]


def test_starts_leave_a_slot_free_on_every_place_and_are_live() -> None:
    """No place is full, fronts stand in line on their lanes, and the certified gate accepts the start."""
    network = RoadNetwork.open(GRID)
    loops = generate_loops(network, 20, seed=3)
    abstraction = make_queues(network, [loops[k % 20] for k in range(300)], seed=2)
    system = abstraction.system
    held = Counter(robot.path[robot.start] for robot in system.robots)
    assert all(count < system.capacity[state] for state, count in held.items())
    line: dict[str, float] = {}
    for k, (robot, start) in enumerate(zip(system.robots, abstraction.starts_m, strict=True)):
        leg = abstraction.itineraries[k].legs[robot.start]
        front = start - leg.begin_m
        assert 5.0 <= front <= leg.end_m - leg.begin_m
        assert front <= line.get(leg.state, np.inf) - 7.5
        line[leg.state] = front
    make_gate("certified", system)


def test_the_same_seed_gives_the_same_starts() -> None:
    """And another seed others."""
    network = RoadNetwork.open(GRID)
    loops = generate_loops(network, 10, seed=3)
    assert make_queues(network, loops, seed=5).starts_m == make_queues(network, loops, seed=5).starts_m
    assert make_queues(network, loops, seed=5).starts_m != make_queues(network, loops, seed=6).starts_m
