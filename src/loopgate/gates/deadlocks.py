"""Deadlocks of a configuration: the circular waits of Definition 3 (Zhou et al. 2020)."""

from loopgate.model import Placement, System


def deadlocked_robots(system: System, configuration: Placement) -> frozenset[int]:
    """Return the robots that wait for one another for ever; empty iff there is no deadlock (Def. 3).

    The largest set of robots each of which wants a full state, all of whose occupants are in the set. Where
    states hold one robot, these are the robots of cycles in which each wants the state of the next, and the
    robots that wait for them. A robot behind another in a FIFO state waits for that one. Robots that stay for
    good do not wait. O(robots^2 * occupants).
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
    changed = True
    while changed:
        free = [robot for robot, others in waits.items() if any(other not in waits for other in others)]
        for robot in free:
            del waits[robot]
        changed = bool(free)
    return frozenset(waits)


def homes_decide_liveness(system: System) -> bool:
    """Return whether every robot on a closed path has a private state, and passes no other robot's end.

    Then a configuration is live iff some sequence of moves brings all robots home at once, those on closed
    paths to private states and the others to their ends: from there each in turn can go round alone. A run in
    which everyone goes on for ever gives such a sequence if, from some moment on, each robot stays when it
    comes home.
    """
    rounds = [(path, after[-1] >= 0) for path, after in zip(system.paths, system.following, strict=True)]
    ends = {path[-1] for path, closed in rounds if not closed}
    return all(
        any(system.private[state] for state in path) and ends.isdisjoint(path)
        for path, closed in rounds
        if closed
    )
