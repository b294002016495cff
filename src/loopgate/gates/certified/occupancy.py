"""The positions of all robots, in plain lists that a search can change, and circular waits among them."""

from __future__ import annotations

from collections.abc import Iterable

from loopgate.gates.certified.system_index import SystemIndex
from loopgate.gates.deadlocks import deadlocked
from loopgate.model import Configuration


class Occupancy:
    """A configuration as lists, for fast searches: positions, occupancy and queues.

    Attributes
    ----------
    at
        Position by robot.
    count
        Robots in each state, by state.
    queue
        Robots in each shared FIFO state, head first, by state.
    """

    __slots__ = ("at", "count", "layout", "queue")

    def __init__(
        self, layout: SystemIndex, at: list[int], count: list[int], queue: dict[int, list[int]]
    ) -> None:
        self.layout = layout
        self.at = at
        self.count = count
        self.queue = queue

    @classmethod
    def of(cls, layout: SystemIndex, configuration: Configuration) -> Occupancy:
        """Return the lists for `configuration`. O(robots + states)."""
        at = list(configuration.positions)
        queues = zip(layout.system.fifo_states, configuration.queues, strict=True)
        count = layout.system.occupancy(configuration)
        return cls(layout, at, count, {s: list(robots) for s, robots in queues})

    def copy(self) -> Occupancy:
        """Return a copy that can be changed on its own."""
        queue = {s: list(q) for s, q in self.queue.items()} if self.queue else {}
        return Occupancy(self.layout, self.at[:], self.count[:], queue)

    def after(self, *robots: int) -> Occupancy:
        """Return the positions of all robots after a sequence of enabled moves."""
        there = self.copy()
        for robot in robots:
            there.step(robot)
        return there

    def state(self, robot: int) -> int:
        """Return the state in which `robot` stands."""
        return self.layout.path[robot][self.at[robot]]

    def wanted(self, robot: int) -> int:
        """Return the next state of `robot`; -1 if it stays."""
        q = self.layout.follow[robot][self.at[robot]]
        return -1 if q < 0 else self.layout.path[robot][q]

    def heads(self, robot: int) -> bool:
        """Return whether no robot is ahead of `robot` in a FIFO state."""
        queue = self.queue.get(self.layout.path[robot][self.at[robot]])
        return queue is None or queue[0] == robot

    def enabled(self, robot: int) -> bool:
        """Return whether `robot` can move within the capacity and the FIFO order."""
        s = self.wanted(robot)
        return s >= 0 and self.count[s] < self.layout.room[s] and self.heads(robot)

    def step(self, robot: int) -> None:
        """Make the next move of `robot`, which must be enabled."""
        path = self.layout.path[robot]
        p = self.at[robot]
        q = self.layout.follow[robot][p]
        left, entered = path[p], path[q]
        self.at[robot] = q
        self.count[left] -= 1
        self.count[entered] += 1
        if self.queue:
            queue = self.queue.get(left)
            if queue is not None:
                queue.remove(robot)
            queue = self.queue.get(entered)
            if queue is not None:
                queue.append(robot)

    def occupants(self, state: int) -> list[int]:
        """Return the robots in `state`, head first in a FIFO state, else in robot order."""
        queue = self.queue.get(state)
        if queue is not None:
            return list(queue)
        path, at = self.layout.path, self.at
        return [i for i in sorted(self.layout.system.visitors[state]) if path[i][at[i]] == state]

    def queues(self) -> tuple[tuple[int, ...], ...]:
        """Return the queues in the form of a `Configuration`."""
        return tuple(tuple(self.queue[s]) for s in self.layout.system.fifo_states)


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
