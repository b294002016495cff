"""Proofs of liveness: each keeps the evidence for one promise, and decides moves by it."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, NamedTuple

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
    """Return the refusal of a move that would block the robot that goes first."""
    detail = f"{system.robots[favoured].id} has waited too long and goes first"
    return refusal(Reason.NEGOTIATION, detail, "steering", (favoured,))


class LivenessProof(ABC):
    """The evidence for one promise, which decides moves."""

    for_everyone = True
    """Whether the promise is that every robot can go on for ever; otherwise that some robot can always
    move."""

    def __init__(self, layout: SystemIndex) -> None:
        self.layout = layout
        """The system's layout, with the homes that this proof uses."""
        self.missing = Reason.DEADLOCK
        """The reason while there is no witness."""

    @abstractmethod
    def begin(self, configuration: Configuration, stand: Occupancy) -> bool:
        """Find a witness for a configuration; return whether there is one.

        Raises `BudgetError` if the budget is used up before the answer is known.
        """

    def at_once(self, stand: Occupancy, robot: int) -> Decision | None:
        """Decide the next move of `robot` from positions alone; None if the configuration is needed."""
        del stand, robot
        return None

    @abstractmethod
    def judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Decision:
        """Decide the next move of `robot`; capacity and order already allow it."""

    @abstractmethod
    def moved(self, robot: int, before: int) -> bool:
        """Record that `robot` moved from the position `before`; return False if no witness is known."""

    @abstractmethod
    def favour(self, configuration: Configuration, stand: Occupancy, robot: int) -> None:
        """Admit only moves after which `robot` can move soon; -1 ends this."""

    @abstractmethod
    def shown(self, stand: Occupancy, robot: int, decision: Decision) -> dict[str, Any] | None:
        """Return the certificate of a decision; None if there is none."""

    def ids(self, robots: Iterable[int]) -> list[str]:
        """Return the names of robots."""
        return [self.layout.system.robots[i].id for i in robots]


class WitnessProof(LivenessProof):
    """A proof by a witness: a sequence of moves which shows that the promise holds."""

    def __init__(self, layout: SystemIndex) -> None:
        super().__init__(layout)
        self.witness: list[int] | None = None
        """Moves from the current configuration to one in which the promise plainly holds; None if unknown."""
        self._checker = Checker(layout.system)
        self._verdicts: dict[int, Verdict] = {}
        self._favoured = -1

    def judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Decision:
        """Decide the next move of `robot`; capacity and order already allow it."""
        verdict = self._verdicts.get(robot)
        if verdict is None:
            verdict = self._verdicts[robot] = self._judge(configuration, stand, robot)
        return verdict.decision

    @abstractmethod
    def _judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Verdict: ...

    def _forget(self) -> None:
        """Begin without a witness and without a robot that goes first."""
        self._verdicts.clear()
        self.witness = None
        self._favoured = -1

    def moved(self, robot: int, before: int) -> bool:
        """Record the move of `robot` and its witness; return False if there is none."""
        del before
        return self._take_over(robot)

    def _found_for(self, robot: int) -> list[int] | None:
        verdict = self._verdicts.get(robot)
        return None if verdict is None else verdict.witness

    def _take_over(self, robot: int) -> bool:
        """Use the witness found for the move of `robot`; return False if there is none."""
        self.witness = self._found_for(robot)
        self._verdicts.clear()
        return self.witness is not None
