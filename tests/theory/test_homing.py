"""The plain search for a way home agrees with the oracle."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loopgate.errors import SystemModelError
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.theory.homing import Homing
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.random_systems import Shape, random_system


@given(seed=st.integers(0, 10**6))
@settings(max_examples=40)
def test_oracle_and_search_agree(seed: int) -> None:
    """On every configuration that any moves can reach, with and without capacities and FIFO states."""
    plain = seed % 2 == 0
    capacity = (1, 1) if plain else (1, 2)
    shape = Shape(
        robots=4,
        states=5,
        path=(2, 3),
        capacity=capacity,
        fifo=0.0 if plain else 0.5,
        closed=plain or seed % 4 == 1,
        private=int(plain or seed % 4 == 1),
    )
    try:
        system = random_system(shape, seed)
    except SystemModelError:
        return
    oracle, homing = Oracle(system), Homing(system)
    seen, todo = {system.initial}, [system.initial]
    dead = 0
    while todo:
        here = todo.pop()
        live = oracle.live(here)
        dead += not live
        assert homing.live(here) == live
        for robot in range(len(system.robots)):
            if system.enabled(here, robot):
                there = system.moved(here, robot)
                if there not in seen:
                    seen.add(there)
                    todo.append(there)


def test_without_private_states_it_does_not_answer() -> None:
    """Two robots that share their whole ring: the search does not cover that."""
    ring = tuple(StateId(s) for s in "abc")
    system = System([Robot(RobotId("r1"), ring), Robot(RobotId("r2"), ring, start=1)])
    with pytest.raises(ValueError, match="no private state"):
        Homing(system)
