"""Where robots are out of the way: homes and rests, written once more for checking."""

from collections.abc import Sequence
from functools import cache

from loopgate.model import Configuration, System


class Places:
    """Homes and rests of a system's robots.

    A robot at *home* hinders nobody: its state is its own, or is left in any order and holds all its
    visitors; on an open path nothing behind it may be closed for good by robots that end there, and the end
    is a home. A *rest* is a home, or a state that holds two robots or more besides those that end there;
    with `rests` these count as homes too.
    """

    def __init__(self, system: System, *, rests: bool = False) -> None:
        self.system = system
        self._rests = rests
        self._fifo = frozenset(system.fifo_states)
        self._ends: dict[int, list[int]] = {}
        for i, path in enumerate(system.paths):
            if system.robots[i].next_position(len(path) - 1) is None:
                self._ends.setdefault(path[-1], []).append(i)
        self.home = cache(self._home)
        self.rest = cache(self._rest)

    def hinders_nobody(self, state: int) -> bool:
        """Return whether a state never blocks: it always has room, and robots leave in any order."""
        system = self.system
        holds_all = state not in self._fifo and system.room[state] >= len(system.visitors[state])
        return system.private[state] or holds_all or (self._rests and self.wide(state))

    def ends_in(self, robot: int, position: int) -> bool:
        """Return whether the robot stays for good at this position."""
        return self.system.robots[robot].next_position(position) is None

    def _home(self, robot: int, position: int) -> bool:
        if self.ends_in(robot, position):
            return True
        if not self.hinders_nobody(self.system.paths[robot][position]):
            return False
        return self._open_behind(robot, position)

    def _open_behind(self, robot: int, position: int) -> bool:
        path = self.system.paths[robot]
        if not self.ends_in(robot, len(path) - 1):
            return True
        return all(self._stays_open(robot, p) for p in range(position + 1, len(path)))

    def _stays_open(self, robot: int, position: int) -> bool:
        state = self.system.paths[robot][position]
        others = [i for i in self._ends.get(state, ()) if i != robot]
        if others and state in self._fifo and not self.ends_in(robot, position):
            return False
        return self.system.room[state] > len(others)

    def wide(self, state: int) -> bool:
        """Return whether a state can block and holds two or more robots, besides robots that end there."""
        ends = self._ends.get(state, [])
        holds_all = state not in self._fifo and self.system.room[state] >= len(self.system.visitors[state])
        if self.system.private[state] or holds_all:
            return False
        if self.system.room[state] - len(ends) < 2 or (ends and state in self._fifo):  # noqa: PLR2004 - a pair
            return False
        return all(
            self._open_behind(i, p)
            for i in self.system.visitors[state]
            for p, s in enumerate(self.system.paths[i])
            if s == state
        )

    def _rest(self, robot: int, position: int) -> bool:
        return self._home(robot, position) or self.wide(self.system.paths[robot][position])

    def way_home(self, robot: int, position: int) -> list[int]:
        """Return the states that the robot enters until it is at home."""
        states: list[int] = []
        while not self.home(robot, position) and len(states) < len(self.system.paths[robot]):
            following = self.system.robots[robot].next_position(position)
            if following is None:
                break
            position = following
            states.append(self.system.paths[robot][position])
        return states

    def rest_of(self, robot: int, position: int) -> int:
        """Return the position of the rest in which the robot is or which it reaches next."""
        for _ in self.system.paths[robot]:
            following = self.system.robots[robot].next_position(position)
            if self.rest(robot, position) or following is None:
                break
            position = following
        return position

    def held(self, configuration: Configuration, place: int) -> int:
        """Return the number of robots that rest in `place` or are on their way there."""
        paths = self.system.paths
        return sum(
            paths[i][self.rest_of(i, p)] == place and self.rest(i, self.rest_of(i, p))
            for i, p in enumerate(configuration.positions)
        )

    def jammed(self, configuration: Configuration) -> list[int]:
        """Return the wide places that are full for good, with every robot at rest."""
        stuck = {s for s in range(len(self.system.states)) if self._full(configuration, s)}
        while True:
            free = {s for s in stuck if not self._waits_only(configuration, s, stuck)}
            if not free:
                return sorted(stuck)
            stuck -= free

    def closed_jam(self, configuration: Configuration, places: Sequence[int]) -> bool:
        """Return whether all of `places` are full, on their way robots included, and wait for each other."""
        stuck = set(places)
        return bool(stuck) and all(
            self._full(configuration, s) and self._waits_only(configuration, s, stuck) for s in stuck
        )

    def _full(self, configuration: Configuration, place: int) -> bool:
        return self.wide(place) and self.held(configuration, place) >= self.system.room[place]

    def _waits_only(self, configuration: Configuration, place: int, stuck: set[int]) -> bool:
        """Return whether the next robot that leaves `place` wants a place of `stuck`, or may do so."""
        inside = self.system.occupants(configuration, place)
        coming = [
            i
            for i, p in enumerate(configuration.positions)
            if not self.rest(i, p) and self.system.paths[i][self.rest_of(i, p)] == place
        ]
        goals = {i: self._goal(i, configuration.positions[i]) for i in [*inside, *coming]}
        leaving = [i for i in inside if goals[i] not in {place, None}]
        later = [i for i in coming if goals[i] not in {place, None}]
        if place not in self._fifo:
            return all(goals[i] in stuck for i in [*leaving, *later])
        if leaving:
            return goals[leaving[0]] in stuck
        return not later or any(goals[i] in stuck for i in later)

    def _goal(self, robot: int, position: int) -> int | None:
        """Return the rest that the robot drives to from the rest where it is or which it reaches next."""
        following = self.system.robots[robot].next_position(self.rest_of(robot, position))
        return None if following is None else self.system.paths[robot][self.rest_of(robot, following)]
