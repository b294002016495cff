"""The positions of all robots, in plain lists that a search can change and copy."""

from __future__ import annotations

from loopgate.gates.certified.system_index import SystemIndex
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
