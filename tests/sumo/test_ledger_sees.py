"""What the ledger sees of ordinary traffic, beside what SUMO says of it step by step."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import heart  # in analysis/
import pytest

from loopgate.control.places import STANDING_MPS, time_s
from loopgate.control.sight import HORIZON_S, Sight
from loopgate.network import RoadNetwork
from loopgate.simulation.sumo.start import start_traffic
from loopgate.simulation.surroundings.laid_roads import map_of
from loopgate.traffic.base import Traffic


@pytest.mark.parametrize("name", ["sumo:DRT", "networks/grid5-priority.net.xml"])
def test_it_sees_what_sumo_says(name: str, tmp_path: Path) -> None:
    """Fronts, rears, edges of routes and vehicles that come to a turn, reckoned anew from SUMO's routes."""
    network = RoadNetwork.open(name)
    trips = tmp_path / "trips.rou.xml"
    heart.draw_trips(name, 1.0, 200.0, 1, trips)
    files = ["--net-file", str(network.file), "--route-files", str(trips), "--no-step-log", "--no-warnings"]
    traffic = start_traffic(files, backend="libsumo", log=tmp_path / "log")
    sight = Sight(map_of(network), traffic)
    seen = rears = 0
    try:
        for step in range(200):
            traffic.step()
            sight.look((), 0)
            if step % 9 == 0:
                seen += compare(sight, traffic, network)
                rears += sum(len(lane.rears) for lane in sight.roads.lanes.values())
    finally:
        traffic.close()
    assert seen > 500
    assert rears > 20
    assert sight.met > 150


def compare(sight: Sight, traffic: Traffic, network: RoadNetwork) -> int:
    """Check everything that is seen; return how many vehicles come to a turn."""
    on = defaultdict(set)
    for vehicle in traffic.vehicles():
        lane, _ = traffic.lane(vehicle)
        on[lane].add(vehicle)
    lanes = sight.roads.lanes
    assert {name: {o.name for o in lane.fronts} for name, lane in lanes.items() if lane.fronts} == on
    turns = {id(turn): edges for edges, turn in sight.roads.turns.items()}
    listed = {
        (coming.other.name, turns[id(turn)], round(coming.to_m - coming.other.position_m, 6))
        for turn in sight.roads.turns.values()
        for coming in turn.coming
    }
    rears = {(rear.other.name, name) for name, lane in lanes.items() for rear in lane.rears}
    expected = []
    for name, other in sight.others.items():
        edges, at = traffic.route(name)
        lane, position_m = traffic.lane(name)
        assert other.position_m == position_m
        assert len(other.edges) == len(edges)
        assert other.at == at
        left_m = network.lanes[lane].length_m - position_m
        if network.lanes[lane].internal:
            at += 1
            left_m += max(one.length_m for one in network.edges[edges[at]].lanes)
        elif other.length_m > position_m and at > 0:
            led = lanes[lane].from_edge(sight.roads.edges[edges[at - 1]])  # none where it has changed lanes
            assert led is None or (name, led.name) in rears
        for before, behind in pairwise(edges[at:]):
            limit = max(one.speed_mps for one in network.edges[before].lanes)
            first_s = time_s(left_m, other.speed, other.accel, max(other.speed, limit))
            if other.speed > STANDING_MPS and first_s > HORIZON_S:
                break
            expected.append((name, (before, behind), round(left_m, 6)))
            if other.speed <= STANDING_MPS:
                break
            left_m += sight.roads.turns[before, behind].through_m
            left_m += max(one.length_m for one in network.edges[behind].lanes)
    assert not set(expected) - listed
    return len(expected)
