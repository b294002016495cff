"""What a vehicle that decides by messages can do and sense on the road."""

from __future__ import annotations

from typing import Protocol

from loopgate.gates import Reason

__all__ = ["Motor"]


class Motor(Protocol):
    """What a vehicle can do and sense on the road."""

    def free_way(self, robot: int) -> bool:
        """Return whether its crossing is still free; else it is told."""
        ...

    def answer_one(self, robot: int, reason: Reason) -> None:
        """Let it go, if the reason is that it is free, or tell it why not."""
        ...

    def would_close(self, robot: int) -> bool:
        """Return whether a gate that sees all would refuse it: for figures only."""
        ...

    def line(self, state: int) -> list[int]:
        """Return who stands in line in a place at the beginning."""
        ...
