"""Section 5 of Zhou et al. 2020: the printed evolution, step by step."""

from __future__ import annotations

from loopgate.gates import Reason, make_gate
from loopgate.model import RobotId
from loopgate.research.theory.instances import instance

MOVES = [
    "r3",
    "r7",
    "r5",
    "r6",
    "r2",
    "r2",
    "r8",
    "r6",
    "r8",
    "r6",
    "r4",
    "r7",
    "r6",
    "r4",
    "r1",
    "r5",
    "r3",
    "r7",
    "r5",
    "r3",
    "r1",
    "r3",
    "r1",
    "r1",
    "r3",
    "r1",
    "r1",
]

ADMITTED = {
    0: ["r3", "r5", "r6", "r7", "r8"],
    1: ["r2", "r5", "r6", "r7", "r8"],
    2: ["r2", "r5", "r6", "r8"],
}
"""Robots that may move before the moves of that number, where the text names them."""

CONFIGURATIONS = {
    0: "s1 s6 s7 s10 s11 s12 s13 s14",
    1: "s1 s6 s5 s10 s11 s12 s13 s14",
    2: "s1 s6 s5 s10 s11 s12 s3 s14",
    6: "s1 s2_0 s5 s10 s9 s8 s3 s14",
    10: "s1 s2_0 s5 s10 s9 s13 s3 s8_0",
}
"""c0, c1, c2, c5 and c6, by the number of moves before them; the others are not printed whole."""


def test_printed_evolution_is_admitted_move_by_move() -> None:
    """All 27 moves, with the admissible sets and configurations that the text states."""
    system = instance("fig10")
    gate = make_gate("algorithm2", system)
    here = system.initial
    for step, name in enumerate(MOVES):
        if step in CONFIGURATIONS:
            assert " ".join(system.describe(here)) == CONFIGURATIONS[step]
        admitted = [r.id for i, r in enumerate(system.robots) if gate.decide(here, i).admitted]
        if step in ADMITTED:
            assert admitted == ADMITTED[step]
        assert name in admitted
        robot = system.robot_number(RobotId(name))
        here = system.move(here, robot)
        gate.moved(here, robot)
    assert len(MOVES) == 27
    assert all(system.finished(here, i) for i in range(len(system.robots)))


def test_first_refusals_are_the_printed_ones() -> None:
    """R1 would cause a fifth-order deadlock with all others; r2 and r4 find their next states occupied."""
    system = instance("fig10")
    gate = make_gate("algorithm2", system)
    first = gate.decide(system.initial, 0)
    assert first.reason is Reason.DEADLOCK
    assert set(first.blockers) == set(range(1, 8))
    assert first.detail.startswith("order-5 deadlock")
    assert gate.decide(system.initial, 1).reason is Reason.OCCUPIED
    assert gate.decide(system.initial, 3).reason is Reason.OCCUPIED
