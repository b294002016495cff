"""One step of foresight: circles are not closed, and that is all."""

from __future__ import annotations

from random import Random

from builders import ring_of_three, system
from loopgate.gates import Decision, Reason
from loopgate.gates.deadlocks import deadlocked_robots
from loopgate.gates.one_step import OneStepGate
from loopgate.research.theory.random_systems import any_system


def test_the_move_that_closes_a_circle_is_refused() -> None:
    """The third robot of a ring stays out; the blockers are the two it would lock up."""
    s = ring_of_three()
    gate = OneStepGate(s)
    c = s.configuration((1, 1, 0))
    assert gate.decide(c, 2) == Decision(admitted=False, reason=Reason.DEADLOCK, blockers=(0, 1))
    assert gate.decide(c, 1).admitted


def test_an_occupied_state_is_refused_as_such() -> None:
    """Collisions come first."""
    s = ring_of_three()
    assert OneStepGate(s).decide(s.configuration((1, 1, 0)), 0) == Decision(
        admitted=False, reason=Reason.OCCUPIED, blockers=(1,)
    )


def test_a_deadlock_of_first_order_is_entered() -> None:
    """Fig. 7 with m = 4: the last of the four is let in, and then x is refused to r1 and r3 for ever."""
    s = system({"r1": "p1 t1 x t2", "r2": "p2 t2 t3", "r3": "p3 t3 x t4", "r4": "p4 t4 t1"})
    gate = OneStepGate(s)
    c = s.configuration((1, 1, 1, 0))
    assert gate.decide(c, 3).admitted
    after = s.moved(c, 3)
    assert [gate.decide(after, i).reason for i in range(4)] == [
        Reason.DEADLOCK,
        Reason.OCCUPIED,
        Reason.DEADLOCK,
        Reason.OCCUPIED,
    ]


def test_who_joins_an_old_deadlock_locks_nobody_up() -> None:
    """r4 may wait behind a deadlock that is there already: no circle is closed by it."""
    s = system(
        {"r1": "p1 a b", "r2": "p2 b c", "r3": "p3 c a", "r4": "p4 q a"}, starts={"r1": 1, "r2": 1, "r3": 1}
    )
    assert OneStepGate(s).decide(s.initial, 3).admitted


def test_looking_near_the_move_is_enough() -> None:
    """On walks through small systems, deadlocks and all, the answers are those of the definition."""
    rng, refused = Random(1), 0
    for seed in range(400):
        s = any_system(seed)
        gate, c = OneStepGate(s), s.initial
        for _ in range(20):
            movable = [robot for robot in range(len(s.robots)) if s.enabled(c, robot)]
            for robot in movable:
                locked = deadlocked_robots(s, s.moved(c, robot)) - deadlocked_robots(s, c) - {robot}
                decision = gate.decide(c, robot)
                assert decision.admitted == (not locked)
                assert set(decision.blockers) == locked
                refused += bool(locked)
            if not movable:
                break
            c = s.moved(c, rng.choice(movable))
    assert refused > 100
