"""Exhaustive exploration where the order in queues counts, or robots have no homes: by numbers."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from loopgate.gates import Gate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.open import OpenGate
from loopgate.model import System
from loopgate.theory.deadlocks import homes_decide_liveness
from loopgate.theory.orders import Orders
from loopgate.untimed.exploration import Exploration, Witness
from loopgate.untimed.numbered import Numbered

__all__ = ["Let", "explore_numbered", "let_by"]


class Let:
    """What a gate lets come about, breadth first from the start.

    Attributes
    ----------
    visited
        Numbers of the configurations, in the order in which they are found.
    admitted
        How many moves are admitted in each of them.
    came
        The index of the one from which each was found, and the robot that moved; -1 for the start.
    """

    def __init__(self, start: int) -> None:
        self.visited = [start]
        self.admitted: list[int] = []
        self.came = [(-1, -1)]

    def way(self, index: int) -> list[int]:
        """Return the robots that move on the way to the configuration with that index."""
        robots: list[int] = []
        while self.came[index][0] >= 0:
            index, robot = self.came[index]
            robots.append(robot)
        return robots[::-1]


def let_by(numbered: Numbered, gate: Gate, progress: Callable[[int], None]) -> Let:
    """Ask the gate about every move that is possible in each configuration that it lets come about."""
    moves = numbered.moves
    asks = not isinstance(gate, (OpenGate, CollisionGate))
    let = Let(0)
    seen = np.zeros(moves.count, np.bool_)
    seen[0] = True
    index = 0
    while index < len(let.visited):
        number = let.visited[index]
        begin, end = int(moves.first[number]), int(moves.first[number + 1])
        here = numbered.configuration(number) if asks else None
        admitted = 0
        for robot, there in zip(
            moves.movers[begin:end].tolist(), moves.targets[begin:end].tolist(), strict=True
        ):
            if here is not None and not gate.decide(here, robot).admitted:
                continue
            admitted += 1
            if not seen[there]:
                seen[there] = True
                let.visited.append(there)
                let.came.append((index, robot))
        let.admitted.append(admitted)
        index += 1
        progress(len(let.visited))
    return let


def explore_numbered(
    system: System,
    gate: Gate,
    *,
    witness: bool = False,
    memory_gb: float = 4.0,
    progress: Callable[[int], None] = lambda _: None,
) -> Exploration:
    """Explore as `loopgate.untimed.explore_plainly` does, but fast; `why_not_numbered` must be empty.

    The gate itself is asked, one decision at a time; ``open`` and ``collision`` need not be.

    Raises
    ------
    ExplorationLimitError
        If the memory does not suffice.
    """
    began = time.perf_counter()
    numbered = Numbered(system, memory_gb=memory_gb, progress=progress)
    let = let_by(numbered, gate, progress)
    visited = np.array(let.visited)
    admitted = np.array(let.admitted)
    live, locked = numbered.live[visited], numbered.locked[visited]
    everybody = np.uint64((1 << len(system.robots)) - 1)
    stuck = (admitted == 0) & (numbered.moves.resting[visited] != everybody)
    found: Witness | None = None
    bad = np.flatnonzero(stuck | ~live)
    if witness and len(bad):
        index = int(bad[0])
        names = tuple(system.robots[i].id for i in let.way(index))
        where = system.describe(numbered.configuration(let.visited[index]))
        found = Witness("stuck" if live[index] else "unsafe", names, where)
    return Exploration(
        configurations=len(visited),
        transitions=int(admitted.sum()),
        live=int(live.sum()),
        deadlocks=int(locked.sum()),
        higher_order=_orders(numbered, visited[~live & ~locked]) if homes_decide_liveness(system) else None,
        stuck=int(stuck.sum()),
        unsafe_admitted=int((~live[1:]).sum()),
        seconds=time.perf_counter() - began,
        witness=found,
    )


def _orders(numbered: Numbered, dead: NDArray[np.int64]) -> dict[str, int]:
    """Count dead configurations without a circular wait by their order."""
    orders = Orders(numbered.words.system)
    found: dict[str, int] = {}
    for number in dead.tolist():
        order = orders.of_configuration(numbered.configuration(number))
        key = "unordered" if order is None else str(order)
        found[key] = found.get(key, 0) + 1
    return dict(sorted(found.items()))
