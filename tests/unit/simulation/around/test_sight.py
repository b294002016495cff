"""Which lanes ordinary vehicles are on, with front and rear, without SUMO."""

from unittest.mock import Mock

import pytest
from fake_traffic import whereabouts
from ordinary_scene import Watched, alone_on

from loopgate.network import RoadNetwork, generate_loops
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.around.crossing_ways import CrossingWays
from loopgate.simulation.around.lights import signals_of
from loopgate.simulation.attaching.plan import Plan
from loopgate.traffic.base import Dynamics, Light, Program


def test_a_long_vehicle_is_on_the_lanes_behind_its_front() -> None:
    """A bus whose front is 2 m beyond a junction is inside too, and before it; one that parks is nowhere."""
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    loop = generate_loops(network, 1, length_m=(800.0, 2000.0))[0]
    roads = [number for number, span in enumerate(loop.spans) if not span.internal]
    way = [span.lane_id for span in loop.spans[roads[0] : roads[1] + 1]]
    length_m = 3.0 + sum(network.lanes[lane].length_m for lane in way[1:-1])
    lanes = {"bus": (way[-1], 2.0), "parked": (way[-1], 2.0)}
    traffic = Mock(
        now_s=0.0,
        step_s=1.0,
        whereabouts=lambda: whereabouts(**{v: (*at, 0.0) for v, at in lanes.items()}),
        parks=lambda vehicle: vehicle == "parked",
        dynamics=lambda _: Dynamics(length_m, 1.2, 4.5, 1.0),
        route=lambda _: (loop.edges, 1),
        route_id=lambda _: "route",
    )
    watched = Watched(*alone_on(network, loop), traffic, network, CrossingWays(network))
    watched.look()
    assert [watched.upon(lane) for lane in way] == [["bus"]] * len(way)
    lanes["bus"] = way[-1], length_m + 1.0
    watched.look()
    assert watched.upon(way[0]) == ["bus"]  # nothing is looked at twice in a step
    traffic.now_s = 1.0
    watched.look()
    assert [watched.upon(lane) for lane in way] == [[]] * (len(way) - 1) + [["bus"]]


@pytest.mark.parametrize("rear_m", [10.0, 11.0])
def test_a_rear_past_the_way_leaves_room(rear_m: float) -> None:
    """On a turn of 14 m, of which a left turner from the other side touches the first 10.6 m."""
    network = RoadNetwork.open("sumo:DRT")
    loop = generate_loops(network, 1, length_m=(400.0, 4000.0), via=("142575674#2", "142575688#0"))[0]
    ways = CrossingWays(network).of(Plan(network, ((loop, DEFAULT_TYPE),)).tracks[0])
    (at,) = (n for n, way in enumerate(ways) if any(":1560224186_13_0" in m.across for m in way.movements))
    (there,) = (c for c in network.connections if ":1560224186_13_0" in c.via)
    front_m = 1.0
    left_m = network.lanes[":1560224186_13_0"].length_m - rear_m
    traffic = Mock(
        now_s=0.0,
        step_s=1.0,
        whereabouts=lambda: whereabouts(o=(f"{there.to_edge}_{there.to_lane}", front_m, 0.0)),
        parks=lambda _: False,
        dynamics=lambda _: Dynamics(front_m + left_m, 2.6, 4.5, 1.0),
        route=lambda _: ((there.from_edge, there.to_edge), 1),
        light=lambda _: Light("G" * 40, 0.0),
        light_program=lambda _: Program((), fixed=False),
        route_id=lambda _: "route",
    )
    signals = signals_of(network)
    watched = Watched(*alone_on(network, loop), traffic, network, CrossingWays(network), signals)
    watched.engine.vehicles["granted"] = at
    watched.look()
    assert watched.blockers() == ([["o"]] if rear_m < 10.5 else [])
    assert watched.upon(":1560224186_13_0") == ["o"]
