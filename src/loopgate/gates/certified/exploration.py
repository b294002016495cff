"""Keeping everybody able to go round for ever where robots have no homes: exact, for small systems."""

from collections import deque
from collections.abc import Iterator
from math import inf
from typing import Any, NamedTuple

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.certified.budget import Budget, BudgetError
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.keepers import Keeper, overruled
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.proof import wait_after
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration


class _Frame(NamedTuple):
    here: Configuration
    entered_by: int
    moves: Iterator[tuple[int, Configuration]]


class _Walk:
    """The open part of Tarjan's depth-first search for strongly connected components."""

    def __init__(self, root: Configuration, moves: Iterator[tuple[int, Configuration]]) -> None:
        self.index = {root: 0}
        self.frames = [_Frame(root, -1, moves)]
        self.left_by = -1
        """The move into the configuration that was left last."""
        self._low = {root: 0}
        self._open = [root]
        self._is_open = {root}

    def comes_back_to(self, there: Configuration) -> bool:
        """Take note of a move from the walk's end to `there`, if that is open; say whether it is."""
        if there not in self._is_open:
            return False
        here = self.frames[-1].here
        self._low[here] = min(self._low[here], self.index[there])
        return True

    def enter(self, there: Configuration, robot: int, moves: Iterator[tuple[int, Configuration]]) -> None:
        """Go on to `there`, which is new."""
        self.index[there] = self._low[there] = len(self.index)
        self._open.append(there)
        self._is_open.add(there)
        self.frames.append(_Frame(there, robot, moves))

    def leave(self) -> list[Configuration]:
        """Go one back; return the members of the component that this closes, its root first, if it does."""
        here, self.left_by, _ = self.frames.pop()
        if self.frames:
            before = self.frames[-1].here
            self._low[before] = min(self._low[before], self._low[here])
        if self._low[here] < self.index[here]:
            return []
        cut = self._open.index(here)
        members = self._open[cut:]
        del self._open[cut:]
        self._is_open.difference_update(members)
        return members


class Exploration(Keeper):
    """Admits a move iff every robot can go on for ever after it, by looking at what can be reached.

    A witness is a path to a configuration from which a circle of moves, in which every robot takes part,
    leads back to it. For each configuration known to be live the next move of its witness is remembered;
    configurations known to be dead are remembered too, so that each is looked at once.

    Parameters
    ----------
    budget
        The most configurations to look at, and the longest time, for one decision; `begin` has no limit
        of time.

    Notes
    -----
    Linear in the configurations that can be reached, which are exponentially many in the robots.
    """

    def __init__(self, layout: SystemIndex, budget: Budget) -> None:
        super().__init__(layout)
        self._system = layout.system
        self._checker = Checker(layout.system)
        self._budget = budget
        self._next: dict[Configuration, int] = {}
        self._circle: dict[Configuration, list[int]] = {}
        self._dead: set[Configuration] = set()
        self._here: Configuration | None = None
        self._plan: list[int] = []

    def begin(self, configuration: Configuration, stand: Occupancy) -> bool:
        """Return whether `configuration` is live; see `Keeper.begin`."""
        del stand
        self._here = None
        self._plan = []
        self.missing = Reason.BUDGET
        if not self.live(configuration):
            self.missing = Reason.DEADLOCK
            return False
        self.missing = Reason.FAULT
        if not self._checker.brings_round(configuration, *self.way_from(configuration)):
            return False
        self._here = configuration
        return True

    def judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Decision:
        """Decide the next move of `robot`, which is enabled."""
        del stand
        if self._here is None:
            return refusal(self.missing, "no way on for all", "begin")
        try:
            return self._judge(self._system.moved(configuration, robot), robot)
        except BudgetError:
            return refusal(Reason.BUDGET, stage="budget")

    def _judge(self, there: Configuration, robot: int) -> Decision:
        if self._plan and not self._keeps_plan(robot, there):
            return overruled(self._system, self._plan[-1])
        known = there in self._dead or self._known_live(there)
        stage = "memory" if known else "search"
        if not self.live(there, timed=True):
            return refusal(Reason.DEADLOCK, "not all could go on for ever", stage)
        if not self._checker.brings_round(there, *self.way_from(there)):
            return refusal(Reason.FAULT, "witness rejected by the checker", "checker")
        return Decision(admitted=True, reason=Reason.FREE, stage=stage)

    def favour(self, configuration: Configuration, stand: Occupancy, robot: int) -> None:
        """From now on admit only what keeps open a way on which `robot` moves; -1: end that."""
        del configuration, stand
        self._plan = []
        if robot >= 0 and self._here is not None:
            approach, circle = self.way_from(self._here)
            moves = approach + circle
            self._plan = moves[: moves.index(robot) + 1] if robot in moves else []

    def _keeps_plan(self, robot: int, there: Configuration) -> bool:
        """Return whether the plan, less the move of `robot` if that is in it, is still possible and live."""
        for i in self._without(robot):
            if not self._system.enabled(there, i):
                return False
            there = self._system.moved(there, i)
        return self.live(there, timed=True)

    def _without(self, robot: int) -> list[int]:
        k = self._plan.index(robot) if robot in self._plan else len(self._plan)
        return self._plan[:k] + self._plan[k + 1 :]

    def moved(self, robot: int, before: int) -> bool:
        """Take note of a move; False if it does not lead to what is known to be live."""
        del before
        self._plan = self._without(robot)
        there = None if self._here is None else self._system.moved(self._here, robot)
        self._here = there if there is not None and self._known_live(there) else None
        return self._here is not None

    def shown(self, stand: Occupancy, robot: int, decision: Decision) -> dict[str, Any]:
        """Return a way to a circle of moves in which all take part; of a refusal, who cannot move again."""
        if not decision.admitted or self._here is None:
            return wait_after(stand, robot) or {"kind": "exhausted"}
        approach, circle = self.way_from(self._system.moved(self._here, robot))
        return {"kind": "round", "approach": self.ids([robot, *approach]), "circle": self.ids(circle)}

    def way_from(self, configuration: Configuration) -> tuple[list[int], list[int]]:
        """Return an approach and a circle from a configuration known to be live."""
        approach: list[int] = []
        while configuration not in self._circle:
            robot = self._next[configuration]
            approach.append(robot)
            configuration = self._system.moved(configuration, robot)
        return approach, self._circle[configuration]

    def _moves(self, configuration: Configuration) -> Iterator[tuple[int, Configuration]]:
        system = self._system
        for robot in range(len(system.robots)):
            if system.enabled(configuration, robot):
                yield robot, system.moved(configuration, robot)

    def live(self, root: Configuration, *, timed: bool = False) -> bool:
        """Return whether every robot can go on for ever from `root` (Tarjan's components, depth first).

        Raises `BudgetError` if more configurations than the budget would have to be looked at, or, if
        `timed`, for longer.
        """
        if self._known_live(root):
            return True
        if root in self._dead:
            return False
        deadline_s = self._budget.deadline_s() if timed else inf
        walk = _Walk(root, self._moves(root))
        while walk.frames:
            for robot, there in walk.frames[-1].moves:
                if there in self._dead or walk.comes_back_to(there):
                    continue
                if self._known_live(there):
                    self._mark(walk, robot)
                    return True
                self._budget.check(len(walk.index) + 1, deadline_s)
                walk.enter(there, robot, self._moves(there))
                break
            else:
                members = walk.leave()
                if members and self._settle(members):
                    self._mark(walk)
                    return True
                self._dead.update(members)
        return False

    def _known_live(self, configuration: Configuration) -> bool:
        return configuration in self._next or configuration in self._circle

    def _mark(self, walk: _Walk, last: int = -1) -> None:
        """Remember that each configuration on the walk is live, and the move that leads on to the next."""
        robots = [*(frame.entered_by for frame in walk.frames[1:]), walk.left_by if last < 0 else last]
        for frame, robot in zip(walk.frames, robots, strict=False):  # on no frame, where the root was left
            self._next[frame.here] = robot

    def _settle(self, members: list[Configuration]) -> bool:
        """Remember the witnesses of a component in which every robot moves; False if some does not."""
        system = self._system
        base = members[0]
        inside = set(members)
        back: dict[Configuration, list[tuple[int, Configuration]]] = {}
        for here in members:
            for robot, there in self._moves(here):
                if there in inside:
                    back.setdefault(there, []).append((robot, here))
        need = {i for i in range(len(system.robots)) if not system.finished(base, i)}
        if not need <= {robot for arrivals in back.values() for robot, _ in arrivals}:
            return False
        towards = self._towards(base, back)
        circle: list[int] = []
        here = base
        while need:
            part = self._shortest(here, inside, need)
            for robot in part:
                here = system.moved(here, robot)
            circle += part
            need.difference_update(part)
        while here != base:
            circle.append(towards[here])
            here = system.moved(here, towards[here])
        self._circle[base] = circle
        self._next.update(towards)
        return True

    @staticmethod
    def _towards(
        base: Configuration, back: dict[Configuration, list[tuple[int, Configuration]]]
    ) -> dict[Configuration, int]:
        """Return the move that leads each configuration of the component one nearer to `base`."""
        queue = deque([base])
        towards: dict[Configuration, int] = {}
        while queue:
            for robot, here in back.get(queue.popleft(), ()):
                if here != base and here not in towards:
                    towards[here] = robot
                    queue.append(here)
        return towards

    def _shortest(self, start: Configuration, inside: set[Configuration], need: set[int]) -> list[int]:
        """Return the fewest moves inside the component that end with a move of a robot in `need`."""
        queue: deque[tuple[Configuration, tuple[int, ...]]] = deque([(start, ())])
        seen = {start}
        while queue:
            here, path = queue.popleft()
            for robot, there in self._moves(here):
                if there not in inside:
                    continue
                if robot in need:
                    return [*path, robot]
                if there not in seen:
                    seen.add(there)
                    queue.append((there, (*path, robot)))
        return []
