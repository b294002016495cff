"""Finds collisions that are new: SUMO reports a collision in each step while it lasts."""

from __future__ import annotations

from collections.abc import Iterable

from loopgate.traffic.base import Collision


class Collisions:
    """Finds new collisions among all collisions that SUMO reports."""

    def __init__(self) -> None:
        self._under_way: set[tuple[str, str]] = set()

    def __bool__(self) -> bool:
        """Return whether a collision lasted in the last step."""
        return bool(self._under_way)

    def begun(self, reported: Iterable[Collision]) -> list[Collision]:
        """Return the collisions that began in the last step."""
        before, now = self._under_way, {(one.collider, one.victim): one for one in reported}
        self._under_way = set(now)
        return [one for pair, one in now.items() if pair not in before and pair[::-1] not in before]
