"""Algorithm 2 by messages, as a gate: the answers of ``algorithm2``, and the number of messages."""

from loopgate.errors import GateError
from loopgate.gates import Decision, Reason
from loopgate.gates.collision import collision_decision
from loopgate.model import Configuration, System
from loopgate.research.agents.agent import Outcome
from loopgate.research.agents.decision import check_single, decide_by_messages
from loopgate.research.agents.network import Link


class AgentsGate:
    """Lets the robots decide among themselves; `Decision.messages` says how many messages it took.

    Slow, for studies: each decision simulates its messages. With losses an answer can be missing; then the
    robot stops, with the reason ``BUDGET``. The same question in the same configuration gets the same answer.

    Raises `GateError` if `loss` is no probability; `SystemModelError` if a shared state holds more than one
    robot.

    Parameters
    ----------
    system
        States of one robot each.
    loss
        Probability that a message is lost, from 0 to 1.
    """

    def __init__(self, system: System, *, loss: float = 0.0, seed: int = 0) -> None:
        self.check_options(loss=loss, seed=seed)
        check_single(system)
        self._system = system
        self._link = Link(loss=loss)
        self._seed = seed

    @staticmethod
    def check_options(*, loss: float = 0.0, seed: int = 0) -> None:
        """Raise `GateError` if `loss` is no probability; any seed will do."""
        del seed
        if not 0.0 <= loss <= 1.0:
            msg = f"gate agents: loss is {loss!r}; expected a probability from 0 to 1"
            raise GateError(msg)

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Let the agents decide the next move of `robot`."""
        first = collision_decision(self._system, configuration, robot)
        if not first.admitted:
            return first
        asked = decide_by_messages(self._system, configuration, robot, link=self._link, seed=self._seed)
        known = {Outcome.LIVE: Reason.FREE, Outcome.DEADLOCK: Reason.DEADLOCK}
        return Decision(
            admitted=asked.admitted,
            reason=known.get(asked.outcome, Reason.BUDGET),
            detail=f"{asked.hops} hops, {asked.depth} states looked ahead",
            messages=sum(asked.messages.values()),
        )

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Do nothing: the agents sense where they are."""
