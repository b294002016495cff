"""The exact search stops when its nodes or its time are used up, and says so."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from contextlib import suppress

import pytest

from loopgate.errors import GateError, UnsafeStartError
from loopgate.gates import Reason, make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.exploration import Exploration
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.gates.certified.homes import Homes
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.search import Budget, BudgetError
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.theory.random_systems import any_system


class Ticking:
    """A clock that goes on by `tick_s` each time it is read."""

    def __init__(self, tick_s: float) -> None:
        self.tick_s, self.reads = tick_s, 0

    def __call__(self) -> float:
        """Return the time [s]."""
        self.reads += 1
        return self.reads * self.tick_s


def _drive(gate: CertifiedGate, system: System) -> Counter[tuple[str, bool, Reason]]:
    """Drive at random; return how the requests were answered."""
    rng, here = random.Random(1), system.initial
    answers: Counter[tuple[str, bool, Reason]] = Counter()
    for _ in range(60):
        decisions = [gate.decide(here, i) for i in range(len(system.robots))]
        answers.update((d.stage, d.admitted, d.reason) for d in decisions)
        admitted = [i for i, d in enumerate(decisions) if d.admitted]
        assert admitted, "the witness can always be followed, whatever the budget"
        robot = rng.choice(admitted)
        here = system.moved(here, robot)
        gate.moved(here, robot)
    return answers


def _stages(answers: Counter[tuple[str, bool, Reason]]) -> set[str]:
    return {stage for stage, _, _ in answers}


def _sharing_all(*starts: int) -> System:
    """Robots without homes on a ring of four states."""
    path = tuple(StateId(s) for s in "abcd")
    return System(Robot(RobotId(f"r{i}"), path, start=start) for i, start in enumerate(starts))


def _one_narrow_place() -> System:
    """Seven robots without homes on a ring of eight places, which hold two but for one that holds one."""
    path = tuple(StateId(s) for s in "abcdefgh")
    robots = [Robot(RobotId(f"r{i}"), path, start=i) for i in range(7)]
    return System(robots, dict.fromkeys(path[:7], 2), path)


def test_a_search_out_of_time_is_refused_for_want_of_budget() -> None:
    """Each reading of the clock takes longer than the budget: no search ends, none is decided otherwise."""
    system, clock = any_system(4), Ticking(0.006)
    gate = CertifiedGate(system, budget_ms=5)
    gate.use_clock(clock)
    answers = _drive(gate, system)
    assert answers["budget", False, Reason.BUDGET] > 0
    assert not any(admitted and stage == "search" for stage, admitted, _ in answers)
    assert clock.reads > 0


@pytest.mark.parametrize(
    ("budget_ms", "clock"),
    [(0, Ticking(100.0)), (5, None), (5, Ticking(1e-6))],
    ids=["no limit", "no clock", "in time"],
)
def test_in_time_the_search_decides(budget_ms: float, clock: Callable[[], float] | None) -> None:
    """The same drive, decided by searching; without a limit the clock is not even read."""
    system = any_system(4)
    gate = CertifiedGate(system, budget_ms=budget_ms)
    if clock is not None:
        gate.use_clock(clock)
    stages = _stages(_drive(gate, system))
    assert "search" in stages
    assert "budget" not in stages
    if not budget_ms:
        assert isinstance(clock, Ticking)
        assert clock.reads == 0


@pytest.mark.parametrize(("tick_s", "stage"), [(0.006, "budget"), (1e-6, "search")])
def test_robots_without_homes_have_the_same_budget(tick_s: float, stage: str) -> None:
    """`Exploration` stops as well, where it has to look at configurations that the start does not lead to."""
    system, elsewhere = _sharing_all(0, 1, 2), _sharing_all(0, 2, 1).initial
    rounds = Exploration(SystemIndex(system), Budget(1000, 0.005, Ticking(tick_s)))
    layout = SystemIndex(system)
    assert rounds.begin(system.initial, Occupancy.of(layout, system.initial)), "a start has no limit of time"
    decision = rounds.judge(elsewhere, Occupancy.of(layout, elsewhere), 1)
    assert (decision.stage, decision.admitted) == (stage, stage == "search")
    assert decision.reason is (Reason.BUDGET if stage == "budget" else Reason.FREE)


def test_steering_says_so_too_when_it_is_out_of_budget() -> None:
    """While a robot is worked towards, a move whose effect cannot be looked at in time is no mere waiting."""
    system, elsewhere = _sharing_all(0, 1, 2), _sharing_all(0, 2, 1).initial
    rounds = Exploration(SystemIndex(system), Budget(1000, 0.005, Ticking(0.006)))
    layout = SystemIndex(system)
    assert rounds.begin(system.initial, Occupancy.of(layout, system.initial))
    rounds.favour(system.initial, Occupancy.of(layout, system.initial), 2)
    assert rounds.judge(elsewhere, Occupancy.of(layout, elsewhere), 1).reason is Reason.BUDGET


def test_the_deadline_is_a_moment_of_the_clock() -> None:
    """The last node in time is looked at, the first one late is not; so are nodes."""
    now = [10.0]
    budget = Budget(3, 0.5, lambda: now[0])
    deadline = budget.deadline_s()
    assert deadline == pytest.approx(10.5)
    now[0] = 10.49
    budget.check(3, deadline)
    with pytest.raises(BudgetError):
        budget.check(4, deadline)
    now[0] = 10.5
    with pytest.raises(BudgetError):
        budget.check(1, deadline)


def test_gates_by_name_get_the_callers_clock() -> None:
    """``name:budget_ms=...`` with a clock."""
    system, clock = any_system(4), Ticking(0.006)
    gate = make_gate("certified:budget_ms=5.5", system, clock)
    assert isinstance(gate, CertifiedGate)
    assert "budget" in _stages(_drive(gate, system))


@pytest.mark.parametrize("wrong", [-1, "soon", True, float("nan"), float("inf")])
def test_a_time_that_is_none_is_refused(wrong: object) -> None:
    """The error names the option."""
    with pytest.raises(GateError, match="budget_ms is"):
        CertifiedGate(any_system(4), budget_ms=wrong)  # type: ignore[arg-type]  # that is the point


def _led_elsewhere(system: System, budget: int) -> Counter[Reason]:
    """Ask about safe moves in configurations that the gate did not lead to; return why it refuses them."""
    gate = CertifiedGate(system, promise="everyone", budget=50_000)
    hurried = CertifiedGate(system, promise="everyone", budget=50_000)
    hurried._budget.nodes = budget
    here, rng, found = system.initial, random.Random(1), Counter[Reason]()
    for _ in range(30):
        safe = [i for i in range(len(system.robots)) if gate.decide(here, i).admitted]
        found.update(d.reason for i in safe if not (d := hurried.decide(here, i)).admitted)
        if not safe:
            break
        here = system.moved(here, rng.choice(safe))
    return found


def test_a_new_beginning_out_of_budget_is_no_deadlock() -> None:
    """Led elsewhere, a gate that finds no way on in time says that, and does not call it a deadlock."""
    found: Counter[Reason] = Counter()
    for seed in range(4, 24):
        with suppress(UnsafeStartError):
            found += _led_elsewhere(any_system(seed), 0)
    assert found[Reason.BUDGET] > 0
    assert found[Reason.DEADLOCK] == 0


def test_neither_is_one_of_robots_without_homes() -> None:
    """The same for `Exploration`: it has looked at nothing yet."""
    system, elsewhere = _sharing_all(0, 1, 2), _sharing_all(0, 2, 1).initial
    rounds = Exploration(SystemIndex(system), Budget(1))
    with pytest.raises(BudgetError):
        rounds.begin(elsewhere, Occupancy.of(SystemIndex(system), elsewhere))
    assert rounds.judge(elsewhere, Occupancy.of(SystemIndex(system), elsewhere), 1).reason is Reason.BUDGET


@pytest.mark.parametrize("keeper", [Homes, Exploration, FreeSlots])
def test_a_rejected_witness_is_called_a_fault(
    monkeypatch: pytest.MonkeyPatch, keeper: type[Homes | Exploration | FreeSlots]
) -> None:
    """It is ours, and must not look like a budget that ran out, nor like a start that is not live."""
    system = {
        Homes: any_system(4),
        Exploration: _sharing_all(0, 1, 2),
        FreeSlots: _one_narrow_place(),
    }[keeper]
    gate = CertifiedGate(system, promise="auto")
    assert type(gate._proof) is keeper
    for method in ("brings_home", "brings_round", "leaves_room"):
        monkeypatch.setattr(Checker, method, lambda *_: False)
    decisions = [gate.decide(system.initial, i) for i in range(len(system.robots))]
    assert {d.reason for d in decisions if d.stage == "checker"} == {Reason.FAULT}
    with pytest.raises(GateError, match="fault of loopgate") as error:
        CertifiedGate(system, promise="auto")
    assert not isinstance(error.value, UnsafeStartError)
