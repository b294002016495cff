"""A proof where homes are missing: keeps a way to a configuration with a free slot in every place."""

from collections.abc import Iterator
from heapq import heappop, heappush
from math import inf
from typing import Any

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.certified.liveness_proof import Verdict, WitnessProof, overruled
from loopgate.gates.certified.occupancy import Occupancy, stuck_for_good
from loopgate.gates.certified.proof import wait_after
from loopgate.gates.certified.search import Budget, BudgetError
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration


class FreeSlots(WitnessProof):
    """The proof by moves that lead to a configuration with a free slot in every place.

    *A configuration with a free slot in every place is live for everyone*, whatever the capacities. Move any
    robot. While that leaves a place full, move the robot that came first into that place. Only one place is
    full at a time, so the sequence is deterministic. It is also one-to-one backwards, since the robot that
    moved last can move back. So it cannot enter a circle except through its beginning; and before its
    beginning a place would have been full that has two free slots then. So the sequence ends, with a free
    slot in every place and the first robot one state further. Robots on open paths have ended by then, in
    states that never block.

    Parameters
    ----------
    layout
        The system's layout; see `applies`.
    budget
        The most configurations to examine, and the longest time, for one decision; `begin` has no limit
        of time.

    Notes
    -----
    Sound, and never blocks all robots. It may refuse safe moves if free slots in every place cannot be
    reached although every robot could go on, or are not found within the budget.
    """

    def __init__(self, layout: SystemIndex, budget: Budget) -> None:
        super().__init__(layout)
        self._budget = budget
        self._blocking = [not free for free in layout.never_blocks]
        self._enders = [i for i, follow in enumerate(layout.follow) if follow[-1] < 0]

    @staticmethod
    def applies(layout: SystemIndex) -> bool:
        """Return whether no robot ends its path in a state that can block."""
        return all(s < 0 for s in layout.settles)

    def begin(self, configuration: Configuration, stand: Occupancy) -> bool:
        """Find moves to free slots in every place; see `LivenessProof.begin`."""
        self._forget()
        self.missing = Reason.BUDGET
        moves = self._search(stand, inf)
        self.missing = Reason.DEADLOCK
        if moves is not None and self._accepts(configuration, moves):
            self.witness = moves
        return self.witness is not None

    def shown(self, stand: Occupancy, robot: int, decision: Decision) -> dict[str, Any] | None:
        """Return moves after which each place has a free slot; of a refusal, the robots that are stuck."""
        if decision.admitted:
            return {"kind": "room", "moves": self.ids([robot, *(self._found_for(robot) or [])])}
        return wait_after(stand, robot)

    def favour(self, configuration: Configuration, stand: Occupancy, robot: int) -> None:
        """Admit only moves that lead to a move of `robot`; -1 ends this."""
        del configuration
        self._verdicts.clear()
        self._favoured = -1
        if robot < 0 or self.witness is None:
            return
        there = stand.after(*self.witness)
        witness = list(self.witness)
        if robot not in witness and self.layout.follow[robot][there.at[robot]] < 0:
            return  # it stays where it is for good
        while robot not in witness:
            first = (there.queue.get(there.state(robot)) or [robot])[0]
            there.step(first)
            witness += [first, *self._pushed(there, first)]
        self.witness, self._favoured = witness, robot

    def _judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Verdict:
        if self.witness is None:
            detail = "no way to a slot free in every place"
            return Verdict(refusal(self.missing, detail, "begin"))
        try:
            return self._decided(configuration, stand, robot)
        except BudgetError:
            return Verdict(refusal(Reason.BUDGET, stage="budget"))

    def _decided(self, configuration: Configuration, stand: Occupancy, robot: int) -> Verdict:
        moves, stage = self._pulled_forward(stand, robot), "replay"
        if moves is None and self._favoured >= 0:
            return Verdict(overruled(self.layout.system, self._favoured))
        if moves is None:
            there = stand.after(robot)
            stuck = stuck_for_good(there, range(len(there.at)))
            if stuck:
                detail = f"robots wait for one another: {self.layout.names(stuck)}"
                return Verdict(refusal(Reason.DEADLOCK, detail, "cycle", stuck))
            moves, stage = self._search(there, self._budget.deadline_s()), "search"
        if moves is None:
            return Verdict(
                refusal(Reason.DEADLOCK, "no moves would lead to a slot free in every place", stage)
            )
        if not self._accepts(configuration, [robot, *moves]):
            return Verdict(refusal(Reason.FAULT, "witness rejected by the checker", "checker"))
        return Verdict(Decision(admitted=True, reason=Reason.FREE, stage=stage), moves)

    def _pulled_forward(self, stand: Occupancy, robot: int) -> list[int] | None:
        """Return the rest of the witness after the move of `robot`, lengthened if necessary."""
        witness, there = self.witness or [], stand.after(robot)
        if self._favoured < 0 and not self._left(there):
            return []
        if robot in witness:
            k = witness.index(robot)
            moves = [*witness[:k], *witness[k + 1 :]]
            return moves if self._possible(there, moves) else None
        if self._favoured >= 0 or not self._possible(there, witness):
            return None
        return witness + self._pushed(there, robot)

    def _possible(self, there: Occupancy, moves: list[int]) -> bool:
        """Make the moves; return False at the first impossible one."""
        for i in moves:
            if not there.enabled(i):
                return False
            there.step(i)
        return True

    def _pushed(self, there: Occupancy, robot: int) -> list[int]:
        """After the move of `robot`, move the heads of full places until none is full; return the moves.

        Places that may be left in any order are left in order of arrival here; robots that were there before
        go by number. The moves come to an end (see the class). No budget limits them, or all robots could be
        refused.
        """
        lines: dict[int, list[int]] = {}
        moves: list[int] = []
        while True:
            entered = there.state(robot)
            if entered not in there.queue and self._blocking[entered]:
                line = lines.get(entered) or [i for i in there.occupants(entered) if i != robot]
                lines[entered] = [*line, robot]
            full = next(self._full(there), None)
            if full is None:
                return moves
            robot = there.queue[full][0] if full in there.queue else lines[full].pop(0)
            there.step(robot)
            moves.append(robot)

    def _full(self, stand: Occupancy) -> Iterator[int]:
        count, room = stand.count, self.layout.room
        return (s for s, blocks in enumerate(self._blocking) if blocks and count[s] >= room[s])

    def _left(self, stand: Occupancy) -> int:
        """Return the number of full places, and of robots that will end but have not; both 0 at the goal."""
        follow = self.layout.follow
        return sum(1 for _ in self._full(stand)) + sum(follow[i][stand.at[i]] >= 0 for i in self._enders)

    def _search(self, stand: Occupancy, deadline_s: float) -> list[int] | None:
        """Return moves from `stand` to free slots in every place, or None; best first."""
        seen = {self._key(stand)}
        ways: list[tuple[int, int]] = [(-1, -1)]
        todo = [(self._left(stand), 0, 0, stand)]
        while todo:
            left, steps, number, here = heappop(todo)
            if not left:
                return self._way(ways, number)
            for i in range(len(here.at)):
                if not here.enabled(i):
                    continue
                there = here.after(i)
                key = self._key(there)
                if key in seen:
                    continue
                seen.add(key)
                self._budget.check(len(seen), deadline_s)
                ways.append((number, i))
                heappush(todo, (self._left(there), steps + 1, len(ways) - 1, there))
        return None

    @staticmethod
    def _way(ways: list[tuple[int, int]], number: int) -> list[int]:
        moves: list[int] = []
        while number:
            number, robot = ways[number]
            moves.append(robot)
        return moves[::-1]

    @staticmethod
    def _key(stand: Occupancy) -> tuple[tuple[int, ...], tuple[tuple[int, ...], ...]]:
        return tuple(stand.at), stand.queues()

    def _accepts(self, configuration: Configuration, moves: list[int]) -> bool:
        return self._checker.leaves_room(configuration, moves, self._blocking)
