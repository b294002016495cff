"""The inner loops of the compiled exploration under a gate, and of the search for higher-order deadlocks."""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from loopgate.untimed.kernel_circuits import all_live
from loopgate.untimed.kernels import clear, shared_cycle, single_cycle, unpack
from loopgate.untimed.table import KEY_PART, LIVE, VISITED, has_flag, set_flag

__all__ = ["ALGORITHM2", "BANKER", "COLLISION", "expand_gated", "higher_order_keys", "judge"]

Words = NDArray[np.uint64]
Numbers = NDArray[np.int64]

COLLISION: Final = 0
BANKER: Final = 1
ALGORITHM2: Final = 2

_NONE = np.uint64(0)
_ONE = np.uint64(1)


@njit(cache=True)
def _is_safe_walk(
    robot: int, q: int, after: Numbers, state: Numbers, room: Numbers, count: Numbers, at: Numbers
) -> bool:
    """Return whether all states from position `q` to the next private one have room.

    Or to the end of the path, if no other robot comes there.
    """
    s = -1
    while q >= 0:
        s = state[robot, q]
        if s < 0:
            return True
        if count[s] >= room[s]:
            return False
        q = after[robot, q]
    for other in range(at.size):
        p = after[other, at[other]] if other != robot else -1
        while p >= 0 and p != at[other]:
            if state[other, p] == s:
                return False
            p = after[other, p]
    return True


@njit(cache=True)
def _admits(
    i: int, q: int, gate: Numbers, after: Numbers, state: Numbers, room: Numbers, at: Numbers, count: Numbers,
    owner: Numbers, visits: Words, legs: Numbers, between: Words, chain: Numbers,
) -> bool:  # fmt: skip
    """Return whether the gate admits robot i, whose next position `q` has room, to it."""
    if gate[0] == BANKER:
        return bool(_is_safe_walk(i, q, after, state, room, count, at))
    p = at[i]
    s = state[i, q]
    if gate[0] == COLLISION or s < 0:
        return True
    left = state[i, p]
    if left >= 0:
        owner[left] = -1
    owner[s] = i
    at[i] = q
    live = all_live(i, gate[1], gate[2], after, state, at, owner, visits, legs, between, chain)
    at[i] = p
    owner[s] = -1
    if left >= 0:
        owner[left] = i
    return bool(live)


@njit(cache=True)
def expand_gated(
    keys: Words,
    table: Words,
    out: Words,
    bad: Words,
    gate: Numbers,
    shift: Words,
    mask: Words,
    after: Numbers,
    state: Numbers,
    home: Numbers,
    room: Numbers,
    visits: Words,
    legs: Numbers,
    between: Words,
    chain: Numbers,
    totals: Numbers,
) -> tuple[int, int]:
    """Visit `keys` under a gate; write new successors to `out`, unsafe or stuck ones of `keys` to `bad`.

    `gate` is the gate's number, its look-ahead along paths [states], and its steps in condition (2). `totals`
    counts transitions, deadlocks, unfinished configurations without an admitted move, and live
    configurations. Returns how many were written to `out` and `bad`.
    """
    robots = shift.size
    at = np.zeros(robots, np.int64)
    waits = np.full(robots, -1, np.int64)
    mark = np.zeros(robots, np.int64)
    owner = np.full(room.size, -1, np.int64)
    count = np.zeros(room.size, np.int64)
    single = room.max() == 1
    found = bads = 0
    for key in keys:
        unpack(key, shift, mask, state, home, at, count, owner)
        moves = finished = blocked = 0
        for i in range(robots):
            p = at[i]
            q = after[i, p]
            waits[i] = -1
            if q < 0:
                finished += 1
                continue
            s = state[i, q]
            if s >= 0 and count[s] >= room[s]:
                waits[i] = s
                blocked += 1
                continue
            if not _admits(
                i, q, gate, after, state, room, at, count, owner, visits, legs, between, chain
            ):  # fmt: skip
                continue
            moves += 1
            there = key + (np.uint64(q - p) << shift[i])
            if set_flag(table, there, VISITED):
                out[found] = there
                found += 1
        totals[0] += moves
        if blocked > 1:
            totals[1] += single_cycle(waits, owner, mark) if single else shared_cycle(waits, state, at)
        stuck = moves == 0 and finished < robots
        live_here = has_flag(table, key, LIVE)
        totals[2] += stuck
        totals[3] += live_here
        if stuck or not live_here:
            bad[bads] = key
            bads += 1
        clear(state, at, count)
        for i in range(robots):
            if state[i, at[i]] >= 0:
                owner[state[i, at[i]]] = -1
    return found, bads


@njit(cache=True)
def higher_order_keys(
    table: Words,
    begin: int,
    end: int,
    needed: np.uint64,
    out: Words,
    shift: Words,
    mask: Words,
    after: Numbers,
    state: Numbers,
    home: Numbers,
    room: Numbers,
) -> int:
    """Write to `out` the keys in slots `begin` to `end` that are neither live nor deadlocks.

    Only those with the flag `needed`. Returns how many.
    """
    robots = shift.size
    at = np.zeros(robots, np.int64)
    waits = np.full(robots, -1, np.int64)
    mark = np.zeros(robots, np.int64)
    owner = np.zeros(room.size, np.int64)
    count = np.zeros(room.size, np.int64)
    single = room.max() == 1
    found = 0
    for slot in range(begin, end):
        word = table[slot]
        if word == _NONE or word & LIVE or word & needed != needed:
            continue
        key = (word & KEY_PART) - _ONE
        unpack(key, shift, mask, state, home, at, count, owner)
        for i in range(robots):
            q = after[i, at[i]]
            waits[i] = -1
            if q >= 0 and state[i, q] >= 0 and count[state[i, q]] >= room[state[i, q]]:
                waits[i] = state[i, q]
        if not (single_cycle(waits, owner, mark) if single else shared_cycle(waits, state, at)):
            out[found] = key
            found += 1
        clear(state, at, count)
    return found


@njit(cache=True)
def judge(
    table: Words,
    gate: Numbers,
    shift: Words,
    mask: Words,
    after: Numbers,
    state: Numbers,
    home: Numbers,
    room: Numbers,
    visits: Words,
    legs: Numbers,
    between: Words,
    chain: Numbers,
) -> tuple[int, int, int, int]:
    """Ask the gate about every move of every live configuration, whether or not it would let it come about.

    Returns the safe moves (into live configurations), those of them that are admitted, the unsafe moves
    admitted, and the unfinished configurations without an admitted move.
    """
    robots = shift.size
    at = np.zeros(robots, np.int64)
    owner = np.full(room.size, -1, np.int64)
    count = np.zeros(room.size, np.int64)
    safe = accepted = unsafe = blocked = 0
    for word in table:
        if not word & LIVE:
            continue
        key = (word & KEY_PART) - _ONE
        unpack(key, shift, mask, state, home, at, count, owner)
        moves = finished = 0
        for i in range(robots):
            q = after[i, at[i]]
            if q < 0:
                finished += 1
                continue
            s = state[i, q]
            if s >= 0 and count[s] >= room[s]:
                continue
            good = has_flag(table, key + (np.uint64(q - at[i]) << shift[i]), LIVE)
            safe += good
            if _admits(
                i, q, gate, after, state, room, at, count, owner, visits, legs, between, chain
            ):  # fmt: skip
                moves += 1
                accepted += good
                unsafe += not good
        blocked += moves == 0 and finished < robots
        clear(state, at, count)
        for i in range(robots):
            if state[i, at[i]] >= 0:
                owner[state[i, at[i]]] = -1
    return safe, accepted, unsafe, blocked
