"""The certified gate against the exact oracle: every decision in every configuration of random walks."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loopgate.errors import GateError, SystemModelError
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.deadlocks import deadlocked_robots
from loopgate.model import System
from loopgate.research.theory.oracle import Oracle, OracleLimitError
from loopgate.research.theory.random_systems import Shape, random_system

_STEPS = 40


def shapes() -> st.SearchStrategy[Shape]:
    """Small systems of every kind: with and without private states, capacities, FIFO, open paths."""
    return st.builds(
        Shape,
        robots=st.integers(3, 5),
        states=st.integers(3, 9),
        path=st.tuples(st.just(2), st.integers(2, 4)),
        private=st.integers(0, 2),
        capacity=st.sampled_from([(1, 1), (1, 2), (1, 3), (2, 3)]),
        fifo=st.sampled_from([0.0, 0.5, 1.0]),
        closed=st.booleans(),
        proposition1=st.booleans(),
    )


def _walk_agrees(system: System, seed: int) -> None:
    """Walk at random where the gate lets us; its every answer is the oracle's."""
    oracle = Oracle(system, limit=20_000)
    here = system.initial
    robots = range(len(system.robots))
    if not oracle.live(here):
        with pytest.raises(GateError, match=r"not live|for ever"):
            CertifiedGate(system, promise="everyone", budget=100_000)
        return
    gate = CertifiedGate(system, promise="everyone", budget=100_000)
    rng = random.Random(seed)
    for _ in range(_STEPS):
        enabled = [i for i in robots if system.enabled(here, i)]
        admitted = [i for i in robots if gate.decide(here, i).admitted]
        assert admitted == [i for i in enabled if oracle.safe(here, i)]
        assert admitted or all(system.finished(here, i) for i in robots)
        if not admitted:
            return
        robot = rng.choice(admitted)
        here = system.moved(here, robot)
        gate.moved(here, robot)


@given(shape=shapes(), seed=st.integers(0, 2**32))
def test_admits_exactly_the_safe_moves(shape: Shape, seed: int) -> None:
    """No unsafe move is admitted, no safe one refused, and a live configuration always goes on."""
    try:
        system = random_system(shape, seed)
        _walk_agrees(system, seed)
    except (SystemModelError, OracleLimitError):
        return


@given(seed=st.integers(0, 10**6))
@settings(max_examples=60)
def test_flow_never_blocks_everyone(seed: int) -> None:
    """Where robots share whole rings of places, somebody may always move."""
    rng = random.Random(seed)
    shape = Shape(
        robots=rng.randint(3, 6),
        states=rng.randint(3, 6),
        path=(2, 4),
        private=0,
        capacity=rng.choice([(1, 3), (2, 2), (2, 3)]),
        fifo=rng.choice([0.0, 0.7, 1.0]),
        proposition1=False,
    )
    try:
        system = random_system(shape, seed)
        gate = CertifiedGate(system, promise="somebody")
    except (GateError, SystemModelError):
        return
    seen, todo = {system.initial}, [system.initial]
    while todo and len(seen) < 1500:
        here = todo.pop()
        admitted = [i for i in range(len(system.robots)) if gate.decide(here, i).admitted]
        assert admitted
        for robot in admitted:
            there = system.move(here, robot)
            if there not in seen:
                seen.add(there)
                todo.append(there)


@pytest.mark.parametrize("fifo", [0.0, 0.5, 1.0])
def test_the_chain_rule_is_exact_where_all_places_are_wide(fifo: float) -> None:
    """With two slots or more everywhere, a move is refused iff it closes a circular wait."""
    refused = 0
    for seed in range(60):
        shape = Shape(6, 5, path=(2, 4), private=0, capacity=(2, 3), fifo=fifo, proposition1=False)
        try:
            system = random_system(shape, seed)
            gate = CertifiedGate(system, promise="somebody")
        except (GateError, SystemModelError):
            continue
        rng, here = random.Random(seed), system.initial
        for _ in range(_STEPS):
            enabled = [i for i in range(6) if system.enabled(here, i)]
            safe = [i for i in enabled if not deadlocked_robots(system, system.moved(here, i))]
            assert [i for i in enabled if gate.decide(here, i).admitted] == safe
            refused += len(enabled) - len(safe)
            robot = rng.choice(safe)
            here = system.moved(here, robot)
            gate.moved(here, robot)
    assert refused > 0
