"""A request that waits for its grant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Crossing
from loopgate.gates import Decision, Reason
from loopgate.negotiation.base import Request

__all__ = ["Pending"]


@dataclass(slots=True)
class Pending:
    """A request, and what became of it so far.

    Attributes
    ----------
    request, crossings
        The request, and what lies between the two states.
    reason, decision
        Why it was refused last, and the gate's decision if it came to that.
    looked_at_version, asked_at_s
        State of the books when it was last looked at, and when the gate was last asked [s].
    """

    request: Request
    crossings: Sequence[Crossing]
    reason: Reason | None = None
    decision: Decision | None = None
    looked_at_version: int = -1
    asked_at_s: float = -1.0

    @property
    def passed_over(self) -> bool:
        """Whether others take what it needs: its crossing, or a slot."""
        return self.reason is Reason.CROSSING or self.reason is Reason.OCCUPIED
