"""Exhaustive exploration, plainly: one dictionary, the gate itself, and the exact oracle."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from loopgate.gates import Gate
from loopgate.model import Configuration, System
from loopgate.theory.deadlocks import deadlocked_robots, homes_decide_liveness
from loopgate.theory.oracle import Oracle
from loopgate.theory.orders import Orders
from loopgate.untimed.exploration import Exploration, Witness

__all__ = ["explore_plainly"]


def explore_plainly(
    system: System,
    gate: Gate,
    *,
    witness: bool = False,
    limit: int = 1_000_000,
    progress: Callable[[int], None] = lambda _: None,
) -> Exploration:
    """Explore all configurations reachable from the start under `gate`, breadth first.

    The oracle of the compiled exploration; use that for anything large. The gate's decisions must depend on
    the configuration alone; `Gate.moved` is not called.

    Raises
    ------
    OracleLimitError
        If more than `limit` configurations are reachable without the gate.
    """
    began = time.perf_counter()
    oracle = Oracle(system, limit=limit)
    came_from: dict[Configuration, tuple[Configuration, int] | None] = {system.initial: None}
    queue = deque([system.initial])
    found: Witness | None = None
    transitions = live = deadlocks = stuck = unsafe = 0
    ordered = homes_decide_liveness(system)
    by_order: dict[str, int] = {}
    orders = Orders(system)
    while queue:
        here = queue.popleft()
        progress(len(came_from))
        admitted = [
            robot
            for robot in range(len(system.robots))
            if system.enabled(here, robot) and gate.decide(here, robot).admitted
        ]
        is_live = oracle.live(here)
        is_stuck = not admitted and not all(system.finished(here, i) for i in range(len(system.robots)))
        live += is_live
        stuck += is_stuck
        unsafe += not is_live and came_from[here] is not None
        if deadlocked_robots(system, here):
            deadlocks += 1
        elif not is_live and ordered:
            found_order = orders.of_configuration(here)
            key = "unordered" if found_order is None else str(found_order)
            by_order[key] = by_order.get(key, 0) + 1
        if witness and found is None and (is_stuck or not is_live):
            found = _witness(system, came_from, here, "stuck" if is_live else "unsafe")
        for robot in admitted:
            there = system.move(here, robot)
            transitions += 1
            if there not in came_from:
                came_from[there] = (here, robot)
                queue.append(there)
    return Exploration(
        configurations=len(came_from),
        transitions=transitions,
        live=live,
        deadlocks=deadlocks,
        higher_order=dict(sorted(by_order.items())) if ordered else None,
        stuck=stuck,
        unsafe_admitted=unsafe,
        seconds=time.perf_counter() - began,
        witness=found,
    )


def _witness(
    system: System,
    came_from: dict[Configuration, tuple[Configuration, int] | None],
    last: Configuration,
    kind: str,
) -> Witness:
    moves: list[int] = []
    step = came_from[last]
    while step is not None:
        moves.append(step[1])
        step = came_from[step[0]]
    names = tuple(system.robots[robot].id for robot in reversed(moves))
    return Witness(kind, names, system.describe(last))
