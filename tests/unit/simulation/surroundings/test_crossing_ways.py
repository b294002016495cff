"""On which ways over junctions nothing keeps vehicles apart from ordinary vehicles."""

from __future__ import annotations

import math

from loopgate.network import RoadNetwork, generate_loops
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.attaching.plan import Plan
from loopgate.simulation.surroundings.crossing_ways import CrossingWays


def test_ways_that_touch_without_right_of_way_count() -> None:
    """A turn to the left from the other side, which goes first; and a turn round that SUMO forgets."""
    network = RoadNetwork.open("sumo:DRT")
    here, there = "142575687#1", "142575655#4"
    loop = generate_loops(network, 1, length_m=(400.0, 4000.0), via=(here, there))[0]
    plan = Plan(network, ((loop, DEFAULT_TYPE),))
    ways = CrossingWays(network).of(plan.tracks[0])
    way = next(way for way in ways if way.lane == f"{here}_1")
    (movement,) = way.movements
    approaches = {(a.from_edge, a.to_edge) for a in movement.approaches}
    assert {("257072321#12", "-142575655#1"), ("-142575655#4", "142575655#4")} <= approaches
    assert any(lane.endswith("_38919786_14_0") for lane in movement.across)
    assert math.isfinite(movement.speed_mps)


def test_who_turns_left_waits_inside_in_the_way() -> None:
    """Of those who come straight on from the other side; who goes straight on waits nowhere."""
    network = RoadNetwork.open("sumo:DRT")
    here, there = "142575688#7", "-114024904"
    loop = generate_loops(network, 1, length_m=(400.0, 4000.0), via=(here, there), vclass="bus")[0]
    ways = CrossingWays(network).of(Plan(network, ((loop, DEFAULT_TYPE),)).tracks[0])
    passed = [movement for way in ways for movement in way.movements]
    (turn,) = (m for m in passed if any(a.from_edge == "-142575688#8" for a in m.approaches))
    assert turn.waits_in_way
    assert all(m.wait_m > 0.0 for m in passed if m.waits_in_way)
    assert not all(m.waits_in_way for m in passed)


def test_who_would_wait_for_it_across_its_way_counts() -> None:
    """Who turns round on a road of 4 m waits there for who comes, whose way on its rear bars meanwhile."""
    network = RoadNetwork.open("sumo:DRT")
    loop = generate_loops(network, 1, length_m=(400.0, 4000.0), via=("8025704#1", "118262353#0"))[0]
    ways = CrossingWays(network).of(Plan(network, ((loop, DEFAULT_TYPE),)).tracks[0])
    (way,) = (way for way in ways if way.lane == "8025704#0_1")
    comers = [{(a.from_edge, a.to_edge) for a in movement.approaches} for movement in way.movements]
    assert any(("46424277", "-46424277") in approaches for approaches in comers)
    assert any(("70130339#2", "46424277") in approaches for approaches in comers)


def test_who_is_inside_the_junction_beside_in_the_way_counts() -> None:
    """Who turns round there drives over the way; who only comes there may wait outside it."""
    network = RoadNetwork.open("sumo:DRT")
    loop = generate_loops(network, 1, length_m=(400.0, 9000.0), via=("71028777#2", "142575692#3"))[0]
    ways = CrossingWays(network).of(Plan(network, ((loop, DEFAULT_TYPE),)).tracks[0])
    turned = ":268816953_0_0"
    (movement,) = (m for way in ways for m in way.movements if turned in m.across)
    assert turned in movement.unseen
    assert movement.past_m[turned] > 0.0
    assert all(a.from_edge != "24733697#2" for a in movement.approaches)
