"""Keeps a path home free for every robot: a proof for systems in which every robot has a home."""

from typing import Any

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.certified.banker import fixpoint
from loopgate.gates.certified.liveness_proof import Verdict, WitnessProof, overruled
from loopgate.gates.certified.occupancy import Occupancy, circle_among, stuck_for_good
from loopgate.gates.certified.proof import dead_after
from loopgate.gates.certified.search import Budget, BudgetError, Search
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration

_REPLAYED = Decision(admitted=True, reason=Reason.FREE, stage="replay")


class Homes(WitnessProof):
    """The proof by moves that bring every robot home, to a state where it blocks no other robot.

    Parameters
    ----------
    layout
        The system's layout; every robot has a home.
    budget
        For one decision, the most branches of the exact search and its longest time; `begin` has no limit
        of time.

    Notes
    -----
    With a budget that is never used up this is exact: a move is admitted if and only if it is safe.
    """

    def __init__(self, layout: SystemIndex, budget: Budget) -> None:
        super().__init__(layout)
        self._search = Search(layout, budget)

    def begin(self, configuration: Configuration, stand: Occupancy) -> bool:
        """Find moves that bring all robots home; see `LivenessProof.begin`."""
        self._forget()
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
        self.witness = moves
        return True

    def at_once(self, stand: Occupancy, robot: int) -> Decision | None:
        """Admit a move between homes that is not in the witness, which stays valid; otherwise return None."""
        return _REPLAYED if self._passes_by(robot, stand.at[robot]) else None

    def moved(self, robot: int, before: int) -> bool:
        """Record a move of `robot` from position `before`, and its witness; False if no witness is known."""
        if self._passes_by(robot, before):
            self.forget_verdicts()
            return True
        return self._take_over(robot)

    def forget_verdicts(self) -> None:
        """Drop the verdicts after a move between homes that is not in the witness."""
        self._verdicts.clear()

    def favour(self, configuration: Configuration, stand: Occupancy, robot: int) -> None:
        """Admit only moves after which `robot` can move soon; -1 ends this.

        The witness is reordered so that before the robot's next move only robots move that must. As long as
        only moves of this witness are pulled forward, the moves before it can only become fewer.
        """
        self._verdicts.clear()
        self._favoured = robot
        if robot < 0 or self.witness is None:
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
            self.witness = [*before, robot, *after]

    def _with(self, stand: Occupancy, robot: int) -> list[int]:
        """Return the witness, with `robot` going to its next home at the end if it does not move in it."""
        witness = self.witness or []
        if robot in witness:
            return witness
        layout = self.layout
        return witness + [robot] * (1 + layout.steps[robot][layout.follow[robot][stand.at[robot]]])

    def witness_after(self, stand: Occupancy, robot: int) -> list[int] | None:
        """Return moves that bring every robot home after the admitted move of `robot`."""
        if self._passes_by(robot, stand.at[robot]):
            return self.witness
        return self._found_for(robot)

    def shown(self, stand: Occupancy, robot: int, decision: Decision) -> dict[str, Any] | None:
        """Return the certificate of a decision: moves that bring all robots home, or a proof of a refusal."""
        if decision.admitted:
            return {"kind": "home", "moves": self.ids([robot, *(self.witness_after(stand, robot) or [])])}
        return dead_after(stand, robot, "dead")

    def _passes_by(self, robot: int, position: int) -> bool:
        witness = self.witness
        return witness is not None and self.layout.straight[robot][position] and robot not in witness

    def _away(self, stand: Occupancy) -> list[int]:
        """Return the robots that are not at home, in the order in which the witness moves them."""
        home, at = self.layout.home, stand.at
        order = list(dict.fromkeys(self.witness)) if self.witness else range(len(at))
        return [i for i in order if not home[i][at[i]]]

    def _judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Verdict:
        if self.witness is None:
            details = {Reason.BUDGET: "no way home for all found within the budget"}
            detail = details.get(self.missing, "no way home for all")
            return Verdict(refusal(self.missing, detail, "begin"))
        for moves in self._pulled_forward(stand, robot):
            if self._accepts(configuration, moves):
                return Verdict(_REPLAYED, moves[1:])
        if self._favoured >= 0:
            return Verdict(overruled(self.layout.system, self._favoured))
        return self._found(configuration, stand, robot)

    def _found(self, configuration: Configuration, stand: Occupancy, robot: int) -> Verdict:
        """Search a witness without using the old one."""
        there = stand.after(robot)
        away = self._away(there)
        if not self.layout.home[robot][there.at[robot]] and robot not in away:
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
            return Verdict(refusal(Reason.BUDGET, stage="budget"))
        if rest is None:
            return self._refuse_core(robot, left)
        stage = "search" if self._search.nodes else "banker"
        return self._checked(configuration, [robot, *moves, *rest], stage)

    def _pulled_forward(self, stand: Occupancy, robot: int) -> list[list[int]]:
        """Return candidates for a witness: first the old witness with the robot's next move in front."""
        witness = self._with(stand, robot)
        k = witness.index(robot)
        tries = [[robot, *witness[:k], *witness[k + 1 :]]]
        if k == len(self.witness or []) and k + 1 < len(witness) and self._favoured < 0:
            tries.insert(0, witness[k:] + witness[:k])  # it drives home before all other robots
        return tries

    def _accepts(self, configuration: Configuration, moves: list[int]) -> bool:
        return self._checker.brings_home(configuration, moves, self.layout.home)

    def _checked(self, configuration: Configuration, moves: list[int], stage: str) -> Verdict:
        if self._accepts(configuration, moves):
            return Verdict(Decision(admitted=True, reason=Reason.FREE, stage=stage), moves[1:])
        return Verdict(refusal(Reason.FAULT, "witness rejected by the checker", "checker"))

    def _refuse_core(self, robot: int, core: list[int]) -> Verdict:
        blockers = tuple(i for i in core if i != robot)
        detail = f"no order of moves would bring all home again: {self.layout.names(blockers)}"
        return Verdict(refusal(Reason.DEADLOCK, detail, "search", blockers))

    def _refuse(self, there: Occupancy, stuck: list[int]) -> Verdict:
        circle = circle_among(there, stuck)
        states = self.layout.system.states
        names = self.layout.system.robots
        detail = "circular wait: " + " -> ".join(f"{names[i].id} in {states[there.state(i)]}" for i in circle)
        return Verdict(refusal(Reason.DEADLOCK, detail, "cycle", circle))
