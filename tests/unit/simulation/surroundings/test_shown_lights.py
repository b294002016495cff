"""What is told of lights that are obeyed."""

from __future__ import annotations

from math import inf

import pytest
from roads import polygon

from loopgate.abstraction.itinerary import Crossing, DrawnLeg, Itinerary
from loopgate.model import StateId
from loopgate.simulation.surroundings.obeyed import ShownLights, longest_closed_s
from loopgate.traffic.base import Phase, Program

CROSS = (Phase("Gr", 20.0, 1), Phase("yr", 3.0, 2), Phase("rG", 30.0, 3), Phase("ry", 3.0, 0))


def test_how_long_a_light_stays_red() -> None:
    """Over the end of the cycle too; for ever if no phase opens it; unknown if it follows traffic."""
    program = Program(CROSS, fixed=True)
    assert longest_closed_s(program, 0) == 36.0
    assert longest_closed_s(program, 1) == 26.0
    assert longest_closed_s(Program((Phase("r", 1000.0, 1), Phase("y", 3.0, 0)), fixed=True), 0) == inf
    assert longest_closed_s(Program(CROSS, fixed=False), 0) == 0.0


def shown(letters: str) -> ShownLights:
    """Return what is told of a light that shows the first letter for 50 s, and the second for 1000 s."""
    phases = tuple(
        Phase(letter, longest_s, 1 - n)
        for n, (letter, longest_s) in enumerate(zip(letters, (50.0, 1000.0), strict=True))
    )
    lights = ShownLights(lambda _: Program(phases, fixed=True))
    leg = DrawnLeg(StateId("a"), 0.0, 100.0, (Crossing("over t", frozenset()),))
    lights.plan([Itinerary(polygon("loop", [(0.0, 0.0), (200.0, 0.0)]), (leg,))], {"over t": ("t", 0)})
    return lights


@pytest.mark.parametrize(
    ("letters", "words"),
    [("ry", ("1 of 1 movements", "never", "over t")), ("Gr", ("1 of 1 movements", "300 s", "1000 s on end"))],
)
def test_a_light_that_rarely_or_never_turns_is_named(letters: str, words: tuple[str, ...]) -> None:
    """A vehicle that stands there is in no deadlock."""
    (line,) = shown(letters).warnings(2000.0, "over t")
    assert all(word in line for word in words)


def test_nothing_is_told_of_a_light_that_is_always_green() -> None:
    assert shown("Gg").warnings(0.0, "") == []


def test_a_long_wait_is_told_with_its_light() -> None:
    """Though the program says nothing of that."""
    (line,) = shown("Gg").warnings(301.0, "over t")
    assert line == "lights: a vehicle waited 301 s for green at movement over t (light t)"
