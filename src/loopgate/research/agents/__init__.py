"""Robots as agents, with messages only: Algorithm 2 as Zhou et al. 2020 mean it."""

from loopgate.research.agents.agent import Outcome
from loopgate.research.agents.decision import Sensing, decide_by_messages
from loopgate.research.agents.messages import Kind
from loopgate.research.agents.network import Link
from loopgate.research.agents.run import run_agents

__all__ = [
    "Kind",
    "Link",
    "Outcome",
    "Sensing",
    "decide_by_messages",
    "run_agents",
]
