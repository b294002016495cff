"""Where ordinary traffic is in the way of a gated vehicle, without SUMO."""

import math

from fake_traffic import FakeVehicle
from ordinary_scene import BEGINS, STREET, Scene

from loopgate.gates import Reason
from loopgate.simulation.around.coming import Arrival
from loopgate.traffic.base import Light, Program


def test_an_empty_road_is_free() -> None:
    """Gated vehicles are no ordinary ones: they are the gate's."""
    scene = Scene()
    scene.traffic.fleet["w"] = FakeVehicle(STREET, BEGINS["foe"] + 5.0)
    assert scene.says() is None
    assert scene.others.blockers(0) == []


def test_an_ordinary_vehicle_before_it_on_its_lane() -> None:
    """Behind it does not matter."""
    scene = Scene()
    scene.put("o", "before", 50.0)
    assert scene.says() is None
    scene.put("o", "before", 97.0)
    assert scene.says() is Reason.TRAFFIC
    assert scene.others.blockers(0) == [["o"]]


def test_an_ordinary_vehicle_across_its_way() -> None:
    """Inside the junction, on a movement that conflicts."""
    scene = Scene()
    scene.put("o", "foe", 3.0)
    assert scene.says() is Reason.TRAFFIC
    assert scene.others.blockers(0) == [["o"]]


def test_ordinary_vehicles_take_room_in_the_next_state() -> None:
    """Three gated vehicles and two ordinary ones leave 12.5 m of 50; a third on its way there takes that."""
    scene = Scene(others_in_next=3)
    scene.put("o", "after", 40.0)
    scene.put("p", "after", 30.0)
    assert scene.says() is None
    scene.put("q", "junction", 10.0)
    assert scene.says() is Reason.TRAFFIC
    (some,) = scene.others.blockers(0)
    assert sorted(set(some)) == ["o", "p", "q", "w"]


def test_a_circle_of_places_with_too_little_room() -> None:
    """Anybody else may have to move on first."""
    scene = Scene()
    scene.put("o", "after", 40.0)
    scene.tight = True
    assert scene.says() is Reason.TRAFFIC
    assert scene.others.blockers(0) == [["w"]]


def test_who_was_free_is_asked_anew_after_a_grant_that_it_rests_on() -> None:
    """Within a step nothing else changes."""
    scene = Scene()
    scene.put("o", "after", 40.0)
    assert scene.says() is None
    scene.tight = True
    assert scene.others.in_the_way(0) is None
    scene.others.granted(1)
    assert scene.others.in_the_way(0) is Reason.TRAFFIC


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
        scene.arrivals = [arrival]
        assert scene.says() is reason


def test_one_that_has_a_red_light_is_not_coming() -> None:
    """Its right of way counts only while its light is green."""
    scene = Scene(signal=("t", 0))
    scene.put("o", "priority", 60.0)
    scene.arrivals = [Arrival(4.0, 4.0)]
    scene.traffic.programs["t"] = Program((), fixed=False)
    scene.traffic.lights["t"] = Light("r", 0.0)
    assert scene.says() is None
    scene.traffic.lights["t"] = Light("G", 0.0)
    assert scene.says() is Reason.TRAFFIC


def test_one_that_stands_at_its_line_is_waited_for_as_long_as_it_may_be_about_to_set_out() -> None:
    """Who stands there for five seconds though it may drive waits for something else; after a red anew."""
    scene = Scene()
    scene.put("o", "priority", 95.0)
    scene.arrivals = [Arrival(2.0, math.inf, "o")]
    said = [scene.says() for _ in range(7)]
    assert said == [Reason.TRAFFIC] * 5 + [None] * 2
    scene.traffic.now_s += 30.0
    assert scene.says() is Reason.TRAFFIC
