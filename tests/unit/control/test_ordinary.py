"""Who of ordinary traffic is in the way of a vehicle, and how it gives way, on roads made by hand."""

from __future__ import annotations

from math import inf
from types import SimpleNamespace
from typing import Any

import pytest

from loopgate.control.blocking import outside
from loopgate.control.courtesy import Courtesy
from loopgate.control.ledger import Ledger
from loopgate.control.ordinary import traffic
from loopgate.control.places import Junction, Leg, Make, Movement, Pass, Place, Vehicle, path_of
from loopgate.control.roads import (
    Across,
    Approach,
    Coming,
    Edge,
    Lane,
    Lookout,
    Other,
    Rear,
    Stretch,
    Turn,
)
from loopgate.control.sight import Map, Sight
from loopgate.control.slack import Slack

CAR = Make(5.0, 2.6, 4.5, 10.0, 1.0)


class Told:
    """A simulation that remembers what vehicles have been told."""

    step_s = 1.0

    def __init__(self) -> None:
        self.now_s = 0.0
        self.speeds: dict[str, float | None] = {}
        self.first: dict[str, bool] = {}

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        self.speeds[vehicle] = speed_mps

    def give_way(self, vehicle: str, *, gives: bool) -> None:
        self.first[vehicle] = not gives


class Scene:
    """A vehicle 10 m before the line of `here`; `next` holds two behind a junction of 20 m; `foe` crosses."""

    def __init__(self, **figures: Any) -> None:  # noqa: ANN401  of the lookout
        edges = {name: Edge(100.0, 10.0) for name in ("here", "next", "side")}
        self.lanes = {
            name: Lane(name, edges[name], 100.0, 10.0, inside=False) for name in ("here", "next", "side")
        }
        self.foe = Lane("foe", Edge(inf, 0.0), 20.0, 10.0, inside=True)
        self.turn = Turn(20.0)
        self.edges = edges
        self.told = Told()
        self.sight = Sight(Map({}, {}, {}), self.told)  # type: ignore[arg-type]
        self.slack = Slack()
        places = Place("here", 9), Place("next", figures.pop("slots", 9))
        self.path: list[Leg] = path_of(list(places), closed=True)
        here, after = self.path
        here.stretch = Stretch(self.lanes["here"], 0.0, 100.0, [], [])
        after.stretch = Stretch(self.lanes["next"], 0.0, 100.0, [], [])
        for leg, begin_m in ((here, 0.0), (after, 120.0)):
            leg.begin_m, leg.end_m = begin_m, begin_m + 100.0  # type: ignore[misc]
        over = Pass(Movement("over", Junction()), 10.0, -inf)
        over.lookout = Lookout(
            [Across(self.foe, 15.0, unseen=False)], [Approach(self.turn)], 0.0, 20.0, 10.0, **figures
        )
        here.passes = [over]
        self.slack.know(self.path)
        self.rule = traffic(self.sight, self.slack)
        self.ledger = Ledger([self.rule])
        self.car = self.ledger.take_in("car", self.path, 0, CAR, 220.0)
        self.car.front_m, self.car.speed = 90.0, 0.0

    def put(self, lane: str, position_m: float, speed: float = 0.0, length_m: float = 5.0) -> Other:
        """Put an ordinary vehicle on the road."""
        other = Other(f"o{len(self.sight.others)}", length_m, 2.6, 4.5, 1.0)
        other.parks = False
        other.position_m, other.speed = position_m, speed
        other.lane = self.foe if lane == "foe" else self.lanes[lane]
        other.lane.fronts.append(other)
        self.sight.others[other.name] = other
        return other

    def let_come(self, other: Other, left_m: float) -> None:
        """Let a vehicle be so far before the turn across."""
        self.turn.coming.append(Coming(other, self.turn, other.position_m + left_m, 10.0, first=True))

    def is_refused(self, now_s: float = 0.0) -> bool:
        """Return whether ordinary traffic keeps the vehicle."""
        return self.rule(self.car, now_s) is not None


def test_nobody_is_in_the_way_of_one_alone() -> None:
    assert not Scene().is_refused()


@pytest.mark.parametrize(("position_m", "refused"), [(80.0, False), (95.0, True), (100.2, True)])
def test_one_before_it_on_its_lane_is_in_the_way(position_m: float, refused: bool) -> None:  # noqa: FBT001
    scene = Scene()
    scene.put("here", position_m)
    assert scene.is_refused() == refused


def test_one_across_is_in_the_way_until_its_rear_is_past() -> None:
    scene = Scene()
    other = scene.put("foe", 10.0)
    assert scene.is_refused()
    scene.foe.fronts.clear()
    scene.foe.rears = [Rear(other, 14.0)]
    assert scene.is_refused()
    scene.foe.rears = [Rear(other, 16.0)]
    assert not scene.is_refused()


@pytest.mark.parametrize(
    ("left_m", "speed", "refused"), [(50.0, 10.0, True), (190.0, 10.0, False), (5.0, 10.0, False)]
)
def test_one_that_comes_is_in_the_way_unless_it_passes_before_or_after(
    left_m: float,
    speed: float,
    refused: bool,  # noqa: FBT001
) -> None:
    scene = Scene()
    if left_m < 10.0:
        scene.car.front_m = 60.0  # it is there in good time
    scene.let_come(scene.put("side", 0.0, speed), left_m)
    assert scene.is_refused() == refused


def test_one_that_stands_at_its_line_is_in_the_way_until_it_seems_to_wait_for_something_else() -> None:
    scene = Scene()
    scene.let_come(scene.put("side", 95.0), 5.0)
    assert [scene.is_refused(float(now_s)) for now_s in range(8)] == [True] * 5 + [False] * 3


def test_ordinary_vehicles_take_slots_and_a_slot_in_five_is_theirs() -> None:
    scene = Scene(slots=13)
    for number in range(12):
        scene.put("next", 100.0 - 7.5 * number)
    assert scene.is_refused()
    scene = Scene(slots=5)
    scene.put("side", 0.0)
    held = [scene.ledger.take_in(f"v{number}", scene.path, 1, CAR, 220.0) for number in range(3)]
    assert not scene.is_refused()  # their first wants `here`, where the vehicle comes from
    for vehicle in held:
        vehicle.leg = SimpleNamespace(after=None, place=scene.path[1].place, passes=[], stretch=None)  # type: ignore[assignment]
    assert not scene.is_refused()
    scene.ledger.take_in("v3", scene.path, 1, CAR, 220.0)
    assert scene.is_refused()


def under_way(scene: Scene, now_s: float = 1.0) -> Vehicle:
    """Let the vehicle have its grant; it drives, 16 m before the junction, and can still stop."""
    assert scene.ledger.answer(now_s) == []
    scene.car.front_m, scene.car.speed = 84.0, 9.0
    scene.ledger.ask(scene.car)
    assert scene.ledger.answer(now_s + 1.0) == [scene.car]
    return scene.car


def test_a_vehicle_slows_down_before_a_junction_to_which_somebody_comes_and_goes_on_after() -> None:
    scene = Scene()
    car, courtesy = under_way(scene), Courtesy(scene.told)  # type: ignore[arg-type]
    courtesy.look([car])
    assert scene.told.speeds == {}
    other = scene.put("side", 0.0, 10.0)
    scene.let_come(other, 40.0)
    scene.told.now_s = 3.0
    courtesy.look([])
    kept = scene.told.speeds["car"]
    assert kept is not None
    assert kept < 10.0
    scene.turn.coming.clear()
    scene.told.now_s = 4.0
    courtesy.look([])
    assert scene.told.speeds["car"] is None


def test_a_vehicle_gives_way_for_a_minute_at_most() -> None:
    scene = Scene()
    car, courtesy = under_way(scene), Courtesy(scene.told)  # type: ignore[arg-type]
    car.front_m, car.speed = 99.0, 0.0
    scene.put("foe", 10.0)
    for now_s in range(10, 75):
        scene.told.now_s = float(now_s)
        courtesy.look([car] if now_s == 10 else [])
        assert scene.told.speeds["car"] == (0.0 if now_s < 70 else None)


def test_one_that_stands_with_nobody_in_its_way_keeps_no_right_of_way() -> None:
    scene = Scene()
    car, courtesy = under_way(scene), Courtesy(scene.told)  # type: ignore[arg-type]
    car.front_m, car.speed = 99.0, 0.0
    for now_s in range(10, 16):
        scene.told.now_s = float(now_s)
        courtesy.look([car] if now_s == 10 else [])
    assert scene.told.first == {"car": True}


def waits_for(scene: Scene) -> list[list[str]]:
    """Return whom of ordinary traffic the vehicle waits for, which asks."""
    scene.ledger.ask(scene.car)
    return outside(scene.car, scene.slack, scene.ledger.vehicles.values())


def test_a_vehicle_waits_for_each_that_is_before_it_or_across_and_not_past() -> None:
    scene = Scene()
    scene.put("here", 95.0)
    scene.put("here", 85.0)
    across, past = scene.put("foe", 10.0), scene.put("foe", 10.0)
    scene.foe.fronts.clear()
    scene.foe.rears = [Rear(across, 14.0), Rear(past, 16.0)]
    assert waits_for(scene) == [["o0"], ["o2"]]


def test_a_vehicle_waits_for_any_in_a_place_that_ordinary_ones_take() -> None:
    """Those inside, and those of the ledger that hold slots there."""
    scene = Scene(slots=13)
    scene.ledger.take_in("held", scene.path, 1, CAR, 220.0)
    names = [scene.put("next", 100.0 - 7.5 * number).name for number in range(12)]
    assert waits_for(scene) == [[*names, "held"]]


def test_a_vehicle_waits_for_anybody_where_a_circle_has_no_room_for_ordinary_ones() -> None:
    scene = Scene(slots=5)
    for number in range(4):
        held = scene.ledger.take_in(f"v{number}", scene.path, 1, CAR, 220.0)
        held.leg = SimpleNamespace(after=None, place=scene.path[1].place, passes=[], stretch=None)  # type: ignore[assignment]
    scene.put("side", 0.0)
    assert waits_for(scene) == [["v0", "v1", "v2", "v3"]]
    scene.car.asks = False
    assert outside(scene.car, scene.slack, scene.ledger.vehicles.values()) == []
