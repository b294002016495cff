"""Keeping everybody able to get home: the certified gate where every robot has a home."""

from __future__ import annotations

from typing import NamedTuple

from loopgate.gates.base import Decision, Reason
from loopgate.gates.certified.banker import fixpoint
from loopgate.gates.certified.budget import Budget, BudgetError
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.deadlock import circle_among, stuck_for_good
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.search import Search
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration

_REPLAYED = Decision(admitted=True, reason=Reason.FREE, stage="replay")


class _Verdict(NamedTuple):
    decision: Decision
    witness: list[int] | None


class Homes:
    """Admits a move iff every robot can still get home after it, and holds the moves that show it.

    Parameters
    ----------
    layout
        The system's layout; no robot is homeless.
    budget
        The most cores the exact search may branch on, and its longest time, for one decision; `begin` has
        no limit of time.

    Notes
    -----
    With a budget that is never used up this is exact: a move is admitted iff it is safe.
    """

    def __init__(self, layout: SystemIndex, budget: Budget) -> None:
        self._layout = layout
        self._search = Search(layout, budget)
        self._checker = Checker(layout.system)
        self._witness: list[int] | None = None
        self.missing = Reason.DEADLOCK
        """Why there is no witness, while there is none."""
        self._verdicts: dict[int, _Verdict] = {}
        self._favoured = -1

    def begin(self, configuration: Configuration, stand: Occupancy) -> bool:
        """Find a witness for a configuration that was not reached by an admitted move; say if there is one.

        Raises
        ------
        BudgetError
            If the budget is used up before the answer is known.
        """
        self._verdicts.clear()
        self._witness = None
        self._favoured = -1
        away = self._away(stand)
        there = stand.copy()
        moves, left = fixpoint(there, away)
        if left:
            self.missing = Reason.BUDGET
            rest = self._search.solve(there, left)
            self.missing = Reason.DEADLOCK
            if rest is None:
                return False
            moves += rest
        self.missing = Reason.FAULT
        if not self._accepts(configuration, moves):
            return False
        self._witness = moves
        return True

    def at_once(self, stand: Occupancy, robot: int) -> Decision | None:
        """Admit a move from one home to the next of which the witness does not speak: it is still one."""
        return _REPLAYED if self._passes_by(robot, stand.at[robot]) else None

    def judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Decision:
        """Decide the next move of `robot`, which is enabled."""
        verdict = self._verdicts.get(robot)
        if verdict is None:
            verdict = self._verdicts[robot] = self._judge(configuration, stand, robot)
        return verdict.decision

    def moved(self, robot: int, before: int) -> bool:
        """Take over the witness of the move of `robot` from position `before`; False if there is none."""
        if self._passes_by(robot, before):
            self.forget_verdicts()
            return True
        verdict = self._verdicts.get(robot)
        self._verdicts.clear()
        self._witness = None if verdict is None else verdict.witness
        return self._witness is not None

    def forget_verdicts(self) -> None:
        """Take note of a move between homes that the witness does not speak of."""
        self._verdicts.clear()

    def favour(self, configuration: Configuration, stand: Occupancy, robot: int) -> None:
        """From now on admit only what keeps a way open on which `robot` moves soon; -1: end that.

        The witness is reordered so that before the robot's next move only those move who have to. While
        it is kept but for moves pulled forward, the moves before it can only become fewer.
        """
        self._verdicts.clear()
        self._favoured = robot
        if robot < 0 or self._witness is None:
            return
        witness = self._with(stand, robot)
        k = witness.index(robot)
        before, after = witness[:k], witness[k + 1 :]
        for other in list(dict.fromkeys(reversed(before))):
            kept = [i for i in before if i != other]
            later = [other] * (len(before) - len(kept)) + after
            if self._accepts(configuration, [*kept, robot, *later]):
                before, after = kept, later
        if self._accepts(configuration, [*before, robot, *after]):
            self._witness = [*before, robot, *after]

    def _with(self, stand: Occupancy, robot: int) -> list[int]:
        """Return the witness, with `robot` going to its next home at the end if it does not move in it."""
        witness = self._witness or []
        if robot in witness:
            return witness
        layout = self._layout
        return witness + [robot] * (1 + layout.steps[robot][layout.follow[robot][stand.at[robot]]])

    @property
    def layout(self) -> SystemIndex:
        """The layout whose homes are meant."""
        return self._layout

    def witness_after(self, stand: Occupancy, robot: int) -> list[int] | None:
        """Return moves that bring every robot home after the admitted move of `robot`."""
        if self._passes_by(robot, stand.at[robot]):
            return self._witness
        verdict = self._verdicts.get(robot)
        return None if verdict is None else verdict.witness

    @property
    def witness(self) -> list[int] | None:
        """Moves that bring every robot home from the current configuration."""
        return self._witness

    def _passes_by(self, robot: int, position: int) -> bool:
        witness = self._witness
        return witness is not None and self._layout.straight[robot][position] and robot not in witness

    def _away(self, stand: Occupancy) -> list[int]:
        """Robots that are not at home, those that the witness moves first in front."""
        home, at = self._layout.home, stand.at
        order = list(dict.fromkeys(self._witness)) if self._witness else range(len(at))
        return [i for i in order if not home[i][at[i]]]

    def _judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> _Verdict:
        if self._witness is None:
            details = {Reason.BUDGET: "no way home for all found within the budget"}
            detail = details.get(self.missing, "no way home for all")
            blocked = Decision(admitted=False, reason=self.missing, detail=detail, stage="begin")
            return _Verdict(blocked, None)
        for moves in self._pulled_forward(stand, robot):
            if self._accepts(configuration, moves):
                return _Verdict(_REPLAYED, moves[1:])
        if self._favoured >= 0:
            name = self._layout.system.robots[self._favoured].id
            decision = Decision(
                admitted=False,
                reason=Reason.NEGOTIATION,
                blockers=(self._favoured,),
                detail=f"{name} has waited too long and goes first",
                stage="steering",
            )
            return _Verdict(decision, None)
        return self._found(configuration, stand, robot)

    def _found(self, configuration: Configuration, stand: Occupancy, robot: int) -> _Verdict:
        """Look for a witness from nothing."""
        there = stand.copy()
        there.step(robot)
        away = self._away(there)
        if not self._layout.home[robot][there.at[robot]] and robot not in away:
            away.append(robot)
        stuck = stuck_for_good(there, away)
        if stuck:
            return self._refuse(there, stuck)
        moves, left = fixpoint(there, away)
        if not left:
            return self._checked(configuration, [robot, *moves], "banker")
        try:
            rest = self._search.solve(there, left, timed=True)
        except BudgetError:
            return _Verdict(Decision(admitted=False, reason=Reason.BUDGET, stage="budget"), None)
        if rest is None:
            return self._refuse_core(robot, left)
        stage = "search" if self._search.nodes else "banker"
        return self._checked(configuration, [robot, *moves, *rest], stage)

    def _pulled_forward(self, stand: Occupancy, robot: int) -> list[list[int]]:
        """Return the old witness with the robot's next move in front, and what else is worth a try."""
        witness = self._with(stand, robot)
        k = witness.index(robot)
        tries = [[robot, *witness[:k], *witness[k + 1 :]]]
        if k == len(self._witness or []) and k + 1 < len(witness) and self._favoured < 0:
            tries.insert(0, witness[k:] + witness[:k])  # it drives on to its home before all others
        return tries

    def _accepts(self, configuration: Configuration, moves: list[int]) -> bool:
        return self._checker.brings_home(configuration, moves, self._layout.home)

    def _checked(self, configuration: Configuration, moves: list[int], stage: str) -> _Verdict:
        if self._accepts(configuration, moves):
            return self._admit(moves, stage)
        wrong = Decision(
            admitted=False, reason=Reason.FAULT, detail="witness rejected by the checker", stage="checker"
        )
        return _Verdict(wrong, None)

    @staticmethod
    def _admit(moves: list[int], stage: str) -> _Verdict:
        return _Verdict(Decision(admitted=True, reason=Reason.FREE, stage=stage), moves[1:])

    def _refuse_core(self, robot: int, core: list[int]) -> _Verdict:
        blockers = tuple(i for i in core if i != robot)
        detail = f"no order of moves would bring all home again: {self._layout.names(blockers)}"
        decision = Decision(
            admitted=False, reason=Reason.DEADLOCK, blockers=blockers, detail=detail, stage="search"
        )
        return _Verdict(decision, None)

    def _refuse(self, there: Occupancy, stuck: list[int]) -> _Verdict:
        circle = circle_among(there, stuck)
        states = self._layout.system.states
        names = self._layout.system.robots
        detail = "circular wait: " + " -> ".join(f"{names[i].id} in {states[there.state(i)]}" for i in circle)
        decision = Decision(
            admitted=False, reason=Reason.DEADLOCK, blockers=tuple(circle), detail=detail, stage="cycle"
        )
        return _Verdict(decision, None)
