"""What is told of lights that are obeyed."""

from types import SimpleNamespace
from typing import Any

from lights_scene import Scene, signal
from roads import polygon

from loopgate.abstraction.itinerary import Crossing, Itinerary, Leg
from loopgate.model import StateId
from loopgate.simulation.around.lights import Lights


def told(scene: Scene) -> Lights:
    """Return what tells of a scene's light."""
    engine: Any = SimpleNamespace(run=scene.tables.run)
    lights = Lights(engine, scene.timetable)
    leg = Leg(StateId("a"), 0.0, 100.0, (Crossing("over t", frozenset()),))
    lights.plan([Itinerary(polygon("loop", [(0.0, 0.0), (200.0, 0.0)]), (leg,))])
    return lights


def test_a_light_that_never_turns_is_named() -> None:
    """And one that is red for minutes on end; what stands there is no deadlock."""
    scene = Scene(signal("t"))
    scene.shows("t", "r", 1000.0, after="y")
    (line,) = told(scene).report()["warnings"]
    assert "1 of 1 movements" in line
    assert "never" in line
    assert "over t" in line
    scene = Scene(signal("t"))
    scene.shows("t", "G", 30.0)
    (line,) = told(scene).report()["warnings"]
    assert "1000 s" in line
    scene = Scene(signal("t"))
    scene.shows("t", "G", 30.0, after="g")
    assert told(scene).report()["warnings"] == []


def test_the_longest_wait_is_told_with_its_light() -> None:
    """It is as long as the red is known to last, and no longer than it has lasted at the end."""
    scene = Scene(signal("t"))
    scene.shows("t", "r", 30.0, after="G")
    scene.traffic.now_s = 10.0
    assert scene.keeps()
    lights = told(scene)
    assert lights.report()["at_lights"]["longest_red_s"] == 0.0
    scene.run["now_s"] = 60.0
    figures = lights.report()["at_lights"]
    assert (figures["longest_red_s"], figures["longest_red_at"]) == (19.0, "over t")
