"""Risky and safe walks (Zhou et al. 2020, Def. 7 and 8), extended to states that hold several robots.

A *full* state is one no further robot fits into. A state of capacity 1 that a robot stands in is an occupied
collision state; what its robot must do before another can enter is to leave it. A state of larger
capacity that has room is as good as a private state. One that is full is an occupied collision state, and its
robot is the head of its queue; if it is not FIFO, any of its robots may leave first. But where a chain of
such full states leads to one with room, or to a private state, all of them can get room by moves that block
nobody, so they count as having room.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from loopgate.model import Configuration, System

__all__ = ["Walk", "default_lookahead", "held_states", "risky_walks", "safe_walk", "steps_ahead"]


@dataclass(frozen=True, slots=True)
class Walk:
    """An individual walk of a robot (Def. 7).

    Attributes
    ----------
    robot
        Whose walk it is.
    states
        State numbers from the tail, where the robot stands, to the head.
    """

    robot: int
    states: tuple[int, ...]

    @property
    def tail(self) -> int:
        """The state in which the robot stands, ``t(w)``."""
        return self.states[0]

    @property
    def head(self) -> int:
        """The last state, ``h(w)``."""
        return self.states[-1]

    @property
    def intermediate(self) -> tuple[int, ...]:
        """The states between tail and head in driving order, ``SE(w)``; ``L(w)`` of them."""
        return self.states[1:-1]


def default_lookahead(system: System) -> int:
    """Return how many states a robot looks ahead: ``N - 2`` from where it stands (Alg. 1, step 1).

    At least one, so that two robots that block each other are seen where Prop. 1 does not hold.
    """
    return max(1, len(system.robots) - 2)


def steps_ahead(system: System, robot: int, position: int, most: int) -> tuple[int, ...]:
    """Return the positions `robot` comes to after `position`, `most` of them or up to the path's end."""
    ahead: list[int] = []
    following = system.robots[robot].next_position(position)
    while following is not None and len(ahead) < most:
        ahead.append(following)
        following = system.robots[robot].next_position(following)
    return tuple(ahead)


def held_states(system: System, configuration: Configuration) -> dict[int, tuple[int, ...]]:
    """Return the states that block, each with the robots one of which must leave before another can enter.

    A state of capacity 1 blocks iff a robot stands in it. A larger one blocks iff it is full and no chain of
    moves out of full states of capacity above 1 leads to a private state or to one with room. An empty
    collision state of capacity 1 does not give way in this sense: walks pass through it.

    O(robots + states), and O(states * robots) where states hold several.
    """
    full: dict[int, tuple[int, ...]] = {}
    for state, count in enumerate(system.occupancy(configuration)):
        if not system.private[state] and count >= system.room[state]:
            inside = tuple(system.occupants(configuration, state))
            full[state] = inside[:1] if state in system.fifo_states else inside
    released = True
    while released:
        released = False
        for state, robots in list(full.items()):
            if system.room[state] == 1:
                continue
            wanted = {system.next_state(configuration, robot) for robot in robots} - {None}
            if any(_gives_way(system, full, after) for after in wanted if after is not None):
                del full[state]
                released = True
    return full


def _gives_way(system: System, held: Mapping[int, tuple[int, ...]], state: int) -> bool:
    return system.private[state] or (system.room[state] > 1 and state not in held)


def risky_walks(
    system: System,
    configuration: Configuration,
    robot: int,
    *,
    held: Mapping[int, tuple[int, ...]] | None = None,
    lookahead: int | None = None,
) -> tuple[Walk, ...]:
    """Return the risky walks of `robot`, shortest first (Def. 8; Alg. 1, step 1).

    A risky walk runs through collision states only and ends in one that another robot holds. A robot in a
    private state, or behind others in a FIFO state, has none. Where a held state comes several times, the
    nearest counts (Section 6).

    Parameters
    ----------
    system, configuration, robot
        Where everyone stands, and whose walks to return.
    held
        `held_states` of the configuration, if the caller has them.
    lookahead
        States to look ahead; `default_lookahead` if not given.
    """
    blocking = held_states(system, configuration) if held is None else held
    tail = system.state_at(configuration, robot)
    if robot not in blocking.get(tail, ()):
        return ()
    most = default_lookahead(system) if lookahead is None else lookahead
    states = [tail]
    heads: set[int] = set()
    walks: list[Walk] = []
    for position in steps_ahead(system, robot, configuration.positions[robot], most):
        state = system.paths[robot][position]
        if _gives_way(system, blocking, state):
            break
        states.append(state)
        if state not in heads and any(other != robot for other in blocking.get(state, ())):
            heads.add(state)
            walks.append(Walk(robot, tuple(states)))
    return tuple(walks)


def safe_walk(system: System, configuration: Configuration, robot: int) -> Walk | None:
    """Return the safe walk of `robot`, or None (Def. 8): every state has room up to its next private state.

    The terminal state of an open path counts as private if no other robot will come to it. O(path length).
    """
    states = [system.state_at(configuration, robot)]
    path = system.paths[robot]
    for position in steps_ahead(system, robot, configuration.positions[robot], len(path)):
        state = path[position]
        if not system.has_room(configuration, state):
            return None
        states.append(state)
        last = system.robots[robot].next_position(position) is None
        if system.private[state] or (last and not _needed(system, configuration, robot, state)):
            return Walk(robot, tuple(states))
    return None


def _needed(system: System, configuration: Configuration, robot: int, state: int) -> bool:
    """Return whether another robot than `robot` will come to `state`."""
    for other in system.visitors[state] - {robot}:
        path = system.paths[other]
        ahead = steps_ahead(system, other, configuration.positions[other], len(path))
        if any(path[position] == state for position in ahead):
            return True
    return False
