"""One decision by messages over a network, and what it cost."""

import random
from dataclasses import dataclass

from loopgate.errors import SystemModelError
from loopgate.gates.walks import default_lookahead
from loopgate.model import Configuration, System
from loopgate.research.agents.agent import Agent, Outcome
from loopgate.research.agents.messages import Kind
from loopgate.research.agents.network import Link, MessageNetwork
from loopgate.research.agents.sensing import Sensing, sense

_PATIENCE = 1000.0
"""How long the robot waits for answers [time units]; then it stops."""


@dataclass(frozen=True, slots=True)
class DistributedDecision:
    """A decision and its cost."""

    admitted: bool
    """Whether the robot may move, as far as deadlocks go; a missing answer means no."""
    outcome: Outcome
    """How its agent sees it."""
    messages: dict[Kind, int]
    """Copies sent, by kind."""
    hops: int
    """Longest chain of visits."""
    depth: int
    """States actually looked ahead by any robot, at most ``N - 2``."""


def check_single(system: System) -> None:
    """Refuse a system whose states hold several robots: the distributed algorithm is the paper's.

    Raises `SystemModelError` if a shared state holds more than one robot.
    """
    for state, room in enumerate(system.room):
        if room > 1 and not system.private[state]:
            msg = (
                f"state {system.states[state]}: it holds {room} robots; agents know states of one robot only"
            )
            raise SystemModelError(msg)


def place(system: System, configuration: Configuration, agents: list[Agent], sensing: Sensing) -> None:
    """Put the agents where the configuration says, and let them read their signals."""
    lookahead = default_lookahead(system)
    for agent in agents:
        agent.position = configuration.positions[agent.robot]
        agent.signals = sense(system, configuration, agent.robot, sensing, lookahead)


def decide_by_messages(
    system: System,
    configuration: Configuration,
    robot: int,
    *,
    link: Link | None = None,
    sensing: Sensing | None = None,
    seed: int = 0,
) -> DistributedDecision:
    """Let the agents decide whether `robot` may enter its next state (Algorithm 2, lines 2 to 10).

    Raises `SystemModelError` if a shared state holds more than one robot.

    Parameters
    ----------
    system, configuration, robot
        The robot that asks, and where everyone stands.
    link, sensing
        How messages fare and how far robots see; without loss and everything needed if not given.
    """
    check_single(system)
    network = MessageNetwork(link or Link(), random.Random(seed))
    agents = [Agent(system, i, network) for i in range(len(system.robots))]
    place(system, configuration, agents, sensing or Sensing())
    asker = agents[robot]
    asker.begin(frozenset(range(len(agents))))
    network.run(until=_PATIENCE)
    return DistributedDecision(
        admitted=asker.outcome is Outcome.LIVE,
        outcome=asker.outcome,
        messages=dict(network.sent),
        hops=asker.hops,
        depth=asker.depth,
    )
