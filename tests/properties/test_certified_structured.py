"""The certified gate where deadlocks are deep: the Fig. 7 family, hooked circuits, systems bred for depth."""

from __future__ import annotations

import random

import pytest
from structured_systems import deepest, from_home, interlocked, uphill

from loopgate.gates.certified import CertifiedGate
from loopgate.model import System
from loopgate.research.theory.homing import Homing
from loopgate.research.theory.instances import fig7


def _agrees_with_the_search(system: System, seed: int, steps: int) -> tuple[int, int]:
    """Drive as far out as the gate lets us; return refusals, and those that no circular wait explains."""
    gate, judge = CertifiedGate(system, patience=0, budget=100_000), Homing(system)
    rng, here, refused, deep = random.Random(seed), system.initial, 0, 0
    for _ in range(steps):
        admitted = []
        for robot in range(len(system.robots)):
            if not system.enabled(here, robot):
                continue
            decision = gate.decide(here, robot)
            assert decision.stage != "budget"
            if decision.stage == "search" or not decision.admitted:
                assert decision.admitted == judge.live(system.moved(here, robot))
            if decision.admitted:
                admitted.append(robot)
            else:
                refused += 1
                deep += decision.stage == "search"
        if not admitted:
            assert all(system.finished(here, i) for i in range(len(system.robots)))
            break
        away = [i for i in admitted if not system.private[system.state_at(here, i)]]
        out = [i for i in admitted if i not in away]
        robot = rng.choice(out if out and rng.random() < 0.8 else admitted)
        here = system.move(here, robot)
        gate.moved(here, robot)
    return refused, deep


@pytest.mark.parametrize("robots", [4, 5, 6, 8])
def test_fig7_family(robots: int) -> None:
    """Into the family's deadlock of order m - 3 from homes before it, for m up to 8: exact all the way."""
    total = [_agrees_with_the_search(from_home(fig7(robots)), seed, 4 * robots) for seed in range(6)]
    assert sum(deep for _, deep in total) > 0 or robots == 4


@pytest.mark.parametrize("ring", [False, True])
@pytest.mark.parametrize(("circuits", "robots"), [(2, 2), (3, 3), (4, 4)])
def test_hooked_circuits(circuits: int, robots: int, *, ring: bool) -> None:
    """Chains and rings of interlocked circuits."""
    system = interlocked(circuits, robots, ring=ring)
    refused = sum(_agrees_with_the_search(system, seed, 80)[0] for seed in range(4))
    assert refused > 0


@pytest.mark.parametrize("seed", [0, 2, 4, 5, 6, 7])
def test_bred_for_depth(seed: int) -> None:
    """Explored to the end: in systems made ever deeper every decision is the exact one."""
    system, depth = uphill(seed)
    assert depth >= 2
    judge = Homing(system)
    gate = CertifiedGate(system, patience=0, budget=100_000)
    seen, todo = {system.initial}, [system.initial]
    while todo:
        here = todo.pop()
        for robot in range(len(system.robots)):
            if not system.enabled(here, robot):
                continue
            there = system.moved(here, robot)
            admitted = gate.decide(here, robot).admitted
            assert admitted == judge.live(there)
            if admitted and there not in seen:
                seen.add(there)
                todo.append(there)


def test_depth_is_the_way_to_the_nearest_circular_wait() -> None:
    """Fig. 7 with four robots: the deadlock of order one is one move away from a circular wait."""
    assert deepest(from_home(fig7(4))) == 1
    assert deepest(from_home(fig7(5))) >= 1
