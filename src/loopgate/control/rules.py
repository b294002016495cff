"""Rules: each a function that says why a vehicle may not go on now, or nothing.

A rule changes nothing. Its refusal names the places that wake the vehicle when one leaves them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from loopgate.control.chain import full_after
from loopgate.control.places import Place, Vehicle


class Refusal:
    """Why a vehicle waits. `until`: it is asked again when a vehicle leaves one of these places."""

    __slots__ = ("reason", "until")

    def __init__(self, reason: str, until: list[Place]) -> None:
        self.reason: Final = reason
        self.until: Final = until


Rule = Callable[[Vehicle], Refusal | None]


def room(vehicle: Vehicle) -> Refusal | None:
    """Refuse where the place that the vehicle wants has no slot free."""
    wanted = vehicle.wanted()
    if wanted is None or not wanted.is_full():
        return None
    return Refusal("occupied", [wanted])


def chain(vehicle: Vehicle) -> Refusal | None:
    """Refuse a move that would close a circle of full places, or lead into one that is there."""
    after = full_after(vehicle)
    return Refusal("deadlock", after.places) if after.circle() else None


def usual() -> list[Rule]:
    """Return the rules of places alone, in the order in which they are asked."""
    return [room, chain]
