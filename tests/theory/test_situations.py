"""The situations that networks/ring3 and networks/order2 are drawn for, as systems without roads."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from builders import system
from loopgate.gates import make_gate
from loopgate.gates.deadlocks import deadlocked_robots
from loopgate.model import Configuration, System
from loopgate.research.theory.oracle import Oracle

RING3 = {"loop1": "p1 s1 s2", "loop2": "p2 s2 s3", "loop3": "p3 s3 s1"}
ORDER2 = {
    "loop1": "p1 t1 x1 x2 t2",
    "loop2": "p2 t2 t3",
    "loop3": "p3 t3 x2 t4",
    "loop4": "p4 t4 x1 t5",
    "loop5": "p5 t5 t1",
}


def reachable(system: System, admits: Callable[[Configuration, int], bool]) -> set[Configuration]:
    """All configurations that can be reached by enabled moves that are admitted."""
    seen = {system.initial}
    ahead = [system.initial]
    while ahead:
        here = ahead.pop()
        for robot in range(len(system.robots)):
            if system.enabled(here, robot) and admits(here, robot):
                there = system.moved(here, robot)
                if there not in seen:
                    seen.add(there)
                    ahead.append(there)
    return seen


def test_ring3_has_one_deadlock_and_none_of_higher_order() -> None:
    """Of all that can be reached only s1 s2 s3 is lost, and that is a plain circle."""
    s = system(RING3)
    oracle = Oracle(s)
    lost = [c for c in reachable(s, lambda _c, _i: True) if not oracle.live(c)]
    assert [s.describe(c) for c in lost] == [("s1", "s2", "s3")]
    assert deadlocked_robots(s, lost[0]) == {0, 1, 2}


def test_order2_has_deadlocks_that_one_step_does_not_see() -> None:
    """Refusing moves that close a circle still leads to seven configurations that are lost.

    With a robot in each of t1 to t5, loop5 may go to t1 once loop1 has gone to x1, and drive round for
    ever; but then loop1 to x2 closes x2 t2 t3, and loop3 to x2 closes x1 x2 t4: loops 1 to 4 stay.
    """
    s = system(ORDER2)
    oracle = Oracle(s)
    gate = make_gate("one-step", s)
    careful = reachable(s, lambda c, i: gate.decide(c, i).admitted)
    assert not any(deadlocked_robots(s, c) for c in careful)
    lost = {s.describe(c) for c in careful if not oracle.live(c)}
    assert len(lost) == 7
    assert ("t1", "t2", "t3", "t4", "t5") in lost
    assert ("x1", "t2", "t3", "t4", "t1") in lost


@pytest.mark.parametrize("gate", ["banker", "algorithm2", "certified"])
def test_gates_that_look_ahead_stay_live_on_order2(gate: str) -> None:
    """They enter none of the lost configurations, and all of the live ones that can be reached."""
    s = system(ORDER2)
    oracle = Oracle(s)
    judge = make_gate(gate, s)
    seen = reachable(s, lambda c, i: judge.decide(c, i).admitted)
    everything = reachable(s, lambda _c, _i: True)
    assert seen == {c for c in everything if oracle.live(c)}


def test_collision_is_lost_on_order2() -> None:
    """The gate without foresight reaches what is not live."""
    s = system(ORDER2)
    oracle = Oracle(s)
    judge = make_gate("collision", s)
    assert any(not oracle.live(c) for c in reachable(s, lambda c, i: judge.decide(c, i).admitted))
