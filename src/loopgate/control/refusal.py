"""Refusals: why a rule does not let a vehicle go on, and what makes the ledger ask again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import Final

from loopgate.control.places import Place, Vehicle

CHAIN: Final = "chain"
"""The chain rule as the name of a stage of the gate."""


class Refusal:
    """Why a vehicle waits, and when the ledger asks the rules about it again.

    `until`: when a vehicle leaves one of these places. `passed`, `passed_m`: when the front of this vehicle
    is at this arc length [m]. `at_s`: at this time [s]. `each_step`: in each step, because none of these is
    given, or because something `outside` may end the refusal too. `stage`: the stage of the gate that
    refused, if the gate did. `cause`: what is closed, or which vehicle stands, and until when. A refusal
    with another cause is noted anew.
    """

    __slots__ = ("at_s", "cause", "each_step", "passed", "passed_m", "reason", "stage", "until")

    def __init__(
        self,
        reason: str,
        until: Sequence[Place] = (),
        at_s: float = inf,
        passed: Vehicle | None = None,
        passed_m: float = 0.0,
        *,
        outside: bool = False,
        stage: str = "",
        cause: str = "",
    ) -> None:
        self.cause: Final = cause
        self.reason: Final = reason
        self.stage: Final = stage
        self.until: Final = until
        self.at_s: Final = at_s
        self.passed: Final = passed
        self.passed_m: Final = passed_m
        self.each_step: Final = outside or (not until and at_s == inf and passed is None)


Rule = Callable[[Vehicle, float], Refusal | None]
