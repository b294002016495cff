"""Theorem 1 on sets of bits: is a circuit live? The fast twin of `loopgate.theory.theorem1`."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

__all__ = ["SMALLEST_CYCLE", "BudgetSpent", "CircuitJudge", "Leg"]

SMALLEST_CYCLE = 3
"""Robots in the smallest deadlock cycle (Prop. 2)."""


class BudgetSpent(Exception):  # noqa: N818 - not an error: the gate answers with Reason.BUDGET
    """The search was not finished within its budget."""


@dataclass(frozen=True, slots=True)
class Leg:
    """A risky walk: its robot, its states from tail to head, and the set of those between."""

    robot: int
    states: tuple[int, ...]
    between: int


class CircuitJudge:
    """Judges circuits by Theorem 1 within a budget of steps.

    Parameters
    ----------
    visits
        Per robot the states on its path, one bit per state.
    lookahead
        Steps of the moving robot in condition (2); 1 is the paper, more is its Remark 2.
    budget
        The most steps until the next `begin`.
    """

    def __init__(self, visits: Sequence[int], *, lookahead: int, budget: int) -> None:
        self._visits = visits
        self._lookahead = lookahead
        self._budget = budget
        self._steps = 0
        self._occupied: Collection[int] = ()

    def begin(self, occupied: Collection[int]) -> None:
        """Begin a new question, with robots in the states `occupied`, and a new budget."""
        self._occupied = occupied
        self._steps = 0

    def spend(self, steps: int) -> None:
        """Take steps off the budget.

        Raises
        ------
        BudgetSpent
            If it is used up.
        """
        self._steps += steps
        if self._steps > self._budget:
            raise BudgetSpent

    def live(self, circuit: list[Leg], union: int) -> bool:
        """Judge a circuit by Theorem 1, with the deadlock cycle never live."""
        if not union:
            return all(len(leg.states) > 2 for leg in circuit)  # noqa: PLR2004 - tail and head
        if self._fulfils(circuit, union):
            return True
        return any(self._step_frees(circuit, index) for index in range(len(circuit)))

    def _fulfils(self, circuit: list[Leg], union: int) -> bool:
        """Return whether condition (1) of Theorem 1 holds."""
        if union.bit_count() > len(circuit) - SMALLEST_CYCLE:
            return True
        once = twice = 0
        for leg in circuit:
            visits = self._visits[leg.robot]
            twice |= once & visits
            once |= visits
        return bool(union & ~twice)

    def _step_frees(self, circuit: list[Leg], index: int) -> bool:
        """Return whether up to `lookahead` steps of the robot of walk `index` fulfil condition (2)."""
        ring = circuit[index:] + circuit[:index]
        for _ in range(self._lookahead):
            mover = ring[0]
            here = mover.states[1]
            if len(mover.states) <= 2 or here in self._occupied:  # noqa: PLR2004 - tail and head
                return False
            left = self._sub_circuit(ring)
            if left is None:
                return True
            union = 0
            for leg in left:
                union |= leg.between
            if union and self._fulfils(left, union):
                return True
            ring = left
        return False

    def _sub_circuit(self, ring: list[Leg]) -> list[Leg] | None:
        """Return what the first robot's step leaves of the circuit, as function ``check`` has it, or None."""
        mover = ring[0]
        here = mover.states[1]
        left = [Leg(mover.robot, mover.states[1:], _bits(mover.states[2:-1]))]
        for leg in ring[1:-1]:
            self.spend(1)
            if leg.between >> here & 1:
                states = leg.states[: leg.states.index(here, 1) + 1]
                left.append(Leg(leg.robot, states, _bits(states[1:-1])))
                return left
            left.append(leg)
        return None


def _bits(states: tuple[int, ...]) -> int:
    bits = 0
    for state in states:
        bits |= 1 << state
    return bits
