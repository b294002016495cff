"""Grants only into green, and who drives on at amber: one vehicle before lights, without SUMO."""

import pytest
from lights_scene import LINE_M, Scene, signal


@pytest.mark.parametrize("letter", ["r", "y", "u"])
def test_nothing_is_granted_into_red_or_yellow(letter: str) -> None:
    """Only green lets a request through."""
    scene = Scene(signal("t"))
    scene.shows("t", letter, 30.0, after="G")
    assert scene.keeps()


@pytest.mark.parametrize("letter", ["G", "g", "O"])
def test_green_or_no_light_lets_pass(letter: str) -> None:
    """Also green with others that go first, and a light that is off."""
    scene = Scene(signal("t"))
    scene.shows("t", letter, 30.0)
    assert not scene.keeps()


def test_a_slow_driver_has_to_be_over_the_line_before_red() -> None:
    """From standing, 60 m at 10 m/s take 9 s at least; amber is used."""
    late, amber, soon = (Scene(signal("t"), at_m=40.0) for _ in range(3))
    late.shows("t", "G", 6.0)
    amber.shows("t", "G", 11.0, after="y")
    soon.shows("t", "G", 20.0)
    assert late.keeps()
    assert not amber.keeps()
    assert not soon.keeps()


def test_a_green_that_comes_in_the_next_step_is_green() -> None:
    """The light changes at the beginning of the step, before anybody moves."""
    scene = Scene(signal("t"))
    scene.shows("t", "r", 0.0, after="G")
    assert not scene.keeps()


def test_who_was_let_go_drives_on_at_amber_and_stops_for_a_red_only_if_it_can() -> None:
    """Near the line at speed it is too late to brake: that is counted."""
    stops, passes = Scene(signal("t"), at_m=40.0, speed=10.0), Scene(signal("t"), at_m=95.0, speed=10.0)
    for scene in (stops, passes):
        scene.shows("t", "G", 30.0)
        scene.let_go()
        scene.look()
        assert not scene.drives_on(), "the light is green"
        scene.shows("t", "r", 1000.0)
        scene.traffic.now_s = 31.0
        scene.look()
    assert not stops.drives_on()
    assert passes.drives_on()
    passes.row["front"] = 100.5
    passes.look()
    assert not passes.drives_on()
    assert passes.run["on_red"] == 1


def test_sumo_is_told_who_drives_on_before_the_light_closes() -> None:
    """In the step before amber; at once where that may come any time, or SUMO's right of way is kept."""
    for changes_s, fixed, yields, told in (
        (30.0, True, False, False),
        (1.0, True, False, True),
        (1.0, False, False, True),
        (30.0, False, False, False),
        (30.0, True, True, True),
    ):
        scene = Scene(signal("t"), at_m=95.0, speed=10.0)
        scene.run["yields"] = yields
        scene.shows("t", "G", changes_s, after="y", fixed=fixed)
        scene.let_go()
        scene.traffic.now_s = 1.0
        scene.look()
        assert scene.drives_on() is told


def test_who_passes_all_lights_for_sure_if_they_let_it_go() -> None:
    """Not a light that is far, nor a second one that changes with the traffic, nor after a long wait."""
    for second_m, fixed, waited_s, sure in (
        (30.0, True, 0.0, True),
        (30.0, False, 0.0, False),
        (60.0, True, 0.0, False),
        (30.0, True, 180.0, False),
    ):
        scene = Scene(signal("t"), signal("u", second_m))
        scene.shows("t", "G", 30.0, fixed=False)
        scene.shows("u", "G", 30.0, fixed=fixed)
        scene.row["red_since_s"] = -waited_s
        assert scene.passes_for_sure() is sure


def two_lights(*, at_m: float) -> Scene:
    """Return a vehicle that was let go over two junctions, one after the other, both lights green."""
    scene = Scene(signal("t"), after=[signal("u")], at_m=at_m, speed=10.0)
    for light, line_m in (("t", LINE_M), ("u", 300.0)):
        scene.shows(light, "G", 30.0)
        scene.let_go(line_m)
    return scene


def test_who_is_over_the_line_of_one_light_still_drives_on_at_amber_at_the_next() -> None:
    """It was let go there too."""
    scene = two_lights(at_m=95.0)
    scene.row["front"] = 101.0
    scene.shows("u", "y", 1000.0)
    scene.traffic.now_s = 31.0
    scene.look()
    assert scene.drives_on()
    scene.row["front"] = 301.0
    scene.look()
    assert not scene.drives_on()


def test_who_stops_at_a_light_is_not_let_through_it_by_a_grant_beyond() -> None:
    """It drives on at the second light when it is over the line of the first, which it waits for."""
    scene = two_lights(at_m=40.0)
    scene.look()
    scene.shows("t", "r", 1000.0)
    scene.shows("u", "y", 1000.0)
    scene.traffic.now_s = 31.0
    scene.look()
    assert not scene.drives_on()
    scene.let_go(500.0)
    scene.look()
    assert not scene.drives_on()
    scene.row["front"] = 101.0
    scene.look()
    assert scene.drives_on()


def test_before_a_green_arrow_a_vehicle_stops() -> None:
    """It heeds the light as SUMO's drivers do."""
    scene = Scene(signal("t"))
    scene.shows("t", "s", 30.0)
    assert not scene.keeps()
    scene.let_go()
    scene.shows("t", "r", 1000.0)
    scene.traffic.now_s = 31.0
    scene.look()
    assert not scene.drives_on()


def test_all_lights_on_one_crossing_have_to_be_green_on_arrival() -> None:
    """The second light turns before the vehicle gets to it; it need not be green yet if it will be."""
    scene = Scene(signal("t"), signal("u", ahead_m=40.0))
    scene.shows("t", "G", 30.0)
    scene.shows("u", "G", 3.0)
    assert scene.keeps()
    scene = Scene(signal("t"), signal("u", ahead_m=40.0))
    scene.shows("t", "G", 30.0)
    scene.shows("u", "r", 2.0, after="G")
    assert not scene.keeps()


def test_a_light_far_ahead_is_of_no_account() -> None:
    """Where nobody may wait on most of a road, who sets out stops for it there, and not 60 m before."""
    for light in (signal("t", ahead_m=60.0), signal("t", ahead_m=40.0)):
        scene = Scene(light)
        scene.shows("t", "r", 1000.0)
        assert scene.keeps() is (light.ahead_m <= 50.0)


def test_lights_that_are_never_green_together_do_not_keep_a_vehicle_for_ever() -> None:
    """After three minutes only the first light counts, so that its turning green is enough."""
    scene = Scene(signal("t"), signal("u", ahead_m=40.0))
    scene.shows("t", "G", 1000.0)
    scene.shows("u", "r", 1000.0)
    assert scene.keeps()
    scene.traffic.now_s = 179.0
    assert scene.keeps()
    scene.traffic.now_s = 180.0
    assert not scene.keeps()
    scene.shows("t", "r", 2000.0)
    scene.traffic.now_s = 1001.0
    assert scene.keeps()


def test_standing_at_a_red_with_a_grant_is_counted() -> None:
    """The light turns after the grant; the vehicle stands for three steps, then passes."""
    scene = Scene(signal("t"))
    scene.shows("t", "G", 5.0)
    scene.let_go()
    scene.look()
    assert scene.run["stood"] == 0
    scene.shows("t", "r", 1000.0)
    scene.traffic.now_s = 6.0
    for _ in range(3):
        scene.look()
    scene.row["front"], scene.row["speed"] = 102.0, 5.0
    scene.look()
    scene.row["speed"] = 0.0
    scene.look()
    assert [scene.run[name] for name in ("let_go", "stood", "stood_s")] == [1, 1, 3.0]
