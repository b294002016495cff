"""The interface of negotiations: they put simultaneous requests in order."""

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
    """The view that a negotiation has: how full the states are, as the vehicles really stand."""

    def held(self, state: int) -> int:
        """Return how many vehicles occupy `state`."""
        ...

    def room(self, state: int) -> int:
        """Return how many more vehicles fit into `state`."""
        ...

    def outside(self, state: int) -> int:
        """Return how many vehicles wait to depart into `state`."""
        ...


@runtime_checkable
class Negotiation(Protocol):
    """Orders requests and may delay some. It never admits a move that the gate refuses.

    A negotiation class is called with a random generator (`random.Random`, seeded by the run) and with
    keyword options that the user may set (``--negotiation name:option=value``).
    """

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return `requests` in the order in which the gate shall decide them.

        A request that is left out waits for the next step.
        """
        ...


@runtime_checkable
class InformedNegotiation(Negotiation, Protocol):
    """A negotiation that wants to know the system before the first request."""

    def prepare(self, system: System) -> None:
        """Take note of the robots, their paths and the capacities of the states."""
        ...
