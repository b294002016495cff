"""Which lanes ordinary vehicles are on, with front and rear, without SUMO."""

from __future__ import annotations

from unittest.mock import Mock

import pytest
from fake_traffic import whereabouts

from loopgate.control.blocking import outside
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.places import Make
from loopgate.control.sight import Sight
from loopgate.network import RoadNetwork, generate_loops
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.attaching.plan import Plan
from loopgate.simulation.surroundings.crossing_ways import CrossingWays
from loopgate.simulation.surroundings.laid_roads import LaidRoads, map_of
from loopgate.simulation.surroundings.obeyed import Lamps
from loopgate.traffic.base import Dynamics, Light, Program


def upon(sight: Sight, lane: str) -> set[str]:
    """Return the vehicles that are on a lane with some part."""
    there = sight.roads.lanes[lane]
    return {other.name for other in there.fronts} | {rear.other.name for rear in there.rears}


@pytest.mark.parametrize("last", [1, 2])
def test_a_long_vehicle_is_on_the_lanes_behind_its_front(last: int) -> None:
    """A bus whose front is 2 m beyond a junction is inside too, and before it; one that parks is nowhere."""
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    loop = generate_loops(network, 1, length_m=(800.0, 2000.0))[0]
    roads = [number for number, span in enumerate(loop.spans) if not span.internal]
    way = [span.lane_id for span in loop.spans[roads[0] : roads[last] + 1]]
    length_m = 3.0 + sum(network.lanes[lane].length_m for lane in way[1:-1])
    lanes = {"bus": (way[-1], 2.0), "parked": (way[-1], 2.0)}
    traffic = Mock(
        now_s=0.0,
        step_s=1.0,
        vehicles=lambda: tuple(lanes),
        whereabouts_of=lambda names: whereabouts(**{name: (*lanes[name], 0.0) for name in names}),
        parks=lambda name: name == "parked",
        dynamics=lambda _: Dynamics(length_m, 1.2, 4.5, 1.0),
        route=lambda _: (loop.edges, last),
        route_id=lambda _: "route",
    )
    sight = Sight(map_of(network), traffic)
    sight.look((), 0)
    assert [upon(sight, lane) for lane in way] == [{"bus"}] * len(way)
    lanes["bus"] = way[-1], length_m + 1.0
    traffic.now_s = 1.0
    sight.look((), 0)
    assert [upon(sight, lane) for lane in way] == [set()] * (len(way) - 1) + [{"bus"}]
    del lanes["bus"]
    sight.look((), 0)
    assert upon(sight, way[-1]) == set()


def test_it_finds_each_vehicle_again_when_it_reads_gated_vehicles_too() -> None:
    """The gated vehicle is read first, and nothing else has changed."""
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    lanes = {"gated": "A0A1_0", "bus": "B0B1_0"}
    traffic = Mock(
        now_s=0.0,
        step_s=1.0,
        vehicles=lambda: tuple(lanes),
        whereabouts=lambda: whereabouts(**{name: (lane, 50.0, 9.0) for name, lane in lanes.items()}),
        whereabouts_of=lambda names: whereabouts(**{name: (lanes[name], 50.0, 9.0) for name in names}),
        dynamics=lambda _: Dynamics(5.0, 2.6, 4.5, 1.0),
        route=lambda _: (("B0B1",), 0),
        route_id=lambda _: "route",
    )
    sight = Sight(map_of(network), traffic)
    sight.look(("gated",), 0)
    sight.read_everybody()
    sight.look(("gated",), 0)
    assert [upon(sight, lane) for lane in lanes.values()] == [set(), {"bus"}]


@pytest.mark.parametrize("rear_m", [10.0, 11.0])
def test_a_rear_past_the_way_leaves_room(rear_m: float) -> None:
    """On a turn of 14 m, of which a left turner from the other side touches the first 10.6 m."""
    network = RoadNetwork.open("sumo:DRT")
    turn = ":1560224186_13_0"
    loop = generate_loops(network, 1, length_m=(400.0, 4000.0), via=("142575674#2", "142575688#0"))[0]
    track = Plan(network, ((loop, DEFAULT_TYPE),)).tracks[0]
    ways = CrossingWays(network).of(track)
    (at,) = (n for n, way in enumerate(ways) if any(turn in m.across for m in way.movements))
    (there,) = (c for c in network.connections if turn in c.via)
    front_m = 1.0
    length_m = front_m + network.lanes[turn].length_m - rear_m
    traffic = Mock(
        now_s=0.0,
        step_s=1.0,
        vehicles=lambda: ("o",),
        whereabouts_of=lambda _: whereabouts(o=(f"{there.to_edge}_{there.to_lane}", front_m, 0.0)),
        parks=lambda _: False,
        dynamics=lambda _: Dynamics(length_m, 2.6, 4.5, 1.0),
        route=lambda _: ((there.from_edge, there.to_edge), 1),
        light=lambda _: Light("G" * 40, 0.0),
        light_program=lambda _: Program((), fixed=False),
        route_id=lambda _: "route",
    )
    laid = LaidRoads(network, traffic, Lamps(traffic).__getitem__)
    slots: dict[str, int] = {leg.state: 9 for leg in track.legs}
    layout = PlaceLayout(slots, [track.legs], on_path=laid.add)
    ledger = Ledger([lambda *_: None])
    car = ledger.take_in("car", layout.path(track.legs), at, Make(5.0, 2.6, 4.5, 10.0, 1.0), track.lap_m)
    car.front_m = car.line_m - 1.0
    ledger.ask(car)
    laid.sight.look(("car",), 1)
    assert outside(car, laid.slack, [car]) == ([["o"]] if rear_m < 10.5 else [])
    assert upon(laid.sight, turn) == {"o"}


def test_one_that_is_not_on_its_route_is_read_in_each_step_until_it_is() -> None:
    """SUMO may lead it elsewhere; where its route names its road it is read again after some seconds only."""
    network, read = RoadNetwork.open("networks/grid5-priority.net.xml"), list[float]()
    lanes = {"bus": "A0A1_0"}
    traffic = Mock(
        now_s=0.0,
        step_s=1.0,
        vehicles=lambda: tuple(lanes),
        whereabouts_of=lambda names: whereabouts(**{name: (lanes[name], 50.0, 9.0) for name in names}),
        dynamics=lambda _: Dynamics(5.0, 2.6, 4.5, 1.0),
        route_id=lambda _: "route",
    )

    def route(_: str) -> tuple[tuple[str, ...], int]:
        read.append(traffic.now_s)
        return ("B0B1", "B1B2"), 0

    traffic.route = route
    sight = Sight(map_of(network), traffic)
    for second in range(4):
        traffic.now_s = float(second)
        sight.look((), 0)
    assert read == [0.0, 1.0, 2.0, 3.0]
    lanes["bus"] = "B0B1_0"
    for second in range(4, 8):
        traffic.now_s = float(second)
        sight.look((), 0)
    assert read == [0.0, 1.0, 2.0, 3.0]
