"""Sending robots home in turn, as far as possible without a search.

Both rules lose nothing: what they do leaves every other robot at least the room it had, so a configuration
is live iff it is live after them.
"""

from loopgate.gates.certified.occupancy import Occupancy


def fixpoint(stand: Occupancy, robots: list[int]) -> tuple[list[int], list[int]]:
    """Send home each robot with a free way home, repeatedly (Banker's rule).

    Parameters
    ----------
    stand
        Where everybody stands; changed to where they stand in the end.
    robots
        The robots to send home, in the order in which to try them.

    Returns
    -------
    tuple of list
        The moves, and the robots left over because something stands in their way.

    Notes
    -----
    A robot that will stay for good in a state others may need is left over, since sending it there could
    lose. O(states on the ways home + robots woken).
    """
    layout, at, count, queue = stand.layout, stand.at, stand.count, stand.queue
    path, way, steps, home = layout.path, layout.way, layout.steps, layout.home
    through, settling, follow = layout.through, layout.settling, layout.follow
    wake: dict[int, list[int]] = {}
    moves: list[int] = []
    todo = robots[::-1]
    while todo:
        i = todo.pop()
        p = at[i]
        if home[i][p]:
            continue
        here = path[i][p]
        line = queue.get(here)
        if line is not None and line[0] != i:
            wake.setdefault(here, []).append(i)
            continue
        if settling[i][p]:
            continue
        count[here] -= 1
        for s in way[i][p]:
            if count[s] >= through[s]:
                count[here] += 1
                wake.setdefault(s, []).append(i)
                break
        else:
            k = steps[i][p]
            moves += [i] * k
            for _ in range(k):
                p = follow[i][p]
            at[i] = p
            count[path[i][p]] += 1
            if line is not None:
                line.pop(0)
            woken = wake.pop(here, None)
            if woken is not None:
                todo += woken[::-1]
    return moves, [i for i in robots if not home[i][at[i]]]


def reduce_to_core(stand: Occupancy, robots: list[int]) -> tuple[list[int], list[int]]:
    """Send robots home, or on to states that no other robot still needs, until no robot can move.

    Parameters and result as `fixpoint`. What is left over is the core that only a search can decide. A
    robot that settles for good in a shared terminal goes there once nobody has to pass it and it has room
    for all who settle there.
    O(rounds * states on the ways home).
    """
    moves, left = fixpoint(stand, robots)
    advanced = True
    while left and advanced:
        advanced = False
        need: dict[int, int] = {}
        ways = {i: _ahead(stand, i) for i in left}
        for i in left:
            for s in set(ways[i]):
                need[s] = need.get(s, 0) + 1
        for i in left:
            k = _harmless(stand, i, ways[i], need)
            if k == 0:
                continue
            for s in set(ways[i]):
                need[s] -= 1
            for s in set(ways[i][k:]):
                need[s] += 1
            for _ in range(k):
                stand.step(i)
            moves += [i] * k
            advanced = True
        if advanced:
            more, left = fixpoint(stand, left)
            moves += more
    return moves, left


def _ahead(stand: Occupancy, robot: int) -> list[int]:
    """All states the robot enters on its way home, in order."""
    layout = stand.layout
    p = stand.at[robot]
    states = []
    for _ in range(layout.steps[robot][p]):
        p = layout.follow[robot][p]
        states.append(layout.path[robot][p])
    return states


def _harmless(stand: Occupancy, robot: int, ahead: list[int], need: dict[int, int]) -> int:
    """How many moves bring the robot to the furthest state that it reaches now and only it still needs."""
    if not stand.heads(robot):
        return 0
    layout, count = stand.layout, stand.count
    here = stand.state(robot)
    settles = layout.settles[robot]
    best = 0
    count[here] -= 1
    for k, s in enumerate(ahead, start=1):
        if count[s] >= (layout.room[s] if k == len(ahead) else layout.through[s]):
            break
        if k == len(ahead) and s == settles:
            if need[s] == _settlers(stand, s) <= layout.room[s] - count[s]:
                best = k
        elif need[s] == 1 and count[s] < layout.through[s]:
            best = k
    count[here] += 1
    return best


def _settlers(stand: Occupancy, state: int) -> int:
    """How many robots still on their way will stay in `state` for good and do not pass it before."""
    layout = stand.layout
    total = 0
    for i in layout.system.visitors[state]:
        if layout.settles[i] == state and not layout.home[i][stand.at[i]]:
            total += _ahead(stand, i).count(state) == 1
    return total
