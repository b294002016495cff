"""Which junctions ordinary vehicles come to, and on which ways over them nothing keeps vehicles apart."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any
from unittest.mock import Mock

import pytest
from fake_traffic import whereabouts
from ordinary_scene import Watched, alone_on

from loopgate.network import RoadNetwork, generate_loops
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.around.crossing_ways import CrossingWays
from loopgate.simulation.attaching.plan import Plan
from loopgate.traffic.base import Dynamics

CAR = Dynamics(5.0, 2.6, 4.5, 1.0)


def test_vehicles_come_to_the_junctions_on_their_routes() -> None:
    """One at 10 m/s, one inside a junction, one that stands in a queue; by their routes, not by lanes.

    One that stands farther back than a queue that sets out in time is left out.
    """
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    loop = generate_loops(network, 1, length_m=(800.0, 2000.0))[0]
    first, second, third, fourth = loop.edges[:4]
    inside = next(span.lane_id for span in loop.spans if span.internal)
    length_m = network.edges[first].lanes[0].length_m
    speeds = {"moves": 10.0, "queues": 0.0, "stands": 0.0, "inside": 10.0}
    lanes = {
        "moves": (f"{first}_0", length_m - 20.0),
        "queues": (f"{first}_0", length_m - 27.0),
        "stands": (f"{first}_0", length_m - 40.0),
        "inside": (inside, network.lanes[inside].length_m),
    }
    traffic = Mock(
        now_s=0.0,
        step_s=1.0,
        whereabouts=lambda: whereabouts(**{v: (*at, speeds[v]) for v, at in lanes.items()}),
        dynamics=lambda _: CAR,
        parks=lambda _: False,
        route=lambda _: (loop.edges, 0),
        route_id=lambda _: "route",
    )
    watched = Watched(*alone_on(network, loop), traffic, network, CrossingWays(network))

    def arrivals() -> dict[tuple[str, str], list[Any]]:
        watched.look()
        return {b: some for b in pairwise(loop.edges) if (some := watched.arrivals(*b))}

    found = arrivals()
    one, queued = found[first, second]
    assert (queued["stands"], queued["last_s"]) == (True, math.inf)
    assert not one["stands"]
    assert one["last_s"] == pytest.approx(2.0)
    assert 1.5 < one["first_s"] < 2.0
    behind_s = {arrival["last_s"] for arrival in found[second, third]}
    assert network.edges[second].lanes[0].length_m / 10.0 == pytest.approx(min(behind_s))
    assert len(behind_s) == 2
    assert all(a["first_s"] <= 20.0 for arrivals in found.values() for a in arrivals)
    traffic.now_s, traffic.route = 1.0, Mock(side_effect=AssertionError)
    lanes.clear()
    lanes["moves"] = f"{second}_0", 0.0
    again = arrivals()
    assert (first, second) not in again
    assert fourth in loop.edges


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
