"""Steering on traffic without SUMO: when stops are set and dropped, and when vehicles change lanes."""

from dataclasses import dataclass, replace

import pytest
from fake_traffic import FakeTraffic, FakeVehicle

from builders import system
from loopgate.abstraction.itinerary import Guide, Leg
from loopgate.abstraction.track import Round, Track
from loopgate.drive.driver import Driver
from loopgate.drive.ground import Ground
from loopgate.drive.steering import Steering
from loopgate.drive.step import LOOK, Step
from loopgate.errors import TrafficError
from loopgate.model import StateId
from loopgate.network.loop import LanePosition
from loopgate.results.recorder import Recorder

ROAD_M, CHANGE_AT_M, PIN_M = 400.0, 100.0, 130.0


@dataclass
class World:
    """A vehicle under way."""

    traffic: FakeTraffic
    driver: Driver
    steering: Steering
    do: Step

    @property
    def vehicle(self) -> FakeVehicle:
        """The vehicle in the traffic."""
        return self.traffic.fleet["v"]

    def busy(self) -> bool:
        """Whether it is steered."""
        return bool(self.steering._ways)

    def step(self) -> list[Driver]:
        """One step; who has arrived on its lane."""
        self.traffic.step()
        at_m = self.traffic.odometers(["v"])
        self.do(LOOK, odometer=at_m)
        due, told = self.steering.is_due(at_m), (len(self.traffic.holds), len(self.traffic.releases))
        done = self.steering.step()
        assert due or (not done and told == (len(self.traffic.holds), len(self.traffic.releases)))
        return done


def world(guide: Guide, start_m: float = 20.0) -> World:
    """One vehicle on a road of 400 m, granted the way from its first state (to 100 m) to the next."""
    traffic = FakeTraffic({"v": FakeVehicle([("e", ROAD_M)], start_m)})
    track = Track(
        vehicle="v",
        loop="loop",
        lap_m=ROAD_M,
        start_m=start_m,
        top_speed_mps=10.0,
        rounds=(Round("e", "round", "first"), Round("", "onward", "second")),
        edges=((0.0, "e"),),
        legs=(
            Leg(StateId("e/1"), 0.0, CHANGE_AT_M, line=LanePosition("e", 0, CHANGE_AT_M), guides=(guide,)),
            Leg(StateId("e/2"), PIN_M, ROAD_M, line=LanePosition("e", 0, ROAD_M)),
        ),
    )
    roads = system({"v": "e/1 e/2"})
    tables = Ground.of([track], roads, Recorder(None).code, step_s=traffic.step_s).tables
    driver = Driver(0, track, tables)
    driver.drives_like(traffic.dynamics("v"))
    driver.correct(start_m)
    driver.row["offset"] = start_m
    steering = Steering(traffic, Recorder(None), lambda _: None)
    steering.begin(driver, 1)
    traffic.step()
    return World(traffic, driver, steering, Step(tables))


@pytest.mark.parametrize("start_m", range(20, 30))
def test_it_changes_lanes_behind_the_place_and_is_then_free(start_m: int) -> None:
    """Not before its rear is past 100 m; the stop goes as soon as it is on the other lane.

    Ten metres a step: of the ten starts some let the front be past 100 m and the rear not.
    """
    one = world(Guide("e", 0, PIN_M, 0.0, to_lane=1), float(start_m))
    assert one.busy()
    assert one.vehicle.hold_m == PIN_M
    changed_at = 0.0
    while one.busy():
        before = one.vehicle.lane
        one.step()
        if one.vehicle.lane != before:
            changed_at = one.vehicle.front_m
    assert CHANGE_AT_M + one.driver.length_m <= changed_at < PIN_M
    assert one.vehicle.hold_m is None


def test_without_a_gap_it_stands_at_the_pin_and_changes_when_there_is_one() -> None:
    """It stands without a stop, since SUMO lets no vehicle at a stop change lanes, and goes on afterwards."""
    one = world(Guide("e", 0, PIN_M, 0.0, to_lane=1))
    one.traffic.gaps = False
    for _ in range(60):
        assert not one.step()
    assert (one.vehicle.lane, one.vehicle.still, one.vehicle.hold_m) == (0, True, None)
    assert one.vehicle.front_m == pytest.approx(PIN_M, abs=1.0)
    one.traffic.gaps = True
    one.step()
    assert one.step() == [one.driver]
    assert (one.vehicle.lane, one.vehicle.still) == (1, False)


def follow(front_m: float) -> tuple[World, Driver]:
    """One that is to change lanes at once, and another whose slot beyond is the one ahead of its own."""
    one = world(Guide("e", 0, PIN_M, 0.0, to_lane=1))
    roads = system({"v": "e/1 e/2", "u": "e/1 e/2"}, capacity={"e/1": 2, "e/2": 2})
    tracks = [one.driver.track, replace(one.driver.track, vehicle="u")]
    tables = Ground.of(tracks, roads, Recorder(None).code, step_s=one.traffic.step_s).tables
    other = Driver(1, tracks[1], tables)
    other.drives_like(one.traffic.dynamics("v"))
    other.correct(front_m)
    one.driver.row["granted"] = other.row["granted"] = 1
    one.steering._ahead_of = lambda driver: other if driver is one.driver else None
    return one, other


def waits(one: World) -> None:
    """Look on as it comes to stand at the pin and stays on its lane, though there is a gap."""
    for _ in range(60):
        assert one.driver not in one.steering.step()
        one.traffic.step()
        one.do(LOOK, odometer=one.traffic.odometers(["v"]))
    assert one.vehicle.front_m == pytest.approx(PIN_M, abs=1.0)
    assert one.vehicle.lane == 0


def changes(one: World) -> None:
    """See to it that it is on the other lane at once."""
    assert not one.steering.step()
    assert (one.steering.step(), one.vehicle.lane) == ([one.driver], 1)


def test_it_changes_lanes_behind_the_vehicle_ahead_of_it_as_a_whole() -> None:
    """That one has changed lanes already, but stands beside it: then there is a gap before that, too."""
    one, other = follow(CHANGE_AT_M + 5.0)
    waits(one)
    other.correct(one.vehicle.front_m + other.length_m)
    changes(one)


def test_it_changes_lanes_after_one_before_it_that_does_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """That one has no gap, and a slot elsewhere."""
    one, other = follow(PIN_M + 9.0)
    monkeypatch.setattr(one.steering, "_ahead_of", lambda _: None)
    change = one.traffic.change_lane

    def only_v(vehicle: str, lane: int) -> None:
        if vehicle == "v":
            change(vehicle, lane)

    monkeypatch.setattr(one.traffic, "change_lane", only_v)
    one.traffic.fleet["u"] = FakeVehicle([("e", ROAD_M)], PIN_M + 9.0, top_mps=0.0)
    one.steering.begin(other, 1)
    waits(one)
    one.steering.forget("u")
    changes(one)


def test_a_stop_that_only_leads_to_a_lane_is_dropped_on_it() -> None:
    """At 30 m behind the first state."""
    one = world(Guide("e", 0, ROAD_M, 30.0))
    while one.busy():
        assert one.vehicle.front_m < CHANGE_AT_M + 30.0
        one.step()
    assert one.steering.strays == 0


@pytest.mark.parametrize("gaps", [True, False])
def test_a_stray_is_led_back_to_its_lane_and_counted(gaps: bool) -> None:  # noqa: FBT001  a parameter of the test
    """It can stop on the lane where it is; where nobody lets it in for a minute it is put on its own."""
    one = world(Guide("e", 0, ROAD_M, 30.0))
    one.vehicle.lane = 1
    one.vehicle.front_m = CHANGE_AT_M + 30.0
    one.traffic.gaps = gaps
    began_s = one.traffic.now_s
    while one.busy():
        one.step()
        assert one.vehicle.front_m <= ROAD_M
    assert (one.vehicle.lane, one.steering.strays, one.vehicle.hold_m) == (0, 1, None)
    assert (one.traffic.now_s - began_s >= 60.0) is not gaps


def test_a_stop_that_cannot_be_set_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The vehicle drives on to where its lane is looked at, and is led back from a wrong one."""

    def refuse(*_: object) -> bool:
        msg = "too close to brake"
        raise TrafficError(msg)

    monkeypatch.setattr(FakeTraffic, "hold", refuse)
    one = world(Guide("e", 0, ROAD_M, 30.0))
    one.vehicle.lane = 1
    one.vehicle.front_m = CHANGE_AT_M + 30.0
    while one.busy():
        one.step()
    assert (one.vehicle.lane, one.steering.strays, one.vehicle.still) == (0, 1, False)


def test_who_is_right_at_the_beginning_of_its_lane_has_not_strayed(monkeypatch: pytest.MonkeyPatch) -> None:
    """SUMO still has it on the lane inside the junction, at its very end: where it is stays as it was."""
    one = world(Guide("e", 1, ROAD_M, 30.0))
    one.vehicle.lane = 1
    lane = FakeTraffic.lane

    def inside(traffic: FakeTraffic, vehicle: str) -> tuple[str, float]:
        there = traffic.fleet[vehicle].front_m <= CHANGE_AT_M + 40.0
        return (":j_0_0", 8.4) if there else lane(traffic, vehicle)

    monkeypatch.setattr(FakeTraffic, "lane", inside)
    monkeypatch.setattr(FakeTraffic, "lane_index", lambda *of: int(inside(*of)[0][-1]))
    while one.busy():
        one.step()
        assert one.driver.front_m == pytest.approx(one.vehicle.front_m)
    assert one.steering.strays == 0
