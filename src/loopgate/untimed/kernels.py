"""The inner loops of the compiled exploration. Arrays are those of `loopgate.untimed.packed.Packed`."""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from loopgate.untimed.table import LIVE, insert, set_flag

__all__ = ["clear", "expand", "shared_cycle", "single_cycle", "spread_live", "unpack"]

Words = NDArray[np.uint64]
Numbers = NDArray[np.int64]


@njit(cache=True, inline="always")
def unpack(
    key: np.uint64,
    shift: Words,
    mask: Words,
    state: Numbers,
    home: Numbers,
    at: Numbers,
    count: Numbers,
    owner: Numbers,
) -> int:
    """Fill in the positions `at`, and the states' `count` and `owner`; return how many are not home."""
    away = 0
    for i in range(shift.size):
        at[i] = np.int64(key >> shift[i] & mask[i])
        s = state[i, at[i]]
        if s >= 0:
            count[s] += 1
            owner[s] = i
        away += 1 - home[i, at[i]]
    return away


@njit(cache=True, inline="always")
def clear(state: Numbers, at: Numbers, count: Numbers) -> None:
    """Undo what `unpack` did to `count`."""
    for i in range(at.size):
        s = state[i, at[i]]
        if s >= 0:
            count[s] = 0


@njit(cache=True, inline="always")
def single_cycle(waits: Numbers, owner: Numbers, mark: Numbers) -> bool:
    """Return whether robots wait in a circle (Def. 3), where states hold one robot each.

    ``waits[i]`` is the full state that robot i wants, or -1; `owner` the robot in a state; `mark` is scratch.
    """
    robots = waits.size
    for i in range(robots):
        mark[i] = 0
    for i in range(robots):
        j = i
        while waits[j] >= 0 and mark[j] == 0:
            mark[j] = i + 1
            j = owner[waits[j]]
        if waits[j] >= 0 and mark[j] == i + 1:
            return True
    return False


@njit(cache=True)
def shared_cycle(waits: Numbers, state: Numbers, at: Numbers) -> bool:
    """Return whether robots wait for one another for ever, where states may hold several; changes `waits`.

    Strikes out the waiting robots that wait for one that does not, until nothing changes.
    """
    robots = waits.size
    waiting = 0
    for i in range(robots):
        waiting += waits[i] >= 0
    changed = waiting > 0
    while changed and waiting > 0:
        changed = False
        for i in range(robots):
            if waits[i] < 0:
                continue
            for j in range(robots):
                if waits[j] < 0 and state[j, at[j]] == waits[i]:
                    waits[i] = -1
                    waiting -= 1
                    changed = True
                    break
    return waiting > 0


_BLOCK: Final = 128
"""Configurations whose successors are computed before any is looked up, so that look-ups overlap."""


@njit(cache=True)
def expand(
    keys: Words,
    table: Words,
    out: Words,
    homes: Words,
    shift: Words,
    mask: Words,
    after: Numbers,
    state: Numbers,
    home: Numbers,
    room: Numbers,
    totals: Numbers,
) -> tuple[int, int]:
    """Visit `keys`; write new successors to `out` and new homes to `homes`; return how many of each.

    `totals` counts transitions, deadlocks, and unfinished configurations without a move.
    """
    robots = shift.size
    at = np.zeros(robots, np.int64)
    waits = np.full(robots, -1, np.int64)
    mark = np.zeros(robots, np.int64)
    owner = np.zeros(room.size, np.int64)
    count = np.zeros(room.size, np.int64)
    candidates = np.zeros(_BLOCK * robots, np.uint64)
    lefts = np.zeros(_BLOCK * robots, np.int64)
    single = room.max() == 1
    found = at_home = 0
    for begin in range(0, keys.size, _BLOCK):
        several = 0
        for key in keys[begin : begin + _BLOCK]:
            away = unpack(key, shift, mask, state, home, at, count, owner)
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
                moves += 1
                candidates[several] = key + (np.uint64(q - p) << shift[i])
                lefts[several] = away + home[i, p] - home[i, q]
                several += 1
            totals[0] += moves
            if blocked > 1:
                totals[1] += single_cycle(waits, owner, mark) if single else shared_cycle(waits, state, at)
            if moves == 0 and finished < robots:
                totals[2] += 1
            clear(state, at, count)
        for k in range(several):
            there = candidates[k]
            if insert(table, there, LIVE if lefts[k] == 0 else np.uint64(0)):
                out[found] = there
                found += 1
                if lefts[k] == 0:
                    homes[at_home] = there
                    at_home += 1
    return found, at_home


@njit(cache=True)
def spread_live(
    stack: Words,
    top: int,
    steps: int,
    table: Words,
    shift: Words,
    mask: Words,
    before: Numbers,
    state: Numbers,
    home: Numbers,
    room: Numbers,
    totals: Numbers,
) -> int:
    """Mark the predecessors of the live configurations on `stack` live; return the new top.

    Stops after about `steps` of these. ``totals[3]`` counts those marked.
    """
    robots = shift.size
    at = np.zeros(robots, np.int64)
    count = np.zeros(room.size, np.int64)
    owner = np.zeros(room.size, np.int64)
    candidates = np.zeros(_BLOCK * robots, np.uint64)
    while top > 0 and steps > 0:
        block = min(top, _BLOCK)
        steps -= block
        several = 0
        for key in stack[top - block : top]:
            unpack(key, shift, mask, state, home, at, count, owner)
            for i in range(robots):
                p = before[i, at[i]]
                if p < 0:
                    continue
                s = state[i, p]
                if s >= 0 and count[s] >= room[s]:
                    continue
                candidates[several] = key + (np.uint64(p - at[i]) << shift[i])
                several += 1
            clear(state, at, count)
        top -= block
        for k in range(several):
            if set_flag(table, candidates[k], LIVE):
                stack[top] = candidates[k]
                top += 1
                totals[3] += 1
    return top
