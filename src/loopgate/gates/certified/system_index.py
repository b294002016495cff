"""Facts about a system that the certified gate needs before the first move: homes, rests, paths home."""

from operator import or_

from loopgate.model import System
from loopgate.reading import listed

_WIDE = 2
"""With this capacity or more, the only deadlocks of places are circles of full places."""


class SystemIndex:
    """The home states of each robot, and the states on the ways between them.

    A state *never blocks* if a single robot visits it, or if it is left in any order and holds all its
    visitors at once. An *ender* of a state is a robot that stays there for good. A state is *passable* for
    a robot if it can still be driven through after all other enders have come to rest in it.

    A *home* of a robot is a position where it blocks no robot and from where it can go on alone when all
    others are at home: on a closed path any state that never blocks, on an open path the terminal, and any
    state that never blocks behind which all states are passable.

    A state is *wide* if it can block, holds two or more besides its enders (and has none if it is FIFO), and
    all robots can still drive on from it when all others have ended.
    With ``rests`` the wide states count as homes; the user of that layout keeps slots free by other means
    (see `ChainRule`).

    Attributes
    ----------
    path, follow
        State numbers, and the next position or -1, per robot and position.
    room
        How many robots a state holds, by state.
    fifo
        Whether the state is left in order of arrival, by state.
    never_blocks, wide
        By state; see above.
    home
        Whether the position is a home, per robot and position.
    straight
        Whether one move leads from a home to a home that it can leave again, per robot and position.
    steps
        Moves from the position to the next home, 0 at a home, -1 if there is none.
    way
        The states on those moves that can block, in order, each checked before the robot is sent home.
    settles
        The blocking state in which the robot will stay for good, or -1.
    homeless
        Robots that share their whole path: no position is a home.
    hopeless
        Robots that can never go on for ever, wherever they are, because others come to rest in their way.
    """

    __slots__ = (
        "fifo", "follow", "home", "homeless", "hopeless", "never_blocks", "path", "room", "settles",
        "settling", "steps", "straight", "system", "through", "way", "wide",
    )  # fmt: skip

    def __init__(self, system: System, *, rests: bool = False) -> None:
        self.system = system
        states = range(len(system.states))
        self.path = [list(path) for path in system.paths]
        self.follow = [list(following) for following in system.following]
        self.room = list(system.room)
        shared_fifo = set(system.fifo_states)
        self.fifo = [s in shared_fifo for s in states]
        self.through = [1 if self.fifo[s] else self.room[s] for s in states]
        """A robot can drive through a state only while fewer robots than this are in it."""
        enders = [0] * len(system.states)
        for i, path in enumerate(self.path):
            if self.follow[i][-1] < 0:
                enders[path[-1]] += 1
        self.never_blocks = [
            system.private[s] or (not self.fifo[s] and self.room[s] >= len(system.visitors[s]))
            for s in states
        ]
        self.wide = [
            not self.never_blocks[s]
            and self.room[s] - enders[s] >= _WIDE
            and not (self.fifo[s] and enders[s])
            for s in states
        ]
        for i, path in enumerate(self.path):
            if self.follow[i][-1] >= 0:
                continue  # it never ends
            for p, s in enumerate(path):
                if self.wide[s] and not self._open_behind(i, p, enders):
                    self.wide[s] = False  # for this robot it is no home
        if rests:
            self.never_blocks = [a or b for a, b in zip(self.never_blocks, self.wide, strict=True)]
        self.settles = [
            path[-1] if self.follow[i][-1] < 0 and not self.never_blocks[path[-1]] else -1
            for i, path in enumerate(self.path)
        ]
        self.home = [self._homes(i, enders) for i in range(len(self.path))]
        self.straight = [
            [home[p] and q >= 0 and home[q] and self.never_blocks[path[q]] for p, q in enumerate(follow)]
            for path, home, follow in zip(self.path, self.home, self.follow, strict=True)
        ]
        self.homeless = tuple(i for i, home in enumerate(self.home) if not any(home))
        self.hopeless = tuple(
            i
            for i, path in enumerate(self.path)
            if any(enders) and not all(self._passable(i, p, enders) for p in self._entered_for_ever(i, path))
        )
        self.steps: list[list[int]] = []
        self.settling: list[list[bool]] = []
        """Whether the next home is the shared terminal in which the robot stays for good."""
        self.way: list[list[tuple[int, ...]]] = []
        for i, path in enumerate(self.path):
            has_home = any(self.home[i])
            walks = [self._walk_home(i, p) if has_home else None for p in range(len(path))]
            self.settling.append([(walk or [])[-1:] == [self.settles[i]] for walk in walks])
            self.steps.append([-1 if walk is None else len(walk) for walk in walks])
            self.way.append([tuple(s for s in walk or () if not self.never_blocks[s]) for walk in walks])

    def _passable(self, robot: int, position: int, enders: list[int]) -> bool:
        path = self.path[robot]
        state = path[position]
        ends = self.follow[robot][-1] < 0 and path[-1] == state
        others = enders[state] - ends
        if self.fifo[state] and others and not (ends and position == len(path) - 1):
            return False
        return self.room[state] > others

    def _entered_for_ever(self, robot: int, path: list[int]) -> range:
        """Positions the robot enters again and again, or in which it ends."""
        return range(0 if self.follow[robot][-1] >= 0 else len(path) - 1, len(path))

    def _homes(self, robot: int, enders: list[int]) -> list[bool]:
        path = self.path[robot]
        if self.follow[robot][-1] >= 0:
            return [self.never_blocks[s] for s in path]
        last = len(path) - 1
        return [
            p == last or (self.never_blocks[s] and self._open_behind(robot, p, enders))
            for p, s in enumerate(path)
        ]

    def _open_behind(self, robot: int, position: int, enders: list[int]) -> bool:
        """Return whether the robot can drive to the end of its path once all others have ended theirs."""
        follow = self.follow[robot]
        later = range(position + 1, len(follow)) if follow[-1] < 0 else ()
        return all(self._passable(robot, p, enders) for p in later)

    def _walk_home(self, robot: int, position: int) -> list[int]:
        walk: list[int] = []
        while not self.home[robot][position]:
            position = self.follow[robot][position]
            walk.append(self.path[robot][position])
        return walk

    @property
    def all_wide(self) -> bool:
        """Whether every state that can block is wide."""
        return all(map(or_, self.never_blocks, self.wide))

    def names(self, robots: list[int] | tuple[int, ...], limit: int = 8) -> str:
        """Return the robots' names for an error text, shortened beyond `limit`."""
        return listed((self.system.robots[i].id for i in robots), limit)
