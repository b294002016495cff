"""Which lanes ordinary vehicles are on, with front and rear, without SUMO."""

from unittest.mock import Mock

from loopgate.network import RoadNetwork, generate_loops
from loopgate.simulation.sight import Sight
from loopgate.traffic.base import Dynamics


def test_a_long_vehicle_is_on_the_lanes_behind_its_front() -> None:
    """A bus whose front is 2 m beyond a junction is still inside, and on the road before; a parked one nowhere."""
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    loop = generate_loops(network, 1, length_m=(800.0, 2000.0))[0]
    before, after = loop.edges[:2]
    (inside,) = {span.lane_id for span in loop.spans[:3] if span.internal}
    lanes = {"bus": (f"{after}_0", 2.0), "parked": (f"{after}_0", 2.0)}
    traffic = Mock(
        now_s=0.0,
        vehicles=lambda: list(lanes),
        lane=lanes.__getitem__,
        parks=lambda vehicle: vehicle == "parked",
        dynamics=lambda _: Dynamics(3.0 + network.lanes[inside].length_m, 1.2, 4.5, 1.0),
        route=lambda _: (loop.edges, 1),
    )
    sight = Sight(network, traffic, [])
    assert sight.look()
    assert not sight.look()
    upon = {
        lane: [seen.vehicle for seen in sight.upon(lane)] for lane in (f"{after}_0", inside, f"{before}_0")
    }
    assert upon == {f"{after}_0": ["bus"], inside: ["bus"], f"{before}_0": ["bus"]}
    lanes["bus"] = f"{after}_0", 30.0
    traffic.now_s = 1.0
    assert sight.look()
    assert [len(sight.upon(lane)) for lane in upon] == [1, 0, 0]
