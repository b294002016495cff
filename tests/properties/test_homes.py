"""Homes and liveness are one: the statement of docs/proofs/Homes.v, held against the program."""

from __future__ import annotations

import random
from collections import Counter

from loopgate.errors import SystemModelError
from loopgate.gates.deadlocks import homes_decide_liveness
from loopgate.model import Configuration, Robot, System
from loopgate.research.state_space.space import StateSpace
from loopgate.research.theory.homing import Homing
from loopgate.research.theory.random_systems import Shape, random_system

SYSTEMS = range(400)
MOST = 1_500
"""Systems with more configurations are not looked at."""


def draw(seed: int) -> System | None:
    """Draw robots on closed paths among others on open ones, in states of every kind; None if none fit."""
    rng = random.Random(seed)
    shape = Shape(
        robots=rng.randint(2, 4),
        states=rng.randint(2, 4),
        path=(2, 3),
        private=rng.choice([0, 1, 1, 2]),
        capacity=rng.choice([(1, 1), (1, 2), (2, 3)]),
        fifo=rng.choice([0.0, 0.5, 1.0]),
        proposition1=False,
    )
    try:
        system = random_system(shape, seed)
    except SystemModelError:
        return None
    share = rng.choice([0.0, 0.3, 0.6])
    robots = [Robot(r.id, r.path, closed=rng.random() >= share, start=r.start) for r in system.robots]
    return System(robots, system.capacity, system.fifo)


def reach(system: System) -> dict[Configuration, list[tuple[int, Configuration]]]:
    """Return all configurations that can be reached, each with who can move and what that makes of it."""
    found: dict[Configuration, list[tuple[int, Configuration]]] = {system.initial: []}
    todo = [system.initial]
    while todo and len(found) <= MOST:
        here = todo.pop()
        robots = range(len(system.robots))
        found[here] = [(i, system.moved(here, i)) for i in robots if system.enabled(here, i)]
        for _, there in found[here]:
            if there not in found:
                found[there] = []
                todo.append(there)
    return found


def live(system: System, moves: dict[Configuration, list[tuple[int, Configuration]]]) -> set[Configuration]:
    """Return the largest set from each of which whoever is not at its end can move, and back into the set."""
    before: dict[Configuration, list[Configuration]] = {here: [] for here in moves}
    for here, ways in moves.items():
        for _, there in ways:
            before[there].append(here)

    def leading_to(goal: set[Configuration]) -> set[Configuration]:
        found, todo = set(goal), list(goal)
        while todo:
            for here in before[todo.pop()]:
                if here not in found:
                    found.add(here)
                    todo.append(here)
        return found

    kept = set(moves)
    while True:
        back = leading_to(kept)
        left = kept
        for robot in range(len(system.robots)):
            first = {here for here, ways in moves.items() if any(i == robot and to in back for i, to in ways)}
            moving = leading_to(first)
            left = {here for here in left if here in moving or system.finished(here, robot)}
        if left == kept:
            return kept
        kept = left


def compare() -> Counter[str]:
    """Count where the program and the statement agree, and on what kinds of systems."""
    found: Counter[str] = Counter()
    for seed in SYSTEMS:
        system = draw(seed)
        if system is None or not homes_decide_liveness(system):
            continue
        moves = reach(system)
        if len(moves) > MOST:
            continue
        kept, homing, space = live(system, moves), Homing(system), StateSpace(system)
        for here in moves:
            found["wrong"] += homing.live(here) != (here in kept)
            found["wrong"] += bool(space.live[space.number(here)]) != (here in kept)
            found["live" if here in kept else "dead"] += 1
        closed = [robot.closed for robot in system.robots]
        found["both kinds of paths"] += len(set(closed)) > 1
        found["in line"] += bool(system.fifo_states)
        found["several in a state"] += max(system.room) > 1
        ends = [path[-1] for path, goes_round in zip(system.paths, closed, strict=True) if not goes_round]
        found["shared ends"] += any(not system.private[end] for end in ends)
    return found


def test_live_is_that_all_can_come_home() -> None:
    """In every configuration of small systems of every kind that the statement speaks of."""
    found = compare()
    assert found["wrong"] == 0
    assert min(found["live"], found["dead"]) > 300
    assert min(found[kind] for kind in ("both kinds of paths", "in line", "several in a state")) > 20
    assert found["shared ends"] > 20
