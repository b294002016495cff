"""Paths changed under way are accepted only if everyone can still go on."""

from __future__ import annotations

import pytest

from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.runs import PathChangeError, change_path
from loopgate.research.theory.oracle import Oracle


def states(text: str) -> tuple[StateId, ...]:
    return tuple(StateId(s) for s in text.split())


def ring() -> System:
    """Three robots, each from its private state over two of three shared ones."""
    return System(
        [
            Robot(RobotId("r1"), states("p1 a b")),
            Robot(RobotId("r2"), states("p2 b c")),
            Robot(RobotId("r3"), states("p3 c d")),
        ]
    )


def test_a_harmless_change_is_accepted() -> None:
    """From home a robot may take any path with its private state."""
    system = ring()
    changed = change_path(system, system.initial, RobotId("r3"), states("p3 c a"))
    assert changed.robots[2].path == states("p3 c a")
    assert Oracle(changed).live(changed.initial)


def test_a_change_into_a_deadlock_is_refused() -> None:
    """With r1 at a, r2 at b, r3 at c the path c a closes a circle; before it, r3 could go on to d."""
    system = ring()
    here = system.configuration((1, 1, 1))
    assert Oracle(system).live(here)
    with pytest.raises(PathChangeError, match=r"new path is refused: .* is not live"):
        change_path(system, here, RobotId("r3"), states("p3 c a"))


def test_the_robot_must_stand_on_its_new_path() -> None:
    """A robot does not jump."""
    system = ring()
    here = system.configuration((1, 0, 0))
    with pytest.raises(PathChangeError, match="robot r1: it stands in a, which is not on its new path"):
        change_path(system, here, RobotId("r1"), states("p1 b"))


def test_states_that_nobody_visits_any_more_are_gone() -> None:
    """Capacities of states that left the system do not stay behind."""
    system = System(
        [Robot(RobotId("r1"), states("p1 a b")), Robot(RobotId("r2"), states("p2 b c"))],
        {StateId("a"): 2},
    )
    changed = change_path(system, system.initial, RobotId("r1"), states("p1 b"))
    assert StateId("a") not in changed.states
    assert not changed.capacity
