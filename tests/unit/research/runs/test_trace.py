"""Traces say why a robot waits, in queues too."""

from __future__ import annotations

import pytest

from loopgate.errors import IllegalMoveError
from loopgate.gates import Reason, make_gate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.runs import run_rounds, trace_moves
from loopgate.research.runs.montecarlo import wilson_interval
from loopgate.research.theory.instances import instance


def queue() -> System:
    """r1 and r2 in the queue q, r1 first; r3 in t."""
    q, t, p = StateId("q"), StateId("t"), StateId("p")
    robots = [Robot(RobotId("r1"), (q, t)), Robot(RobotId("r2"), (q, t)), Robot(RobotId("r3"), (t, p))]
    return System(robots, {q: 2}, [q])


def test_behind_and_occupied() -> None:
    """r2 stands behind r1, whose next state is taken by r3."""
    system = queue()
    (step,) = trace_moves(system, make_gate("collision", system), [])
    assert step.admitted == ("r3",)
    assert step.refused[RobotId("r1")].reason is Reason.OCCUPIED
    assert step.refused[RobotId("r1")].detail == "t is taken by r3"
    assert step.refused[RobotId("r2")].reason is Reason.BEHIND
    assert step.refused[RobotId("r2")].detail == "it stands behind r1"


def test_a_finished_robot_is_neither_admitted_nor_refused() -> None:
    """r1 of Fig. 8 at its end."""
    system = instance("fig8")
    *_, last = trace_moves(system, make_gate("collision", system), [RobotId("r1")] * 4)
    assert "r1" not in last.admitted
    assert "r1" not in last.refused
    with pytest.raises(IllegalMoveError, match="it stays for good"):
        trace_moves(system, make_gate("collision", system), [RobotId("r1")] * 5)


def test_rounds_on_closed_paths_end_after_one_round_each() -> None:
    """Under the gate of the banker all rounds of the five robots live, with one move per state at least."""
    system = instance("unsound_n5")
    found = run_rounds(system, lambda: make_gate("banker", system), rounds=20, seed=1)
    assert found.live == 20
    assert found.transitions["min"] >= sum(len(path) for path in system.paths)


def test_wilson_interval() -> None:
    """Known values: 0 of 10 reaches to 0.2775, 5 of 10 from 0.2366 to 0.7634; no trials say nothing."""
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert wilson_interval(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)
    assert wilson_interval(0, 0) == (0.0, 1.0)
