"""The exploration finds what brute force finds."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import lru_cache

import pytest
from brute_force import explore_plainly
from hypothesis import given
from hypothesis import strategies as st

from loopgate.errors import SystemModelError, UnsafeStartError
from loopgate.gates import make_gate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.state_space import ExplorationLimitError, StateSpace, explore
from loopgate.research.theory.instances import fig7, instance
from loopgate.research.theory.random_systems import Shape, any_system, random_system

GATES = [
    "open",
    "collision",
    "algorithm2",
    "certified",
    "certified:promise=somebody",
]
SHAPES = [
    Shape(robots=4, states=5, path=(2, 4)),
    Shape(robots=5, states=6, path=(3, 5)),
    Shape(robots=5, states=5, path=(2, 4), proposition1=False),
    Shape(robots=4, states=4, path=(2, 4), capacity=(1, 2)),
    Shape(robots=5, states=6, closed=False, private=2),
    Shape(robots=4, states=8, path=(3, 4), closed=False, private=0),
    Shape(robots=4, states=6, path=(3, 4), private=0),
    Shape(robots=4, states=4, path=(2, 3), capacity=(2, 2), fifo=1.0),
    Shape(robots=5, states=3, path=(2, 3), private=0, capacity=(2, 3), fifo=1.0),
    Shape(robots=4, states=5, path=(2, 4), private=0, capacity=(1, 3), fifo=0.5, proposition1=False),
    Shape(robots=4, states=5, path=(2, 4), closed=False, private=0, capacity=(2, 3), fifo=1.0),
]

the_instance = lru_cache(maxsize=8)(instance)
the_random_system = lru_cache(maxsize=8)(random_system)
"""The same system for each gate, so that brute force looks at it once."""


def check(system: System, gate: str) -> None:
    """Compare all figures, with and without a counterexample; replay it."""
    try:
        made = make_gate(gate, system)
    except UnsafeStartError:
        return
    plain = explore_plainly(system, made)
    found = explore(system, made, counterexample=True)
    assert replace(found, seconds=0.0) == plain
    assert replace(explore(system, made), seconds=0.0) == replace(plain, counterexample=None)
    if found.counterexample:
        here = system.initial
        for name in found.counterexample.moves:
            robot = system.robot_number(name)
            assert made.decide(here, robot).admitted
            here = system.move(here, robot)
        assert system.describe(here) == found.counterexample.configuration


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("shape", SHAPES)
def test_on_random_systems(shape: Shape, gate: str) -> None:
    """With capacities, queues, open paths, and robots without private states among them."""
    for seed in range(4):
        with suppress(SystemModelError):  # no room for all
            check(the_random_system(shape, seed), gate)


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("name", ["fig2b", "fig8", "fig10", "unsound_n5", "blocked_n6"])
def test_on_the_instances(name: str, gate: str) -> None:
    """On the paper's systems and the counterexamples."""
    check(the_instance(name), gate)


def test_fig7_from_its_start() -> None:
    """Nothing is live, and the highest order appears once: in the start."""
    found = explore(fig7(8), make_gate("collision", fig7(8)))
    assert found.live == 0
    assert found.higher_order is not None
    assert found.higher_order["5"] == 1


@given(seed=st.integers(0, 2**32), gate=st.sampled_from(GATES))
def test_on_any_system(seed: int, gate: str) -> None:
    """Whatever the system is: the figures of both, and each configuration's words lead back to it."""
    system = any_system(seed, robots=(2, 5))
    try:
        space = StateSpace(system, limit=600)
    except ExplorationLimitError:
        return
    assert all(space.number(space.configuration(k)) == k for k in range(space.count))
    check(system, gate)


def test_several_words() -> None:
    """Twenty robots on a long ring with one gap: too many bits for one word."""
    path = tuple(StateId(f"s{k}") for k in range(21))
    system = System(Robot(RobotId(f"r{k}"), path, start=k) for k in range(20))
    space = StateSpace(system)
    assert space.encoding.words == 2
    assert all(space.number(space.configuration(k)) == k for k in range(space.count))
    found = explore(system, make_gate("collision", system))
    assert (found.configurations, found.transitions, found.live) == (21 * 20, 21 * 20, 21 * 20)


def test_several_words_with_queues() -> None:
    """Three of many robots can move, in a ring; the order in its queues is in several words."""
    stay = [
        Robot(RobotId(f"e{k}"), (StateId(f"x{k}"), StateId("end")), closed=False, start=0) for k in range(70)
    ]
    ring = (StateId("a"), StateId("b"))
    turn = [Robot(RobotId(f"r{k}"), ring, start=k % 2) for k in range(3)]
    both = System([*turn[:1], *stay, *turn[1:], Robot(RobotId("e"), (StateId("end"),), closed=False)],
                  {StateId("a"): 2, StateId("b"): 2}, {StateId("a"), StateId("b")})  # fmt: skip
    alone = System(turn, {StateId("a"): 2, StateId("b"): 2}, {StateId("a"), StateId("b")})
    found, plain = (explore(s, make_gate("collision", s)) for s in (both, alone))
    assert StateSpace(both).encoding.words > 1
    assert (found.configurations, found.transitions) == (plain.configurations, plain.transitions)


def test_memory_is_bounded() -> None:
    """A system that is too large: a clear error before the memory is taken."""
    system = random_system(Shape(robots=8, states=10, path=(4, 5)), 1)
    with pytest.raises(ExplorationLimitError, match="GB are allowed"):
        explore(system, make_gate("collision", system), memory_gb=0.0001)


def test_train_missions() -> None:
    """Eight trains over one yard: as many live configurations as model checkers find with regions."""
    system = instance("oneway8")
    found = explore(system, make_gate("collision", system))
    assert (found.configurations, found.transitions) == (1_636_561, 7_134_296)
    assert (found.live, found.deadlocks, found.stuck) == (1_636_545, 16, 16)
