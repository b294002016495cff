"""The figures of Zhou et al. 2020 as the text describes them."""

from __future__ import annotations

import pytest

from loopgate.gates.algorithm2 import (
    Circuit,
    Condition,
    Walk,
    all_circuits,
    circuits_through,
    lemma1,
    sub_circuit,
    theorem1,
)
from loopgate.model import RobotId, StateId
from loopgate.research.theory.instances import fig7, instance
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.orders import Orders, order
from loopgate.research.theory.random_systems import small_system


def test_fig2a_is_a_deadlock() -> None:
    """Three robots, each waiting for the next: order 0, and not live."""
    system = instance("fig2a")
    (circuit,) = all_circuits(system, system.initial)
    assert circuit.is_deadlock_cycle
    assert order(system, system.initial, circuit) == 0
    assert theorem1(system, system.initial, circuit).condition is Condition.DEADLOCK_CYCLE


def test_fig2b_is_a_first_order_deadlock() -> None:
    """Only r1 and r3 can move; either move makes three robots a deadlock cycle, so the order is 1."""
    system = instance("fig2b")
    here = system.initial
    assert [i for i in range(4) if system.enabled(here, i)] == [0, 2]
    (circuit,) = all_circuits(system, here)
    assert order(system, system.initial, circuit) == 1
    assert not theorem1(system, here, circuit).live
    for mover, left in ((0, {0, 1, 2}), (2, {0, 2, 3})):
        after = system.move(here, mover)
        cycles = [c for c in all_circuits(system, after) if c.is_deadlock_cycle]
        assert [set(c.robots) for c in cycles] == [left]


def test_fig3_has_three_circuits() -> None:
    """<w16, w61>, <w12, w23, w36, w61> and <w12, w23, w34, w45, w56, w61>, as printed."""
    system = instance("fig3")
    found = {c.robots for c in circuits_through(system, system.initial, system.paths[0][0])}
    assert found == {(0, 5), (0, 1, 2, 5), (0, 1, 2, 3, 4, 5)}


def test_fig4_is_the_sub_circuit_of_fig3_and_a_second_order_deadlock() -> None:
    """When r1 moves to s2, r5's walk is cut to s8 s2 and r6 is excluded; the rest has order 2."""
    system = instance("fig3")
    here = system.initial
    (large,) = (c for c in all_circuits(system, here) if len(c.walks) == 6)
    left = sub_circuit(large, 0)
    assert left is not None
    assert left.robots == (0, 1, 2, 3, 4)
    assert [system.states[s] for s in left.walks[-1].states] == ["s8", "s2"]
    after = system.move(here, 0)
    assert left in set(all_circuits(system, after))
    assert order(system, after, left) == 2
    assert {system.states[s] for s in left.intermediate} == {"s3", "s4"}


@pytest.mark.parametrize("robots", range(4, 13))
def test_fig7_has_the_highest_order(robots: int) -> None:
    """The order is m - 3 exactly, all lemmas hold with equality, and no state is safe."""
    system = fig7(robots)
    (circuit,) = (c for c in all_circuits(system, system.initial) if len(c.walks) == robots)
    found = order(system, system.initial, circuit)
    assert found == robots - 3
    assert lemma1(system, circuit)
    assert found == len(circuit.intermediate)
    assert not theorem1(system, system.initial, circuit).live
    if robots <= 8:
        assert not Oracle(system).live(system.initial)


def test_fig5_is_live_by_the_second_condition() -> None:
    """SE(W) lies within S_alpha(W) and is small, but r2's step to s6 leaves r2, r3, r4, r5 with two states.

    With r2 at s6 the walk of r5 is cut to s11 s6, so m' = 4 and SE(W') = {s7, s10}: 2 > 4 - 3.
    """
    system = instance("fig5")
    (circuit,) = all_circuits(system, system.initial)
    assert lemma1(system, circuit)
    assert len(circuit.intermediate) == 6
    verdict = theorem1(system, system.initial, circuit)
    assert verdict.live
    assert verdict.condition is Condition.SUB_TOO_MANY_STATES
    assert system.robots[verdict.mover or 0].id == "r2"
    assert order(system, system.initial, circuit) is None


def test_fig10_r1_would_cause_a_deadlock_of_order_5() -> None:
    """The only circuit of r1's first move holds all eight robots and has order 5 = 8 - 3."""
    system = instance("fig10")
    after = system.move(system.initial, system.robot_number(RobotId("r1")))
    (circuit,) = circuits_through(system, after, system.states.index(StateId("s2")))
    assert set(circuit.robots) == set(range(8))
    assert order(system, after, circuit) == 5


def test_the_walk_behind_the_mover_is_not_asked() -> None:
    """As printed, ``check`` asks the walks j+1 to j+m-2: the one that ends where the mover stood is released.

    r1 moves from 0 to 1; of the others only r3's walk 3 1 4 0 passes state 1, and it ends at 0.
    """
    walks = (Walk(0, (0, 1, 2)), Walk(1, (2, 3)), Walk(2, (3, 1, 4, 0)))
    assert sub_circuit(Circuit(walks), 0) is None
    passing = (Walk(0, (0, 1, 2)), Walk(1, (2, 1, 3)), Walk(2, (3, 0)))
    left = sub_circuit(Circuit(passing), 0)
    assert left is not None
    assert [walk.states for walk in left.walks] == [(1, 2), (2, 1)]


def test_the_lowest_order_counts() -> None:
    """Where circuits of several orders are there, the configuration has the lowest (Remark 1)."""
    several = 0
    for seed in range(5000, 5150):
        system = small_system(seed)
        orders = Orders(system)
        here = system.initial
        for step in range(40):
            enabled = [i for i in range(len(system.robots)) if system.enabled(here, i)]
            if not enabled:
                break
            here = system.move(here, enabled[(seed + 7 * step) % len(enabled)])
            found = {orders.of_circuit(here, circuit) for circuit in all_circuits(system, here)} - {None}
            assert orders.of_configuration(here) == min((k for k in found if k is not None), default=None)
            several += len(found) > 1
    assert several > 0
