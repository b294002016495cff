"""The gatekeeper: collects requests, lets the gate decide them, keeps the books of who holds what."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from collections.abc import Set as AbstractSet
from time import perf_counter_ns
from typing import NamedTuple

from loopgate.abstraction.itinerary import Abstraction
from loopgate.gates import Decision, FollowingGate, Gate, Reason
from loopgate.model import Configuration
from loopgate.negotiation.base import InformedNegotiation, Negotiation, Request
from loopgate.simulation.histogram import Histogram
from loopgate.simulation.obstacles import Obstacle
from loopgate.simulation.occupancy import Occupancy
from loopgate.simulation.pending import Pending
from loopgate.simulation.right_of_way import RightOfWay
from loopgate.simulation.sight import Sight

__all__ = ["REASK_S", "Answer", "Gatekeeper"]

REASK_S = 1.0
"""A refusal that any change may lift is asked again at most this often [s]."""

_OUTSIDE = frozenset({Reason.RED, Reason.TRAFFIC})
"""What lifts these refusals happens outside the system, so they are looked at again every step."""


class Answer(NamedTuple):
    """What became of a request in this step: granted, or refused for a new reason.

    The stage is the gate's, empty where the gate has none or was not asked.
    """

    request: Request
    granted: bool
    reason: Reason
    stage: str = ""


class Gatekeeper:
    """Decides which vehicles may enter their next state. Knows robots, states and time; no roads.

    The configuration moves on with every grant; the occupancy follows the physical vehicles, so a state
    stays taken until `left` is told that the rear is out of it.

    Parameters
    ----------
    abstraction
        System and itineraries.
    gate
        Made for the abstraction's system.
    negotiation
        Orders the requests that are possible at the same time.
    """

    def __init__(self, abstraction: Abstraction, gate: Gate, negotiation: Negotiation) -> None:
        self.system = abstraction.system
        self.occupancy = Occupancy(self.system)
        self._at = list(self.system.initial.positions)
        queues = zip(self.system.fifo_states, self.system.initial.queues, strict=True)
        self._lines = {state: list(robots) for state, robots in queues}
        self._configuration: Configuration | None = self.system.initial
        self._follow = [
            tuple(-1 if (q := robot.next_position(p)) is None else q for p in range(len(robot.path)))
            for robot in self.system.robots
        ]
        self.refusals: Counter[str] = Counter()
        self.decision_us: defaultdict[str, Histogram] = defaultdict(Histogram)
        """Times of the decisions by the stage that made them, empty where the gate has none."""
        self.messages = 0
        self.itineraries = abstraction.itineraries
        by_loop = {id(way): [leg.crossings for leg in way.legs] for way in abstraction.itineraries}
        self._crossings_of = [by_loop[id(way)] for way in abstraction.itineraries]
        self.gate = gate
        self._following = gate if isinstance(gate, FollowingGate) else None
        self.negotiation = negotiation
        if isinstance(negotiation, InformedNegotiation):
            negotiation.prepare(self.system)
        self._pending: dict[int, Pending] = {}
        self._new: list[Pending] = []
        self._decided_s = -1.0
        self._version = 0
        self._filled: set[int] = set()
        """States that this step's grants took slots of."""
        self._entered: set[str] = set()
        """Movements that they lead over."""
        self._kept = RightOfWay(self.occupancy)
        self.sight: Sight | None = None
        """Frees crossings piece by piece if given; else when the rear has passed all of it."""
        self.obstacles: tuple[Obstacle, ...] = ()
        """What else can be in the way; asked in this order, after room and crossings."""
        for robot, path in enumerate(self.system.paths):
            self.occupancy.take(robot, path[self._at[robot]])

    @property
    def configuration(self) -> Configuration:
        """The configuration, written out if need be. O(robots) after a move."""
        if self._configuration is None:
            queues = tuple(tuple(self._lines[state]) for state in self.system.fifo_states)
            self._configuration = Configuration(tuple(self._at), queues)
        return self._configuration

    def position(self, robot: int) -> int:
        """Return the position of `robot` on its path: the last state it was granted."""
        return self._at[robot]

    def asks(self, robot: int, now_s: float) -> None:
        """Take a request of `robot`, the head of its state, for its next one; it stays until granted.

        In a FIFO state the head stays the head until it is granted, so others need not ask.
        """
        if robot in self._pending or self.first_before(robot) is not None:
            return
        path, here = self.system.paths[robot], self._at[robot]
        there = self._follow[robot][here]
        if there >= 0:
            request = Request(robot, path[here], path[there], now_s)
            pending = Pending(request, self._crossings_of[robot][here])
            self._pending[robot] = pending
            self._new.append(pending)

    def first_before(self, robot: int) -> int | None:
        """Return the head of the FIFO state that `robot` is in, if that is another robot."""
        line = self._lines.get(self.system.paths[robot][self._at[robot]])
        return None if line is None or line[0] == robot else line[0]

    def line(self, state: int) -> Sequence[int]:
        """Return who stands in `state`, head first, if it is a shared FIFO state."""
        return self._lines.get(state, ())

    def pending(self, robot: int) -> bool:
        """Return whether `robot` waits for an answer."""
        return robot in self._pending

    def left(self, robot: int, state: int) -> None:
        """Take note that the rear of `robot` has left `state`."""
        self.occupancy.leave(robot, state)
        self._version += 1

    def cleared(self, robot: int, position: int) -> None:
        """Take note that the rear of `robot` has passed the crossings behind `position`."""
        crossings = self._crossings_of[robot][position]
        if crossings:
            self.occupancy.clear(robot, crossings)
            self._version += 1

    def decide(self, now_s: float) -> list[Answer]:
        """Answer the requests, in the negotiation's order; return grants and new reasons of refusal.

        Each request is looked at once per step: within it grants take room and give none back.
        """
        if now_s > self._decided_s:
            self._decided_s = now_s
            if self._kept.renew(self._pending.values(), now_s):
                self._version += 1  # who was refused for a slot that was kept is looked at again
            looked_at: Iterable[Pending] = self._pending.values()
        else:
            looked_at = self._new
        self._new = []
        self._filled.clear()
        self._entered.clear()
        answers: list[Answer] = []
        possible = [pending.request for pending in looked_at if self._possible(pending, now_s, answers)]
        if possible:
            ordered = self.negotiation.order(possible, self.occupancy, now_s)
            for request in ordered:
                self._decide_one(self._pending[request.robot], now_s, answers)
            if len(ordered) < len(possible):
                going = {request.robot for request in ordered}
                for request in possible:
                    if request.robot not in going:
                        self._refuse(self._pending[request.robot], Reason.RESERVE, answers)
        return answers

    def _possible(self, pending: Pending, now_s: float, answers: list[Answer]) -> bool:
        """Return whether it is for the negotiation and the gate to say; else note the refusal."""
        reason = pending.reason
        if reason is Reason.OCCUPIED and self.occupancy.room(pending.request.wanted) <= 0:
            return False
        # Vehicles drive on without a word: who is in sight on a crossing is looked at again every step.
        if pending.looked_at_version == self._version and not (
            reason is None or reason is Reason.CROSSING or reason in _OUTSIDE
        ):
            return False
        pending.looked_at_version = self._version
        reason = self._in_the_way(pending)
        if reason is not None:
            self._refuse(pending, reason, answers)
            return False
        return pending.decision is None or now_s - pending.asked_at_s >= REASK_S

    def blockers(self, robot: int) -> list[list[int]]:
        """Return whom the request of `robot` waits for: of every set, some robot has to move on."""
        pending = self._pending.get(robot)
        if pending is None or pending.reason is None or pending.reason in _OUTSIDE:
            return []
        request = pending.request
        if pending.reason is Reason.OCCUPIED:
            if self.occupancy.room(request.wanted) > 0:
                return self._kept_by({self._kept.slot.get(request.wanted, robot)} - {robot})
            return [[other for other in self.occupancy.holders(request.wanted) if other != robot]]
        if pending.reason is Reason.CROSSING:
            crossings = pending.crossings
            kept_for = {self._kept.way.get(mine.id, robot) for mine in crossings} - {robot}
            return self._kept_by(kept_for) + [
                [other] for mine in crossings for other, _ in self.occupancy.foes_on_way(mine, robot)
            ]
        decision = pending.decision
        if decision is not None and self._following is not None:
            decision = self._following.decide_here(robot)  # by now others may be in its way, or none
        if decision is not None and pending.reason is not Reason.RESERVE and decision.blockers:
            return [list(decision.blockers)]
        return [[other for other in range(len(self.system.robots)) if other != robot]]

    def _kept_by(self, late: AbstractSet[int]) -> list[list[int]]:
        """Return those for whom something is kept still: not those that something else keeps by now."""
        pending = ((other, self._pending.get(other)) for other in sorted(late))
        return [[other] for other, its in pending if its is not None and its.passed_over]

    def outside_blockers(self, robot: int) -> list[list[str]]:
        """Return as `blockers` does, by name, who keeps `robot` from a grant as the obstacles say."""
        pending = self._pending.get(robot)
        if pending is None or pending.reason not in _OUTSIDE:
            return []
        return [list(some) for obstacle in self.obstacles for some in obstacle.blockers(robot)]

    def _in_the_way(self, pending: Pending) -> Reason | None:
        request = pending.request
        robot = request.robot
        room = self.occupancy.room(request.wanted)
        if room <= 0 or (room == 1 and self._kept.slot.get(request.wanted, robot) != robot):
            return Reason.OCCUPIED
        for mine in pending.crossings:
            if self._kept.way.get(mine.id, robot) != robot:
                return Reason.CROSSING
            for other, foe in self.occupancy.foes_on_way(mine, robot):
                if self.sight is None or self.sight.in_the_way(robot, mine, other, foe):
                    return Reason.CROSSING
        for obstacle in self.obstacles:
            reason = obstacle.in_the_way(robot)
            if reason is not None:
                return reason
        return None

    def _decide_one(self, pending: Pending, now_s: float, answers: list[Answer]) -> None:
        robot = pending.request.robot
        if self._crossed_by_grants(pending):
            reason = self._in_the_way(pending)
            if reason is not None:
                self._refuse(pending, reason, answers)
                return
        pending.asked_at_s = now_s
        begin = perf_counter_ns()
        if self._following is not None:
            decision = self._following.decide_here(robot)
        else:
            decision = self.gate.decide(self.configuration, robot)
        self.decision_us[decision.stage].add((perf_counter_ns() - begin) / 1000.0)
        self.messages += decision.messages
        pending.decision = decision
        if not decision.admitted:
            self._refuse(pending, decision.reason, answers, decision.stage)
            return
        self._grant(pending, decision, answers)

    def _crossed_by_grants(self, pending: Pending) -> bool:
        """Return whether a grant of this step can be in the way of a request that was looked at before it."""
        if self.obstacles or pending.request.wanted in self._filled:
            return True
        entered = self._entered
        return bool(entered) and any(not entered.isdisjoint(mine.foes) for mine in pending.crossings)

    def _grant(self, pending: Pending, decision: Decision, answers: list[Answer]) -> None:
        request, crossings = pending.request, pending.crossings
        robot = request.robot
        for obstacle in self.obstacles:
            obstacle.granted(robot)
        self.occupancy.enter(robot, crossings)
        self._entered.update(mine.id for mine in crossings)
        self._filled.add(request.wanted)
        self._at[robot] = self._follow[robot][self._at[robot]]
        line = self._lines.get(request.here)
        if line is not None:
            line.remove(robot)
        line = self._lines.get(request.wanted)
        if line is not None:
            line.append(robot)
        self._configuration = None
        self.occupancy.take(robot, request.wanted)
        if self._following is not None:
            self._following.moved_here(robot)
        else:
            self.gate.moved(self.configuration, robot)
        self._version += 1
        del self._pending[robot]
        answers.append(Answer(request, granted=True, reason=decision.reason, stage=decision.stage))

    def _refuse(self, pending: Pending, reason: Reason, answers: list[Answer], stage: str = "") -> None:
        if pending.reason is not reason:
            pending.reason = reason
            self.refusals[reason.value] += 1
            answers.append(Answer(pending.request, granted=False, reason=reason, stage=stage))
