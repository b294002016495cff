"""The compiled chain rule beside the certified gate, on random walks through small road systems."""

from __future__ import annotations

import random
from types import SimpleNamespace
from typing import Any, cast

import pytest
from numba import njit

from loopgate.abstraction.itinerary import Abstraction, Itinerary, Leg
from loopgate.errors import SystemModelError, UnsafeStartError
from loopgate.gates import make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.model import System
from loopgate.simulation.compiled import count, gatekeeping
from loopgate.simulation.compiled.making import make_books
from loopgate.simulation.compiled.tables import Books, Rider
from loopgate.simulation.fleet import Fleet
from loopgate.drive.rows import table
from loopgate.theory.road_systems import (
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
def closes(i: int, b: Books) -> bool:
    """Return whether the move is refused; compiled here, as a part of a kernel is."""
    return bool(gatekeeping._closes(i, b))


@njit(error_model="numpy")
def go(i: int, state: int, b: Books) -> None:
    """Let the vehicle move, and its rear leave at once."""
    gatekeeping.asks(i, 0.0, b)
    b.pool[count.FRESH] = 0
    gatekeeping._grant(i, b)
    gatekeeping.left(i, state, b)


def books_of(system: System) -> Books:
    """Return the books for a system whose states lie end to end, with nothing to cross."""
    names = [system.states[s] for s in range(len(system.states))]
    ways = tuple(
        Itinerary(
            robot.id,
            10.0 * len(path),
            tuple(Leg(names[s], 10.0 * k, 10.0 * k + 9.0) for k, s in enumerate(path)),
        )
        for robot, path in zip(system.robots, system.paths, strict=True)
    )
    abstraction = Abstraction("queues", system, ways, tuple(0.0 for _ in ways))
    riders = table(Rider, {"legs": [len(path) for path in system.paths]})
    fleet = SimpleNamespace(columns=riders, tables=(riders, riders[:0], riders[:0]))
    return make_books(abstraction, cast("Fleet", fleet), lambda _: 0)


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
            ours = not closes(robot, books)
            assert ours == gate.decide_here(robot).admitted
            refused += not ours
            if ours:
                can.append(robot)
        robot = rng.choice(can)  # some robot can always move
        path = system.paths[robot]
        go(robot, path[at[robot]], books)
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
