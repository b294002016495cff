"""Grants only into green: one vehicle before a light, without SUMO."""

from collections.abc import Sequence

import pytest
from fake_traffic import FakeTraffic

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.drive.build import make_tables
from loopgate.drive.driver import Driver
from loopgate.drive.track import Round, Track
from loopgate.gates import Reason
from loopgate.model import StateId
from loopgate.results.recorder import Recorder
from loopgate.simulation.around.lights import Lights, Signal
from loopgate.simulation.around.timetable import Timetable
from loopgate.traffic.base import Dynamics, Light, Phase, Program

LINE_M = 100.0


class Scene:
    """A vehicle whose first state ends at 100 m, before crossings with the lights given."""

    def __init__(
        self, *signals: Signal, after: Sequence[Signal] = (), at_m: float = 99.0, speed: float = 0.0
    ) -> None:
        track = Track(
            vehicle="v",
            loop="loop",
            lap_m=400.0,
            start_m=at_m,
            top_speed_mps=10.0,
            rounds=(Round("e", "round", "first"), Round("", "onward", "second")),
            edges=((0.0, "e"),),
            legs=(Leg(StateId("a"), 0.0, LINE_M), Leg(StateId("b"), 150.0, 300.0)),
        )
        tables = make_tables([track], system({"v": "a b"}), Recorder(None).code, step_s=1.0)
        self.driver = Driver(0, track, tables)
        self.driver.drives_like(Dynamics(5.0, 2.6, 4.5, 1.0))
        self.driver.row["line_m"] = LINE_M
        self.driver.row["speed"] = speed
        self.traffic = FakeTraffic({})
        self.drivers = [self.driver]
        self.lights = Lights(
            self.traffic,
            self.drivers,
            {"loop": (signals, tuple(after))},
            Timetable(self.traffic),
        )

    def shows(self, light: str, state: str, changes_s: float, *, after: str = "r") -> None:
        """Let a light show a letter until a time, then another for 1000 s."""
        self.traffic.lights[light] = Light(state, changes_s, "p", 0)
        self.traffic.programs[light] = Program((Phase(state, 50.0, 1), Phase(after, 1000.0, 0)), fixed=True)


def signal(light: str, ahead_m: float = 0.1) -> Signal:
    """Make a light with one link."""
    return Signal(f"over {light}", light, 0, ahead_m, 10.0, at_line=ahead_m < 1.0)


@pytest.mark.parametrize("letter", ["r", "y", "u"])
def test_nothing_is_granted_into_red_or_yellow(letter: str) -> None:
    """Only green lets a request through."""
    scene = Scene(signal("t"))
    scene.shows("t", letter, 30.0, after="G")
    assert scene.lights.in_the_way(0) is Reason.RED
    assert scene.lights.blockers(0) == ()


@pytest.mark.parametrize("letter", ["G", "g", "O"])
def test_green_or_no_light_lets_pass(letter: str) -> None:
    """Also green with others that go first, and a light that is off."""
    scene = Scene(signal("t"))
    scene.shows("t", letter, 30.0)
    assert scene.lights.in_the_way(0) is None


def test_a_slow_driver_has_to_be_over_the_line_before_red() -> None:
    """From standing, 60 m at 10 m/s take 9 s at least; amber is used."""
    late, amber, soon = (Scene(signal("t"), at_m=40.0) for _ in range(3))
    late.shows("t", "G", 6.0)
    amber.shows("t", "G", 11.0, after="y")
    soon.shows("t", "G", 20.0)
    assert late.lights.in_the_way(0) is Reason.RED
    assert amber.lights.in_the_way(0) is None
    assert soon.lights.in_the_way(0) is None


def test_a_green_that_comes_in_the_next_step_is_green() -> None:
    """The light changes at the beginning of the step, before anybody moves."""
    scene = Scene(signal("t"))
    scene.shows("t", "r", 0.0, after="G")
    assert scene.lights.in_the_way(0) is None


def test_who_was_let_go_drives_on_at_amber_and_stops_for_a_red_only_if_it_can() -> None:
    """Near the line at speed it is too late to brake: that is counted."""
    stops, passes = Scene(signal("t"), at_m=40.0, speed=10.0), Scene(signal("t"), at_m=95.0, speed=10.0)
    for scene in (stops, passes):
        scene.shows("t", "G", 30.0)
        scene.driver.row["granted"] = 1
        scene.lights.granted(0)
        assert scene.traffic.heedless == {"v"}
        scene.lights.look()
        scene.shows("t", "r", 1000.0)
        scene.traffic.now_s = 31.0
        scene.lights.look()
    assert stops.traffic.heedless == set()
    assert passes.traffic.heedless == {"v"}
    passes.driver.row["front"] = 100.5
    passes.lights.look()
    assert passes.traffic.heedless == set()
    assert passes.lights.figures()["on_red"] == 1


def two_lights(*, at_m: float) -> Scene:
    """Return a vehicle that was let go over two junctions, one after the other, both lights green."""
    scene = Scene(signal("t"), after=[signal("u")], at_m=at_m, speed=10.0)
    for light, line_m in (("t", LINE_M), ("u", 300.0)):
        scene.shows(light, "G", 30.0)
        scene.driver.row["line_m"] = line_m
        scene.driver.row["granted"] += 1
        scene.lights.granted(0)
    assert scene.traffic.heedless == {"v"}
    return scene


def test_who_is_over_the_line_of_one_light_still_drives_on_at_amber_at_the_next() -> None:
    """It was let go there too."""
    scene = two_lights(at_m=95.0)
    scene.driver.row["front"] = 101.0
    scene.lights.look()
    assert scene.traffic.heedless == {"v"}
    scene.driver.row["front"] = 301.0
    scene.lights.look()
    assert scene.traffic.heedless == set()


def test_who_stops_at_a_light_is_not_let_through_it_by_a_grant_beyond() -> None:
    """It drives on at the second light when it is over the line of the first, which it waits for."""
    scene = two_lights(at_m=40.0)
    scene.lights.look()
    scene.shows("t", "r", 1000.0)
    scene.shows("u", "G", 1000.0)
    scene.traffic.now_s = 31.0
    scene.lights.look()
    assert scene.traffic.heedless == set()
    scene.driver.row["granted"] += 1
    scene.driver.row["line_m"] = 500.0
    scene.lights.granted(0)
    assert scene.traffic.heedless == set()
    scene.driver.row["front"] = 101.0
    scene.lights.look()
    assert scene.traffic.heedless == {"v"}


def test_before_a_green_arrow_a_vehicle_stops() -> None:
    """It heeds the light as SUMO's drivers do."""
    scene = Scene(signal("t"))
    scene.shows("t", "s", 30.0)
    assert scene.lights.in_the_way(0) is None
    scene.driver.row["granted"] = 1
    scene.lights.granted(0)
    assert scene.traffic.heedless == set()


def test_all_lights_on_one_crossing_have_to_be_green_on_arrival() -> None:
    """The second light turns before the vehicle gets to it; it need not be green yet if it will be."""
    scene = Scene(signal("t"), signal("u", ahead_m=40.0))
    scene.shows("t", "G", 30.0)
    scene.shows("u", "G", 3.0)
    assert scene.lights.in_the_way(0) is Reason.RED
    scene = Scene(signal("t"), signal("u", ahead_m=40.0))
    scene.shows("t", "G", 30.0)
    scene.shows("u", "r", 2.0, after="G")
    assert scene.lights.in_the_way(0) is None


def test_a_light_far_ahead_is_of_no_account() -> None:
    """Where nobody may wait on most of a road, who sets out stops for it there, and not 60 m before."""
    for light in (signal("t", ahead_m=60.0), signal("t", ahead_m=40.0)):
        scene = Scene(light)
        scene.shows("t", "r", 1000.0)
        assert scene.lights.in_the_way(0) is (None if light.ahead_m > 50.0 else Reason.RED)


def test_lights_that_are_never_green_together_do_not_keep_a_vehicle_for_ever() -> None:
    """After three minutes only the first light counts, so that its turning green is enough."""
    scene = Scene(signal("t"), signal("u", ahead_m=40.0))
    scene.shows("t", "G", 1000.0)
    scene.shows("u", "r", 1000.0)
    assert scene.lights.in_the_way(0) is Reason.RED
    scene.traffic.now_s = 179.0
    assert scene.lights.in_the_way(0) is Reason.RED
    scene.traffic.now_s = 180.0
    assert scene.lights.in_the_way(0) is None
    scene.shows("t", "r", 2000.0)
    scene.traffic.now_s = 1001.0
    assert scene.lights.in_the_way(0) is Reason.RED


def test_standing_at_a_red_with_a_grant_is_counted() -> None:
    """The light turns after the grant; the vehicle stands for three steps, then passes."""
    scene = Scene(signal("t"))
    scene.shows("t", "G", 5.0)
    scene.driver.row["granted"] = 1
    scene.lights.granted(0)
    scene.lights.look()
    assert scene.lights.figures()["stood"] == 0
    scene.shows("t", "r", 1000.0)
    scene.traffic.now_s = 6.0
    for _ in range(3):
        scene.lights.look()
    scene.driver.row["front"], scene.driver.row["speed"] = 102.0, 5.0
    scene.lights.look()
    scene.driver.row["speed"] = 0.0
    scene.lights.look()
    figures = scene.lights.figures()
    assert (figures["grants"], figures["stood"], figures["stood_s"]) == (1, 1, 3.0)


def test_a_light_that_never_turns_is_named() -> None:
    """And one that is red for minutes on end; what stands there is no deadlock."""
    scene = Scene(signal("t"))
    scene.shows("t", "r", 1000.0, after="y")
    (line,) = scene.lights.warnings()
    assert "1 of 1 movements" in line
    assert "never" in line
    assert "over t" in line
    scene = Scene(signal("t"))
    scene.shows("t", "G", 30.0)
    (line,) = scene.lights.warnings()
    assert "1000 s" in line
    scene = Scene(signal("t"))
    scene.shows("t", "G", 30.0, after="g")
    assert scene.lights.warnings() == []


def test_who_joins_or_leaves_does_not_change_who_is_looked_after() -> None:
    """A vehicle has another driver then, which is looked at; nobody asks about one that is gone."""
    scene = Scene(signal("t"), at_m=90.0, speed=5.0)
    scene.shows("t", "G", 1000.0)
    scene.driver.row["granted"] = 1
    scene.lights.granted(0)
    other = Scene(signal("t"), at_m=101.0, speed=5.0).driver
    other.row["granted"] = 1
    scene.drivers[:] = [other]
    scene.lights.look()
    assert scene.traffic.heedless == set(), "it is over the line"
    scene.lights.granted(0)
    scene.drivers.clear()
    scene.lights.look()
    assert scene.lights.figures()["stood"] == 0
