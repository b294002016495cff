"""Which lanes ordinary vehicles are on, with front and rear, without SUMO."""

from unittest.mock import Mock

from loopgate.network import RoadNetwork, generate_loops
from loopgate.simulation.sight import Sight
from loopgate.traffic.base import Dynamics


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
        vehicles=lambda: list(lanes),
        lane=lanes.__getitem__,
        parks=lambda vehicle: vehicle == "parked",
        dynamics=lambda _: Dynamics(length_m, 1.2, 4.5, 1.0),
        route=lambda _: (loop.edges, 1),
    )
    sight = Sight(network, traffic, [])
    assert sight.look()
    assert not sight.look()
    assert [[seen.vehicle for seen in sight.upon(lane)] for lane in way] == [["bus"]] * len(way)
    lanes["bus"] = way[-1], length_m + 1.0
    traffic.now_s = 1.0
    assert sight.look()
    assert [len(sight.upon(lane)) for lane in way] == [0] * (len(way) - 1) + [1]
