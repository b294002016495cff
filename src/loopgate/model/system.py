"""The labelled transition system of all robots together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple, NewType, Protocol

from loopgate.errors import IllegalMoveError, SystemModelError
from loopgate.reading import shown


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot on a fixed path: the sequence of states that it visits (Zhou et al. 2020, Section 3.2).

    Raises `SystemModelError` on an empty name or path, a start outside the path, or a state that follows
    itself.

    Parameters
    ----------
    id
        The robot's name, unique in its system.
    path
        The states in driving order. A state may occur several times, but not twice in a row; each visit is a
        position of its own.
    closed
        Whether the last state is followed by the first. An open path ends in a terminal state where the
        robot stays for good.
    start
        Position on the path at the beginning, ``0 <= start < len(path)``.

    Examples
    --------
    >>> from loopgate import Robot
    >>> Robot("a", ("s1", "s2", "s3")).next_position(2)
    0
    >>> Robot("b", ("s1", "s2", "s3"), closed=False).next_position(2) is None
    True
    """

    id: RobotId
    path: tuple[StateId, ...]
    closed: bool = True
    start: int = 0

    def __post_init__(self) -> None:
        if not self.id:
            msg = "a robot has an empty id; give every robot a name"
            raise SystemModelError(msg)
        if not self.path:
            msg = f"robot {self.id}: its path is empty; a path needs at least one state"
            raise SystemModelError(msg)
        if not all(self.path):
            msg = f"robot {self.id}: a state on its path has an empty id"
            raise SystemModelError(msg)
        if not 0 <= self.start < len(self.path):
            last = len(self.path) - 1
            msg = f"robot {self.id}: start {shown(self.start)} is not a position on its path (0 to {last})"
            raise SystemModelError(msg)
        followers = self.path[1:] + self.path[:1] if self.closed and len(self.path) > 1 else self.path[1:]
        for here, following in zip(self.path, followers, strict=False):
            if here == following:
                msg = f"robot {self.id}: state {here} follows itself; write the two visits as one"
                raise SystemModelError(msg)

    def next_position(self, position: int) -> int | None:
        """Return the index on the path after `position`; None if the robot stays for good.

        A robot stays for good at the end of an open path and on a closed path of a single state.
        """
        if position + 1 < len(self.path):
            return position + 1
        return 0 if self.closed and len(self.path) > 1 else None


class Placement(Protocol):
    """The interface of positions of robots: of a `Configuration` or a `MutableConfiguration`."""

    @property
    def positions(self) -> Sequence[int]:
        """The index on its path of each robot."""
        ...

    @property
    def queues(self) -> Sequence[Sequence[int]]:
        """The robots in each FIFO state in order, by state number."""
        ...


class Configuration(NamedTuple):
    """The positions of all robots of a system, and their order within FIFO states."""

    positions: tuple[int, ...]
    """``positions[i]`` is the index on its path of robot ``i``; each visit of a state in one round is a
    position of its own."""
    queues: tuple[tuple[int, ...], ...] = ()
    """For each FIFO state, in the order of ``System.fifo_states``, the robots in it, head first. Empty for
    systems without FIFO states."""


class MutableConfiguration:
    """A configuration that can be changed: moves are made and undone in place.

    `System.make` and `System.take_back` do so.
    """

    __slots__ = ("positions", "queues")

    def __init__(self, placement: Placement) -> None:
        self.positions = list(placement.positions)
        self.queues = [list(queue) for queue in placement.queues]

    def frozen(self) -> Configuration:
        """Return an immutable copy of the present configuration."""
        return Configuration(tuple(self.positions), tuple(map(tuple, self.queues)))


RobotId = NewType("RobotId", str)
"""Name of a robot (on the road: of a vehicle)."""

StateId = NewType("StateId", str)
"""Name of a discrete state (on the road: of a segment or of a place where vehicles may wait)."""


LARGEST_CAPACITY = 1_000_000
"""More than any road holds; sums over all states still fit into the integers of compiled code."""


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """Robots on paths over states, some of which are shared (Zhou et al. 2020, Section 3.2).

    Robots and states are numbered: robot ``i`` is ``robots[i]``; state numbers follow the first
    appearance along the robots' paths. Algorithms use the numbers; names are for people.

    A state that a single robot visits is *private*; every other state is a *collision state*. A collision
    state holds ``capacity`` robots at once, one unless said otherwise. In a *FIFO* state robots leave in
    the order in which they came; in any other state they may leave in any order.

    Raises `SystemModelError` on duplicate robots, capacities below 1 or above `LARGEST_CAPACITY`, capacity or
    FIFO given for a state that is on no path, or more robots starting in a state than it holds.

    Parameters
    ----------
    robots
        At least one robot; ids are unique.
    capacity
        The number of robots that a state holds at once, by the state's name; 1 for states that are not named.
    fifo
        Names of the states that robots leave in the order of their arrival.

    Examples
    --------
    >>> from loopgate import Robot, System
    >>> system = System([Robot("a", ("a1", "s", "a2")), Robot("b", ("b1", "s", "s2"))], {"s": 2})
    >>> [system.states[number] for number, alone in enumerate(system.private) if not alone]
    ['s']
    """

    robots: tuple[Robot, ...]
    capacity: Mapping[StateId, int] = field(default_factory=dict)
    fifo: frozenset[StateId] = frozenset()

    states: tuple[StateId, ...] = field(init=False, repr=False)
    """Names of the states by number."""
    paths: tuple[tuple[int, ...], ...] = field(init=False, repr=False)
    """``paths[i][p]`` is the number of the state at position ``p`` on robot ``i``'s path."""
    visitors: tuple[frozenset[int], ...] = field(init=False, repr=False)
    """``visitors[s]`` are the robots whose path contains state ``s``."""
    private: tuple[bool, ...] = field(init=False, repr=False)
    """Whether a single robot visits state ``s``."""
    room: tuple[int, ...] = field(init=False, repr=False)
    """Number of robots that state ``s`` holds."""
    fifo_states: tuple[int, ...] = field(init=False, repr=False)
    """Numbers of the FIFO states that are shared, ascending; indexes ``Configuration.queues``."""
    following: tuple[tuple[int, ...], ...] = field(init=False, repr=False)
    """``following[i][p]`` is the position robot ``i`` moves to from position ``p``, -1 if it stays."""
    _queue_of: dict[int, int] = field(init=False, repr=False)

    def __init__(
        self,
        robots: Iterable[Robot],
        capacity: Mapping[StateId, int] | None = None,
        fifo: Iterable[StateId] = (),
    ) -> None:
        put = object.__setattr__  # the dataclass is frozen; its derived fields are set once, here
        put(self, "robots", tuple(robots))
        put(self, "capacity", MappingProxyType(dict(capacity or {})))
        put(self, "fifo", frozenset(fifo))
        self._check_robots()
        number: dict[StateId, int] = {}
        for robot in self.robots:
            for state in robot.path:
                number.setdefault(state, len(number))
        self._check_names(number)
        put(self, "states", tuple(number))
        put(self, "paths", tuple(tuple(number[s] for s in robot.path) for robot in self.robots))
        visitors: list[set[int]] = [set() for _ in number]
        for i, path in enumerate(self.paths):
            for s in path:
                visitors[s].add(i)
        put(self, "visitors", tuple(frozenset(v) for v in visitors))
        put(self, "private", tuple(len(v) == 1 for v in visitors))
        put(self, "room", tuple(self.capacity.get(name, 1) for name in self.states))
        fifo_states = tuple(
            s for s, name in enumerate(self.states) if name in self.fifo and not self.private[s]
        )
        put(self, "fifo_states", fifo_states)
        put(self, "_queue_of", {s: q for q, s in enumerate(fifo_states)})
        following = tuple(
            (
                *range(1, len(robot.path)),
                -1 if (first := robot.next_position(len(robot.path) - 1)) is None else first,
            )
            for robot in self.robots
        )
        put(self, "following", following)
        self._check_start()

    def _check_robots(self) -> None:
        if not self.robots:
            msg = "the system has no robots"
            raise SystemModelError(msg)
        for name, count in Counter(robot.id for robot in self.robots).items():
            if count > 1:
                msg = f"robot {name}: the id is used by {count} robots; ids must be unique"
                raise SystemModelError(msg)

    def _check_names(self, number: Mapping[StateId, int]) -> None:
        for name, room in self.capacity.items():
            if name not in number:
                msg = f"state {name}: a capacity is given, but no robot's path visits it"
                raise SystemModelError(msg)
            if not 1 <= room <= LARGEST_CAPACITY:
                msg = f"state {name}: its capacity is {shown(room)}; expected 1 to {LARGEST_CAPACITY}"
                raise SystemModelError(msg)
        for name in sorted(self.fifo):
            if name not in number:
                msg = f"state {name}: it is listed as FIFO, but no robot's path visits it"
                raise SystemModelError(msg)

    def _check_start(self) -> None:
        standing: dict[int, list[RobotId]] = {}
        for robot, path in zip(self.robots, self.paths, strict=True):
            standing.setdefault(path[robot.start], []).append(robot.id)
        for s, names in standing.items():
            if len(names) > self.room[s]:
                msg = (
                    f"state {self.states[s]}: robots {', '.join(names)} start in it, "
                    f"but it holds {self.room[s]}; start all but that many elsewhere"
                )
                raise SystemModelError(msg)

    @property
    def initial(self) -> Configuration:
        """The configuration in which every robot is at its start.

        Robots that start in one FIFO state are queued in the order in which they are listed, head first.
        """
        return self.configuration(robot.start for robot in self.robots)

    def configuration(self, positions: Iterable[int]) -> Configuration:
        """Return the configuration with given positions; FIFO states are queued in robot order."""
        where = tuple(positions)
        queues: list[list[int]] = [[] for _ in self.fifo_states]
        for i, p in enumerate(where):
            q = self._queue_of.get(self.paths[i][p])
            if q is not None:
                queues[q].append(i)
        return Configuration(where, tuple(tuple(q) for q in queues))

    def robot_number(self, name: RobotId) -> int:
        """Return the number of the robot with a name.

        Raises `SystemModelError` if no robot has that name.
        """
        for i, robot in enumerate(self.robots):
            if robot.id == name:
                return i
        msg = f"robot {name}: there is no such robot; there are {', '.join(r.id for r in self.robots)}"
        raise SystemModelError(msg)

    def state_at(self, configuration: Placement, robot: int) -> int:
        """Return the state that `robot` occupies."""
        return self.paths[robot][configuration.positions[robot]]

    def next_position(self, configuration: Placement, robot: int) -> int | None:
        """Return the next index of `robot` on its path; None if it stays for good."""
        following = self.following[robot][configuration.positions[robot]]
        return None if following < 0 else following

    def next_state(self, configuration: Placement, robot: int) -> int | None:
        """Return the next state of `robot`; None if it stays for good."""
        following = self.following[robot][configuration.positions[robot]]
        return None if following < 0 else self.paths[robot][following]

    def finished(self, configuration: Placement, robot: int) -> bool:
        """Return whether `robot` is at the end of its path and stays there for good."""
        return self.following[robot][configuration.positions[robot]] < 0

    def occupancy(self, configuration: Placement) -> list[int]:
        """Return the number of robots in each state, by state number."""
        count = [0] * len(self.states)
        for path, p in zip(self.paths, configuration.positions, strict=True):
            count[path[p]] += 1
        return count

    def occupants(self, configuration: Placement, state: int) -> list[int]:
        """Return the robots in `state`: the head first in a FIFO state, otherwise in robot order."""
        q = self._queue_of.get(state)
        if q is not None:
            return list(configuration.queues[q])
        return [i for i in sorted(self.visitors[state]) if self.paths[i][configuration.positions[i]] == state]

    def head(self, configuration: Placement, state: int) -> int | None:
        """Return the first robot in `state`; None if the state is empty or not FIFO."""
        q = self._queue_of.get(state)
        return configuration.queues[q][0] if q is not None and configuration.queues[q] else None

    def at_head(self, configuration: Placement, robot: int) -> bool:
        """Return whether `robot` is first in its state; always true if the state is not FIFO."""
        q = self._queue_of.get(self.state_at(configuration, robot))
        return q is None or configuration.queues[q][0] == robot

    def has_room(self, configuration: Placement, state: int) -> bool:
        """Return whether `state` can hold one more robot (the paper's ``Sign(state) == 0``)."""
        if self.private[state]:
            return True
        q = self._queue_of.get(state)
        if q is not None:
            return len(configuration.queues[q]) < self.room[state]
        count = 0
        for i in self.visitors[state]:
            count += self.paths[i][configuration.positions[i]] == state
        return count < self.room[state]

    def enabled(self, configuration: Placement, robot: int) -> bool:
        """Return whether `robot` can move to its next state within the capacity and the FIFO order.

        This is the paper's "movable" (Section 4.1), extended to capacities and FIFO states.
        """
        following = self.next_state(configuration, robot)
        return (
            following is not None
            and self.at_head(configuration, robot)
            and self.has_room(configuration, following)
        )

    def move(self, configuration: Configuration, robot: int) -> Configuration:
        """Return the configuration after `robot` has moved to its next state.

        Raises `IllegalMoveError` if the move is not `enabled`.
        """
        if not self.enabled(configuration, robot):
            name = self.robots[robot].id
            here = self.states[self.state_at(configuration, robot)]
            following = self.next_state(configuration, robot)
            there = "nowhere" if following is None else self.states[following]
            msg = f"robot {name}: it cannot move from {here} to {there} in this configuration"
            raise IllegalMoveError(msg)
        return self.moved(configuration, robot)

    def moved(self, configuration: Configuration, robot: int) -> Configuration:
        """Return the configuration after the next move of `robot`, without checking that it is possible."""
        p = configuration.positions[robot]
        q = self.following[robot][p]
        positions = (*configuration.positions[:robot], q, *configuration.positions[robot + 1 :])
        if not self.fifo_states:
            return Configuration(positions)
        queues = list(configuration.queues)
        left = self._queue_of.get(self.paths[robot][p])
        if left is not None:
            queues[left] = queues[left][1:]
        entered = self._queue_of.get(self.paths[robot][q])
        if entered is not None:
            queues[entered] = (*queues[entered], robot)
        return Configuration(positions, tuple(queues))

    def make(self, placement: MutableConfiguration, robot: int) -> int:
        """Make the next move of `robot` in place, unchecked; return the old position for `take_back`."""
        p = placement.positions[robot]
        q = placement.positions[robot] = self.following[robot][p]
        left, entered = (self._queue_of.get(self.paths[robot][at]) for at in (p, q))
        if left is not None:
            del placement.queues[left][0]
        if entered is not None:
            placement.queues[entered].append(robot)
        return p

    def take_back(self, placement: MutableConfiguration, robot: int, before: int) -> None:
        """Undo the last move in place, which `robot` made from the position `before`."""
        q = placement.positions[robot]
        placement.positions[robot] = before
        left, entered = (self._queue_of.get(self.paths[robot][at]) for at in (before, q))
        if entered is not None:
            del placement.queues[entered][-1]
        if left is not None:
            placement.queues[left].insert(0, robot)

    def describe(self, configuration: Configuration) -> tuple[StateId, ...]:
        """Return the names of the states that the robots occupy, in robot order."""
        return tuple(
            self.states[path[p]] for path, p in zip(self.paths, configuration.positions, strict=True)
        )
