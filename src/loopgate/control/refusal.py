"""Refusals: what a rule says, and what lifts it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import Final

from loopgate.control.places import Place, Vehicle


class Refusal:
    """Why a vehicle waits, and what wakes it: it is asked about again then.

    `until`: a vehicle leaves one of these places, or its line. `passed`: that vehicle's front is at
    `passed_m`. `at_s`: that time comes. One that names nothing is asked about again in each step.
    """

    __slots__ = ("at_s", "passed", "passed_m", "reason", "until")

    def __init__(
        self,
        reason: str,
        until: Sequence[Place] = (),
        at_s: float = inf,
        passed: Vehicle | None = None,
        passed_m: float = 0.0,
    ) -> None:
        self.reason: Final = reason
        self.until: Final = until
        self.at_s: Final = at_s
        self.passed: Final = passed
        self.passed_m: Final = passed_m

    def names_nothing(self) -> bool:
        """Return whether nothing that the ledger sees lifts it."""
        return not self.until and self.at_s == inf and self.passed is None


Rule = Callable[[Vehicle, float], Refusal | None]
