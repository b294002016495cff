"""Circular waits: robots that can never move again, the circle they wait in, and who would close one."""

from collections.abc import Iterable

from loopgate.gates.certified.occupancy import Occupancy


def stuck_for_good(stand: Occupancy, robots: Iterable[int]) -> list[int]:
    """Return those of `robots` that can never move again, whatever the others of them do.

    Robots not listed count as gone, but for those that stay for good. A robot may move some day if it heads
    its queue and its next state has room or may lose a robot, or if all before it in its queue may move.
    Robots that stay where they are for good are not reported. O(robots + occupants).
    """
    among = set(robots)
    waiting: dict[int, list[int]] = {}
    todo: list[int] = []
    free: set[int] = set()
    for i in sorted(among):
        if not stand.heads(i):
            line = stand.queue[stand.state(i)]
            waiting.setdefault(-1 - line[line.index(i) - 1], []).append(i)
            continue
        s = stand.wanted(i)
        if s >= 0 and stand.count[s] < stand.layout.room[s]:
            todo.append(i)
        elif s >= 0:
            waiting.setdefault(s, []).append(i)
    while todo:
        i = todo.pop()
        if i in free:
            continue
        free.add(i)
        todo += waiting.pop(-1 - i, [])  # who stands behind it
        todo += waiting.pop(stand.state(i), [])  # who wants its state
    return [i for i in sorted(among - free) if stand.wanted(i) >= 0]


def circle_among(stand: Occupancy, stuck: list[int]) -> list[int]:
    """Return robots of which each waits for the next and the last for the first.

    `stuck` are robots that can never move again. Where they wait for a robot that stays for good there may
    be no circle; then the chain up to that robot is returned. O(robots).
    """
    among = set(stuck)
    i = stuck[0]
    chain: list[int] = []
    while i not in chain:
        chain.append(i)
        ahead = _waits_for(stand, i)
        following = [j for j in ahead if j in among]
        if not following:
            return chain + ahead[:1]
        i = following[0]
    return chain[chain.index(i) :]


def _waits_for(stand: Occupancy, robot: int) -> list[int]:
    if not stand.heads(robot):
        line = stand.queue[stand.state(robot)]
        return [line[line.index(robot) - 1]]
    s = stand.wanted(robot)
    line_there = stand.occupants(s)
    return line_there[:1] if s in stand.queue else line_there
