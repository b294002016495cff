"""Who of ordinary traffic is in the way of a vehicle, and how it gives way, on roads made by hand."""

from __future__ import annotations

from math import inf
from types import SimpleNamespace

import pytest
from among_others import CAR, Scene
from fake_traffic import FakeTraffic

from loopgate.control.blocking import outside
from loopgate.control.courtesy import Courtesy
from loopgate.control.lamps import Lamp
from loopgate.control.ordinary import is_too_full
from loopgate.control.places import Vehicle
from loopgate.control.roads import Across, Approach, Lookout, Rear, RoadEdge, RoadLane, RoadStretch
from loopgate.traffic.base import Light, Phase, Program


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
    ("speed", "across", "wait_m", "refused"),
    [
        (8.0, "joins", 0.0, False),
        (0.5, "joins", 0.0, True),
        (8.0, "joins", 5.0, True),
        (8.0, "unseen", 0.0, True),
        (8.0, "crosses", 0.0, True),
    ],
)
def test_one_that_joins_and_drives_on_is_followed(
    speed: float,
    across: str,
    wait_m: float,
    refused: bool,  # noqa: FBT001
) -> None:
    """Not by one that may have to wait inside."""
    scene = Scene()
    past_m = 15.0 if across == "crosses" else inf
    one = Across(scene.foe, past_m, unseen=across == "unseen")
    scene.path[0].passes[0].lookout = Lookout([one], [], wait_m=wait_m)
    other = scene.put("foe", 10.0, speed)
    assert scene.is_refused() == refused
    scene.foe.fronts.clear()
    scene.foe.rears = [Rear(other, 5.0)]
    assert scene.is_refused() == refused


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


@pytest.mark.parametrize(
    ("left_m", "speed", "refused"),
    [(36.0, 3.0, True), (40.0, 10.0, True), (2.0, 10.0, False), (90.0, 7.5, False)],
)
def test_one_that_comes_slowly_may_drive_faster(left_m: float, speed: float, *, refused: bool) -> None:
    """The vehicle takes some 7 s to be over: 12 s at the other's pace are 5 s at the limit."""
    scene = Scene()
    scene.let_come(scene.put("side", 0.0, speed), left_m)
    assert scene.is_refused() is refused


@pytest.mark.parametrize(("letter", "refused"), [("r", False), ("G", True)])
def test_one_that_has_a_red_light_does_not_come(letter: str, *, refused: bool) -> None:
    """Its right of way counts only while its light is green."""
    lights = FakeTraffic({})
    lights.programs["t"] = Program((), fixed=False)
    lights.lights["t"] = Light(letter, 0.0)
    scene = Scene()
    lookout = scene.path[0].passes[0].lookout
    assert lookout is not None
    lookout.approaches[:] = [Approach(scene.turn, Lamp("t", lights), 0)]
    scene.let_come(scene.put("side", 0.0, 10.0), 40.0)
    assert scene.is_refused() is refused


def test_one_whose_light_turns_green_in_the_next_step_comes() -> None:
    """It sets out in the step in which the gated vehicle does."""
    lights = FakeTraffic({})
    phases = tuple(Phase(letter, 10.0, 1 - number) for number, letter in enumerate("rG"))
    lights.programs["t"] = Program(phases, fixed=True)
    lights.lights["t"] = Light("r", 5.0)
    scene = Scene()
    lookout = scene.path[0].passes[0].lookout
    assert lookout is not None
    lookout.approaches[:] = [Approach(scene.turn, Lamp("t", lights), 0)]
    scene.let_come(scene.put("side", 95.0), 5.0)
    assert [scene.is_refused(now_s) for now_s in (4.0, 5.0)] == [False, True]


def test_one_that_stands_at_its_line_is_in_the_way_until_it_seems_to_wait_for_something_else() -> None:
    """After it had to stand for something else it may be about to set out anew."""
    scene = Scene()
    scene.let_come(scene.put("side", 95.0), 5.0)
    assert [scene.is_refused(float(now_s)) for now_s in range(8)] == [True] * 5 + [False] * 3
    assert scene.is_refused(38.0)


def test_ordinary_vehicles_take_room_in_the_next_place() -> None:
    """Three under the gate and nine ordinary ones leave 10 m of 100; one more on its way there takes that."""
    scene = Scene()
    junction = RoadLane("junction", RoadEdge(inf, 0.0), 20.0, 10.0, inside=True)
    scene.path[1].stretch = RoadStretch(scene.lanes["next"], 0.0, 100.0, [junction], [])
    for number in range(3):
        scene.ledger.take_in(f"w{number}", scene.path, 1, CAR, 220.0)
    for number in range(9):
        scene.put("next", 100.0 - 7.5 * number)
    assert not is_too_full(scene.car)
    last = scene.put("foe", 10.0)
    scene.foe.fronts.clear()
    junction.fronts.append(last)
    assert is_too_full(scene.car)
    scene.ledger.ask(scene.car)
    (some,) = outside(scene.car, scene.slack, scene.ledger.vehicles.values())
    assert sorted(some) == sorted([*(f"o{number}" for number in range(10)), "w0", "w1", "w2"])


def test_ordinary_vehicles_take_slots_and_a_slot_in_five_is_theirs() -> None:
    scene = Scene(slots=13)
    for number in range(12):
        scene.put("next", 100.0 - 7.5 * number)
    assert scene.is_refused()
    scene = Scene(slots=5)
    coming = scene.put("side", 0.0)
    scene.lanes["next"].edge.coming[coming] = None
    held = [scene.ledger.take_in(f"v{number}", scene.path, 1, CAR, 220.0) for number in range(3)]
    assert not scene.is_refused()  # their first wants `here`, where the vehicle comes from
    for vehicle in held:
        vehicle.leg = SimpleNamespace(after=None, place=scene.path[1].place, passes=[], stretch=None)  # type: ignore[assignment]
    assert not scene.is_refused()
    scene.ledger.take_in("v3", scene.path, 1, CAR, 220.0)
    assert scene.is_refused()
    scene.lanes["next"].edge.coming.clear()  # it goes elsewhere
    assert not scene.is_refused()


def under_way(scene: Scene, now_s: float = 1.0) -> Vehicle:
    """Let the vehicle have its grant; it drives, 16 m before the junction, and can still stop."""
    assert scene.ledger.answer(now_s) == []
    scene.car.front_m, scene.car.speed = 84.0, 9.0
    scene.ledger.ask(scene.car)
    assert scene.ledger.answer(now_s + 1.0) == [scene.car]
    return scene.car


@pytest.mark.parametrize(("guide_m", "slows"), [(120.0, True), (95.0, False)])
def test_one_that_must_change_lanes_behind_a_junction_slows_down_before_it(
    guide_m: float,
    slows: bool,  # noqa: FBT001
) -> None:
    """Where it must change lanes before, it is held there."""
    scene = Scene()
    car, courtesy = under_way(scene), Courtesy(scene.told)  # type: ignore[arg-type]
    car.steered, car.guide_m = True, guide_m
    scene.let_come(scene.put("side", 0.0, 10.0), 40.0)
    courtesy.look([car])
    assert ("car" in scene.told.speeds) == slows


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
    scene.lanes["next"].edge.coming[scene.put("side", 0.0)] = None
    assert waits_for(scene) == [["v0", "v1", "v2", "v3"]]
    scene.car.asks = False
    assert outside(scene.car, scene.slack, scene.ledger.vehicles.values()) == []


@pytest.mark.parametrize(
    ("at_m", "returns"), [(49.5, True), (50.5, False), (90.0, False), (94.5, False), (95.0, True)]
)
def test_a_parked_vehicle_returns_with_nobody_within_40_m_behind_or_beside(
    at_m: float,
    returns: bool,  # noqa: FBT001
) -> None:
    """Its front is at 90 m; the other is 5 m long."""
    scene = Scene()
    scene.put("here", at_m)
    assert scene.slack.has_room(scene.car) == returns


def test_a_parked_vehicle_returns_only_where_it_fits_beside_ordinary_ones() -> None:
    """Of 100 m those ahead take what leaves just one more car, or none."""
    for length_m, returns in ((89.9, True), (90.1, False)):
        scene = Scene()
        scene.car.front_m, scene.car.leg.place.bodies[:] = 5.0, []
        scene.put("here", 99.9, length_m=length_m)
        scene.slack._too_tight = lambda *_: []  # type: ignore[method-assign]
        assert scene.slack.has_room(scene.car) == returns
