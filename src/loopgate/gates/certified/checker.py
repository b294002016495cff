"""The witness checker: it replays moves one by one and knows no search. What it accepts is safe.

It shares no code with the stages that find witnesses, so that a mistake there costs permissiveness, never
safety. Only the model's own data are read.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence

from loopgate.model import Configuration, System

__all__ = ["brings_home", "brings_round"]


class _Replay:
    """The system, moved on from a configuration by legal moves only."""

    def __init__(self, system: System, configuration: Configuration) -> None:
        self._system = system
        self.at = list(configuration.positions)
        self.inside = system.occupancy(configuration)
        self.order = dict(zip(system.fifo_states, map(deque, configuration.queues), strict=True))

    def play(self, moves: Iterable[int]) -> bool:
        """Make the moves; False at the first that breaks a capacity, an order, or does not exist."""
        paths, robots, room = self._system.paths, self._system.robots, self._system.room
        at, inside, order = self.at, self.inside, self.order
        for robot in moves:
            path, here = paths[robot], at[robot]
            there = here + 1 if here + 1 < len(path) else 0
            if there == 0 and (not robots[robot].closed or here == 0):
                return False
            left, entered = path[here], path[there]
            if inside[entered] >= room[entered]:
                return False
            if left in order and order[left].popleft() != robot:
                return False
            if entered in order:
                order[entered].append(robot)
            inside[left] -= 1
            inside[entered] += 1
            at[robot] = there
        return True


def brings_home(
    system: System, configuration: Configuration, moves: Sequence[int], home: Sequence[Sequence[bool]]
) -> bool:
    """Return whether `moves` are legal one after the other and end with every robot at home.

    Parameters
    ----------
    system, configuration
        Where the moves begin.
    moves
        One robot number per move.
    home
        Whether a position is a home, per robot and position (see `Layout`).

    Notes
    -----
    O(moves + robots + states).
    """
    replay = _Replay(system, configuration)
    return replay.play(moves) and all(at_home[p] for at_home, p in zip(home, replay.at, strict=True))


def brings_round(
    system: System, configuration: Configuration, approach: Sequence[int], circle: Sequence[int]
) -> bool:
    """Return whether `approach` is legal, and then `circle`, which moves all and leads back to its beginning.

    That is a witness that every robot can go on for ever in a system whose robots have no homes: the
    circle can be driven again and again. Robots that stay for good at its beginning need not move.
    O(moves + robots + states).
    """
    replay = _Replay(system, configuration)
    if not replay.play(approach):
        return False
    before = list(replay.at), {s: list(q) for s, q in replay.order.items()}
    if not replay.play(circle) or before != (replay.at, {s: list(q) for s, q in replay.order.items()}):
        return False
    moving = set(circle)
    return all(
        i in moving or robot.next_position(p) is None
        for i, (robot, p) in enumerate(zip(system.robots, replay.at, strict=True))
    )
