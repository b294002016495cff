"""Circular waits: robots that can never move again, their circle, and moves that would close a circle."""

from collections.abc import Iterable

from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.deadlocks import deadlocked


def stuck_for_good(stand: Occupancy, robots: Iterable[int]) -> list[int]:
    """Return the robots of `robots` that can never move again.

    Robots not listed count as gone, except robots that stay for good. A robot may move some day in two cases:
    it heads its queue, and its next state has a free slot or may lose a robot; or all robots before it in its
    queue may move. Robots that stay where they are for good are not returned. O(robots + occupants).
    """
    members = set(robots)
    inside: dict[int, list[int]] = {}
    for i in members:
        inside.setdefault(stand.state(i), []).append(i)
    waits: dict[int, list[list[int]]] = {}
    for i in members:
        s = stand.wanted(i)
        if not stand.heads(i):
            line = stand.queue[stand.state(i)]
            ahead = line[line.index(i) - 1]
            waits[i] = [[ahead] if ahead in members else []]
        elif s < 0:
            waits[i] = [[]]
        elif stand.count[s] >= stand.layout.room[s]:
            waits[i] = [inside.get(s, [])]
    return sorted(i for i in deadlocked(waits) if stand.wanted(i) >= 0)


def circle_among(stand: Occupancy, stuck: list[int]) -> list[int]:
    """Return robots of which each waits for the next and the last for the first.

    `stuck`: robots that can never move again. If they wait for a robot that stays for good there may be no
    circle; then the chain up to that robot is returned. O(robots).
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
