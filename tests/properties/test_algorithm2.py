"""The fast search of algorithm2 answers like the plain theory: all circuits, each judged by Theorem 1."""

from __future__ import annotations

import random

import pytest

from loopgate.gates import Reason, make_gate
from loopgate.gates.algorithm2 import Holders, circuits_through, theorem1
from loopgate.model import Configuration, Robot, System
from loopgate.research.theory.random_systems import Shape, dense, random_system, sparse

SHAPES = [
    Shape(robots=3, states=4, path=(2, 4)),
    Shape(robots=5, states=6, path=(3, 5)),
    Shape(robots=6, states=6, path=(3, 6), proposition1=False),
    Shape(robots=7, states=8, path=(3, 6)),
    Shape(robots=6, states=12, path=(4, 7), private=0, proposition1=False),
    Shape(robots=6, states=5, path=(2, 4), capacity=(1, 3), fifo=0.5),
    Shape(robots=8, states=6, path=(2, 4), capacity=(2, 2), fifo=1.0, private=0, proposition1=False),
    Shape(robots=8, states=6, path=(2, 4), capacity=(2, 2), private=0, proposition1=False),
    Shape(robots=6, states=7, path=(3, 5), private=2, closed=False),
    sparse(8),
    dense(12),
]


def plain_answer(system: System, configuration: Configuration, robot: int, lookahead: int) -> bool:
    """Whether all circuits through the state that `robot` enters are live."""
    state = system.next_state(configuration, robot)
    assert state is not None
    after = system.moved(configuration, robot)
    return all(
        theorem1(system, after, circuit, lookahead=lookahead).live
        for circuit in circuits_through(system, after, state)
    )


@pytest.mark.parametrize("lookahead", [1, 3])
@pytest.mark.parametrize("shape", SHAPES)
def test_fast_search_is_the_theory(shape: Shape, lookahead: int) -> None:
    """On every configuration of random runs without avoidance, deadlocks included."""
    refused = 0
    for seed in range(12):
        system = random_system(shape, seed)
        gate = make_gate(f"algorithm2:lookahead={lookahead}", system)
        rng = random.Random(seed)
        here = system.initial
        for _ in range(40):
            enabled = [i for i in range(len(system.robots)) if system.enabled(here, i)]
            if not enabled:
                break
            for robot in enabled:
                decision = gate.decide(here, robot)
                assert decision.admitted == plain_answer(system, here, robot, lookahead), (seed, here, robot)
                refused += decision.reason is Reason.DEADLOCK
            here = system.move(here, rng.choice(enabled))
    assert refused > 0


def blocking(system: System, here: Configuration) -> dict[int, tuple[int, ...]]:
    """Return the states that block and the robots one of which must leave first, by striking out."""
    full: dict[int, tuple[int, ...]] = {}
    for state, count in enumerate(system.occupancy(here)):
        if not system.private[state] and count >= system.room[state]:
            inside = tuple(system.occupants(here, state))
            full[state] = inside[:1] if state in system.fifo_states else inside
    while released := [
        state
        for state, robots in full.items()
        if system.room[state] > 1
        and any(
            after is not None and (system.private[after] or (system.room[after] > 1 and after not in full))
            for after in (system.next_state(here, robot) for robot in robots)
        )
    ]:
        for state in released:
            del full[state]
    return full


@pytest.mark.parametrize("shape", [shape for shape in SHAPES if shape.capacity != (1, 1)])
def test_who_blocks_where_states_hold_several(shape: Shape) -> None:
    """Asked one by one, as by striking out all full states that lead to room."""
    several = 0
    for seed in range(12):
        system = random_system(shape, seed)
        rng, here = random.Random(seed), system.initial
        while enabled := [i for i in range(len(system.robots)) if system.enabled(here, i)]:
            held, expected = Holders(system, here), blocking(system, here)
            states = rng.sample(range(len(system.states)), len(system.states))
            assert {s: held.of(s) for s in states if held.of(s)} == expected
            several += any(system.room[s] > 1 for s in expected)
            here = system.move(here, rng.choice(enabled))
            if rng.random() < 1 / 40:
                break
    assert several > 0


def with_repeats(system: System, rng: random.Random) -> System:
    """Let every robot come back to one of its states once more in a round, not next to itself."""
    robots = []
    for robot in system.robots:
        path = list(robot.path)
        for _ in range(10):
            state = rng.choice(path)
            place = rng.randrange(len(path) + 1)
            if state not in {path[place - 1], path[place % len(path)]}:
                path.insert(place, state)
                break
        robots.append(Robot(robot.id, tuple(path), start=next(k for k, s in enumerate(path) if s[0] == "p")))
    return System(robots)


def test_states_passed_several_times_in_a_round() -> None:
    """Section 6: each visit is a place of its own; fast and plain versions agree."""
    repeated = 0
    for seed in range(40):
        rng = random.Random(seed)
        system = with_repeats(random_system(Shape(robots=5, states=6, path=(3, 5)), seed), rng)
        repeated += any(len(set(path)) < len(path) for path in system.paths)
        gate = make_gate("algorithm2", system)
        here = system.initial
        for _ in range(30):
            enabled = [i for i in range(5) if system.enabled(here, i)]
            if not enabled:
                break
            for robot in enabled:
                admitted = gate.decide(here, robot).admitted
                assert admitted == plain_answer(system, here, robot, 1)
            here = system.move(here, rng.choice(enabled))
    assert repeated > 30
