"""Circular waits: robots that can never move again, the circle they wait in, and who would close one."""

from collections.abc import Iterable, Mapping, Sequence

from loopgate.gates.certified.occupancy import Occupancy


def free_some_day(
    free: Iterable[int], waiting: Mapping[int, Sequence[int]], needed: dict[int, int]
) -> set[int]:
    """Return all that go on some day: those that are free, and those that wait for enough of them.

    `waiting` has those that wait for each, `needed` how many of those that it waits for must go on before one
    does; 1 where it says nothing. It is changed. O(waits).
    """
    todo, found = list(free), set[int]()
    while todo:
        one = todo.pop()
        if one in found:
            continue
        found.add(one)
        for other in waiting.get(one, ()):
            needed[other] = needed.get(other, 1) - 1
            if needed[other] <= 0:
                todo.append(other)
    return found


def stuck_for_good(stand: Occupancy, robots: Iterable[int]) -> list[int]:
    """Return those of `robots` that can never move again, whatever the others of them do.

    Robots not listed count as gone, but for those that stay for good. A robot may move some day if it heads
    its queue and its next state has room or may lose a robot, or if all before it in its queue may move.
    Robots that stay where they are for good are not reported. O(robots + occupants).
    """
    among = set(robots)
    waiting: dict[int, list[int]] = {}
    free: list[int] = []
    for i in among:
        waiting.setdefault(i, []).append(-1 - stand.state(i))  # a slot of it, numbered below 0
        if not stand.heads(i):
            line = stand.queue[stand.state(i)]
            waiting.setdefault(line[line.index(i) - 1], []).append(i)
            continue
        s = stand.wanted(i)
        if s >= 0 and stand.count[s] < stand.layout.room[s]:
            free.append(i)
        elif s >= 0:
            waiting.setdefault(-1 - s, []).append(i)
    going = free_some_day(free, waiting, {})
    return [i for i in sorted(among - going) if stand.wanted(i) >= 0]


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
