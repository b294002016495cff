"""The compiled chain rule beside the certified gate, on random walks through small road systems."""

from __future__ import annotations

import random
from typing import Any, cast

import pytest
from books import Books
from numba import njit
from small_roads import (
    Roads,
    commuters,
    figure_eight,
    one_way_grid,
    ring,
    road_system,
    roundabout,
    two_rings,
    two_way_grid,
)

from loopgate.abstraction.itinerary import Leg
from loopgate.drive import chain
from loopgate.drive.codes import NOBODY
from loopgate.drive.step import SETTLE
from loopgate.drive.tables import Tables
from loopgate.errors import SystemModelError, UnsafeStartError
from loopgate.gates import make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.model import System
from loopgate.negotiation.simple import OldestFirst

ROADS = (
    ring(4),
    two_rings(3),
    commuters(3),
    figure_eight(3),
    one_way_grid(),
    two_way_grid(),
    roundabout(3),
    roundabout(4),
)
MOVES = 150


@njit(error_model="numpy")
def closes(i: int, tables: Tables) -> bool:
    """Return whether the move is refused; compiled here, as a part of a step is."""
    return bool(chain.last_of_circle(i, tables) != NOBODY)


def books_of(system: System) -> Books:
    """Return the books for a system whose states lie end to end, with nothing to cross."""
    legs = [
        [Leg(system.states[s], 10.0 * k, 10.0 * k + 9.0) for k, s in enumerate(path)] for path in system.paths
    ]
    return Books(system, legs, make_gate("collision", system), OldestFirst(random.Random(0)))


def walk(system: System, seed: int) -> int:
    """Make random moves, every robot judged by both before each; return how many were refused."""
    gate = make_gate("certified:promise=somebody", system)
    assert isinstance(gate, CertifiedGate)
    assert gate.by_chain_alone
    books = books_of(system)
    at = list(system.initial.positions)
    queues = {s: list(q) for s, q in zip(system.fifo_states, system.initial.queues, strict=True)}
    rng = random.Random(seed)
    refused = 0
    for _ in range(MOVES):
        can = []
        for robot, path in enumerate(system.paths):
            here, there = path[at[robot]], path[(at[robot] + 1) % len(path)]
            if queues[here][0] != robot or len(queues[there]) >= system.room[there]:
                continue
            ours = not closes(robot, books.tables)
            assert ours == gate.decide_here(robot).admitted
            refused += not ours
            if ours:
                can.append(robot)
        robot = rng.choice(can)  # some robot can always move
        path = system.paths[robot]
        books.do(SETTLE, robot, 1)
        books.run["answers"] = 0
        books.left(robot, path[at[robot]])
        gate.moved_here(robot)
        queues[path[at[robot]]].remove(robot)
        at[robot] = (at[robot] + 1) % len(path)
        queues[path[at[robot]]].append(robot)
    return refused


@pytest.mark.parametrize("roads", ROADS, ids=lambda roads: roads.name)
def test_the_compiled_chain_rule_is_the_gates(roads: Roads) -> None:
    """Every decision of long walks, from few vehicles to as many as the gate takes; some are refused."""
    refused = 0
    for capacity in (2, 3):
        for vehicles in range(2, capacity * len(roads.places)):
            for seed in range(4):
                try:
                    system = road_system(roads, vehicles, capacity, seed=seed)
                    make_gate("certified:promise=somebody", system)
                except (SystemModelError, UnsafeStartError):
                    continue
                if not any(system.private):
                    refused += walk(system, seed)
    assert refused or len(roads.loops) == 1


def test_one_place_that_holds_one_is_left_to_the_gate() -> None:
    """There the exact stage has a say."""
    system = road_system(ring(4), 3, lambda place: 1 if place == "p0" else 2)
    gate = cast("Any", make_gate("certified", system))
    assert not gate.by_chain_alone
