"""What keepers that hold a witness have in common: verdicts on moves, each with the witness after it."""

from abc import ABC, abstractmethod
from typing import NamedTuple

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration, System


class Verdict(NamedTuple):
    """A decision about a move, and the witness after it if it is admitted."""

    decision: Decision
    witness: list[int] | None = None


def overruled(system: System, favoured: int) -> Decision:
    """Return the refusal of what would not keep open the way of a robot that goes first."""
    detail = f"{system.robots[favoured].id} has waited too long and goes first"
    return refusal(Reason.NEGOTIATION, detail, "steering", (favoured,))


class WitnessKeeper(ABC):
    """Holds moves that show a promise to be kept, and what it found out about the next ones."""

    def __init__(self, layout: SystemIndex) -> None:
        self.layout = layout
        """The system's layout; of homes, those that are meant."""
        self.witness: list[int] | None = None
        """Moves from the current configuration to where all is well; None if none are known."""
        self.missing = Reason.DEADLOCK
        """Why there is no witness, while there is none."""
        self._checker = Checker(layout.system)
        self._verdicts: dict[int, Verdict] = {}
        self._favoured = -1

    def judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Decision:
        """Decide the next move of `robot`, which is enabled."""
        verdict = self._verdicts.get(robot)
        if verdict is None:
            verdict = self._verdicts[robot] = self._judge(configuration, stand, robot)
        return verdict.decision

    @abstractmethod
    def _judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Verdict: ...

    def _forget(self) -> None:
        """Begin without a witness, and without working towards anybody."""
        self._verdicts.clear()
        self.witness = None
        self._favoured = -1

    def _found_for(self, robot: int) -> list[int] | None:
        verdict = self._verdicts.get(robot)
        return None if verdict is None else verdict.witness

    def _take_over(self, robot: int) -> bool:
        """Take over the witness of the move of `robot`; False if there is none."""
        self.witness = self._found_for(robot)
        self._verdicts.clear()
        return self.witness is not None
