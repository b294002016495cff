"""Whole runs of agents over a bad network: Algorithm 2 with its negotiation, round by round."""

import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from loopgate.model import Configuration, System
from loopgate.research.agents.agent import Agent, Outcome
from loopgate.research.agents.decision import Sensing, check_single, place
from loopgate.research.agents.messages import Claim, Kind, Message
from loopgate.research.agents.network import Link, MessageNetwork

_DECIDE = 60.0
_NEGOTIATE = 20.0
"""Time for a decision, and for each step of the negotiation [units of the delays]."""


@dataclass(frozen=True, slots=True)
class DistributedRun:
    """The result of a run."""

    moves: tuple[tuple[Configuration, int], ...]
    """Robots in the order in which they moved, with the configuration they moved in."""
    rounds: int
    """Rounds of deciding and negotiating; at most one robot moves in each."""
    stopped: int
    """Decisions that missed answers, and so were ``stop``."""
    replaced: int
    """Rounds in which a coordinator failed and another took over."""
    messages: dict[Kind, int]
    """Copies sent, by kind."""
    last: Configuration
    """Where the robots stood at the end."""


class _Negotiator:
    """The part of a robot in `Neg`: candidate, coordinator, or voter for a winner."""

    def __init__(self, agent: Agent, network: MessageNetwork) -> None:
        self.agent = agent
        self.round = -1
        self.won = False
        self.heard = False
        self.agreed: set[int] = set()
        self._agreed_to: int | None = None
        self._delays: dict[int, float] = {}
        self._network = network
        network.connect(agent.robot, self.receive)

    def start(self, number: int) -> None:
        """Forget the last round."""
        self.round = number
        self.won = self.heard = False
        self.agreed.clear()
        self._agreed_to = None
        self._delays.clear()

    def receive(self, message: Message) -> None:
        """Take the messages of the negotiation; hand the others to the agent. Late messages are void."""
        claim = message.payload
        if not isinstance(claim, Claim):
            self.agent.receive(message)
        elif claim.round == self.round:
            if message.kind is Kind.DELAY:
                self._delays[claim.robot] = claim.delay
            elif message.kind is Kind.GRANT:
                self.heard = True
                self.won = self.won or claim.robot == self.agent.robot
            elif message.kind is Kind.CLAIM:
                self.agree(claim)
            elif message.kind is Kind.AGREE:
                self.agreed.add(message.sender)

    def agree(self, claim: Claim) -> None:
        """Agree to the first robot that claims the round, and to no other."""
        if self._agreed_to in {None, claim.robot}:
            self._agreed_to = claim.robot
            self._network.send(Kind.AGREE, self.agent.robot, claim.robot, claim)

    def claim(self, robots: int) -> None:
        """Ask all robots, also this robot, to agree; a robot that has agreed to another claims nothing."""
        if self._agreed_to in {None, self.agent.robot}:
            self._agreed_to = self.agent.robot
            for other in range(robots):
                if other != self.agent.robot:
                    claim = Claim(self.round, self.agent.robot)
                    self._network.send(Kind.CLAIM, self.agent.robot, other, claim)

    def coordinate(self, candidates: list[int]) -> None:
        """Name the candidate with the least delay heard of to all candidates."""
        if not self._delays:
            return
        winner = min(self._delays, key=lambda robot: (self._delays[robot], robot))
        grant = Claim(self.round, winner)
        for robot in candidates:
            self._network.send(Kind.GRANT, self.agent.robot, robot, grant)


def run_agents(
    system: System,
    *,
    rounds: int,
    seed: int,
    link: Link | None = None,
    sensing: Sensing | None = None,
    fails: Callable[[int, int], bool] = lambda _number, _robot: False,
) -> DistributedRun:
    """Run the agents from the start of the system for at most `rounds` rounds.

    In each round every robot decides by messages whether its move is free of collisions and deadlocks. Robots
    with such a move negotiate: each sends a random delay to a coordinator, drawn among them, and the
    coordinator names the robot with the smallest delay. If the coordinator fails, the next robot in the draw
    takes over. The named robot moves only if all others agree, and each agrees to one robot per round. So two
    robots never move in the same configuration, even if messages are lost or late.

    Raises `SystemModelError` if a shared state holds more than one robot.

    Parameters
    ----------
    system
        States of one robot each.
    rounds, seed
        Largest number of rounds, and seed of the random numbers.
    fails
        Function of round and robot: whether the robot fails as coordinator in that round.
    """
    check_single(system)
    rng = random.Random(seed)
    network = MessageNetwork(link or Link(), rng)
    robots = len(system.robots)
    agents = [Agent(system, i, network) for i in range(robots)]
    negotiators = [_Negotiator(agent, network) for agent in agents]
    here = system.initial
    moves: list[tuple[Configuration, int]] = []
    stopped = replaced = done = 0
    everyone = frozenset(range(robots))
    for number in range(rounds):
        if all(system.finished(here, i) for i in range(robots)):
            break
        done += 1
        place(system, here, agents, sensing or Sensing())
        for negotiator in negotiators:
            negotiator.start(number)
            negotiator.agent.begin(everyone)
        network.run(until=network.now + _DECIDE)
        stopped += sum(agent.outcome is Outcome.OPEN for agent in agents)
        candidates = [agent.robot for agent in agents if agent.outcome is Outcome.LIVE]
        if not candidates:
            continue
        tried = _negotiate(network, negotiators, candidates, rng, partial(fails, number))
        replaced += tried > 1
        for robot in candidates:
            if negotiators[robot].won:
                negotiators[robot].claim(robots)
        network.run(until=network.now + _NEGOTIATE)
        for robot in candidates:
            negotiator = negotiators[robot]
            if negotiator.won and negotiator.agreed == everyone - {robot}:
                moves.append((here, robot))
                here = system.move(here, robot)
    return DistributedRun(tuple(moves), done, stopped, replaced, dict(Counter(network.sent)), here)


def _negotiate(
    network: MessageNetwork,
    negotiators: list[_Negotiator],
    candidates: list[int],
    rng: random.Random,
    fails: Callable[[int], bool],
) -> int:
    """Let coordinators act in turn until some robot has heard of a winner; return how many acted."""
    order = rng.sample(candidates, len(candidates))
    delays = {robot: rng.random() for robot in candidates}
    tried = 0
    for coordinator in order[:3]:
        tried += 1
        for robot in candidates:
            # Who has heard of a winner stays with it.
            if not negotiators[robot].heard:
                claim = Claim(negotiators[robot].round, robot, delays[robot])
                network.send(Kind.DELAY, robot, coordinator, claim)
        network.run(until=network.now + _NEGOTIATE)
        if not fails(coordinator):
            negotiators[coordinator].coordinate(candidates)
        network.run(until=network.now + _NEGOTIATE)
        if any(negotiators[robot].heard for robot in candidates):
            break
    return tried
