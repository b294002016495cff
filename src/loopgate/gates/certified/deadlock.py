"""Circular waits: robots that can never move again, the circle they wait in, and who would close one."""

from collections.abc import Iterable, Sequence
from typing import Protocol

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


class Standing(Protocol):
    """The places in which robots stand, and those that they want next."""

    def line(self, state: int, /) -> Sequence[int]:
        """Return the robots whose last grant is a state, first one first."""
        ...

    def slots(self, state: int, /) -> int:
        """Return how many robots fit into a state."""
        ...

    def wanted(self, robot: int, /) -> int:
        """Return the state behind the last that was granted to a robot."""
        ...


def closes_by_entering(standing: Standing, state: int, *, room: int, wanted: int | None) -> bool:
    """Return whether one more, last in line in a state, closes a circle of full places.

    `room` robots fit into the state; the newcomer wants the state `wanted` next, None for one that is empty.
    """
    line = standing.line(state)
    if len(line) + 1 < room:
        return False
    return leads_round(standing, standing.wanted(line[0]) if line else wanted, state)


def leads_round(standing: Standing, first: int | None, state: int) -> bool:
    """Return whether full places lead from `first` to `state` or into a circle, each by what its head wants.

    O(places on the way).
    """
    seen = {state}
    while first is not None and first not in seen:
        line = standing.line(first)
        if len(line) < standing.slots(first):
            return False
        seen.add(first)
        first = standing.wanted(line[0])
    return first is not None
