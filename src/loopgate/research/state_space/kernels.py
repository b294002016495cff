"""The inner loops over all configurations, compiled."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from loopgate.arrays import Flags, Ints, Small, Words
from loopgate.research.kernel_cache import kernel
from loopgate.research.state_space.encoding import Arrays

_MIX: Final = np.uint64(0x9E3779B97F4A7C15)
_HALF: Final = np.uint64(32)
_ONE: Final = np.uint64(1)


def new_slots(log2_slots: int) -> Small:
    """Return an empty table from configurations to numbers, of ``2 ** log2_slots`` slots."""
    return np.full(1 << log2_slots, -1, np.int32)


@kernel
def _slot(slots: Small, keys: Words, key: Words) -> np.uint64:
    """Return the slot that holds the number of `key`, or the empty slot where it belongs."""
    last = np.uint64(slots.size - 1)
    mixed = np.uint64(0)
    for w in range(key.size):
        mixed = (mixed ^ key[w]) * _MIX
        mixed = (mixed ^ (mixed >> _HALF)) * _MIX
    slot = mixed >> _HALF & last
    while True:
        number = slots[slot]
        if number < 0:
            return slot
        same = True
        for w in range(key.size):
            same &= keys[number, w] == key[w]
        if same:
            return slot
        slot = (slot + _ONE) & last


@kernel
def find(slots: Small, keys: Words, key: Words) -> int:
    """Return the number of the configuration with the words `key`, or -1."""
    return int(slots[_slot(slots, keys, key)])


@kernel
def rehash(slots: Small, keys: Words, count: int) -> None:
    """Enter the first `count` configurations into an empty table."""
    for k in range(count):
        slots[_slot(slots, keys, keys[k])] = k


@kernel
def stand(key: Words, arrays: Arrays, at: Ints, line: Ints, inside: Ints, head: Ints) -> None:
    """Fill in the position of each robot, the robots before it, and the number and the head of each state.

    The head of a state that is not FIFO is any of its robots, that of an empty one -1.
    """
    inside[:] = 0
    head[:] = -1
    for i in range(at.size):
        part = key[arrays.word[i]]
        at[i] = np.int64(part >> arrays.shift[i] & arrays.mask[i])
        line[i] = np.int64(part >> arrays.line_shift[i] & arrays.line_mask[i])
        s = arrays.state[i, at[i]]
        if s >= 0:
            inside[s] += 1
            if line[i] == 0:
                head[s] = i


@kernel
def _locked(arrays: Arrays, waits: Ints, front: Ints, at: Ints, head: Ints, left: int) -> bool:
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
            elif s >= 0 and (arrays.fifo[s] or arrays.room[s] == 1):
                free = waits[head[s]] < 0 and front[head[s]] < 0
            elif s >= 0:
                for j in range(waits.size):
                    if arrays.state[j, at[j]] == s and waits[j] < 0 and front[j] < 0:
                        free = True
                        break
            if free:
                waits[i] = -1
                front[i] = -1
                left -= 1
                changed = True
    return left > 0


@kernel
def expand(
    begin: int,
    end: int,
    count: int,
    keys: Words,
    slots: Small,
    first: Ints,
    targets: Small,
    movers: NDArray[np.int16],
    locked: Flags,
    home: Flags,
    rests: NDArray[np.int16],
    arrays: Arrays,
) -> int:
    """Visit the configurations `begin` to `end`, append new configurations to `keys`, return the new count.

    Writes each one's moves to `targets` and `movers` from ``first[k]`` on, whether it has a circular wait to
    `locked`, whether everyone is at home to `home`, and how many stay for good to `rests`. All arrays must
    have room.
    """
    robots = arrays.shift.size
    at = np.zeros(robots, np.int64)
    line = np.zeros(robots, np.int64)
    waits = np.full(robots, -1, np.int64)
    front = np.full(robots, -1, np.int64)
    inside = np.zeros(arrays.room.size, np.int64)
    head = np.full(arrays.room.size, -1, np.int64)
    new = np.zeros(keys.shape[1], np.uint64)
    edge = first[begin]
    for k in range(begin, end):
        stand(keys[k], arrays, at, line, inside, head)
        blocked = stay = away = 0
        for i in range(robots):
            p = at[i]
            q = arrays.after[i, p]
            waits[i] = -1
            front[i] = -1
            away += not arrays.home[i, p]
            if q < 0:
                stay += 1
                continue
            here = arrays.state[i, p]
            there = arrays.state[i, q]
            if line[i] > 0:
                front[i] = head[here]
                blocked += 1
                continue
            if there >= 0 and inside[there] >= arrays.room[there]:
                waits[i] = there
                blocked += 1
                continue
            new[:] = keys[k]
            new[arrays.word[i]] += np.uint64(q - p) << arrays.shift[i]
            if here >= 0 and inside[here] > 1 and arrays.fifo[here]:
                for j in range(robots):
                    if line[j] > 0 and arrays.state[j, at[j]] == here:
                        new[arrays.word[j]] -= _ONE << arrays.line_shift[j]
            if there >= 0 and inside[there] > 0 and arrays.fifo[there]:
                new[arrays.word[i]] += np.uint64(inside[there]) << arrays.line_shift[i]
            slot = _slot(slots, keys, new)
            if slots[slot] < 0:
                slots[slot] = count
                keys[count] = new
                count += 1
            targets[edge] = slots[slot]
            movers[edge] = i
            edge += 1
        first[k + 1] = edge
        rests[k] = stay
        home[k] = away == 0
        locked[k] = blocked > 1 and _locked(arrays, waits, front, at, head, blocked)
    return count


@kernel
def spread_back(good: Flags, first: Ints, targets: Small, backwards: bool) -> bool:  # noqa: FBT001
    """Mark in `good` configurations with a move to a marked one, in one sweep; return whether any was marked.

    Sweeps down and up in turn until nothing is marked any more find everything from which something marked
    can be reached. Most moves lead to a higher number, so few sweeps do.
    """
    changed = False
    for n in range(good.size):
        k = good.size - 1 - n if backwards else n
        if good[k]:
            continue
        for edge in range(first[k], first[k + 1]):
            if good[targets[edge]]:
                good[k] = True
                changed = True
                break
    return changed


@kernel
def keep_moving(good: Flags, done: Flags, first: Ints, targets: Small, backwards: bool) -> bool:  # noqa: FBT001
    """Strike out of `good` unfinished configurations without a move into it, in one sweep.

    Returns whether anything was struck out. Sweeps until nothing is leave the largest part that can be kept.
    """
    changed = False
    for n in range(good.size):
        k = good.size - 1 - n if backwards else n
        if not good[k] or done[k]:
            continue
        kept = False
        for edge in range(first[k], first[k + 1]):
            kept |= good[targets[edge]]
        if not kept:
            good[k] = False
            changed = True
    return changed


@kernel
def advance(
    begin: int,
    end: int,
    count: int,
    order: Small,
    rank: Small,
    ways: NDArray[np.int16],
    admitted: Flags,
    first: Ints,
    targets: Small,
) -> int:
    """Follow the admitted moves of the configurations at places `begin` to `end` of `order`, breadth first.

    Appends what is new to `order`, enters its place there into `rank` (-1 before), and writes how many moves
    are admitted to `ways`; returns how many are in `order`.
    """
    for place in range(begin, end):
        k = order[place]
        for edge in range(first[k], first[k + 1]):
            if admitted[edge]:
                ways[k] += 1
                there = targets[edge]
                if rank[there] < 0:
                    rank[there] = count
                    order[count] = there
                    count += 1
    return count
