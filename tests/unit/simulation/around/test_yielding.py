"""Gated vehicles with grants give way before junctions, without SUMO."""

import pytest
from ordinary_scene import Arrival, Scene

COMES = [Arrival(4.0, 4.0)]


class Way(Scene):
    """The vehicle ``v`` has its grant; the junction begins at 100 m."""

    def __init__(self) -> None:
        super().__init__(others_in_next=1)
        self.row["granted"] = 1
        self.put("o", "priority", 60.0)

    def change_numbers(self) -> None:
        """Let the two vehicles have each other's rows."""
        vehicles, drivers = self.engine.vehicles, self.engine.drivers
        vehicles[[0, 1]] = vehicles[[1, 0]]
        drivers.reverse()
        for robot, driver in enumerate(drivers):
            driver.robot, driver.row = robot, vehicles[robot]
        self.row = vehicles[1]

    def told(self, arrivals: list[Arrival], *, front_m: float, speed_mps: float) -> list[float | None]:
        """Return what the vehicle is told in a step."""
        self.slowed.clear()
        self.given = arrivals
        self.row["front"], self.row["speed"] = front_m, speed_mps
        self.traffic.now_s += 1.0
        self.look()
        self.sight.give_way()
        assert {vehicle for vehicle, _ in self.slowed} <= {"v"}
        return [told for _, told in self.slowed]


def test_who_stands_at_its_line_sets_out_when_nobody_comes() -> None:
    """SUMO's right of way, which stopped it, may let both go at once; after a minute it decides alone."""
    way = Way()
    assert way.told([], front_m=98.0, speed_mps=0.0) == []
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == [0.0]
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == []
    assert way.told([], front_m=98.0, speed_mps=0.0) == [None]
    assert way.told(COMES, front_m=60.0, speed_mps=0.0) == []
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == [0.0]
    way.change_numbers()
    assert way.told([], front_m=98.0, speed_mps=0.0) == [None]
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == [0.0]
    way.traffic.now_s += 60.0
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == [None]
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == []


def test_who_is_under_way_slows_down_as_late_as_it_can_and_stops_before_the_junction() -> None:
    """At 10 m/s it needs 11 m to brake; who can no more drives on, and who has the way to itself too."""
    way = Way()
    assert way.told(COMES, front_m=70.0, speed_mps=10.0) == []
    assert way.told([], front_m=84.0, speed_mps=10.0) == []
    assert way.told(COMES, front_m=95.0, speed_mps=10.0) == []
    front_m, speed_mps = 80.0, 10.0
    for _ in range(12):
        (told,) = way.told([Arrival(3.0, 9.0)], front_m=front_m, speed_mps=speed_mps) or [speed_mps]
        assert told is not None
        assert told >= speed_mps - 4.5 - 1e-9
        speed_mps, front_m = told, front_m + told
    assert front_m == pytest.approx(99.5)
    assert way.told([], front_m=front_m, speed_mps=speed_mps) == [None]


def test_whom_sumo_does_not_see_is_given_way_to_under_way() -> None:
    """Who stands across the way is SUMO's to see, unless it does not know that the two ways touch."""
    way = Way()
    way.put("o", "foe", 3.0)
    assert way.told([], front_m=84.0, speed_mps=10.0) == []
    way.change(unseen=("foe_0",))
    (told,) = way.told([], front_m=84.0, speed_mps=10.0)
    assert told is not None
    assert told < 10.0


def test_who_drove_in_when_nobody_came_does_not_wait_inside() -> None:
    """Where it would be in the way of one that departs just then; not who drove in by SUMO's right of way."""
    way = Way()
    way.change(wait_m=8.0, waits_in_way=True)
    firsts = way.traffic.firsts
    assert way.told([], front_m=98.0, speed_mps=0.0) == []
    assert way.told(COMES, front_m=99.5, speed_mps=6.0) == []
    assert not firsts
    way.told(COMES, front_m=102.0, speed_mps=4.0)
    assert firsts == {"v"}
    way.told([Arrival(1.0, 1.0, near=True)], front_m=103.0, speed_mps=4.0)
    assert not firsts
    way.told(COMES, front_m=104.0, speed_mps=4.0)
    assert firsts == {"v"}
    way.told(COMES, front_m=108.5, speed_mps=4.0)
    assert not firsts
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == [0.0]
    way.traffic.now_s += 60.0
    assert way.told(COMES, front_m=98.0, speed_mps=0.0) == [None]
    way.told([], front_m=102.0, speed_mps=4.0)
    assert not firsts
