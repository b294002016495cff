"""A robot as an agent: its own path, its own signals, and the messages it gets."""

from dataclasses import dataclass, field
from enum import StrEnum

from loopgate.gates.circuits import Circuit, sub_circuit
from loopgate.gates.walks import Walk, default_lookahead
from loopgate.model import Robot, System
from loopgate.research.agents.messages import Circuits, Kind, Message, Question, Verdict, Visit
from loopgate.research.agents.network import MessageNetwork


class Outcome(StrEnum):
    """The progress of a robot's decision about its next move."""

    OPEN = "open"
    """Answers are missing; if they stay missing, the robot stops."""
    LIVE = "live"
    """All circuits are live: the move causes no higher-order deadlock."""
    DEADLOCK = "deadlock"
    """Some circuit is not live."""
    BLIND = "blind"
    """A signal that is needed cannot be read."""


@dataclass(slots=True)
class _Branch:
    """A visit that was passed on: the robot to answer, and the answers that are missing."""

    visit: int
    sender: int
    waiting: set[int]
    circuits: list[tuple[Circuit, tuple[frozenset[int], ...]]] = field(default_factory=list)
    depth: int = 0
    hops: int = 0


class Agent:
    """A robot that decides by messages; it knows its path, shared states, signals and the number of robots.

    Parameters
    ----------
    system
        The system; the agent takes from it its own path, and no more.
    """

    def __init__(self, system: System, robot: int, network: MessageNetwork) -> None:
        self.robot = robot
        self.position = system.robots[robot].start
        self.signals: dict[int, int | None] = {}
        self.outcome = Outcome.OPEN
        self.depth = 0
        self.hops = 0
        self._me: Robot = system.robots[robot]
        self._path = system.paths[robot]
        self._collision = frozenset(s for s in self._path if not system.private[s])
        self._most = default_lookahead(system)
        self._network = network
        self._seen: set[int] = set()
        self._branches: dict[int, _Branch] = {}
        self._mine: _Branch | None = None
        self._asked_state = -1
        self._questions: dict[int, int] = {}
        self._unsettled: set[int] = set()
        self._answers: dict[int, int] = {}
        network.connect(robot, self.receive)

    def begin(self, robots: frozenset[int]) -> None:
        """Start Algorithm 1 for the next state; once messages are delivered, `outcome` tells its end."""
        self._branches.clear()
        self._questions.clear()
        self._unsettled.clear()
        self._answers.clear()
        self._mine = None
        following = self._me.next_position(self.position)
        if following is None:
            self.outcome = Outcome.DEADLOCK
            return
        self._asked_state = self._path[following]
        self.outcome = Outcome.OPEN
        self.depth = self.hops = 0
        if self._asked_state not in self._collision:
            self.outcome = Outcome.LIVE
            return
        if self.signals.get(self._asked_state, self.robot) is not None:
            blind = self._asked_state not in self.signals
            self.outcome = Outcome.BLIND if blind else Outcome.DEADLOCK
            return
        walks = self._walks(following, self.robot, self._asked_state)
        if walks is None:
            self.outcome = Outcome.BLIND
            return
        self._mine = _Branch(0, self.robot, set(), depth=self.depth)
        for walk, head in walks:
            visit = Visit(self.robot, self._asked_state, (walk,), (self._collision,), robots - {self.robot})
            self._mine.waiting.add(self._network.send(Kind.VISIT, self.robot, head, visit))
        self._settle(self._mine)

    def receive(self, message: Message) -> None:
        """Take a message; ignore copies of earlier messages."""
        if message.number in self._seen:
            return
        self._seen.add(message.number)
        payload = message.payload
        if isinstance(payload, Visit):
            self._visit(message, payload)
        elif isinstance(payload, Circuits):
            self._circuits(payload)
        elif isinstance(payload, Question):
            self._network.send(
                Kind.CHECK, self.robot, message.sender, Verdict(message.number, self._check(payload))
            )
        elif isinstance(payload, Verdict):
            self._verdict(payload)

    def _occupant(self, state: int, asker: int, asked: int) -> int | None:
        """Return the robot that holds `state`, if the asking robot stood in the state that it asks about."""
        if state == asked:
            return asker
        seen = self.signals.get(state)
        return None if seen == asker else seen

    def _walks(self, position: int, asker: int, asked: int) -> list[tuple[Walk, int]] | None:
        """Return the risky walks from `position` and the robots at their heads; None if a signal misses."""
        states = [self._path[position]]
        heads: set[int] = set()
        walks: list[tuple[Walk, int]] = []
        looked = 0
        for _ in range(self._most):
            following = self._me.next_position(position)
            if following is None:
                break
            position = following
            state = self._path[position]
            looked += 1
            if state not in self._collision:
                break
            if state != asked and state not in self.signals and state != states[0]:
                return None
            states.append(state)
            head = self._occupant(state, asker, asked)
            if head is not None and head != self.robot and head not in heads:
                heads.add(head)
                walks.append((Walk(self.robot, tuple(states)), head))
        self.depth = max(self.depth, looked)
        return walks

    def _visit(self, message: Message, visit: Visit) -> None:
        """Do function ``visit`` of Algorithm 1; missing a signal, do not answer, so that the asker stops."""
        self.depth = 0
        walks = self._walks(self.position, visit.asker, visit.state)
        if walks is None:
            return
        index = visit.index - {self.robot}
        branch = _Branch(message.number, message.sender, set(), depth=self.depth)
        for walk, head in walks:
            chain = (*visit.walks, walk)
            visited = (*visit.visited, self._collision)
            if head == visit.asker:
                branch.circuits.append((Circuit(chain), visited))
            elif head in index:
                passed = Visit(visit.asker, visit.state, chain, visited, index)
                number = self._network.send(Kind.VISIT, self.robot, head, passed)
                branch.waiting.add(number)
                self._branches[number] = branch
        self._settle(branch)

    def _circuits(self, found: Circuits) -> None:
        mine = self._mine
        branch = mine if mine and found.visit in mine.waiting else self._branches.pop(found.visit, None)
        if branch is None:
            return
        branch.waiting.discard(found.visit)
        branch.circuits.extend(found.circuits)
        branch.depth = max(branch.depth, found.depth)
        branch.hops = max(branch.hops, found.hops)
        self._settle(branch)

    def _settle(self, branch: _Branch) -> None:
        """Answer a visit, or judge the circuits of the own decision, once all answers are there."""
        if branch.waiting:
            return
        if branch is not self._mine:
            found = Circuits(branch.visit, tuple(branch.circuits), branch.depth, branch.hops + 1)
            self._network.send(Kind.REPLY, self.robot, branch.sender, found)
            return
        self.depth = max(self.depth, branch.depth)
        self.hops = branch.hops
        doubtful = [pair for pair in branch.circuits if not _condition1(*pair)]
        if any(circuit.is_deadlock_cycle for circuit, _ in doubtful):
            self.outcome = Outcome.DEADLOCK
            return
        self._unsettled = set(range(len(doubtful)))
        for number, (circuit, visited) in enumerate(doubtful):
            question = Question(self.robot, self._asked_state, circuit, visited)
            if self._check(question):
                self._unsettled.discard(number)
                continue
            for robot in circuit.robots[1:]:
                sent = self._network.send(Kind.CIRCUIT, self.robot, robot, question)
                self._questions[sent] = number
                self._answers[number] = self._answers.get(number, 0) + 1
        self._conclude()

    def _check(self, question: Question) -> bool:
        """Return whether the own one-step move frees the circuit: ``check`` of Algorithm 1."""
        index = question.circuit.robots.index(self.robot)
        walk = question.circuit.walks[index]
        if not walk.intermediate:
            return False
        if self._occupant(walk.states[1], question.asker, question.state) is not None:
            return False
        left = sub_circuit(question.circuit, index)
        if left is None:
            return True
        known = dict(zip(question.circuit.robots, question.visited, strict=True))
        return _condition1(left, tuple(known[robot] for robot in left.robots))

    def _verdict(self, verdict: Verdict) -> None:
        number = self._questions.pop(verdict.question, None)
        if number is None or self.outcome is not Outcome.OPEN:
            return
        self._answers[number] -= 1
        if verdict.frees:
            self._unsettled.discard(number)
        elif self._answers[number] == 0 and number in self._unsettled:
            self.outcome = Outcome.DEADLOCK
            return
        self._conclude()

    def _conclude(self) -> None:
        if not self._unsettled and self.outcome is Outcome.OPEN:
            self.outcome = Outcome.LIVE


def _condition1(circuit: Circuit, visited: tuple[frozenset[int], ...]) -> bool:
    """Return whether condition (1) of Theorem 1 holds; never for a deadlock cycle."""
    if circuit.is_deadlock_cycle:
        return False
    states = circuit.intermediate
    if len(states) > len(circuit.walks) - 3:
        return True
    return any(sum(state in own for own in visited) < 2 for state in states)  # noqa: PLR2004 - the owner and another
