"""Pressure: full places go first, and no vehicle drives from an emptier place into a crowded place."""

from collections.abc import Sequence
from random import Random
from typing import Final

from loopgate.model import System
from loopgate.negotiation.base import Request, View
from loopgate.negotiation.formulas import leaves_room, pressure

_NO_RESERVE = 2.0
"""A share that no place is filled to."""


class Pressure:
    """The negotiation ``pressure``: the vehicle from the fullest place into the emptiest goes first.

    It is max-pressure (Varaiya 2013) by shares of slots.

    A gate that admits every safe move lets a crowded network fill up around its busiest junctions until
    only single slots move through the queues. So a vehicle is asked to wait while the place it wants is
    crowded and fuller than its own. The queues then even out, and free slots lie where they are needed. The
    reserve yields: the longer a vehicle waits, the fuller the place that it may enter, so it delays moves
    but never forbids one; what is safe is the gate's affair.

    How much is kept free follows from the network: a place counts as crowded once the share of it that is
    taken exceeds the share of all slots that the vehicles leave free. Few vehicles need no reserve; the more
    there are, the more of each place is kept.

    Raises `ValueError` if an option is negative, or `patience` or `wait` is 0.

    Parameters
    ----------
    rng
        Not used; the order is fixed by the queues.
    crowded
        Share of its capacity from which a place counts as crowded; above 1 there is no reserve. At 0 it
        follows from the network.
    patience
        Longest wait [s] for the reserve, from an empty place into a full one; less in proportion to how much
        fuller the place ahead is.
    """

    def __init__(self, rng: Random, crowded: float = 0.0, patience: float = 100.0) -> None:
        del rng
        if not (crowded >= 0 and patience > 0):
            msg = f"crowded={crowded:g}, patience={patience:g}; expected a share, and a time above 0"
            raise ValueError(msg)
        self.given: Final = crowded > 0
        """Whether `crowded` is the user's, and does not follow from the network."""
        self._crowded = crowded if self.given else _NO_RESERVE
        self._patience_s = patience

    @property
    def figures(self) -> tuple[float, float]:
        """The options `crowded` and `patience`; `crowded` follows from the network."""
        return float(self._crowded), float(self._patience_s)

    def prepare(self, system: System) -> None:
        """Find the share of taken slots above which a place is crowded. O(states)."""
        if not self.given:
            self._crowded = max(0.0, 1.0 - len(system.robots) / sum(system.room))

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return the requests that need not wait, by falling pressure; ties go by robot number."""
        going = [request for request in requests if not self._waits(request, view, now_s)]
        return sorted(going, key=lambda request: (-self._pressure(request, view, now_s), request.robot))

    def _pressure(self, request: Request, view: View, now_s: float) -> float:
        behind, ahead = self._shares(request, view)
        return pressure(behind, ahead, now_s - request.since_s)

    def _waits(self, request: Request, view: View, now_s: float) -> bool:
        here, ahead = self._shares(request, view)
        return leaves_room(ahead, here, (now_s - request.since_s) / self._patience_s, self._crowded)

    def _shares(self, request: Request, view: View) -> list[float]:
        """Return the shares of taken slots in the vehicle's place and in the next place."""
        return [
            view.held(state) / (view.held(state) + view.room(state))
            for state in (request.here, request.wanted)
        ]
