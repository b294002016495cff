"""Vehicles that park beside the road and return, without SUMO."""

from __future__ import annotations

import pytest
from fake_traffic import FakeTraffic, FakeVehicle

from loopgate.control.diary import Row
from loopgate.control.ledger import Ledger
from loopgate.control.parking import Parking, has_slot_for
from loopgate.control.places import Leg, Make, Place, Vehicle, joined
from loopgate.control.rules import usual
from loopgate.network.stops import Stop

CAR = Make(5.0, 2.6, 4.5, 10.0, 1.0, 2.5)
YARD = Stop("yard", "parkingArea", "a_0", 20.0, 60.0, parks=True)


class Beside(FakeTraffic):
    """A simulation that notes how long vehicles are to stay, and which are to stand."""

    def __init__(self) -> None:
        super().__init__({})
        self.left_s: dict[str, float] = {}
        self.stood: list[tuple[str, float | None]] = []
        self.off: set[str] = set()
        self.lot_m = 0.0

    def lot_ahead_m(self, vehicle: str, stop: Stop) -> float:
        del vehicle, stop
        return self.lot_m

    def lane(self, vehicle: str) -> tuple[str, float]:
        return ("", 0.0) if vehicle in self.off else super().lane(vehicle)

    def stays_s(self, vehicle: str) -> float:
        return self.left_s[vehicle]

    def stay(self, vehicle: str, for_s: float) -> None:
        self.left_s[vehicle] = for_s

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        self.stood.append((vehicle, speed_mps))


class Road:
    """A place of 100 m and four slots, in which `v` parks beside the road; nobody may go on from there."""

    def __init__(self, front_m: float = 50.0, *, closed: bool = True, lot_m: float = 0.0) -> None:
        self.traffic, self.rows = Beside(), list[Row]()
        self.traffic.lot_m = lot_m
        self.ledger = Ledger(usual())
        self.place, after = Place("a", 4), Place("b", 0)
        legs = [Leg(self.place, 0, 0.0, 100.0), Leg(after, 1, 120.0, 220.0)]
        self.path = joined(legs if closed else legs[:1], closed=closed)
        self.parking = Parking(self.traffic, self.ledger, lambda _: True, self.rows)
        self.car = self.put("v", front_m)
        assert self.parking.begin(self.car, YARD)
        self.traffic.off.add("v")
        self.traffic.left_s["v"] = 10.0

    def put(self, name: str, front_m: float, speed: float = 0.0) -> Vehicle:
        """Put a vehicle on the road."""
        one = self.ledger.take_in(name, self.path, 0, CAR, 240.0)
        one.front_m, one.speed = front_m, speed
        self.traffic.fleet[name] = FakeVehicle([("a", 240.0)], front_m)
        return one

    def step(self) -> list[str]:
        """Look once; return what has been noted."""
        before = len(self.rows)
        self.traffic.now_s += 1.0
        self.ledger.open_up()
        self.parking.look()
        self.ledger.answer(self.traffic.now_s)
        self.traffic.left_s["v"] -= 1.0
        return [str(row[2]) for row in self.rows[before:]]


def test_a_parked_vehicle_holds_no_slot_until_its_stop_is_nearly_over() -> None:
    """It gets one two steps before, and is in the place again once it is on the road."""
    road = Road()
    assert road.car.beside
    for _ in range(8):
        assert road.place.bodies == []
        road.step()
    road.step()
    assert [body.vehicle for body in road.place.bodies] == [road.car]
    road.traffic.off.clear()
    assert road.step() == ["return"]
    assert road.place.line == [one for one in [road.car] if not one.beside]
    assert (road.parking.parked, road.parking.late_s) == (1, 0.0)


@pytest.mark.parametrize("lot_m", [15.0, 0.3])
def test_one_that_has_been_put_beside_its_lot_is_there_and_no_farther(lot_m: float) -> None:
    """SUMO does so a step before it drives. Counted as far ahead once more, it was driven into."""
    road = Road(lot_m=lot_m)
    left_m = road.car.left_m()
    road.step()
    assert road.car.left_m() == left_m
    road.car.front_m += lot_m + 0.2
    road.step()
    assert road.car.left_m() == pytest.approx(left_m - 0.2)


def test_one_returns_although_slots_are_kept_if_more_than_one_is_free() -> None:
    """Else those who wait for its lot wait for good, behind whom the slot is kept."""
    road = Road()
    road.place.mover = road.put("a", 5.0)
    assert has_slot_for(road.car)
    road.put("b", 12.5)
    road.put("c", 20.0)
    assert not has_slot_for(road.car)


def test_one_that_sumo_keeps_off_gives_its_slot_back_and_tries_again() -> None:
    road = Road()
    road.traffic.left_s["v"] = 2.0
    road.step()
    assert road.place.bodies
    held = []
    for _ in range(4):
        road.step()
        held.append(len(road.place.bodies))
    assert held == [1, 1, 1, 1]
    assert road.parking.late_s == road.parking.latest_s == 4.0


@pytest.mark.parametrize(
    ("front_m", "speed", "returns"),
    [(45.0, 0.0, False), (36.0, 10.0, False), (5.0, 10.0, True), (57.4, 0.0, False), (57.6, 0.0, True)],
)
def test_it_returns_where_nobody_is_beside_it_and_those_behind_can_brake(
    front_m: float,
    speed: float,
    returns: bool,  # noqa: FBT001  a case
) -> None:
    """Its front is at 50 m, and the others are 5 m long and keep 2.5 m."""
    road = Road()
    road.put("o", front_m, speed)
    road.traffic.left_s["v"] = 2.0
    road.step()
    assert (len(road.place.bodies) == 2) == returns


def test_one_that_cannot_return_keeps_the_others_out_every_other_twenty_seconds() -> None:
    road = Road()
    road.put("o", 50.0)
    road.traffic.left_s["v"] = 2.0
    shut = []
    for second in range(80):
        road.step()
        if road.place.shut:
            shut.append(second)
    assert shut == [*range(20, 40), *range(60, 80)]


@pytest.mark.parametrize(
    ("front_m", "closed", "stands"), [(98.0, True, True), (50.0, True, False), (98.0, False, False)]
)
def test_one_that_returns_close_before_its_line_stands_until_it_is_held_there(
    front_m: float,
    closed: bool,  # noqa: FBT001  a case
    stands: bool,  # noqa: FBT001  a case
) -> None:
    """Else it would be past it before it can be held; where its way ends there is no line."""
    road = Road(front_m, closed=closed)
    road.traffic.left_s["v"] = 2.0
    road.step()
    assert road.traffic.stood == [("v", 0.0)] * stands
    road.traffic.off.clear()
    road.step()
    road.step()
    assert road.traffic.stood == [("v", 0.0)] * stands
    road.car.held = True
    road.step()
    assert road.traffic.stood == [("v", 0.0), ("v", None)] * stands
