"""Obstacles to a request besides the vehicles under the gate and lights: ordinary traffic, their owner."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from loopgate.gates import Reason

__all__ = ["Obstacle"]


class Obstacle(Protocol):
    """Something outside the system that delays grants.

    It can only say no for now: a grant still needs the gate's admission. So all that a gate guarantees of
    the configurations it admits stays true; that every vehicle goes on needs the obstacle to give way
    again and again.
    """

    def in_the_way(self, robot: int) -> Reason | None:
        """Return why `robot`, whose request nothing else speaks against, may not set out now.

        Asked at most a few times per robot and step, and every step again as long as it says no.
        """
        ...

    def granted(self, robot: int) -> None:
        """Take note that the request of `robot` has just been granted; it has not been told."""
        ...

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return the vehicles that kept `robot` waiting when it was last asked about, by name.

        Of every set, some vehicle must move on before it can. Empty where what keeps it passes by itself.
        """
        ...
