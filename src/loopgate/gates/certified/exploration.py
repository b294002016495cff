"""A proof for small systems in which robots have no homes: explores all configurations, exactly."""

from collections import deque
from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from math import inf
from typing import Any

import numpy as np
import scipy

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.liveness_proof import LivenessProof, overruled
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.proof import wait_after
from loopgate.gates.certified.search import Budget, BudgetError
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration

_Moves = dict[Configuration, list[tuple[int, Configuration]]]
"""The moves out of configurations: the robot that moves, and the next configuration."""


class Exploration(LivenessProof):
    """The proof by exploring all reachable configurations: every robot can go on for ever.

    A witness leads to a configuration from which a circle of moves, in which every robot takes part, leads
    back to that configuration. For each configuration known to be live, the next move of its witness is
    stored. Configurations known to be dead are stored too, so that each is examined once.

    Parameters
    ----------
    budget
        The most configurations to examine, and the longest time, for one decision; `begin` has no limit
        of time.

    Notes
    -----
    Linear in the number of reachable configurations, which is exponential in the number of robots.
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
        """Return whether `configuration` is live; see `LivenessProof.begin`."""
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
        """Decide the next move of `robot`; capacity and order already allow it."""
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
        """Admit only moves after which `robot` can still move; -1 ends this."""
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
        """Record a move; return False if the configuration after it is not known to be live."""
        del before
        self._plan = self._without(robot)
        there = None if self._here is None else self._system.moved(self._here, robot)
        self._here = there if there is not None and self._known_live(there) else None
        return self._here is not None

    def shown(self, stand: Occupancy, robot: int, decision: Decision) -> dict[str, Any]:
        """Return a way to a circle of moves of all robots; of a refusal, the robots that cannot move."""
        if not decision.admitted or self._here is None:
            return wait_after(stand, robot) or {"kind": "exhausted"}
        approach, circle = self.way_from(self._system.moved(self._here, robot))
        return {"kind": "round", "approach": self.ids([robot, *approach]), "circle": self.ids(circle)}

    def way_from(self, configuration: Configuration) -> tuple[list[int], list[int]]:
        """Return the moves from a live configuration to a circle of moves, and the moves of that circle."""
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
        """Return whether every robot can go on for ever from `root`.

        Raises `BudgetError` if it would have to examine more configurations than the budget, or, if `timed`,
        would take longer.
        """
        if not self._known_live(root) and root not in self._dead:
            self._look_from(root, self._budget.deadline_s() if timed else inf)
        return self._known_live(root)

    def _known_live(self, configuration: Configuration) -> bool:
        return configuration in self._next or configuration in self._circle

    def _look_from(self, root: Configuration, deadline_s: float) -> None:
        """Store for each reachable configuration whether it leads to a circle of moves of all robots."""
        moves: _Moves = {}
        todo = [root]
        while todo:
            here = todo.pop()
            if here not in moves and here not in self._dead and not self._known_live(here):
                self._budget.check(len(moves) + 1, deadline_s)
                moves[here] = list(self._moves(here))
                todo += [there for _, there in moves[here]]
        for members in _components(moves):
            self._settle(members, moves)
        back: _Moves = {}
        for here, on in moves.items():
            for robot, there in on:
                back.setdefault(there, []).append((robot, here))
        todo = [there for there in (*moves, *back) if self._known_live(there)]
        for there in todo:
            for robot, here in back.get(there, ()):
                if not self._known_live(here):
                    self._next[here] = robot
                    todo.append(here)
        self._dead.update(here for here in moves if not self._known_live(here))

    def _settle(self, members: AbstractSet[Configuration], moves: _Moves) -> None:
        """Store a circle of moves in a strongly connected component if every robot moves in it."""
        base = min(members)
        inside = {here: [move for move in moves[here] if move[1] in members] for here in members}
        need = {i for i in range(len(self._system.robots)) if not self._system.finished(base, i)}
        if not need <= {robot for on in inside.values() for robot, _ in on}:
            return
        circle: list[int] = []
        here = base
        while need or here != base:
            part, here = _shortest(inside, here, need, base)
            need.difference_update(part)
            circle += part
        self._circle[base] = circle


def _components(moves: _Moves) -> Iterable[set[Configuration]]:
    """Return the strongly connected sets of configurations."""
    number = {here: k for k, here in enumerate(moves)}
    steps = [(k, number[there]) for here, k in number.items() for _, there in moves[here] if there in number]
    begins, ends = np.array(steps, np.int32).reshape(-1, 2).T
    graph = scipy.sparse.csr_array(
        (np.ones(len(steps), np.int8), (begins, ends)), shape=(len(moves), len(moves))
    )
    _, labels = scipy.sparse.csgraph.connected_components(graph, connection="strong")
    parts: dict[int, set[Configuration]] = {}
    for here, label in zip(moves, labels.tolist(), strict=True):
        parts.setdefault(label, set()).add(here)
    return parts.values()


def _shortest(
    moves: _Moves, start: Configuration, need: AbstractSet[int], goal: Configuration
) -> tuple[list[int], Configuration]:
    """Return the shortest sequence of moves that ends with a move of a robot in `need`, or in `goal`."""
    todo: deque[tuple[Configuration, tuple[int, ...]]] = deque([(start, ())])
    seen = {start}
    while True:
        here, way = todo.popleft()
        for robot, there in moves[here]:
            if robot in need or (not need and there == goal):
                return [*way, robot], there
            if there not in seen:
                seen.add(there)
                todo.append((there, (*way, robot)))
