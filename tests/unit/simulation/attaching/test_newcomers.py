"""Where a vehicle is held back that is to come under the gate, without SUMO."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from loopgate.errors import TrafficError
from loopgate.network import RoadNetwork, VehicleType, make_loop
from loopgate.simulation.attaching.newcomers import Newcomer
from loopgate.simulation.attaching.plan import Plan
from loopgate.traffic.base import Dynamics

CAR = VehicleType()
EDGES = ("B1C1", "C1C2", "C2B2", "B2B1")


class Road:
    """One vehicle, put where a test wants it; it takes every stop but those on some edges."""

    step_s = 1.0

    def __init__(self) -> None:
        self.at = ("B1C1_0", 10.0)
        self.speed_mps = 0.0
        self.holds: list[str] = []
        self.released = 0
        self.led: list[tuple[str, ...]] = []
        self.refused: set[str] = set()
        self.beside: set[str] = set()

    def lane(self, vehicle: str) -> tuple[str, float]:
        del vehicle
        return self.at

    def speed(self, vehicle: str) -> float:
        del vehicle
        return self.speed_mps

    def dynamics(self, vehicle: str) -> Dynamics:
        del vehicle
        return Dynamics(5.0, 2.6, 4.5, 1.0)

    def route(self, vehicle: str) -> tuple[tuple[str, ...], int]:
        del vehicle
        return EDGES, 0

    def lead(self, vehicle: str, edges: tuple[str, ...]) -> None:
        del vehicle
        self.led.append(edges)

    def hold(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> bool:
        del vehicle, lane_index, position_m
        if edge in self.refused:
            raise TrafficError(edge)
        if edge not in self.beside:
            self.holds.append(edge)
        return edge not in self.beside

    def release(self, vehicle: str) -> None:
        del vehicle
        self.released += 1


@pytest.fixture(name="scene")
def make_scene() -> tuple[Newcomer, Any, Plan]:
    """Return a newcomer on a block of the grid, its road and the plan."""
    roads = RoadNetwork.open(Path(__file__).parents[4] / "networks" / "grid5-priority.net.xml")
    loop = make_loop(roads, "block", EDGES)
    return Newcomer("v", loop, CAR, 0.0), Road(), Plan(roads, ((loop, CAR),))


def test_it_is_held_at_the_end_of_its_place(scene: tuple[Newcomer, Any, Plan]) -> None:
    """It can be taken in when its rear is in the place too; its route lasts for rounds."""
    newcomer, road, plan = scene
    road.at = ("B1C1_0", 4.0)
    newcomer.look(road, plan)
    assert (newcomer.inside, road.holds) == (False, ["B1C1"])
    assert road.led[0][:5] == (*EDGES, "B1C1")
    road.at = ("B1C1_0", 60.0)
    newcomer.look(road, plan)
    assert newcomer.inside
    assert road.holds == ["B1C1"], "once is enough"
    assert newcomer.arc_m == pytest.approx(60.0)


@pytest.mark.parametrize("why", ["it cannot brake", "SUMO refuses it", "it is on the lane beside"])
def test_where_it_cannot_be_held_it_is_at_the_next(why: str, scene: tuple[Newcomer, Any, Plan]) -> None:
    """What is too near is not asked of SUMO, which would take it if it lay on another edge."""
    newcomer, road, plan = scene
    road.at, road.speed_mps = ("B1C1_0", 78.0), 13.9
    if why != "it cannot brake":
        road.speed_mps = 1.0
        (road.refused if "SUMO" in why else road.beside).add("B1C1")
    newcomer.look(road, plan)
    assert road.holds == ["C1C2"]
    assert not newcomer.inside
    assert newcomer.left_m > 60.0


@pytest.mark.parametrize(("left_m", "edge"), [(3.7, "B1C1"), (3.54, "C1C2")])
def test_it_is_held_where_it_can_brake_for_that(
    left_m: float, edge: str, scene: tuple[Newcomer, Any, Plan]
) -> None:
    """SUMO takes a stop that is nearer than the braking distance, 3.67 m here, and drives on past it."""
    newcomer, road, plan = scene
    line_m = plan.track("v", "block", front_m=0.0, position=0).legs[0].line.position_m
    road.at, road.speed_mps = ("B1C1_0", line_m - left_m), 8.17
    newcomer.look(road, plan)
    assert road.holds == [edge]


def test_past_its_line_it_is_held_anew(scene: tuple[Newcomer, Any, Plan]) -> None:
    """Somebody has let it go, or it has not stopped."""
    newcomer, road, plan = scene
    newcomer.look(road, plan)
    road.at = (":C1_7_0", 3.0)
    newcomer.look(road, plan)
    assert (road.released, newcomer.position) == (1, None)
    road.at = ("C1C2_0", 5.0)
    newcomer.look(road, plan)
    assert road.holds == ["B1C1", "C1C2"]


def test_off_its_loop_it_is_left_alone(scene: tuple[Newcomer, Any, Plan]) -> None:
    """Until it comes back."""
    newcomer, road, plan = scene
    newcomer.look(road, plan)
    road.at = ("C1D1_0", 5.0)
    newcomer.look(road, plan)
    assert math.isnan(newcomer.arc_m)
    assert (road.released, newcomer.position) == (1, None)
    road.at = (":C1_0_0", 1.0)
    newcomer.look(road, plan)
    assert road.holds == ["B1C1"]
