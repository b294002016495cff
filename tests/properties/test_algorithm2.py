"""The fast search of algorithm2 answers like the plain theory: all circuits, each judged by Theorem 1."""

from __future__ import annotations

import random

import pytest

from loopgate.gates import Reason, make_gate
from loopgate.model import Configuration, System
from loopgate.theory.circuits import circuits_through
from loopgate.theory.random_systems import Shape, dense, random_system, sparse
from loopgate.theory.theorem1 import theorem1

SHAPES = [
    Shape(robots=3, states=4, path=(2, 4)),
    Shape(robots=5, states=6, path=(3, 5)),
    Shape(robots=6, states=6, path=(3, 6), proposition1=False),
    Shape(robots=7, states=8, path=(3, 6)),
    Shape(robots=6, states=12, path=(4, 7), private=0, proposition1=False),
    Shape(robots=6, states=5, path=(2, 4), capacity=(1, 3), fifo=0.5),
    Shape(robots=8, states=6, path=(2, 4), capacity=(2, 2), fifo=1.0, private=0, proposition1=False),
    Shape(robots=8, states=6, path=(2, 4), capacity=(2, 2), private=0, proposition1=False),
    Shape(robots=6, states=7, path=(3, 5), private=2, closed=False),
    sparse(8),
    dense(12),
]


def plain_answer(system: System, configuration: Configuration, robot: int, lookahead: int) -> bool:
    """Whether all circuits through the state that `robot` enters are live."""
    state = system.next_state(configuration, robot)
    assert state is not None
    after = system.moved(configuration, robot)
    return all(
        theorem1(system, after, circuit, lookahead=lookahead).live
        for circuit in circuits_through(system, after, state)
    )


@pytest.mark.parametrize("lookahead", [1, 3])
@pytest.mark.parametrize("shape", SHAPES)
def test_fast_search_is_the_theory(shape: Shape, lookahead: int) -> None:
    """On every configuration of random runs without avoidance, deadlocks included."""
    refused = 0
    for seed in range(12):
        system = random_system(shape, seed)
        gate = make_gate(f"algorithm2:lookahead={lookahead}", system)
        rng = random.Random(seed)
        here = system.initial
        for _ in range(40):
            enabled = [i for i in range(len(system.robots)) if system.enabled(here, i)]
            if not enabled:
                break
            for robot in enabled:
                decision = gate.decide(here, robot)
                assert decision.admitted == plain_answer(system, here, robot, lookahead), (seed, here, robot)
                refused += decision.reason is Reason.DEADLOCK
            here = system.move(here, rng.choice(enabled))
    assert refused > 0
