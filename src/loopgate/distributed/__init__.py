"""Robots as agents, with messages only: Algorithm 2 as Zhou et al. 2020 mean it, and the certified gate."""

from loopgate.distributed.agent import Agent, Outcome
from loopgate.distributed.certified import CertifiedRun, components, part, run_certified_agents
from loopgate.distributed.decision import DistributedDecision, decide_by_messages
from loopgate.distributed.messages import Kind, Message
from loopgate.distributed.network import Link, MessageNetwork
from loopgate.distributed.run import DistributedRun, run_agents
from loopgate.distributed.sensing import Sensing

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
