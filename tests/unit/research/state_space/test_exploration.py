"""The exploration, on systems small enough to count by hand or to know from the text."""

from __future__ import annotations

import pytest

from loopgate.gates import make_gate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.state_space import Counterexample, ExplorationLimitError, explore
from loopgate.research.theory.instances import instance


def test_first_order_deadlock_by_hand() -> None:
    """Fig. 2(b): two moves are possible, each into a deadlock of three robots.

    After r1's move r4 can move to s1, and off it; after r3's, r2 can move to s4, and off it. That makes 7
    configurations: the start of order 1, and 6 with a deadlock.
    """
    system = instance("fig2b")
    found = explore(system, make_gate("collision", system))
    assert (found.configurations, found.transitions) == (7, 6)
    assert (found.live, found.deadlocks, found.higher_order) == (0, 6, {"1": 1})
    assert (found.stuck, found.unsafe_admitted) == (2, 6)


def test_unsound_instance() -> None:
    """Algorithm 2 admits one move into a configuration that is not live; eight moves lead there."""
    system = instance("unsound_n5")
    found = explore(system, make_gate("algorithm2", system), counterexample=True)
    assert (found.configurations, found.unsafe_admitted, found.stuck) == (721, 1, 1)
    assert found.higher_order == {"2": 1}
    assert found.counterexample is not None
    assert found.counterexample.kind == "unsafe"
    assert len(found.counterexample.moves) == 8
    here = system.initial
    for name in found.counterexample.moves:
        here = system.move(here, system.robot_number(name))
    assert system.describe(here) == found.counterexample.configuration


def test_blocked_instance() -> None:
    """Algorithm 2 stops everybody in one live configuration."""
    system = instance("blocked_n6")
    found = explore(system, make_gate("algorithm2", system), counterexample=True)
    assert (found.unsafe_admitted, found.stuck) == (0, 1)
    assert found.counterexample is not None
    assert found.counterexample.kind == "stuck"
    assert found.counterexample.configuration == ("s0", "s5", "s4", "s3", "s2", "p6")


def test_order_is_not_counted_without_private_states() -> None:
    """Two robots that turn in a ring of three shared states: live for ever, and no orders."""
    ring = tuple(StateId(s) for s in ("a", "b", "c"))
    system = System([Robot(RobotId("r1"), ring), Robot(RobotId("r2"), ring, start=1)])
    found = explore(system, make_gate("collision", system), counterexample=True)
    assert (found.configurations, found.live, found.stuck) == (6, 6, 0)
    assert found.higher_order is None
    assert found.counterexample is None


def test_a_start_is_not_live_because_it_is_private() -> None:
    """Two end in one place that holds one: whoever comes second never gets there."""
    ends = [Robot(RobotId(r), (StateId(f"p{r}"), StateId("e")), closed=False) for r in ("r1", "r2")]
    found = explore(System(ends), make_gate("collision", System(ends)))
    assert (found.configurations, found.live, found.deadlocks, found.stuck) == (3, 0, 0, 2)
    assert found.higher_order == {"unordered": 3}


def test_counterexample_of_a_bad_start_has_no_moves() -> None:
    """If the start is not live, nothing has to be admitted for it."""
    system = instance("fig2b")
    found = explore(system, make_gate("banker", system), counterexample=True)
    assert found.counterexample == Counterexample("unsafe", (), tuple(map(StateId, ("s1", "s3", "s4", "s5"))))
    assert found.unsafe_admitted == 0


def test_limit() -> None:
    """More configurations than allowed: a clear error."""
    system = instance("fig8")
    with pytest.raises(ExplorationLimitError, match="more than 100 configurations"):
        explore(system, make_gate("collision", system), limit=100)
