"""Where ordinary traffic is in the way of a gated vehicle, without SUMO."""

import math

from fake_traffic import FakeVehicle
from ordinary_scene import BEGINS, STREET, Arrival, Scene

from loopgate.drive import step as drive
from loopgate.gates import Reason
from loopgate.traffic.base import Light, Program


def test_an_empty_road_is_free() -> None:
    """Gated vehicles are no ordinary ones: they are the gate's."""
    scene = Scene(others_in_next=1)
    scene.traffic.fleet["w0"] = FakeVehicle(STREET, BEGINS["foe"] + 5.0)
    assert scene.says() is None
    assert scene.blockers() == []


def test_an_ordinary_vehicle_before_it_on_its_lane() -> None:
    """Behind it does not matter."""
    scene = Scene()
    scene.put("o", "before", 50.0)
    assert scene.says() is None
    scene.put("o", "before", 97.0)
    assert scene.says() is Reason.TRAFFIC
    assert scene.blockers() == [["o"]]


def test_an_ordinary_vehicle_across_its_way() -> None:
    """Inside the junction, on a movement that conflicts."""
    scene = Scene()
    scene.put("o", "foe", 3.0)
    assert scene.says() is Reason.TRAFFIC
    assert scene.blockers() == [["o"]]
    del scene.traffic.fleet["o"]
    assert scene.says() is None


def test_ordinary_vehicles_take_room_in_the_next_state() -> None:
    """Three gated vehicles and two ordinary ones leave 12.5 m of 50; a third on its way there takes that."""
    scene = Scene(others_in_next=3)
    scene.put("o", "after", 40.0)
    scene.put("p", "after", 30.0)
    assert scene.says() is None
    scene.put("q", "junction", 10.0)
    assert scene.says() is Reason.TRAFFIC
    (some,) = scene.blockers()
    assert sorted(set(some)) == ["o", "p", "q", "w0", "w1", "w2"]


def test_there_may_be_more_of_them_than_there_was_room_for() -> None:
    """Each of them has its row, and those that are gone have none."""
    scene = Scene()
    for number in range(300):
        scene.put(f"o{number:03}", "priority", 96.0 + number / 100.0)
    scene.put("z", "foe", 3.0)
    assert scene.says() is Reason.TRAFFIC
    assert scene.blockers() == [["z"]]
    assert scene.sight.count == 301
    scene.traffic.fleet = {"z": scene.traffic.fleet["z"]}
    assert scene.says() is Reason.TRAFFIC
    assert scene.blockers() == [["z"]]


def test_who_was_free_is_asked_anew_after_a_grant() -> None:
    """Within a step nothing else changes."""
    scene = Scene()
    scene.put("o", "foe", 3.0)
    assert scene.says() is Reason.TRAFFIC
    run = scene.engine.run
    run["granted"] = run["grants"]
    assert scene.keeper.ask(drive.STILL_FREE)
    run["grants"] += 1
    assert not scene.keeper.ask(drive.STILL_FREE)


def test_one_that_comes_with_the_right_of_way() -> None:
    """It takes some 7 s to be over: 4 s away is too near, at the line is past before, 9 s is far enough."""
    scene = Scene()
    scene.put("o", "priority", 60.0)
    for arrival, reason in (
        (Arrival(4.0, 4.0), Reason.TRAFFIC),
        (Arrival(0.0, 0.2), None),
        (Arrival(9.0, 12.0), None),
        (Arrival(5.0, 12.0), Reason.TRAFFIC),
    ):
        scene.given = [arrival]
        assert scene.says() is reason


def test_one_that_has_a_red_light_is_not_coming() -> None:
    """Its right of way counts only while its light is green."""
    scene = Scene(signal=("t", 0))
    scene.put("o", "priority", 60.0)
    scene.given = [Arrival(4.0, 4.0)]
    scene.traffic.programs["t"] = Program((), fixed=False)
    scene.traffic.lights["t"] = Light("r", 0.0)
    assert scene.says() is None
    scene.traffic.lights["t"] = Light("G", 0.0)
    assert scene.says() is Reason.TRAFFIC


def test_one_that_stands_at_its_line_is_waited_for_as_long_as_it_may_be_about_to_set_out() -> None:
    """Who stands there for five seconds though it may drive waits for something else; after a red anew."""
    scene = Scene()
    scene.put("o", "priority", 60.0)
    scene.given = [Arrival(2.0, math.inf, "o")]
    scene.look()
    said = [scene.says() for _ in range(7)]
    assert said == [Reason.TRAFFIC] * 5 + [None] * 2
    scene.traffic.now_s += 30.0
    assert scene.says() is Reason.TRAFFIC
