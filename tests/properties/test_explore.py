"""The compiled exploration finds what the plain one finds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from loopgate.gates import make_gate
from loopgate.model import System
from loopgate.theory.instances import fig7, instance
from loopgate.theory.oracle import Oracle
from loopgate.theory.random_systems import Shape, random_system
from loopgate.untimed import ExplorationLimitError, explore, explore_plainly
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


def test_other_systems_are_explored_plainly() -> None:
    """Queues of several robots, and robots without private states, do not fit into words."""
    for shape in (
        Shape(robots=4, states=6, path=(3, 4), private=0),
        Shape(robots=4, states=4, path=(2, 3), capacity=(2, 2), fifo=1.0),
    ):
        system = random_system(shape, 1)
        assert why_not_packed(system)
        check(system, "collision")


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
