"""A fast search for a circuit that Theorem 1 does not call live, within a budget of steps.

It gives the answer of `theorem1` for the circuits of `circuits_through`, but does not list circuits that
condition (1) makes live. Sets of states are whole numbers, one bit per state.
"""

from collections.abc import Iterator

from loopgate.gates.circuits import Circuit
from loopgate.gates.theorem1 import theorem1
from loopgate.gates.walks import Holders, Walk, risky_walks
from loopgate.model import Configuration, System

_SMALLEST_CYCLE = 3
"""Robots in the smallest deadlock cycle (Prop. 2)."""

_Leg = tuple[Walk, int]
"""A risky walk and the set of its intermediate states."""


class BudgetSpent(Exception):  # noqa: N818 - not an error: the gate answers with Reason.BUDGET
    """The search was not finished within its budget."""


class CircuitSearch:
    """Searches for a circuit through a state that is not live by Theorem 1.

    Parameters
    ----------
    lookahead
        Steps of the moving robot in condition (2) of Theorem 1; 1 is the paper, more is its Remark 2.
    budget
        The most search steps per question; a step is a walk appended to a chain, or one of a circuit judged.
    """

    def __init__(self, system: System, *, lookahead: int, budget: int) -> None:
        self._system = system
        self._visits = [sum(1 << s for s in set(path)) for path in system.paths]
        self._configuration = system.initial
        self._held = Holders(system, system.initial)
        self._legs: dict[int, list[_Leg]] = {}
        self._lookahead = lookahead
        self._budget = budget
        self._steps = 0

    def find(self, configuration: Configuration, state: int) -> Circuit | None:
        """Return a circuit through the robots that hold `state` which is not live, or None if all are live.

        Raises `BudgetSpent` if the budget did not suffice to say which. Time is O(N * look-ahead + budget *
        N) at most.
        """
        self._configuration = configuration
        self._held = Holders(self._system, configuration)
        self._legs.clear()
        self._steps = 0
        for first in self._held.of(state):
            alive = self._circling(first, state)
            if alive and (circuit := self._search(first, state, alive)) is not None:
                return circuit
        return None

    def _legs_of(self, robot: int) -> list[_Leg]:
        legs = self._legs.get(robot)
        if legs is None:
            walks = risky_walks(self._system, self._configuration, robot, held=self._held)
            legs = self._legs[robot] = [
                (walk, sum(1 << state for state in set(walk.intermediate))) for walk in walks
            ]
        return legs

    def _circling(self, first: int, state: int) -> set[int]:
        """Return the robots that may be on a circuit of interest through `first`; empty if there is none.

        Drops, until nothing changes, robots that `first` does not reach or that do not reach `state`, and
        walks that condition (1) makes live in any circuit of the robots left.
        """
        alive = self._mutual(first, state)
        while alive:
            once = twice = 0
            for robot in alive:
                twice |= once & self._visits[robot]
                once |= self._visits[robot]
            most = max(0, len(alive) - _SMALLEST_CYCLE)
            dropped = False
            for robot in alive:
                legs = self._legs[robot]
                kept = [leg for leg in legs if not leg[1] & ~twice and leg[1].bit_count() <= most]
                if len(kept) < len(legs):
                    self._legs[robot] = kept
                    dropped = True
            if not dropped:
                break
            alive = self._mutual(first, state)
        return alive

    def _mutual(self, first: int, state: int) -> set[int]:
        reached = {first}
        to_do = [first]
        before: dict[int, list[int]] = {}
        closing: list[int] = []
        while to_do:
            robot = to_do.pop()
            for walk, _ in self._legs_of(robot):
                head = walk.head
                if head == state:
                    closing.append(robot)
                for after in self._held.of(head):
                    before.setdefault(after, []).append(robot)
                    if after not in reached:
                        reached.add(after)
                        to_do.append(after)
        back = set(closing)
        while closing:
            for robot in before.get(closing.pop(), ()):
                if robot not in back:
                    back.add(robot)
                    closing.append(robot)
        return back if first in back else set()

    def _options(self, robot: int, state: int, *, begun: bool) -> Iterator[tuple[_Leg, int | None]]:
        for leg in self._legs_of(robot):
            head = leg[0].head
            if head == state and begun:
                yield leg, None
            else:
                for after in self._held.of(head):
                    yield leg, after

    def _search(self, first: int, state: int, alive: set[int]) -> Circuit | None:
        """Extend chains of walks from `first`, depth first, until one closes that is not live."""
        most = max(0, len(alive) - _SMALLEST_CYCLE)
        chain: list[Walk] = []
        unions = [0]
        robots = [first]
        stack = [self._options(first, state, begun=False)]
        while stack:
            option = next(stack[-1], None)
            if option is None:
                stack.pop()
                robots.pop()
                unions.pop()
                if chain:
                    chain.pop()
                continue
            (walk, between), after = option
            self._spend(1)
            union = unions[-1] | between
            if union.bit_count() > most:
                continue
            if after is None:
                circuit = Circuit((*chain, walk))
                if self._is_dead(circuit, union):
                    return circuit
            elif after in alive and after not in robots:
                chain.append(walk)
                unions.append(union)
                robots.append(after)
                stack.append(self._options(after, state, begun=True))
        return None

    def _is_dead(self, circuit: Circuit, union: int) -> bool:
        """Return whether Theorem 1 does not call the circuit live; `union` are its intermediate states."""
        count = len(circuit.walks)
        if union and union.bit_count() > count - _SMALLEST_CYCLE:
            return False
        self._spend(count)
        return not theorem1(self._system, self._configuration, circuit, lookahead=self._lookahead).live

    def _spend(self, steps: int) -> None:
        self._steps += steps
        if self._steps > self._budget:
            raise BudgetSpent
