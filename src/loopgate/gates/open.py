"""No gate at all: on the road, the simulator's own right of way decides."""

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.model import Configuration, System


class OpenGate:
    """Admits every move that exists.

    On the road no vehicle asks it: SUMO's right of way and lights rule. In a system without roads the
    states' capacities still hold, so there it behaves like the collision gate.
    """

    def __init__(self, system: System) -> None:
        self._system = system

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Admit unless the robot has no next state."""
        if self._system.finished(configuration, robot):
            return refusal(Reason.STAYS)
        return Decision(admitted=True, reason=Reason.FREE)

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Do nothing: the gate has no memory."""
