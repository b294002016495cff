"""The checker of witnesses: it replays moves without a search, and accepts only correct witnesses.

It shares no code with the stages that find witnesses, so that a mistake there costs permissiveness, never
safety. Only the model's own data are read.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from operator import getitem

from loopgate.model import Configuration, System


class Checker:
    """Replays moves of a system, and checks where they lead."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._paths = system.paths
        self._room = system.room
        self._next = [
            [-1 if (q := robot.next_position(p)) is None else q for p in range(len(robot.path))]
            for robot in system.robots
        ]

    def brings_home(
        self, configuration: Configuration, moves: Sequence[int], home: Sequence[Sequence[bool]]
    ) -> bool:
        """Return whether `moves` are legal in order and bring every robot home.

        Parameters
        ----------
        configuration
            Where the moves begin.
        moves
            One robot number per move.
        home
            Whether a position is a home, per robot and position (see `SystemIndex`).

        Notes
        -----
        O(moves + robots + states).
        """
        at = list(configuration.positions)
        order = self._order(configuration)
        if not self._play(at, order, moves):
            return False
        return all(map(getitem, home, at))

    def brings_round(
        self, configuration: Configuration, approach: Sequence[int], circle: Sequence[int]
    ) -> bool:
        """Return whether `approach` and then `circle` are legal, and `circle` moves all robots round.

        That is a witness that every robot can go on for ever in a system whose robots have no homes: the
        circle can be driven again and again. Robots that stay for good at its beginning need not move.
        O(moves + robots + states).
        """
        at = list(configuration.positions)
        order = self._order(configuration)
        if not self._play(at, order, approach):
            return False
        before = list(at), {s: list(queue) for s, queue in order.items()}
        if not self._play(at, order, circle):
            return False
        if before != (at, {s: list(queue) for s, queue in order.items()}):
            return False
        moving = set(circle)
        return all(i in moving or self._next[i][p] < 0 for i, p in enumerate(at))

    def leaves_room(
        self, configuration: Configuration, moves: Sequence[int], blocking: Sequence[bool]
    ) -> bool:
        """Return whether `moves` are legal and leave a free slot in every state that can block.

        A robot whose path ends must by then be in the last state of its path, and that state must never
        block. From there every other robot can drive for ever, see `FreeSlots`. `blocking`: for each state,
        whether it can block. O(moves + robots + states).
        """
        at = list(configuration.positions)
        if not self._play(at, self._order(configuration), moves):
            return False
        inside = [0] * len(self._room)
        for path, following, p in zip(self._paths, self._next, at, strict=True):
            inside[path[p]] += 1
            if following[-1] < 0 and (following[p] >= 0 or blocking[path[p]]):
                return False
        return all(n < most or not may for n, most, may in zip(inside, self._room, blocking, strict=True))

    def _order(self, configuration: Configuration) -> dict[int, deque[int]]:
        if not configuration.queues:
            return {}
        return dict(zip(self._system.fifo_states, map(deque, configuration.queues), strict=True))

    def _play(self, at: list[int], order: dict[int, deque[int]], moves: Iterable[int]) -> bool:
        """Make the moves; False at the first that breaks a capacity, an order, or does not exist."""
        paths, room, following = self._paths, self._room, self._next
        inside = [0] * len(room)
        for path, p in zip(paths, at, strict=True):
            inside[path[p]] += 1
        for robot in moves:
            p = at[robot]
            q = following[robot][p]
            path = paths[robot]
            entered = path[q]
            if q < 0 or inside[entered] >= room[entered]:
                return False
            left = path[p]
            if order:
                if left in order and order[left].popleft() != robot:
                    return False
                if entered in order:
                    order[entered].append(robot)
            inside[left] -= 1
            inside[entered] += 1
            at[robot] = q
        return True
