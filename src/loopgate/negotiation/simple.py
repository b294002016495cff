"""The two plain strategies: chance and seniority."""

from collections.abc import Sequence
from random import Random

from loopgate.negotiation.base import Request, View


class RandomDelay:
    """The negotiation ``random``: the smallest random delay goes first (the paper's ``Neg``)."""

    def __init__(self, rng: Random) -> None:
        self._rng = rng

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return the requests in random order."""
        del view, now_s
        delays = {request.robot: self._rng.random() for request in requests}
        return sorted(requests, key=lambda request: delays[request.robot])


class OldestFirst:
    """The negotiation ``oldest``: the oldest request goes first; ties go by robot number."""

    def __init__(self, rng: Random) -> None:
        del rng

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return the requests, oldest first."""
        del view, now_s
        return sorted(requests, key=lambda request: (request.since_s, request.robot))
