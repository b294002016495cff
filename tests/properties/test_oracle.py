"""Two meanings of live that agree: everyone can go on for ever, and everyone can come home."""

from __future__ import annotations

import random

from hypothesis import given
from hypothesis import strategies as st

from loopgate.model import Configuration, System
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.random_systems import Shape, random_system

SHAPES = [
    Shape(robots=3, states=3, path=(2, 3), proposition1=False),
    Shape(robots=4, states=4, path=(2, 4)),
    Shape(robots=5, states=5, path=(2, 4), proposition1=False),
    Shape(robots=4, states=4, path=(2, 3), capacity=(1, 2), proposition1=False),
    Shape(robots=4, states=3, path=(2, 3), capacity=(1, 2), fifo=1.0, proposition1=False),
    Shape(robots=4, states=5, path=(2, 4), private=2, closed=False),
]


def all_can_come_home(system: System, configuration: Configuration) -> bool:
    """Whether some sequence of moves brings every robot to a private or terminal state at once.

    A robot that is home may go on; home is where all are at the same time.
    """
    seen = {configuration}
    ahead = [configuration]
    while ahead:
        here = ahead.pop()
        robots = range(len(system.robots))
        if all(system.private[system.state_at(here, i)] or system.finished(here, i) for i in robots):
            return True
        for there in (system.moved(here, i) for i in robots if system.enabled(here, i)):
            if there not in seen:
                seen.add(there)
                ahead.append(there)
    return False


@given(shape=st.sampled_from(SHAPES), seed=st.integers(0, 10**6), steps=st.integers(0, 25))
def test_live_iff_all_can_come_home(shape: Shape, seed: int, steps: int) -> None:
    """With a private state for every robot (a private terminal state on open paths) the two are one."""
    system = random_system(shape, seed)
    oracle = Oracle(system)
    rng = random.Random(seed)
    here = system.initial
    for _ in range(steps):
        free = [i for i in range(len(system.robots)) if system.enabled(here, i)]
        if not free:
            break
        here = system.moved(here, rng.choice(free))
    assert oracle.live(here) == all_can_come_home(system, here)
