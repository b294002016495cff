"""The gates ``banker`` and ``algorithm2``, compiled: all moves of many configurations at once."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from loopgate.arrays import Flags, Ints, Small, Words
from loopgate.kernel_cache import kernel
from loopgate.research.state_space.encoding import Arrays
from loopgate.research.state_space.kernel_circuits import all_live
from loopgate.research.state_space.kernels import stand

BANKER: Final = 1
ALGORITHM2: Final = 2


@kernel
def _is_safe_walk(robot: int, q: int, arrays: Arrays, inside: Ints, at: Ints) -> bool:
    """Return whether all states from position `q` to the next private one have room.

    Or to the end of the path, if no other robot comes there. No way leads home where no state is private.
    """
    after, state = arrays.after, arrays.state
    s = -1
    while q >= 0:
        s = state[robot, q]
        if s < 0:
            return True
        if inside[s] >= arrays.room[s] or q == at[robot]:
            return False
        q = after[robot, q]
    for other in range(at.size):
        p = after[other, at[other]] if other != robot else -1
        while p >= 0 and p != at[other]:
            if state[other, p] == s:
                return False
            p = after[other, p]
    return True


@kernel
def _is_live(
    i: int, q: int, gate: Ints, arrays: Arrays, at: Ints, owner: Ints, visits: Words,
    legs: Ints, between: Words, chain: Ints,
) -> bool:  # fmt: skip
    """Return whether every circuit is live by Theorem 1 that robot i is on once it has moved to `q`."""
    p = at[i]
    left, s = arrays.state[i, p], arrays.state[i, q]
    if s < 0:
        return True
    if left >= 0:
        owner[left] = -1
    owner[s] = i
    at[i] = q
    live = all_live(
        i, gate[1], gate[2], arrays.after, arrays.state, at, owner, visits, legs, between, chain
    )  # fmt: skip
    at[i] = p
    owner[s] = -1
    if left >= 0:
        owner[left] = i
    return bool(live)


@kernel
def ask(
    numbers: Small,
    keys: Words,
    first: Ints,
    movers: NDArray[np.int16],
    admitted: Flags,
    arrays: Arrays,
    gate: Ints,
    visits: Words,
    legs: Ints,
    between: Words,
    chain: Ints,
) -> None:
    """Write to `admitted` which moves out of the configurations `numbers` the gate admits.

    `gate` is the gate's number, its look-ahead along paths [states], and its steps in condition (2); the last
    three are scratch.
    """
    robots = arrays.shift.size
    at = np.zeros(robots, np.int64)
    line = np.zeros(robots, np.int64)
    inside = np.zeros(arrays.room.size, np.int64)
    owner = np.full(arrays.room.size, -1, np.int64)
    for k in numbers:
        stand(keys[k], arrays, at, line, inside, owner)
        for edge in range(first[k], first[k + 1]):
            i = movers[edge]
            q = arrays.after[i, at[i]]
            if gate[0] == BANKER:
                admitted[edge] = _is_safe_walk(i, q, arrays, inside, at)
            else:
                admitted[edge] = _is_live(i, q, gate, arrays, at, owner, visits, legs, between, chain)
