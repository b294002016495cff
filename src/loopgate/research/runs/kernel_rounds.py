"""Random rounds without a gate, compiled: at each step a movable robot, drawn at random, moves."""

import numpy as np

from loopgate.arrays import Ints
from loopgate.research.kernel_cache import kernel


@kernel
def count_live_rounds(rounds: int, seed: int, start: Ints, after: Ints, state: Ints, room: Ints) -> int:
    """Return how many of `rounds` rounds bring every robot to the end of its open path.

    Arrays are those of `loopgate.research.state_space.encoding.Arrays`; `start` are the positions at the
    beginning. On closed paths a round would not end.
    """
    np.random.seed(seed)  # noqa: NPY002 - compiled code has no other generator of its own
    robots = start.size
    at = start.copy()
    count = np.zeros(room.size, np.int64)
    movable = np.zeros(robots, np.int64)
    live = 0
    for _ in range(rounds):
        count[:] = 0
        finished = 0
        for i in range(robots):
            at[i] = start[i]
            finished += after[i, at[i]] < 0
            if state[i, at[i]] >= 0:
                count[state[i, at[i]]] += 1
        while finished < robots:
            found = 0
            for i in range(robots):
                q = after[i, at[i]]
                if q >= 0 and (state[i, q] < 0 or count[state[i, q]] < room[state[i, q]]):
                    movable[found] = i
                    found += 1
            if found == 0:
                break
            i = movable[np.random.randint(found)]  # noqa: NPY002 - as above
            if state[i, at[i]] >= 0:
                count[state[i, at[i]]] -= 1
            at[i] = after[i, at[i]]
            if state[i, at[i]] >= 0:
                count[state[i, at[i]]] += 1
            finished += after[i, at[i]] < 0
        live += finished == robots
    return live
