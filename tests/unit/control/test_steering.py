"""Steering without SUMO: when stops are set and dropped, and when vehicles change lanes."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import cast

import pytest
from fake_traffic import FakeTraffic, FakeVehicle

from loopgate.abstraction.itinerary import Guide
from loopgate.control.diary import Diary, Row
from loopgate.control.ledger import Ledger
from loopgate.control.places import Leg, Make, Place, Vehicle, joined
from loopgate.control.steering import Steering
from loopgate.errors import TrafficError
from loopgate.network.loop import LanePosition

ROAD_M, CHANGE_AT_M, PIN_M = 400.0, 100.0, 130.0
CAR = Make(5.0, 2.6, 4.5, 10.0, 1.0)


class World:
    """A vehicle on a road of 400 m, which has the way from its first place, to 100 m, to the next."""

    def __init__(self, guide: Guide, start_m: float = 20.0) -> None:
        self.traffic = FakeTraffic({"v": FakeVehicle([("e", ROAD_M)], start_m)})
        self.rows: list[Row] = []
        self.steering = Steering(self.traffic, self.rows)
        self._ledger = Ledger([lambda *_: None])
        places = Place("e/1", 2), Place("e/2", 2)
        legs = [Leg(places[0], 0, 0.0, CHANGE_AT_M), Leg(places[1], 1, PIN_M, ROAD_M)]
        legs[0].guided = True
        self._path = joined(legs, closed=True)
        self.guide = guide
        self.car = self.grant("v", start_m)
        self.steering.begin(self.car, (guide,), CHANGE_AT_M)
        self.traffic.step()

    def grant(self, name: str, front_m: float) -> Vehicle:
        """Return a vehicle that has its grant."""
        one = self._ledger.take_in(name, self._path, 0, CAR, ROAD_M)
        one.front_m = front_m
        self._ledger.ask(one)
        assert self._ledger.answer() == [one]
        return one

    @property
    def vehicle(self) -> FakeVehicle:
        """The vehicle in the traffic."""
        return self.traffic.fleet["v"]

    def step(self) -> list[Vehicle]:
        """Make one step; return the vehicles that have come to their lanes."""
        self.traffic.step()
        self.look()
        return self.steering.step()

    def look(self) -> None:
        """See where the vehicle is."""
        self.car.front_m, self.car.speed = self.vehicle.front_m, self.vehicle.speed_mps

    def drive(self) -> None:
        """Make steps until the vehicle is steered no longer."""
        while self.car.steered:
            self.step()
            assert self.vehicle.front_m <= ROAD_M
            assert self.traffic.now_s < 1000.0


@pytest.mark.parametrize("start_m", range(20, 30))
def test_it_changes_lanes_behind_the_place_and_is_then_free(start_m: int) -> None:
    """Not before its rear is past 100 m; the stop goes as soon as it is on the other lane.

    Ten metres a step: of the ten starts some let the front be past 100 m and the rear not.
    """
    one = World(Guide("e", 0, PIN_M, 0.0, to_lane=1), float(start_m))
    assert (one.car.steered, one.vehicle.hold_m) == (True, PIN_M)
    changed_at = 0.0
    while one.car.steered:
        before = one.vehicle.lane
        one.step()
        if one.vehicle.lane != before:
            changed_at = one.vehicle.front_m
    assert CHANGE_AT_M + CAR.length_m <= changed_at < PIN_M
    assert one.vehicle.hold_m is None


def test_without_a_gap_it_stands_at_the_pin_and_changes_when_there_is_one() -> None:
    """It stands without a stop, since SUMO lets no vehicle at a stop change lanes, and goes on afterwards."""
    one = World(Guide("e", 0, PIN_M, 0.0, to_lane=1))
    one.traffic.gaps = False
    for _ in range(60):
        assert not one.step()
    assert (one.vehicle.lane, one.vehicle.still, one.vehicle.hold_m) == (0, True, None)
    assert one.vehicle.front_m == pytest.approx(PIN_M, abs=1.0)
    one.traffic.gaps = True
    one.step()
    assert one.step() == [one.car]
    assert (one.vehicle.lane, one.vehicle.still) == (1, False)


def stays(one: World) -> None:
    """Look on as it comes to stand at the pin and stays on its lane, though there is a gap."""
    for _ in range(60):
        assert one.car not in one.step()
    assert one.vehicle.front_m == pytest.approx(PIN_M, abs=1.0)
    assert one.vehicle.lane == 0


def changes(one: World) -> None:
    """See to it that it is on the other lane at once."""
    assert not one.steering.step()
    assert (one.steering.step(), one.vehicle.lane) == ([one.car], 1)


def followed(front_m: float) -> tuple[World, Vehicle]:
    """Return a vehicle that is to change lanes, and another whose slot beyond is the one before its own."""
    one = World(Guide("e", 0, PIN_M, 0.0, to_lane=1))
    other = one.grant("u", front_m)
    one.car.leg.place.bodies.reverse()
    return one, other


def test_it_changes_lanes_behind_the_vehicle_before_it_as_a_whole() -> None:
    """That one has changed lanes already, but stands beside it: then there is a gap before that, too."""
    one, other = followed(CHANGE_AT_M + 5.0)
    stays(one)
    other.front_m = one.vehicle.front_m + CAR.length_m
    changes(one)


def test_it_does_not_overtake_in_the_step_after_which_it_changes_lanes() -> None:
    """SUMO lets it drive before it changes: it would come to lie before a slow one ten metres ahead."""
    one, other = followed(0.0)
    one.traffic.gaps = False
    while one.vehicle.front_m <= CHANGE_AT_M + CAR.length_m:
        one.step()
    assert one.car.speed == CAR.top
    one.traffic.gaps = True
    other.front_m, other.speed = one.vehicle.front_m + CAR.length_m + 10.0, 0.0
    for _ in range(3):
        assert not one.steering.step()
    assert one.vehicle.lane == 0
    other.speed = CAR.top
    changes(one)


def test_it_changes_lanes_after_one_before_it_that_does_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """That one has no gap, and a slot elsewhere."""
    one = World(Guide("e", 0, PIN_M, 0.0, to_lane=1))
    other = one.grant("u", PIN_M + 9.0)
    change = one.traffic.change_lane

    def only_v(vehicle: str, lane: int) -> None:
        if vehicle == "v":
            change(vehicle, lane)

    monkeypatch.setattr(one.traffic, "change_lane", only_v)
    one.traffic.fleet["u"] = FakeVehicle([("e", ROAD_M)], PIN_M + 9.0, top_mps=0.0)
    one.steering.begin(other, (one.guide,), CHANGE_AT_M)
    stays(one)
    one.steering.forget(other)
    changes(one)


def test_a_stop_that_only_leads_to_a_lane_is_dropped_on_it() -> None:
    """At 30 m behind the first place."""
    one = World(Guide("e", 0, ROAD_M, 30.0))
    while one.car.steered:
        assert one.vehicle.front_m < CHANGE_AT_M + 30.0
        one.step()
    assert one.steering.strays == 0


@pytest.mark.parametrize("gaps", [True, False])
def test_a_stray_is_led_back_to_its_lane_and_counted(gaps: bool) -> None:  # noqa: FBT001  a case
    """It can stop on the lane where it is; where no vehicle lets it in for a minute it is put on its own."""
    one = World(Guide("e", 0, ROAD_M, 30.0))
    one.vehicle.lane = 1
    one.vehicle.front_m = CHANGE_AT_M + 30.0
    one.traffic.gaps = gaps
    began_s = one.traffic.now_s
    one.drive()
    assert (one.vehicle.lane, one.steering.strays, one.vehicle.hold_m) == (0, 1, None)
    assert [row[2] for row in one.rows] == ["stray"]
    assert (one.traffic.now_s - began_s >= 60.0) is not gaps


def test_a_stop_that_cannot_be_set_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The vehicle drives on to where its lane is looked at, and is led back from a wrong one."""

    def refuse(*_: object) -> bool:
        msg = "too close to brake"
        raise TrafficError(msg)

    monkeypatch.setattr(FakeTraffic, "hold", refuse)
    one = World(Guide("e", 0, ROAD_M, 30.0))
    one.vehicle.lane = 1
    one.vehicle.front_m = CHANGE_AT_M + 30.0
    one.drive()
    assert (one.vehicle.lane, one.steering.strays, one.vehicle.still) == (0, 1, False)


def test_a_vehicle_at_the_very_beginning_of_its_lane_has_not_strayed(monkeypatch: pytest.MonkeyPatch) -> None:
    """SUMO still has it on the lane inside the junction, at its end."""
    one = World(Guide("e", 1, ROAD_M, 30.0))
    one.vehicle.lane = 1
    lane = FakeTraffic.lane

    def inside(traffic: FakeTraffic, vehicle: str) -> tuple[str, float]:
        there = traffic.fleet[vehicle].front_m <= CHANGE_AT_M + 40.0
        return (":j_0_0", 8.4) if there else lane(traffic, vehicle)

    monkeypatch.setattr(FakeTraffic, "lane", inside)
    monkeypatch.setattr(FakeTraffic, "lane_index", lambda *of: int(inside(*of)[0][-1]))
    one.drive()
    assert one.steering.strays == 0


@pytest.mark.parametrize(
    ("lane", "speed", "front_m", "found"),
    [(1, 0.0, 20.0, 1), (0, 0.0, 20.0, 0), (1, 5.0, 20.0, 0), (1, 0.0, 100.0, 1), (1, 0.0, 101.0, 0)],
)
def test_one_that_stands_on_another_lane_of_its_place_is_led_back(
    lane: int, speed: float, front_m: float, found: int
) -> None:
    """Not one that drives, nor one whose front is beyond the place."""
    one = World(Guide("e", 0, PIN_M, 0.0), 20.0)
    other = one.grant("u", front_m)
    one.traffic.fleet["u"] = FakeVehicle([("e", ROAD_M)], front_m, lane=lane)
    other.speed, other.steered = speed, False
    lines = LanePosition("e", 0, CHANGE_AT_M), LanePosition("e", 1, PIN_M)
    legs = [SimpleNamespace(line=line) for line in lines]
    diary = cast("Diary", SimpleNamespace(vehicle=other, drawn=legs.__getitem__))
    one.steering.look_for_strays([diary])
    assert (one.steering.strays, len(one.rows)) == (found, found)
    assert one.steering.leads_back(other) == bool(found)
    assert [row[1:4] for row in one.rows] == [("u", "stray", "e_1")] * found


def test_strays_are_looked_for_every_ten_seconds() -> None:
    one, asked = World(Guide("e", 0, PIN_M, 0.0), 20.0), list[float]()

    class Diaries(list[Diary]):
        """Notes when somebody looks."""

        def __iter__(self) -> Iterator[Diary]:
            asked.append(one.traffic.now_s)
            return iter(())

    begin_s = one.traffic.now_s
    for half in range(45):
        one.traffic.now_s = begin_s + half / 2.0
        one.steering.look_for_strays(Diaries())
    assert asked == [begin_s, begin_s + 10.0, begin_s + 20.0]
