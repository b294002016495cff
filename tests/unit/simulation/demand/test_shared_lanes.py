"""Loops share parallel lanes."""

from __future__ import annotations

from dataclasses import replace

from roads import roads

from loopgate.network import RoadNetwork, VehicleDemand, make_loop
from loopgate.network.vehicle_type import DEFAULT_TYPE, type_of_class
from loopgate.simulation.demand.shared_lanes import share_lanes

WIDE = roads({"a": (100, 2), "b": (100, 2)}, ["a_0>b_0", "a_1>b_1", "b_0>a_0", "b_1>a_1"])


def on(network: RoadNetwork, *names: str, edges: tuple[str, ...] = ("a", "b")) -> list[VehicleDemand]:
    """Return a vehicle on each of these loops."""
    return [
        VehicleDemand(f"v{k}", make_loop(network, name, edges), DEFAULT_TYPE) for k, name in enumerate(names)
    ]


def lanes(vehicles: list[VehicleDemand]) -> list[list[int]]:
    """Return the lanes of each vehicle, edge by edge."""
    return [[span.lane for span in v.loop.roads] for v in vehicles]


def test_loops_over_the_same_edges_take_a_lane_each() -> None:
    """Two lanes lead all the way round, and two loops: one on each, without a change."""
    shared = share_lanes(WIDE, on(WIDE, "one", "other"))
    assert sorted(lanes(shared)) == [[0, 0], [1, 1]]
    assert [v.loop.id for v in shared] == ["one", "other"]
    assert all(v.loop.closed and len(v.loop.movements) == 2 for v in shared)


def test_the_vehicles_of_a_loop_stay_together() -> None:
    """Three vehicles on one loop are on its lanes, and the other loop goes beside them."""
    shared = share_lanes(WIDE, on(WIDE, "many", "many", "many", "few"))
    assert lanes(shared)[0] == lanes(shared)[1] == lanes(shared)[2] != lanes(shared)[3]


def test_loops_that_keep_their_lanes() -> None:
    """A loop that is named keeps its lanes, and the other goes beside it; or all keep them."""
    before = on(WIDE, "one", "other")
    assert lanes(share_lanes(WIDE, before, ["one"])) == [lanes(before)[0], [1, 1]]
    assert share_lanes(WIDE, before, None) == before


def test_positions_move_with_the_lanes() -> None:
    """A vehicle that wants to start 30 m into an edge does so on the other lane too."""
    before = [replace(v, edge=1, depart_m=130.0) for v in on(WIDE, "one", "other")]
    assert [v.depart_m for v in share_lanes(WIDE, before)] == [130.0, 130.0]


def test_a_loop_for_several_classes_keeps_its_lanes() -> None:
    """A lane that is open to cars may be closed to buses."""
    before = on(WIDE, "one", "other", "other")
    before[2] = replace(before[2], type=type_of_class("bus", "types"))
    assert [v.loop for v in share_lanes(WIDE, before)[1:]] == [v.loop for v in before[1:]]
