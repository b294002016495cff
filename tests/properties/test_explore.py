"""The compiled exploration finds what the plain one finds."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from loopgate.errors import SystemModelError
from loopgate.gates import make_gate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.theory.instances import fig7, instance
from loopgate.theory.oracle import Oracle, OracleLimitError
from loopgate.theory.random_systems import Shape, random_system
from loopgate.untimed import ExplorationLimitError, any_system, explore, explore_plainly
from loopgate.untimed.numbered import Numbered, why_not_numbered
from loopgate.untimed.numbered_exploration import explore_numbered
from loopgate.untimed.packed import why_not_packed

GATES = ["open", "collision", "banker", "algorithm2", "algorithm2:lookahead=2", "certified"]
SHAPES = [
    Shape(robots=4, states=5, path=(2, 4)),
    Shape(robots=5, states=6, path=(3, 5)),
    Shape(robots=5, states=5, path=(2, 4), proposition1=False),
    Shape(robots=4, states=4, path=(2, 4), capacity=(1, 2)),
    Shape(robots=5, states=6, closed=False, private=2),
    Shape(robots=4, states=8, path=(3, 4), closed=False, private=0),
]


def check(system: System, gate: str) -> None:
    """Compare all figures and the kind and length of the witness; replay the witness."""
    if gate == "certified" and not Oracle(system).live(system.initial):
        return  # that gate refuses a start that is not live
    plain = explore_plainly(system, make_gate(gate, system), witness=True)
    fast = explore(system, make_gate(gate, system), witness=True)
    quick = explore(system, make_gate(gate, system))
    assert replace(fast, seconds=0.0, witness=None) == replace(plain, seconds=0.0, witness=None)
    assert replace(quick, seconds=0.0) == replace(plain, seconds=0.0, witness=None)
    assert (plain.witness is None) == (fast.witness is None)
    if plain.witness and fast.witness:
        assert len(fast.witness.moves) == len(plain.witness.moves)
        judge = make_gate(gate, system)
        here = system.initial
        for name in fast.witness.moves:
            robot = system.robot_number(name)
            assert judge.decide(here, robot).admitted
            here = system.move(here, robot)
        assert system.describe(here) == fast.witness.configuration


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("shape", SHAPES)
def test_compiled_is_plain(shape: Shape, gate: str) -> None:
    """On random systems, with capacities and open paths among them."""
    for seed in range(3):
        system = random_system(shape, seed)
        assert not why_not_packed(system)
        check(system, gate)


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("name", ["fig2b", "fig8", "fig10", "unsound_n5", "blocked_n6"])
def test_compiled_is_plain_on_the_instances(name: str, gate: str) -> None:
    """On the paper's systems and the counterexamples."""
    check(instance(name), gate)


def test_fig7_from_its_start() -> None:
    """Nothing is live, and the highest order appears once: in the start."""
    found = explore(fig7(8), make_gate("collision", fig7(8)))
    assert found.live == 0
    assert found.higher_order is not None
    assert found.higher_order["5"] == 1


OTHERS = [
    Shape(robots=4, states=6, path=(3, 4), private=0),
    Shape(robots=4, states=4, path=(2, 3), capacity=(2, 2), fifo=1.0),
    Shape(robots=5, states=3, path=(2, 3), private=0, capacity=(2, 3), fifo=1.0),
    Shape(robots=4, states=5, path=(2, 4), private=0, capacity=(1, 3), fifo=0.5, proposition1=False),
    Shape(robots=4, states=5, path=(2, 4), closed=False, private=0, capacity=(2, 3), fifo=1.0),
]


@pytest.mark.parametrize("gate", ["collision", "banker", "algorithm2", "certified"])
@pytest.mark.parametrize("shape", OTHERS)
def test_others_are_numbered(shape: Shape, gate: str) -> None:
    """Queues of several robots, and robots without private states, with the order in the queues."""
    others = []
    for seed in range(40):
        with suppress(SystemModelError):  # no room for all
            system = random_system(shape, seed)
            if why_not_packed(system):
                others.append(system)
    assert len(others) >= 4
    for system in others[:4]:
        assert not why_not_numbered(system)
        check(system, gate)


@given(seed=st.integers(0, 2**32))
def test_numbered_is_plain_on_any_system(seed: int) -> None:
    """Whatever the system is: the figures of both, and each configuration's word leads back to it."""
    system = any_system(seed, robots=(3, 5))
    gate = make_gate("collision", system)
    try:
        plain = explore_plainly(system, gate, witness=True, limit=1_500)
    except OracleLimitError:
        return
    numbered = Numbered(system)
    assert replace(explore_numbered(system, gate, witness=True), seconds=0.0) == replace(plain, seconds=0.0)
    assert all(numbered.number(numbered.configuration(k)) == k for k in range(numbered.count))


def test_what_fits_nowhere_is_explored_plainly() -> None:
    """Twenty robots on a long ring: too many bits for a word, not too many configurations."""
    path = tuple(StateId(f"s{k}") for k in range(21))
    system = System(Robot(RobotId(f"r{k}"), path, start=k) for k in range(20))
    assert "bits" in why_not_numbered(system)
    assert explore(system, make_gate("collision", system)).configurations == 21 * 20


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
