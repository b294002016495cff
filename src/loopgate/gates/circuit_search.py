"""A fast search for a circuit that Theorem 1 does not call live, within a budget of steps.

The same answers as `loopgate.theory.circuits` and `loopgate.theory.theorem1` together, without listing
circuits that condition (1) makes live anyway. Sets of states are whole numbers, one bit per state.
"""

from __future__ import annotations

from collections.abc import Iterator

from loopgate.gates.circuit_judge import SMALLEST_CYCLE, CircuitJudge, Leg
from loopgate.model import Configuration, System
from loopgate.theory.walks import default_lookahead

__all__ = ["CircuitSearch"]


class CircuitSearch:
    """Looks for a circuit through one state that is not live by Theorem 1.

    Parameters
    ----------
    system
        The system.
    lookahead
        Steps of the moving robot in condition (2) of Theorem 1; 1 is the paper, more is its Remark 2.
    budget
        The most search steps per question; a step is a walk appended to a chain, or a walk asked in `check`.
    """

    def __init__(self, system: System, *, lookahead: int, budget: int) -> None:
        self._system = system
        self._most = default_lookahead(system)
        self._fifo = frozenset(system.fifo_states)
        self._windows: dict[tuple[int, int], tuple[int, ...]] = {}
        self._visits = [sum(1 << s for s in set(path)) for path in system.paths]
        self._configuration = system.initial
        self._standing: dict[int, int] = {}
        self._holders: dict[int, tuple[int, ...]] = {}
        self._legs: dict[int, list[Leg]] = {}
        self._judge = CircuitJudge(self._visits, lookahead=lookahead, budget=budget)

    def find(self, configuration: Configuration, state: int) -> list[Leg] | None:
        """Return a circuit through the robots that hold `state` which is not live, or None if all are live.

        Raises
        ------
        BudgetSpent
            If the budget did not suffice to say which. Time is O(N * look-ahead + budget * N) at most.
        """
        self._configuration = configuration
        self._holders.clear()
        self._legs.clear()
        self._standing = {
            path[p]: i
            for i, (path, p) in enumerate(zip(self._system.paths, configuration.positions, strict=True))
        }
        self._judge.begin(self._standing)
        for first in self._held_by(state):
            alive = self._circling(first, state)
            if alive and (circuit := self._search(first, state, alive)) is not None:
                return circuit
        return None

    def _held_by(self, state: int) -> tuple[int, ...]:
        """Return the robots that hold `state`, as `loopgate.theory.walks.held_states` has it; () if none."""
        if state in self._holders:
            return self._holders[state]
        system = self._system
        if system.private[state] or state not in self._standing:
            holders: tuple[int, ...] = ()
        elif system.room[state] == 1:
            holders = (self._standing[state],)
        else:
            self._fill(state)
            return self._holders[state]
        self._holders[state] = holders
        return holders

    def _fill(self, root: int) -> None:
        """Find the holders of `root`, a state of capacity above 1, and of the full ones it leads to.

        Those from which a chain leads to a state that gives way have none.
        """
        system, here = self._system, self._configuration
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
                full[state] = inside[:1] if state in self._fifo else inside
                for wanted in self._wanted(full[state]):
                    if wanted not in before:
                        to_do.append(wanted)
                    before.setdefault(wanted, []).append(state)
        self._holders.update(full)
        released = set(given)
        self._holders.update(dict.fromkeys(given, ()))
        while given:
            for state in before[given.pop()]:
                if state not in released:
                    released.add(state)
                    given.append(state)
                    self._holders[state] = ()

    def _wanted(self, robots: tuple[int, ...]) -> list[int]:
        states = (self._system.next_state(self._configuration, robot) for robot in robots)
        return [state for state in states if state is not None]

    def _gives_way(self, state: int) -> bool:
        if self._system.private[state]:
            return True
        return self._system.room[state] > 1 and not self._held_by(state)

    def _window(self, robot: int) -> tuple[int, ...]:
        """Return the collision states before `robot`, as far as it looks ahead."""
        key = (robot, self._configuration.positions[robot])
        window = self._windows.get(key)
        if window is None:
            here, path = self._system.robots[robot], self._system.paths[robot]
            states: list[int] = []
            following = here.next_position(key[1])
            while following is not None and len(states) < self._most:
                if self._system.private[path[following]]:
                    break
                states.append(path[following])
                following = here.next_position(following)
            window = self._windows[key] = tuple(states)
        return window

    def _legs_of(self, robot: int) -> list[Leg]:
        legs = self._legs.get(robot)
        if legs is not None:
            return legs
        legs = self._legs[robot] = []
        tail = self._system.state_at(self._configuration, robot)
        if robot not in self._held_by(tail):
            return legs
        states = [tail]
        heads: set[int] = set()
        between = 0
        several = self._system.room
        for state in self._window(robot):
            if several[state] > 1 and self._gives_way(state):
                break
            states.append(state)
            if (
                state in self._standing
                and state not in heads
                and any(j != robot for j in self._held_by(state))
            ):
                heads.add(state)
                legs.append(Leg(robot, tuple(states), between))
            between |= 1 << state
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
            most = max(0, len(alive) - SMALLEST_CYCLE)
            dropped = False
            for robot in alive:
                legs = self._legs[robot]
                kept = [leg for leg in legs if not leg.between & ~twice and leg.between.bit_count() <= most]
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
            for leg in self._legs_of(robot):
                head = leg.states[-1]
                if head == state:
                    closing.append(robot)
                for after in self._held_by(head):
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

    def _options(self, robot: int, state: int, *, begun: bool) -> Iterator[tuple[Leg, int | None]]:
        for leg in self._legs_of(robot):
            head = leg.states[-1]
            if head == state and begun:
                yield leg, None
            else:
                for after in self._held_by(head):
                    yield leg, after

    def _search(self, first: int, state: int, alive: set[int]) -> list[Leg] | None:
        """Extend chains of walks from `first`, depth first, until one closes that is not live."""
        most = max(0, len(alive) - SMALLEST_CYCLE)
        chain: list[Leg] = []
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
            leg, after = option
            self._judge.spend(1)
            union = unions[-1] | leg.between
            if union.bit_count() > most:
                continue
            if after is None:
                if not self._judge.live([*chain, leg], union):
                    return [*chain, leg]
            elif after in alive and after not in robots:
                chain.append(leg)
                unions.append(union)
                robots.append(after)
                stack.append(self._options(after, state, begun=True))
        return None
