"""The two gates without foresight."""

from __future__ import annotations

import pytest

from builders import ring_of_three, system
from loopgate.gates import Decision, Gate, Reason
from loopgate.gates.collision import CollisionGate
from loopgate.gates.open import OpenGate
from loopgate.model import System


@pytest.mark.parametrize("make", [OpenGate, CollisionGate])
def test_both_are_gates(make: type[OpenGate | CollisionGate]) -> None:
    """They keep the protocol."""
    assert isinstance(make(ring_of_three()), Gate)


def test_collision_admits_into_a_deadlock() -> None:
    """Mutual exclusion is all it looks at (Section 4.1), so the third robot closes the circle."""
    s = ring_of_three()
    gate = CollisionGate(s)
    c = s.initial
    for i in range(3):
        assert gate.decide(c, i) == Decision(admitted=True, reason=Reason.FREE)
        c = s.move(c, i)
    assert [gate.decide(c, i).blockers for i in range(3)] == [(1,), (2,), (0,)]
    assert {gate.decide(c, i).reason for i in range(3)} == {Reason.OCCUPIED}


def test_collision_names_who_stands_before_it() -> None:
    """Behind the head of a FIFO state the blocker is the robot just ahead."""
    s = system(dict.fromkeys(("r1", "r2", "r3"), "a b"), capacity={"a": 3, "b": 1}, fifo=("a",))
    gate = CollisionGate(s)
    decisions = [gate.decide(s.initial, i) for i in range(3)]
    assert [d.reason for d in decisions] == [Reason.FREE, Reason.BEHIND, Reason.BEHIND]
    assert [d.blockers for d in decisions] == [(), (0,), (1,)]


def test_collision_names_all_who_fill_a_state() -> None:
    """A full state of two is blocked by both of its robots."""
    s = system({"r1": "p1 a", "r2": "p2 a", "r3": "p3 a"}, starts={"r1": 1, "r2": 1}, capacity={"a": 2})
    assert CollisionGate(s).decide(s.initial, 2).blockers == (0, 1)


def test_open_admits_whatever_moves() -> None:
    """On the road SUMO's right of way rules; the gate says yes, even into an occupied state."""
    s = ring_of_three()
    full = s.configuration((1, 1, 1))
    assert [OpenGate(s).decide(full, i).admitted for i in range(3)] == [True] * 3


@pytest.mark.parametrize("make", [OpenGate, CollisionGate])
def test_a_robot_that_stays_is_told_so(make: type[OpenGate | CollisionGate]) -> None:
    """There is no next state to enter."""
    s: System = system({"r1": "p1 a"}, starts={"r1": 1}, closed=False)
    assert make(s).decide(s.initial, 0) == Decision(admitted=False, reason=Reason.STAYS)
