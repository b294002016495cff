"""Refusals: what a rule says, and what lifts it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import Final

from loopgate.control.places import Place, Vehicle

CHAIN: Final = "chain"
"""The chain rule, as a stage that decides."""


class Refusal:
    """Why a vehicle waits, and what wakes it: it is asked about again then.

    `until`: a vehicle leaves one of these places, or its line. `passed`: that vehicle's front is at
    `passed_m`. `at_s`: that time comes. One that names nothing, or that something `outside` may lift too,
    is asked about again in `each_step`. `stage`: which stage of the gate decided, if it was the gate.
    """

    __slots__ = ("at_s", "each_step", "passed", "passed_m", "reason", "stage", "until")

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
    ) -> None:
        self.reason: Final = reason
        self.stage: Final = stage
        self.until: Final = until
        self.at_s: Final = at_s
        self.passed: Final = passed
        self.passed_m: Final = passed_m
        self.each_step: Final = outside or (not until and at_s == inf and passed is None)


Rule = Callable[[Vehicle, float], Refusal | None]
