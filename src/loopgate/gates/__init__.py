"""Gates, which decide one request at a time whether a robot may enter its next state."""

from loopgate.gates.base import Decision, FollowingGate, Gate, Reason, TimedGate
from loopgate.gates.registry import check_gate, gate_names, make_gate, name_gate

__all__ = [
    "Decision",
    "FollowingGate",
    "Gate",
    "Reason",
    "TimedGate",
    "check_gate",
    "gate_names",
    "make_gate",
    "name_gate",
]
