"""The tests of the certified gate can fail: each stage is broken on purpose, and each time they notice.

A fault is put into the source of one function, whose code is then exchanged while the test runs. Without a
fault the same checks pass.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest
from breaking import break_it
from everyone import WRONG, draw, narrow_system, wide_system

from loopgate.errors import GateError, IllegalMoveError, SystemModelError
from loopgate.gates import Decision
from loopgate.gates.certified import CertifiedGate, deadlock
from loopgate.gates.certified.banker import _harmless, fixpoint
from loopgate.gates.certified.chain import follow, next_mover
from loopgate.gates.certified.chain_rule import ChainRule
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.crowding import _Net, find_crowd, refuse_crowds
from loopgate.gates.certified.exploration import _components
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.gates.certified.homes import Homes
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.patience import Patience
from loopgate.gates.certified.search import Search
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.gates.deadlocks import deadlocked_robots, homes_decide_liveness
from loopgate.model import Configuration, Robot, StateId, System
from loopgate.research.theory.homing import Homing
from loopgate.research.theory.instances import fig7, instance
from loopgate.research.theory.oracle import Oracle, OracleLimitError
from loopgate.research.theory.random_systems import Shape, any_system, random_system

_STEPS = 25


def _from_home(system: System) -> System:
    """Let every robot begin in a state of its own, one before where it began."""
    return System(
        Robot(robot.id, (StateId(f"{robot.id}_start"), *robot.path), closed=False) for robot in system.robots
    )


_DEEP = (instance("unsound_n5"), instance("blocked_n6"), _from_home(fig7(5)), _from_home(fig7(6)))
"""Systems with deadlocks that no look ahead of one move sees."""


def _agrees(system: System, seed: int, promise: str) -> bool:
    """Walk where the gate lets us; its answers are exact, or (``somebody``) nobody ever waits in a circle."""
    judge = Homing(system) if homes_decide_liveness(system) else Oracle(system, limit=3_000)
    try:
        live = judge.live(system.initial)
        gate = CertifiedGate(system, promise=promise, budget=20_000, patience=0)
    except OracleLimitError:
        return True
    except GateError:
        return promise == "somebody" or not live
    rng, here, robots = random.Random(seed), system.initial, range(len(system.robots))
    right = promise == "somebody" or live
    for _ in range(_STEPS):
        decisions = [gate.decide(here, i) for i in robots]
        right = right and all(_right(system, gate, judge, here, i, decisions[i]) for i in robots)
        admitted = [i for i in robots if decisions[i].admitted]
        if not right or not admitted:
            return right and all(system.finished(here, i) for i in robots)
        robot = rng.choice(admitted)
        here = system.moved(here, robot)
        gate.moved(here, robot)
    return right


def _right(
    system: System,
    gate: CertifiedGate,
    judge: Homing | Oracle,
    here: Configuration,
    robot: int,
    decision: Decision,
) -> bool:
    if not system.enabled(here, robot):
        return not decision.admitted
    there = system.moved(here, robot)
    circle = bool(deadlocked_robots(system, there))
    if gate.promise == "somebody":
        return not (decision.admitted and circle)
    by_the_cycle_test = decision.stage == "cycle" or not isinstance(gate._keeper, Homes)
    return decision.admitted == judge.live(there) and (by_the_cycle_test or not circle)


def _all_pass() -> bool:
    """Run the checks on systems of every kind; an exception counts as a failure."""
    try:
        for seed in range(6):
            for system in _DEEP:
                if not _agrees(system, seed, "everyone"):
                    return False
        for seed in range(110):
            if not _agrees(any_system(seed, robots=(3, 6)), seed, "everyone"):
                return False
        for seed in range(110):
            shape = Shape(
                robots=5,
                states=4,
                path=(2, 4),
                private=0,
                capacity=(1, 3) if seed % 2 else (2, 2),
                fifo=(0.0, 0.6, 1.0)[seed % 3],
                proposition1=False,
            )
            with suppress(SystemModelError):  # where the robots do not fit in
                if not _agrees(random_system(shape, seed), seed, "somebody"):
                    return False
    except (IndexError, KeyError, ValueError, RecursionError, UnboundLocalError):
        return False
    return True


def test_unbroken_all_pass() -> None:
    """Without a fault every check passes."""
    assert _all_pass()


@pytest.mark.parametrize(
    ("function", "old", "new"),
    [
        pytest.param(Homes._accepts, "return self._checker", "return True or self._checker", id="no checker"),
        pytest.param(
            Checker._play,
            "inside[entered] >= room[entered]",
            "inside[entered] > room[entered]",
            id="checker off by one",
        ),
        pytest.param(
            fixpoint, "if count[s] >= through[s]:", "if count[s] > through[s]:", id="fixpoint off by one"
        ),
        pytest.param(fixpoint, "k = steps[i][p]", "k = steps[i][p] - 1", id="fixpoint one move short"),
        pytest.param(fixpoint, "line[0] != i", "line[0] == -1", id="fixpoint jumps the queue"),
        pytest.param(_harmless, "need[s] == 1", "need[s] == 2", id="in the way of another"),
        pytest.param(
            deadlock.stuck_for_good,
            "return [i for i in sorted(among - free) if stand.wanted(i) >= 0]",
            "return []",
            id="no cycle test",
        ),
        pytest.param(
            deadlock.stuck_for_good,
            "todo += waiting.pop(stand.state(i), [])",
            "waiting.pop(stand.state(i), [])",
            id="cycle test too eager",
        ),
        pytest.param(Search._branch, "for i in part:", "for i in part[:1]:", id="search tries one robot"),
        pytest.param(Homes._take_over, "self._found_for(robot)", "self.witness", id="witness not kept up"),
        pytest.param(
            _components,
            'connection="strong"',
            'connection="weak"',
            id="components torn apart",
        ),
        pytest.param(SystemIndex._homes, "[self.never_blocks[s] for", "[True for", id="everything is a home"),
        pytest.param(
            SystemIndex._passable,
            "return self.room[state] > others",
            "return True",
            id="blocked ends overlooked",
        ),
        pytest.param(Occupancy.step, "self.count[left] -= 1", "pass", id="states never emptied"),
        pytest.param(ChainRule.closes, "return full.circle()", "return []", id="no chain rule"),
        pytest.param(
            ChainRule._leavers, "for i in line:", "for i in line[::-1]:", id="last instead of first"
        ),
        pytest.param(ChainRule.moved, "self._held[target] += 1", "pass", id="no slots reserved"),
    ],
)
def test_each_fault_is_noticed(
    monkeypatch: pytest.MonkeyPatch, function: Callable[..., Any], old: str, new: str
) -> None:
    """With the fault, some check fails."""
    break_it(monkeypatch, function, old, new)
    assert not _all_pass()


_CROWDED = (34, 503, 526, 529)
"""Seeds of systems without a circle, but with a crowd: not live for everyone all the same."""


def _everyone_goes_on() -> bool:
    """Compare the promise to everyone with what is so, on small roads; everyone is served."""
    try:
        for seed in (*_CROWDED, *range(70)):
            for narrow in (False, True):
                roads = draw(seed, narrow=narrow)
                if not any(roads.start) or (narrow and min(roads.slots) > 1):
                    continue
                with suppress(OverflowError):
                    found = (narrow_system if narrow else wide_system)(roads, seed)
                    if any(found[key] for key in WRONG) or (found["needless"] and not narrow):
                        return False
    except (GateError, IllegalMoveError, KeyError, IndexError, ValueError, RecursionError):
        return False
    return True


def test_unbroken_everyone_goes_on() -> None:
    """Without a fault the comparison passes."""
    assert _everyone_goes_on()


@pytest.mark.parametrize(
    ("function", "old", "new"),
    [
        pytest.param(refuse_crowds, "if crowd is None:", "if crowd:", id="crowds are taken"),
        pytest.param(
            refuse_crowds, "count < most for", "count <= most for", id="a slot free where there is none"
        ),
        pytest.param(find_crowd, "if spare < SPARE:", "if spare < SPARE - 1:", id="one resident too many"),
        pytest.param(
            find_crowd,
            "spare, places = net.least_spare(inside, outside)",
            "spare, places = net.least_spare(inside)",
            id="crossed or not",
        ),
        pytest.param(_Net.tight, "s - 1", "s", id="cuts not looked at"),
        pytest.param(
            next_mover, "chain.places[-1] if chain.places else place", "place", id="service of the first only"
        ),
        pytest.param(next_mover, "circle[-1] if circle else last", "last", id="service closes circles"),
        pytest.param(ChainRule.closes, "return full.circle()", "return []", id="no chain rule"),
        pytest.param(follow, " - (place == entered)", "", id="the slot that it takes overlooked"),
        pytest.param(follow, " + (place == left)", "", id="the slot behind overlooked"),
        pytest.param(FreeSlots._full, "count[s] >= room[s]", "count[s] > room[s]", id="full overlooked"),
    ],
)
def test_each_fault_of_the_promise_to_everyone_is_noticed(
    monkeypatch: pytest.MonkeyPatch, function: Callable[..., Any], old: str, new: str
) -> None:
    """With the fault, somebody is left behind, or refused for nothing."""
    break_it(monkeypatch, function, old, new)
    assert not _everyone_goes_on()


def test_patience_is_covered_elsewhere() -> None:
    """Steering changes who goes first, not what is safe: its own tests are in test_fairness."""
    assert Patience(3, 0).moved(0, for_good=False) is False
