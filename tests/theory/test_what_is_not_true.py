"""Algorithm 2 fails where docs/studies/paper.md says so; the search finds such systems again."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from loopgate.gates import Reason, make_gate
from loopgate.gates.algorithm2 import Condition, all_circuits, circuits_through, theorem1
from loopgate.model import Configuration, RobotId, System, system_to_dict
from loopgate.research.state_space import explore
from loopgate.research.theory.instances import instance
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.orders import order
from loopgate.research.theory.random_systems import small_system

SCRIPT = Path(__file__).parents[2] / "analysis" / "counterexamples.py"


@pytest.fixture(scope="module")
def study() -> ModuleType:
    spec = importlib.util.spec_from_file_location("counterexamples", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def after(system: System, moves: str) -> Configuration:
    """Make moves that Algorithm 2 admits."""
    gate = make_gate("algorithm2", system)
    here = system.initial
    for name in moves.split():
        robot = system.robot_number(RobotId(name))
        assert gate.decide(here, robot).admitted
        here = system.move(here, robot)
    return here


def test_five_robots_admitted_into_an_inevitable_deadlock() -> None:
    """Before r2's move all can go on; after it nobody can, and only r5 can move at all.

    The circuit of all five is called live since r5's step to s6 leaves no circuit of its walks. But r2's
    longer walk passes s6, so a circuit is left all the same: the order is 2.
    """
    system = instance("unsound_n5")
    before = after(system, "r3 r4 r4 r5 r5 r1 r5")
    assert Oracle(system).live(before)
    doomed = after(system, "r3 r4 r4 r5 r5 r1 r5 r2")
    assert not Oracle(system).live(doomed)
    assert [i for i in range(5) if system.enabled(doomed, i)] == [system.robot_number(RobotId("r5"))]
    assert all(theorem1(system, doomed, circuit).live for circuit in all_circuits(system, doomed))
    (large,) = (circuit for circuit in all_circuits(system, doomed) if len(circuit.walks) == 5)
    assert theorem1(system, doomed, large).condition is Condition.BREAKS_UP
    assert order(system, doomed, large) == 2


@pytest.mark.parametrize(
    ("name", "moves"), [("blocked_n5", "r1 r2 r3 r4 r5"), ("blocked_n6", "r5 r1 r1 r5 r4 r3 r2")]
)
def test_everybody_stopped_though_all_could_go_on(name: str, moves: str) -> None:
    """One robot can move, and its move is safe, but Theorem 1 finds no condition for one of its circuits."""
    system = instance(name)
    here = after(system, moves)
    gate = make_gate("algorithm2", system)
    robots = range(len(system.robots))
    assert Oracle(system).live(here)
    assert not any(gate.decide(here, i).admitted for i in robots)
    (mover,) = (i for i in robots if system.enabled(here, i))
    assert gate.decide(here, mover).reason is Reason.DEADLOCK
    there = system.move(here, mover)
    assert Oracle(system).live(there)
    found = list(circuits_through(system, there, system.state_at(there, mover)))
    assert any(theorem1(system, there, c).condition is Condition.NONE for c in found)
    assert all(order(system, there, c) is None for c in found)


def test_the_certified_gate_does_neither() -> None:
    """On the same systems: nothing unsafe, nobody blocked."""
    for name in ("unsound_n5", "blocked_n5", "blocked_n6"):
        system = instance(name)
        found = explore(system, make_gate("certified", system))
        assert (found.unsafe_admitted, found.stuck) == (0, 0)


def test_more_look_ahead_is_no_cure() -> None:
    """Remark 2 only ever calls more circuits live, so what is admitted wrongly stays admitted."""
    system = instance("unsound_n5")
    for steps in (1, 2, 3):
        found = explore(system, make_gate(f"algorithm2:lookahead={steps}", system))
        assert found.unsafe_admitted >= 1


def test_the_search_finds_them_again(study: ModuleType) -> None:
    """Seeds of the study: a blocked system of five robots, and an unsound one."""
    assert system_to_dict(small_system(16456)) == system_to_dict(instance("blocked_n5"))
    assert study.study(16456)["blocked"] == 1
    assert study.study(6876)["unsafe"] > 0


def test_the_study_counts(study: ModuleType) -> None:
    """Rates and permissiveness from its rows: accepted over safe moves."""
    rows = [study.study(seed) for seed in range(10)]
    table = study.summarise(rows)
    assert table["all"]["systems"] == 10
    assert set(table) == {"all", "4", "5", "6", "7", "8"}
    assert 0.5 < table["all"]["banker_permissiveness"] < table["all"]["algorithm2_permissiveness"] <= 1.0
