"""The inner loops over configurations as words. Arrays are those of `loopgate.untimed.words.Words`."""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["expand", "index_of", "keep_moving", "new_slots", "rehash", "spread_back"]

Unsigned = NDArray[np.uint64]
Numbers = NDArray[np.int64]
Small = NDArray[np.int32]
Flags = NDArray[np.bool_]

_MIX: Final = np.uint64(0x9E3779B97F4A7C15)
_HALF: Final = np.uint64(32)
_ONE: Final = np.uint64(1)


def new_slots(log2_slots: int) -> Small:
    """Return an empty table from words to numbers, of ``2 ** log2_slots`` slots."""
    return np.full(1 << log2_slots, -1, np.int32)


@njit(cache=True, inline="always")
def _slot(slots: Small, words: Unsigned, word: np.uint64) -> np.uint64:
    """Return the slot that holds the number of `word`, or the empty slot where it belongs."""
    last = np.uint64(slots.size - 1)
    mixed = word * _MIX
    slot = (mixed ^ (mixed >> _HALF)) * _MIX >> _HALF & last
    while slots[slot] >= 0 and words[slots[slot]] != word:
        slot = (slot + _ONE) & last
    return slot


@njit(cache=True)
def index_of(slots: Small, words: Unsigned, word: np.uint64) -> int:
    """Return the number of `word`, or -1."""
    return int(slots[_slot(slots, words, word)])


@njit(cache=True)
def rehash(slots: Small, words: Unsigned, count: int) -> None:
    """Enter the first `count` words into an empty table."""
    for k in range(count):
        slots[_slot(slots, words, words[k])] = k


@njit(cache=True)
def _locked(
    waits: Numbers, front: Numbers, state: Numbers, at: Numbers, head: Numbers, fifo: Numbers, left: int
) -> bool:
    """Return whether robots wait for one another for ever (Def. 3); changes `waits`.

    ``waits[i]`` is the full state that robot i, a head, wants, else -1; ``front[i]`` the head that it stands
    behind, else -1; `left` how many robots have either.
    """
    changed = True
    while changed and left > 0:
        changed = False
        for i in range(waits.size):
            s = waits[i]
            free = False
            if front[i] >= 0:
                free = waits[front[i]] < 0 and front[front[i]] < 0
            elif s >= 0 and fifo[s]:
                free = waits[head[s]] < 0 and front[head[s]] < 0
            elif s >= 0:
                for j in range(waits.size):
                    if state[j, at[j]] == s and waits[j] < 0 and front[j] < 0:
                        free = True
                        break
            if free:
                waits[i] = -1
                front[i] = -1
                left -= 1
                changed = True
    return left > 0


@njit(cache=True)
def expand(
    begin: int,
    end: int,
    count: int,
    words: Unsigned,
    slots: Small,
    first: Numbers,
    targets: Small,
    movers: NDArray[np.int8],
    locked: Flags,
    resting: Unsigned,
    shift: Unsigned,
    mask: Unsigned,
    line_shift: Unsigned,
    line_mask: Unsigned,
    after: Numbers,
    state: Numbers,
    room: Numbers,
    fifo: Numbers,
) -> int:
    """Visit the words with numbers `begin` to `end`; append new ones to `words`; return how many there are.

    Writes each one's moves to ``targets`` and ``movers`` from ``first[k]`` on, whether it has a circular wait
    to `locked`, and the robots that stay for good, as bits, to `resting`. All arrays must have room.
    """
    robots = shift.size
    at = np.zeros(robots, np.int64)
    line = np.zeros(robots, np.int64)
    waits = np.full(robots, -1, np.int64)
    front = np.full(robots, -1, np.int64)
    inside = np.zeros(room.size, np.int64)
    head = np.full(room.size, -1, np.int64)
    edge = first[begin]
    for k in range(begin, end):
        word = words[k]
        inside[:] = 0
        for i in range(robots):
            at[i] = np.int64(word >> shift[i] & mask[i])
            line[i] = np.int64(word >> line_shift[i] & line_mask[i])
            waits[i] = -1
            front[i] = -1
            s = state[i, at[i]]
            if s >= 0:
                inside[s] += 1
                if line[i] == 0:
                    head[s] = i
        blocked = 0
        stay = np.uint64(0)
        for i in range(robots):
            p = at[i]
            q = after[i, p]
            if q < 0:
                stay |= _ONE << np.uint64(i)
                continue
            here = state[i, p]
            there = state[i, q]
            if here >= 0 and fifo[here] and line[i] > 0:
                front[i] = head[here]
                blocked += 1
                continue
            if there >= 0 and inside[there] >= room[there]:
                waits[i] = there
                blocked += 1
                continue
            new = word + (np.uint64(q - p) << shift[i])
            if here >= 0 and fifo[here]:
                for j in range(robots):
                    if line[j] > 0 and state[j, at[j]] == here:
                        new -= _ONE << line_shift[j]
            if there >= 0 and fifo[there]:
                new += np.uint64(inside[there]) << line_shift[i]
            slot = _slot(slots, words, new)
            if slots[slot] < 0:
                slots[slot] = count
                words[count] = new
                count += 1
            targets[edge] = slots[slot]
            movers[edge] = i
            edge += 1
        first[k + 1] = edge
        resting[k] = stay
        locked[k] = blocked > 1 and _locked(waits, front, state, at, head, fifo, blocked)
    return count


@njit(cache=True)
def spread_back(good: Flags, first: Numbers, sources: Small) -> None:
    """Mark everything in `good` from which something marked can be reached, given the moves backwards."""
    stack = np.empty(good.size, np.int32)
    top = 0
    for k in range(good.size):
        if good[k]:
            stack[top] = k
            top += 1
    while top > 0:
        top -= 1
        here = stack[top]
        for edge in range(first[here], first[here + 1]):
            before = sources[edge]
            if not good[before]:
                good[before] = True
                stack[top] = before
                top += 1


@njit(cache=True)
def keep_moving(
    good: Flags, done: Flags, first: Numbers, targets: Small, back_first: Numbers, sources: Small
) -> None:
    """Shrink `good` to the largest part in which each node is done or has a move to another of the part."""
    ways = np.zeros(good.size, np.int64)
    stack = np.empty(good.size, np.int32)
    top = 0
    for k in range(good.size):
        for edge in range(first[k], first[k + 1]):
            ways[k] += good[targets[edge]]
        if good[k] and not done[k] and ways[k] == 0:
            good[k] = False
            stack[top] = k
            top += 1
    while top > 0:
        top -= 1
        here = stack[top]
        for edge in range(back_first[here], back_first[here + 1]):
            before = sources[edge]
            ways[before] -= 1
            if good[before] and not done[before] and ways[before] == 0:
                good[before] = False
                stack[top] = before
                top += 1
