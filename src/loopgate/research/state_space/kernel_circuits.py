"""Algorithm 2's decision, compiled, for states that hold one robot each and at most 64 shared states.

The same search as `loopgate.gates.circuit_search`, without a budget. A walk is a robot, the step after which
it begins, counted from where the robot stands, and how many intermediate states it has.
"""

import numpy as np

from loopgate.arrays import Ints, Words
from loopgate.kernel_cache import kernel, part

_ONE = np.uint64(1)
_NONE = np.uint64(0)


def scratch_for(robots: int) -> tuple[Ints, Words, Ints]:
    """Return scratch arrays for `all_live`: legs' heads and lengths, their states, and chains."""
    return (
        np.zeros((2, robots, robots), np.int64),
        np.zeros((robots, robots), np.uint64),
        np.zeros((8, robots + 1), np.int64),
    )


@part
def _bits(word: np.uint64) -> int:
    count = 0
    while word != _NONE:
        word &= word - _ONE
        count += 1
    return count


@kernel
def _legs_of(
    robot: int, most: int, after: Ints, state: Ints, at: Ints, owner: Ints,
    legs: Ints, between: Words,
) -> int:  # fmt: skip
    """Find the risky walks of `robot`; return how many."""
    found = 0
    heads = _NONE
    states = _NONE
    p = at[robot]
    for step in range(most):
        p = after[robot, p]
        if p < 0:
            break
        s = state[robot, p]
        if s < 0:
            break
        head = owner[s]
        if head >= 0 and head != robot and not heads >> np.uint64(head) & _ONE:
            heads |= _ONE << np.uint64(head)
            legs[0, robot, found] = head
            legs[1, robot, found] = step
            between[robot, found] = states
            found += 1
        states |= _ONE << np.uint64(s)
    return found


@kernel
def _state_after(robot: int, steps: int, after: Ints, state: Ints, at: Ints) -> int:
    p = at[robot]
    for _ in range(steps):
        p = after[robot, p]
    return int(state[robot, p])


@kernel
def _condition1(robots: Ints, count: int, union: np.uint64, visits: Words) -> bool:
    if _bits(union) > count - 3:
        return True
    once = twice = _NONE
    for k in range(count):
        twice |= once & visits[robots[k]]
        once |= visits[robots[k]]
    return bool(union & ~twice)


@kernel
def _step_frees(
    index: int, count: int, lookahead: int, after: Ints, state: Ints, at: Ints, owner: Ints,
    visits: Words, chain: Ints,
) -> bool:  # fmt: skip
    """Return whether steps of the robot of walk `index` fulfil condition (2) of Theorem 1.

    Rows of `chain`: robots and lengths of the circuit's walks (0, 1); robots, beginnings and lengths of the
    rest that is left of them (2, 3, 4).
    """
    for k in range(count):
        other = (index + k) % count
        chain[2, k] = chain[0, other]
        chain[3, k] = 0
        chain[4, k] = chain[1, other]
    for _ in range(lookahead):
        if chain[4, 0] == 0:
            return False
        here = _state_after(chain[2, 0], chain[3, 0] + 1, after, state, at)
        if owner[here] >= 0:
            return False
        chain[3, 0] += 1
        chain[4, 0] -= 1
        left = 0
        for k in range(1, count - 1):
            for step in range(1, chain[4, k] + 1):
                if _state_after(chain[2, k], chain[3, k] + step, after, state, at) == here:
                    left = k + 1
                    chain[4, k] = step - 1
                    break
            if left:
                break
        if left == 0:
            return True
        count = left
        union = _NONE
        for k in range(count):
            for step in range(1, chain[4, k] + 1):
                s = _state_after(chain[2, k], chain[3, k] + step, after, state, at)
                union |= _ONE << np.uint64(s)
        if union != _NONE and _condition1(chain[2], count, union, visits):
            return True
    return False


@kernel
def all_live(
    robot: int, most: int, lookahead: int, after: Ints, state: Ints, at: Ints, owner: Ints,
    visits: Words, legs: Ints, between: Words, chain: Ints,
) -> bool:  # fmt: skip
    """Return whether every circuit through `robot` is live by Theorem 1, with everyone where `at` says.

    `owner` is the robot in a state, or -1; `visits` the states on a robot's path, as bits; the last three are
    `scratch_for`'s. Exponential in the number of robots in the worst case.
    """
    robots = at.size
    reached = _ONE << np.uint64(robot)
    known = _NONE
    counts = chain[5]
    open_ = reached
    circles = False
    while open_ != _NONE:
        j = 0
        while not open_ >> np.uint64(j) & _ONE:
            j += 1
        open_ &= ~(_ONE << np.uint64(j))
        known |= _ONE << np.uint64(j)
        counts[j] = _legs_of(j, most, after, state, at, owner, legs, between)
        for k in range(counts[j]):
            head = _ONE << np.uint64(legs[0, j, k])
            circles = circles or legs[0, j, k] == robot
            reached |= head
            open_ |= head & ~known
    if not circles:
        return True
    # Robots from which the asking one can be reached; only they can be on a circuit.
    back = _ONE << np.uint64(robot)
    grown = True
    while grown:
        grown = False
        for j in range(robots):
            if reached >> np.uint64(j) & _ONE and not back >> np.uint64(j) & _ONE:
                for k in range(counts[j]):
                    if back >> np.uint64(legs[0, j, k]) & _ONE:
                        back |= _ONE << np.uint64(j)
                        grown = True
                        break
    most_states = max(0, _bits(back) - 3)
    unions = np.zeros(robots + 1, np.uint64)
    tried = chain[6]
    used = _ONE << np.uint64(robot)
    chain[0, 0] = robot
    tried[0] = 0
    depth = 0
    while depth >= 0:
        j = chain[0, depth]
        k = tried[depth]
        if k >= counts[j]:
            used &= ~(_ONE << np.uint64(j))
            depth -= 1
            continue
        tried[depth] += 1
        head = legs[0, j, k]
        union = unions[depth] | between[j, k]
        if _bits(union) > most_states:
            continue
        chain[1, depth] = legs[1, j, k]
        if head == robot:
            count = depth + 1
            if union == _NONE:
                return False
            if _condition1(chain[0], count, union, visits):
                continue
            live = False
            for index in range(count):
                if _step_frees(index, count, lookahead, after, state, at, owner, visits, chain):
                    live = True
                    break
            if not live:
                return False
        elif back >> np.uint64(head) & _ONE and not used >> np.uint64(head) & _ONE:
            depth += 1
            chain[0, depth] = head
            tried[depth] = 0
            unions[depth] = union
            used |= _ONE << np.uint64(head)
    return True
