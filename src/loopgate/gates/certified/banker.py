"""Sends robots home in turn, as far as possible without a search.

Neither rule loses anything: after it, every other robot has at least the slots that it had before. So a
configuration is live if and only if it is live after the rule.
"""

from loopgate.gates.certified.occupancy import Occupancy


def fixpoint(stand: Occupancy, robots: list[int]) -> tuple[list[int], list[int]]:
    """Send home each robot with a free path home, again and again (Banker's rule).

    Parameters
    ----------
    stand
        The positions of all robots; changed to the positions at the end.
    robots
        The robots to send home, in the order in which to try them.

    Returns
    -------
    tuple of list
        The moves, and the robots left over because something stands in their way.

    Notes
    -----
    A robot that will stay for good in a state that other robots may need is left over, since sending it there
    could block them. O(states on the paths home + robots woken).
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
    """Send robots home, or on to states that no other robot needs, until no robot can move.

    Parameters and result as in `fixpoint`. The robots left over are the core, which only a search can decide.
    A robot that stays for good in a shared terminal goes there when no robot has to pass it and there are
    slots for all robots that stay there.
    O(rounds * states on the paths home).
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
    """Return all states that the robot enters on its path home, in order."""
    layout = stand.layout
    p = stand.at[robot]
    states = []
    for _ in range(layout.steps[robot][p]):
        p = layout.follow[robot][p]
        states.append(layout.path[robot][p])
    return states


def _harmless(stand: Occupancy, robot: int, ahead: list[int], need: dict[int, int]) -> int:
    """Return the number of moves to the farthest state that is reachable now and only this robot needs."""
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
    """Return how many robots on their way home will stay in `state` for good and do not pass it before."""
    layout = stand.layout
    total = 0
    for i in layout.system.visitors[state]:
        if layout.settles[i] == state and not layout.home[i][stand.at[i]]:
            total += _ahead(stand, i).count(state) == 1
    return total
