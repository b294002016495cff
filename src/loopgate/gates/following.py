"""Base class of gates that need only the present configuration and follow the moves themselves."""

from abc import ABC, abstractmethod

from loopgate.gates.base import Decision, FollowingGate, Gate
from loopgate.model import Configuration, MutableConfiguration, Placement, System

_DECIDING = ("decide", "decide_here")


class Follower(ABC):
    """A gate that decides by the positions of robots only; see `FollowingGate`.

    A class declares that it follows with ``follows=True``. A class derived from it does not follow unless it
    declares so too: its decisions may depend on past configurations.
    """

    follows = False

    def __init_subclass__(cls, *, follows: bool = False) -> None:
        cls.follows = follows

    def __init__(self, system: System) -> None:
        self._system = system
        self._here = MutableConfiguration(system.initial)

    @abstractmethod
    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Decide the next move of `robot`."""

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Do nothing: the gate has no memory."""
        del configuration, robot

    def _trial(self, configuration: Placement) -> MutableConfiguration:
        """Return a configuration in which a move can be made and undone."""
        return self._here if configuration is self._here else MutableConfiguration(configuration)

    def decide_here(self, robot: int) -> Decision:
        """Decide the next move of `robot` in the configuration after all known moves."""
        return self.decide(self._here, robot)

    def moved_here(self, robot: int) -> None:
        """Record that `robot` has made an admitted move."""
        self._system.make(self._here, robot)


def following(gate: Gate) -> FollowingGate | None:
    """Return the gate if it follows the moves itself; None if it needs to be given configurations."""
    if isinstance(gate, Follower):
        return gate if gate.follows else None
    return gate if isinstance(gate, FollowingGate) and not _decides_anew(gate) else None


def _decides_anew(gate: FollowingGate) -> bool:
    """Return whether a subclass of a following gate has its own `decide`, but no `decide_here`."""
    homes = [next((k for k in type(gate).__mro__ if name in vars(k)), None) for name in _DECIDING]
    anew, here = homes
    return anew is not here and anew is not None and here is not None and issubclass(anew, here)
