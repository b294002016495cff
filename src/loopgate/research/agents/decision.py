"""One decision by messages over a network: signals seen, the decision, and its cost."""

import random
from dataclasses import dataclass

from loopgate.errors import SystemModelError
from loopgate.gates.walks import default_lookahead, steps_ahead
from loopgate.model import Configuration, System
from loopgate.research.agents.agent import Agent, Outcome
from loopgate.research.agents.messages import Kind
from loopgate.research.agents.network import Link, MessageNetwork

_PATIENCE = 1000.0
"""How long the robot waits for answers [time units]; then it stops."""


@dataclass(frozen=True, slots=True)
class Sensing:
    """The signals that a robot can read: of states ahead on its path, and of states with a monitor."""

    states_ahead: int | None = None
    """Number of states ahead whose signals a robot can read; None for as many as it looks ahead."""
    monitored: frozenset[int] = frozenset()
    """States with a monitor, which tells other robots which robot is there (Section 3.1 of Zhou et al. 2020):
    for segments longer than the range."""


def sense(
    system: System, configuration: Configuration, robot: int, sensing: Sensing, lookahead: int
) -> dict[int, int | None]:
    """Return the signals that `robot` can read: the robot in each collision state ahead, or None.

    A state whose signal it cannot read is not in the answer. It looks no further than its next private state.
    """
    signals: dict[int, int | None] = {}
    ahead = steps_ahead(system, robot, configuration.positions[robot], lookahead + 1)
    for step, position in enumerate(ahead):
        state = system.paths[robot][position]
        if system.private[state]:
            break
        if sensing.states_ahead is None or step < sensing.states_ahead or state in sensing.monitored:
            inside = system.occupants(configuration, state)
            signals[state] = inside[0] if inside else None
    return signals


@dataclass(frozen=True, slots=True)
class DistributedDecision:
    """A decision and its cost."""

    admitted: bool
    """Whether the robot may move, as far as deadlocks go; a missing answer means no."""
    outcome: Outcome
    """The outcome as the asking agent sees it."""
    messages: dict[Kind, int]
    """Copies sent, by kind."""
    hops: int
    """Longest chain of visits."""
    depth: int
    """States actually looked ahead by any robot, at most ``N - 2``."""


def check_single(system: System) -> None:
    """Raise `SystemModelError` if a shared state of a system holds several robots.

    Raises `SystemModelError` if a shared state holds more than one robot.
    """
    for state, room in enumerate(system.room):
        if room > 1 and not system.private[state]:
            msg = (
                f"state {system.states[state]}: it holds {room} robots; agents know states of one robot only"
            )
            raise SystemModelError(msg)


def place(system: System, configuration: Configuration, agents: list[Agent], sensing: Sensing) -> None:
    """Put the agents in the states of a configuration, and let them read their signals."""
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
    """Let agents decide by messages whether `robot` may move (Algorithm 2, lines 2 to 10).

    Raises `SystemModelError` if a shared state holds more than one robot.

    Parameters
    ----------
    system, configuration, robot
        The system, the positions of all robots, and the robot that asks.
    link, sensing
        Delay and loss of messages, and the sensing range; default: no loss and a sufficient range.
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
