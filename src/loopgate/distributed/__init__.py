"""Algorithm 2 as Zhou et al. 2020 mean it: robots as agents, with local signals and messages only."""

from loopgate.distributed.agent import Agent, Outcome
from loopgate.distributed.decision import DistributedDecision, decide_by_messages
from loopgate.distributed.messages import Kind, Message
from loopgate.distributed.network import Link, MessageNetwork
from loopgate.distributed.run import DistributedRun, run_agents
from loopgate.distributed.sensing import Sensing

__all__ = [
    "Agent",
    "DistributedDecision",
    "DistributedRun",
    "Kind",
    "Link",
    "Message",
    "MessageNetwork",
    "Outcome",
    "Sensing",
    "decide_by_messages",
    "run_agents",
]
