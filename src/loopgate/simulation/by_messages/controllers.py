"""The controllers of the vehicles of a run, as the bridge between them and the road sees them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from loopgate.vehicles.controller import Answer, Controller
from loopgate.vehicles.messages import Stamp, ToVehicle
from loopgate.vehicles.vehicle import Vehicle

__all__ = ["Controllers", "ControllersHere", "Stand"]

Stand = tuple[tuple[int, ...], int, tuple[int, ...]]
"""The loop of a vehicle as places, the position of its place there, and places behind that it is still in."""


class Controllers(Protocol):
    """Controllers, each of which hears only what is for it. One that is silent gives an empty answer."""

    def begin(self, stands: Sequence[Stand], crowded: float) -> None:
        """Begin with these vehicles, by number, which leave room in places from this share of slots on."""
        ...

    def look(self, now_s: float, stand: Callable[[int], Stand]) -> list[tuple[int, Answer]]:
        """Apply failures and restarts of controllers now; return each restarted vehicle with its answer.

        `stand`: returns where a vehicle stands, by its number.
        """
        ...

    def report(self) -> dict[str, Any]:
        """Return figures of the controllers."""
        ...

    def close(self) -> None:
        """End all controllers."""
        ...

    def at_line(
        self, number: int, stamp: Stamp, now_s: float, shares: tuple[float, float], *, free: bool
    ) -> Answer:
        """Tell one that it is at its line, since when, its clock [s], what it heard and what it sees."""
        ...

    def hear(self, number: int, message: ToVehicle) -> Answer:
        """Give it a message."""
        ...

    def crossing(self, number: int, now_s: float, *, free: bool) -> Answer:
        """Tell it its clock [s] and whether its crossing is free, now that it can go."""
        ...

    def rear_out(self, number: int) -> Answer:
        """Tell it that its rear has left a place."""
        ...

    def remind(self, number: int) -> Answer:
        """Tell it that some time has passed."""
        ...


class ControllersHere:
    """Controllers in this process."""

    def __init__(self) -> None:
        self.all: list[Controller] = []

    def begin(self, stands: Sequence[Stand], crowded: float) -> None:
        """Begin with these vehicles."""
        self.all = [Controller(Vehicle(n, loop, at), crowded) for n, (loop, at, _) in enumerate(stands)]

    def look(self, now_s: float, stand: Callable[[int], Stand]) -> list[tuple[int, Answer]]:
        """Return nothing: nothing happens to them."""
        del now_s, stand
        return []

    def report(self) -> dict[str, Any]:
        """Return no figures."""
        return {}

    def close(self) -> None:
        """Do nothing: they end with this process."""

    def at_line(
        self, number: int, stamp: Stamp, now_s: float, shares: tuple[float, float], *, free: bool
    ) -> Answer:
        """See `Controllers`."""
        return self.all[number].at_line(stamp, now_s, shares, free=free)

    def hear(self, number: int, message: ToVehicle) -> Answer:
        """See `Controllers`."""
        return self.all[number].hear(message)

    def crossing(self, number: int, now_s: float, *, free: bool) -> Answer:
        """See `Controllers`."""
        return self.all[number].crossing(now_s, free=free)

    def rear_out(self, number: int) -> Answer:
        """See `Controllers`."""
        return self.all[number].rear_out()

    def remind(self, number: int) -> Answer:
        """See `Controllers`."""
        return self.all[number].remind()
