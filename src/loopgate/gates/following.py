"""Gates without a memory that follow the moves all the same, so that nobody writes configurations out."""

from abc import ABC, abstractmethod

from loopgate.gates.base import Decision
from loopgate.model import Configuration, MutableConfiguration, Placement, System


class Follower(ABC):
    """A gate that decides by where robots stand, and by nothing else; see `FollowingGate`."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._here = MutableConfiguration(system.initial)

    @abstractmethod
    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Decide the next move of `robot`."""

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Do nothing: the gate has no memory."""
        del configuration, robot

    def decide_here(self, robot: int) -> Decision:
        """Decide the next move of `robot` after the moves told so far."""
        return self.decide(self._here, robot)

    def moved_here(self, robot: int) -> None:
        """Take note that `robot` has made an admitted move."""
        self._system.make(self._here, robot)
