"""Exhaustive exploration, fast: packed configurations and compiled loops."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from loopgate.gates import Gate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.open import OpenGate
from loopgate.model import System
from loopgate.theory.orders import Orders
from loopgate.untimed.exploration import Exploration, Witness
from loopgate.untimed.gated import Gated
from loopgate.untimed.kernel_gated import higher_order_keys
from loopgate.untimed.numbered import why_not_numbered
from loopgate.untimed.numbered_exploration import explore_numbered
from loopgate.untimed.packed import Packed, why_not_packed
from loopgate.untimed.plain import explore_plainly
from loopgate.untimed.space import Space
from loopgate.untimed.table import VISITED

__all__ = ["explore"]


def explore(
    system: System,
    gate: Gate,
    *,
    witness: bool = False,
    memory_gb: float = 4.0,
    progress: Callable[[int], None] = lambda _: None,
) -> Exploration:
    """Explore all configurations reachable from the start under `gate`.

    The figures are those of `explore_plainly`. The gates ``open``, ``collision``, ``banker`` and
    ``algorithm2`` are compiled, others asked one decision at a time; either way liveness is found by going
    back from the configurations in which everyone is at home. Where that does not decide it, or several
    robots queue in one state, so that their order counts, the configurations are numbered, and liveness is
    found by their strongly connected components (`loopgate.untimed.numbered`). Only systems whose
    configurations do not fit into a word are explored plainly.

    Parameters
    ----------
    system, gate
        What to explore. The gate's decisions must depend on the configuration alone.
    witness
        Whether to look for a shortest counterexample.
    memory_gb
        The most memory to use [GB].
    progress
        Called now and then with the number of configurations found.

    Raises
    ------
    ExplorationLimitError
        If the memory does not suffice.

    Notes
    -----
    O(robots) table look-ups per configuration that can be reached without the gate; 12 to 24 bytes for each.

    Examples
    --------
    >>> from loopgate import Robot, System, explore, make_gate
    >>> system = System([Robot("a", ("a1", "s1", "s2")), Robot("b", ("b1", "s2", "s1"))])
    >>> explore(system, make_gate("collision", system)).deadlocks
    1
    >>> explore(system, make_gate("certified", system)).deadlocks
    0
    """
    if why_not_packed(system):
        if not why_not_numbered(system):
            return explore_numbered(system, gate, witness=witness, memory_gb=memory_gb, progress=progress)
        limit = max(1000, int(memory_gb * 250_000))  # about 4 kB per configuration as Python objects
        return explore_plainly(system, gate, witness=witness, limit=limit, progress=progress)
    began = time.perf_counter()
    space = Space(system, memory_gb=memory_gb, progress=progress)
    if isinstance(gate, (OpenGate, CollisionGate)) and not witness:
        start_live = space.is_live(system.initial)
        return Exploration(
            configurations=space.count,
            transitions=space.transitions,
            live=space.live,
            deadlocks=space.deadlocks,
            higher_order=_orders(space, np.uint64(0)),
            stuck=space.stuck,
            unsafe_admitted=space.count - space.live - (not start_live),
            seconds=time.perf_counter() - began,
        )
    gated = Gated(space, gate, progress=progress)
    found: Witness | None = gated.explore(witness=witness)
    return Exploration(
        configurations=gated.count,
        transitions=gated.transitions,
        live=gated.live,
        deadlocks=gated.deadlocks,
        higher_order=_orders(space, VISITED),
        stuck=gated.stuck,
        unsafe_admitted=gated.count - gated.live - (not space.is_live(system.initial)),
        seconds=time.perf_counter() - began,
        witness=found,
    )


def _orders(space: Space, needed: np.uint64) -> dict[str, int]:
    """Count by order the configurations with flag `needed` that are neither live nor deadlocks."""
    packed = space.packed
    orders = Orders(packed.system)
    by_order: dict[int, int] = {}
    chunk = 1 << 20
    out = np.empty(chunk, np.uint64)
    places: dict[int, int] = {}
    for begin in range(0, space.table.size, chunk):
        end = min(begin + chunk, space.table.size)
        found = higher_order_keys(
            space.table, begin, end, needed, out,
            packed.shift, packed.mask, packed.after, packed.state, packed.home, packed.room,
        )  # fmt: skip
        keys, counts = np.unique(_parked(packed, out[:found]), return_counts=True)
        for key, count in zip(keys.tolist(), counts.tolist(), strict=True):
            places[key] = places.get(key, 0) + count
    for key, count in places.items():
        order = orders.of_configuration(packed.configuration(key))
        number = -1 if order is None else order
        by_order[number] = by_order.get(number, 0) + count
    unordered = by_order.pop(-1, 0)
    named = {str(k): by_order[k] for k in sorted(by_order)}
    return {**named, "unordered": unordered} if unordered else named


def _parked(packed: Packed, keys: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return the keys with robots in private states moved to their first ones: orders stay the same."""
    parked = keys.copy()
    for i, (shift, mask) in enumerate(zip(packed.shift, packed.mask, strict=True)):
        private = np.flatnonzero(packed.state[i, : len(packed.system.paths[i])] < 0)
        if len(private):
            at = (keys >> shift & mask).astype(np.int64)
            inside = packed.state[i, at] < 0
            move = (private[0] - at).astype(np.uint64) << shift
            parked = np.where(inside, parked + move, parked)
    return parked
