"""Deadlocks: robots that wait for one another for good; circular waits (Zhou et al. 2020, Definition 3)."""

from collections.abc import Hashable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import TypeVar

from loopgate.model import Placement, System

W = TypeVar("W", bound=Hashable)
N = TypeVar("N", int, str)


def deadlocked(waits: Mapping[W, Sequence[Sequence[W]]]) -> set[W]:
    """Return the robots that wait for each other for good: the greatest fixpoint.

    The detection of deadlocks on roads calls it with vehicles, gates with robots and full places. O(members
    of all sets).

    Parameters
    ----------
    waits
        For each waiting member, the sets for which it waits (AND-OR model of resource deadlocks): of
        *every* set *some* member must go on before it can. Without sets it goes on; with an empty set it
        never does. A member that is no key goes on.

    Examples
    --------
    >>> from loopgate.gates.deadlocks import deadlocked
    >>> sorted(deadlocked({"a": [["b", "c"]], "b": [["a"]], "c": [["d"]]}))
    []
    >>> sorted(deadlocked({"a": [["b", "c"]], "b": [["a"]], "c": [["b"], ["d"]]}))
    ['a', 'b', 'c']
    """
    stuck = {one for one, sets in waits.items() if sets}
    behind: dict[W, list[tuple[W, int]]] = {}
    left: dict[W, int] = {}
    for one in stuck:
        closed = [number for number, some in enumerate(waits[one]) if all(other in stuck for other in some)]
        left[one] = len(closed)
        for number in closed:
            for other in waits[one][number]:
                behind.setdefault(other, []).append((one, number))
    todo = [one for one in stuck if not left[one]]
    met: set[tuple[W, int]] = set()
    while todo:
        gone = todo.pop()
        stuck.discard(gone)
        for one, number in behind.get(gone, ()):
            if (one, number) not in met:
                met.add((one, number))
                left[one] -= 1
                if not left[one]:
                    todo.append(one)
    return stuck


def circular_wait(waits: Mapping[N, Sequence[Sequence[N]]], stuck: AbstractSet[N]) -> list[N]:
    """Return a circle of stuck members: each waits for the next, and the last for the first.

    The circle begins at its smallest member, and ties go to the smallest, so that the result is always the
    same. A member that never goes on by itself is a circle of its own.

    Parameters
    ----------
    waits
        As for `deadlocked`.
    stuck
        What `deadlocked` returned; not empty.
    """
    here = min(stuck)
    seen: dict[N, int] = {}
    while here not in seen:
        seen[here] = len(seen)
        all_stuck = next(some for some in waits[here] if all(other in stuck for other in some))
        if not all_stuck:
            return [here]
        here = min(all_stuck)
    circle = [one for one, at in seen.items() if at >= seen[here]]
    first = circle.index(min(circle))
    return circle[first:] + circle[:first]


def deadlocked_robots(system: System, configuration: Placement) -> frozenset[int]:
    """Return the robots in a deadlock, which wait for each other for ever (Def. 3).

    It is the largest set of robots in which each wants a full state, all of whose occupants are in the set.
    If states hold one robot, these are the robots of cycles in which each wants the state of the next, and
    the robots that wait for them. A robot behind another in a FIFO state waits for that robot. Robots that
    stay for good do not wait. O(robots * occupants).
    """
    waits: dict[int, tuple[int, ...]] = {}
    for robot in range(len(system.robots)):
        wanted = system.next_state(configuration, robot)
        if wanted is None or system.enabled(configuration, robot):
            continue
        if system.at_head(configuration, robot):
            inside = tuple(system.occupants(configuration, wanted))
            # In a FIFO state it is the head that has to go.
            waits[robot] = inside[:1] if wanted in system.fifo_states else inside
        else:
            waits[robot] = tuple(system.occupants(configuration, system.state_at(configuration, robot))[:1])
    return frozenset(deadlocked({robot: [others] for robot, others in waits.items()}))


def homes_decide_liveness(system: System) -> bool:
    """Return whether every robot on a closed path has a private state, and passes no other robot's end.

    If so, a configuration is live if and only if some sequence of moves brings all robots home at once:
    robots on closed paths to private states, the others to their ends. From there each robot in turn can go
    round alone. Conversely, a run in which every robot goes on for ever gives such a sequence: from some
    moment on, let each robot stay when it comes home.
    """
    rounds = [(path, after[-1] >= 0) for path, after in zip(system.paths, system.following, strict=True)]
    ends = {path[-1] for path, closed in rounds if not closed}
    return all(
        any(system.private[state] for state in path) and ends.isdisjoint(path)
        for path, closed in rounds
        if closed
    )
