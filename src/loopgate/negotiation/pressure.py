"""Pressure: long queues go first, and nobody drives from an emptier place into a crowded one."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from loopgate.negotiation.base import Request, View

__all__ = ["Pressure"]


class Pressure:
    """Orders by pressure, queue behind less queue ahead (max-pressure, Varaiya 2013), with a soft reserve.

    A gate that admits every safe move lets a crowded network fill up around its busiest junctions until
    only single slots move through the queues. So a vehicle is asked to wait while the place it wants is
    crowded and fuller than its own. The queues then even out, and free slots lie where they are needed. The
    reserve needs no knowledge of the network, and it yields: the longer a vehicle waits, the fuller the
    place that it may enter, so it delays moves but never forbids one; what is safe is the gate's affair.

    Parameters
    ----------
    rng
        Not used; the order is fixed by the queues.
    crowded
        Share of its capacity from which a place counts as crowded, 0 to 1; above 1 there is no reserve.
    patience
        Wait [s] that outweighs one vehicle of difference in the reserve.
    wait
        Wait [s] that counts as much as one vehicle of pressure in the order.

    Raises
    ------
    ValueError
        If an option is not positive.
    """

    def __init__(self, rng: Random, crowded: float = 0.6, patience: float = 100.0, wait: float = 5.0) -> None:
        del rng
        if not (crowded > 0 and patience > 0 and wait > 0):
            msg = f"crowded={crowded:g}, patience={patience:g}, wait={wait:g}; expected more than 0"
            raise ValueError(msg)
        self._crowded = crowded
        self._patience_s = patience
        self._wait_s = wait

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return the requests that need not wait, strongest pressure first; ties go by robot number."""

        def pressure(request: Request) -> float:
            queues = view.held(request.here) - view.held(request.wanted)
            return queues + (now_s - request.since_s) / self._wait_s

        going = [request for request in requests if not self._waits(request, view, now_s)]
        return sorted(going, key=lambda request: (-pressure(request), request.robot))

    def _waits(self, request: Request, view: View, now_s: float) -> bool:
        ahead = view.held(request.wanted)
        capacity = ahead + view.room(request.wanted)
        if ahead < self._crowded * capacity:
            return False
        behind = view.held(request.here)
        share = behind / (behind + view.room(request.here))
        return ahead - share * capacity >= (now_s - request.since_s) / self._patience_s
