"""A robot that waits too long is worked towards; without that, admitting all that is safe starves it."""

from __future__ import annotations

import pytest

from builders import system
from loopgate.errors import GateError, SystemModelError
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.gate import MovePatience
from loopgate.gates.certified.homes import Homes
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.theory.random_systems import Shape, random_system

_PATHS = {
    "r1": ("s0", "p1", "s3", "s2"),
    "r2": ("p2", "s2", "s3", "s1"),
    "r3": ("p3", "s2", "s4"),
    "r4": ("s0", "s2", "s3", "p4"),
}


def _starving() -> System:
    """Four robots: r1 may only go out when the others' states are clear, and oldest first never has that."""
    return System(
        Robot(RobotId(name), tuple(StateId(s) for s in path), start=path.index(f"p{name[1]}"))
        for name, path in _PATHS.items()
    )


def _longest_wait(system: System, gate: CertifiedGate, moves: int) -> list[int]:
    """Let the admissible robot move that moved longest ago; return each robot's longest wait in moves."""
    robots = range(len(system.robots))
    here, last, longest = system.initial, [0 for _ in robots], [0 for _ in robots]
    for now in range(1, moves + 1):
        robot = next(i for i in sorted(robots, key=lambda i: last[i]) if gate.decide(here, i).admitted)
        here = system.move(here, robot)
        gate.moved(here, robot)
        longest[robot] = max(longest[robot], now - last[robot])
        last[robot] = now
    return [max(wait, moves - then) for wait, then in zip(longest, last, strict=True)]


def test_plain_permissiveness_starves_a_robot() -> None:
    """Oldest first among all safe moves: r1 stands for ever while the others drive."""
    system = _starving()
    waits = _longest_wait(system, CertifiedGate(system, patience=0), 2000)
    assert waits[0] > 1900
    assert max(waits[1:]) < 50


@pytest.mark.parametrize("patience", [2, 10, 50])
def test_steering_ends_every_wait(patience: int) -> None:
    """With patience p and four robots nobody waits much longer than 4 p moves."""
    system = _starving()
    waits = _longest_wait(system, CertifiedGate(system, patience=patience), 2000)
    assert max(waits) < 4 * patience + 20


@pytest.mark.parametrize("private", [0, 1])
def test_nobody_waits_for_ever(private: int) -> None:
    """With homes and without, whatever the system: oldest first, everybody moves again."""
    checked = 0
    for seed in range(150):
        shape = Shape(robots=4, states=5 if private else 9, path=(3, 5), private=private)
        try:
            system = random_system(shape, seed)
            gate = CertifiedGate(system, promise="everyone", patience=5)
        except (SystemModelError, GateError):
            continue
        checked += 1
        assert max(_longest_wait(system, gate, 300)) < 150
    assert checked > 20


def test_a_favoured_robot_that_drives_from_home_to_home_leaves_a_witness_behind() -> None:
    """While it is favoured the witness speaks of its next move, which has to go when it is made."""
    robots = system({"f": "p1 p2 c", "g": "p3 c"})
    gate = CertifiedGate(robots)
    keeper = gate._proof
    assert isinstance(keeper, Homes)
    keeper.favour(robots.initial, gate._stand, 0)
    assert keeper.witness == [0]
    assert gate.decide_here(0).admitted
    gate.moved_here(0)
    assert keeper.witness is not None
    assert Checker(robots).brings_home(gate._here(), keeper.witness, keeper.layout.home)


def test_patience_favours_the_oldest_until_it_moves() -> None:
    """Counted in moves: of two robots with patience 2, the second is favoured after five of the first."""
    patience = MovePatience(2, 2)
    changes = [patience.moved(0, for_good=False) for _ in range(5)]
    assert changes == [False, False, False, False, True]
    assert patience.favoured == 1
    assert patience.moved(1, for_good=False)
    assert patience.favoured == -1


def test_patience_gives_up_on_a_robot_that_does_not_come() -> None:
    """A robot that is broken down is favoured for as long as it had waited, and then its turn is over."""
    patience = MovePatience(3, 1)
    seen = []
    for move in range(30):
        patience.moved(move % 2, for_good=False)
        seen.append(patience.favoured)
    assert 2 in seen
    assert seen[-1] in {-1, 2}
    assert seen.count(-1) > 5
