"""Risky and safe walks (Zhou et al. 2020, Def. 7 and 8), extended to states that hold several robots.

A *full* state has no free slot. A state of capacity 1 with a robot in it is an occupied collision state: its
robot must leave before another robot can enter. A state of larger capacity with a free slot is as good as a
private state. Without a free slot it is an occupied collision state whose robot is the head of its queue; if
it is not FIFO, any of its robots may leave first. But if a chain of such full states leads to a state with a
free slot, or to a private state, all states of the chain can get a free slot by moves that block no robot. So
they count as having one.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from loopgate.model import Configuration, Placement, System


@dataclass(frozen=True, slots=True)
class Walk:
    """An individual walk of a robot (Def. 7).

    Attributes
    ----------
    robot
        The robot that makes the walk.
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
    """Return how many states a robot looks ahead: ``N - 2`` from its position (Alg. 1, step 1).

    It is at least one, so that two robots that block each other are found where Prop. 1 does not hold.
    """
    return max(1, len(system.robots) - 2)


def steps_ahead(system: System, robot: int, position: int, most: int) -> Iterator[int]:
    """Yield the next positions of `robot` after `position`: `most` of them, or up to the path's end."""
    following = system.following[robot]
    for _ in range(most):
        position = following[position]
        if position < 0:
            return
        yield position


class Holders:
    """The states that are blocked in a configuration, and the robots that block them; computed on demand.

    A state of capacity 1 is blocked if and only if a robot is in it. A larger state is blocked if and only if
    it is full, and no chain of moves out of full states of capacity above 1 leads to a private state or a
    state with a free slot.
    """

    def __init__(self, system: System, configuration: Configuration) -> None:
        self._system = system
        self._here = configuration
        self._known: dict[int, tuple[int, ...]] = {}

    @cached_property
    def _standing(self) -> dict[int, int]:
        """The robot in each occupied state; one of them in a state of larger capacity."""
        paths = zip(self._system.paths, self._here.positions, strict=True)
        return {path[p]: robot for robot, (path, p) in enumerate(paths)}

    def of(self, state: int) -> tuple[int, ...]:
        """Return the robots in a full `state`, any of which may leave first; () if it has a free slot."""
        if self._system.private[state]:
            return ()
        if self._system.room[state] == 1:
            return (self._standing[state],) if state in self._standing else ()
        if state not in self._known:
            self._follow(state)
        return self._known[state]

    def _follow(self, root: int) -> None:
        """Find the robots in `root`, a state of capacity above 1, and in the full states that it leads to."""
        system, here = self._system, self._here
        full: dict[int, tuple[int, ...]] = {}
        before: dict[int, list[int]] = {root: []}
        given: list[int] = []
        to_do = [root]
        while to_do:
            state = to_do.pop()
            if system.private[state] or (system.room[state] > 1 and system.has_room(here, state)):
                given.append(state)
            elif system.room[state] > 1:
                inside = tuple(system.occupants(here, state))
                full[state] = inside[:1] if system.states[state] in system.fifo else inside
                for robot in full[state]:
                    wanted = system.next_state(here, robot)
                    if wanted is None:
                        continue
                    if wanted not in before:
                        to_do.append(wanted)
                    before.setdefault(wanted, []).append(state)
        self._known.update(full)
        released = set(given)
        self._known.update(dict.fromkeys(given, ()))
        while given:
            for state in before[given.pop()]:
                if state not in released:
                    released.add(state)
                    given.append(state)
                    self._known[state] = ()


def risky_walks(
    system: System,
    configuration: Configuration,
    robot: int,
    *,
    held: Holders | None = None,
    lookahead: int | None = None,
) -> tuple[Walk, ...]:
    """Return the risky walks of `robot`, shortest first (Def. 8; Alg. 1, step 1).

    A risky walk runs through collision states only and ends in a state that another robot holds. A robot in a
    private state, or behind others in a FIFO state, has none. If a held state comes several times, the
    nearest counts (Section 6).

    Parameters
    ----------
    system, configuration, robot
        The system, the positions of all robots, and the robot of the walks.
    held
        `Holders` of the configuration, if the caller has them.
    lookahead
        States to look ahead; `default_lookahead` if not given.
    """
    held = held or Holders(system, configuration)
    path = system.paths[robot]
    tail = path[configuration.positions[robot]]
    if robot not in held.of(tail):
        return ()
    most = default_lookahead(system) if lookahead is None else lookahead
    states = [tail]
    heads: set[int] = set()
    walks: list[Walk] = []
    for position in steps_ahead(system, robot, configuration.positions[robot], most):
        state = path[position]
        by = held.of(state)
        if system.private[state] or (system.room[state] > 1 and not by):
            break
        states.append(state)
        if by not in {(), (robot,)} and state not in heads:
            heads.add(state)
            walks.append(Walk(robot, tuple(states)))
    return tuple(walks)


def safe_walk(system: System, configuration: Placement, robot: int) -> Walk | None:
    """Return the safe walk of `robot`, or None (Def. 8).

    In a safe walk every state up to the robot's next private state has a free slot. The terminal state of an
    open path counts as private if no other robot will come to it. O(path length).
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


def _needed(system: System, configuration: Placement, robot: int, state: int) -> bool:
    """Return whether another robot than `robot` will come to `state`."""
    for other in system.visitors[state] - {robot}:
        path = system.paths[other]
        ahead = steps_ahead(system, other, configuration.positions[other], len(path))
        if any(path[position] == state for position in ahead):
            return True
    return False
