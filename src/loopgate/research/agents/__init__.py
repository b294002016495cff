"""Robots as agents, with messages only: Algorithm 2 as Zhou et al. 2020 mean it, and the certified gate."""

from loopgate.research.agents.agent import Agent, Outcome
from loopgate.research.agents.certified import CertifiedRun, components, part, run_certified_agents
from loopgate.research.agents.decision import DistributedDecision, decide_by_messages
from loopgate.research.agents.messages import Kind, Message
from loopgate.research.agents.network import Link, MessageNetwork
from loopgate.research.agents.run import DistributedRun, run_agents
from loopgate.research.agents.sensing import Sensing

__all__ = [
    "Agent",
    "CertifiedRun",
    "DistributedDecision",
    "DistributedRun",
    "Kind",
    "Link",
    "Message",
    "MessageNetwork",
    "Outcome",
    "Sensing",
    "components",
    "decide_by_messages",
    "part",
    "run_agents",
    "run_certified_agents",
]
