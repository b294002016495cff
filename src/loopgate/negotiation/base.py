"""The interface of negotiations, which order simultaneous requests."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from loopgate.model import System


class Request(NamedTuple):
    """A vehicle's request to enter its next state."""

    robot: int
    here: int
    wanted: int
    """`here` and `wanted`: number of the vehicle's state, and number of the state that it requests."""
    since_s: float
    """Time of the first request for `wanted` [s]."""


class View(Protocol):
    """The occupancy of states as a negotiation sees it."""

    def held(self, state: int) -> int:
        """Return the number of vehicles in `state`."""
        ...

    def room(self, state: int) -> int:
        """Return the number of free slots of `state`."""
        ...


@runtime_checkable
class Negotiation(Protocol):
    """The interface of a negotiation, which orders requests and may delay some.

    A negotiation class is called with a random generator (`random.Random`, seeded by the run) and with
    keyword options that the user may set (``--negotiation name:option=value``).
    """

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return `requests` in the order in which the gate decides them.

        A request that is left out waits for the next step.
        """
        ...


@runtime_checkable
class InformedNegotiation(Negotiation, Protocol):
    """A negotiation that gets the system before the first request."""

    def prepare(self, system: System) -> None:
        """Read the robots, their paths and the capacities of the states."""
        ...
