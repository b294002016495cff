"""The controllers aboard the vehicles of a run, as the simulation calls them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from loopgate.vehicles.controller import Answer, Controller
from loopgate.vehicles.messages import Stamp, ToVehicle
from loopgate.vehicles.vehicle import AskingVehicle

__all__ = ["Controllers", "ControllersHere", "Stand"]

Stand = tuple[tuple[int, ...], int, tuple[int, ...]]
"""A vehicle's loop as places, the index of its place there, and the places behind that its rear is in."""


class Controllers(Protocol):
    """The controllers aboard the vehicles, by number of the vehicle; each gets only its own messages.

    A controller that is out of order gives an empty answer.
    """

    def begin(self, stands: Sequence[Stand], crowded: float) -> None:
        """Start a controller for each vehicle; a place is crowded from the share `crowded` of its slots."""
        ...

    def look(self, now_s: float, stand: Callable[[int], Stand]) -> list[tuple[int, Answer]]:
        """Apply failures and restarts of controllers now; return each restarted vehicle with its answer.

        `stand`: returns where a vehicle stands, by its number.
        """
        ...

    def report(self) -> dict[str, Any]:
        """Return figures of the controllers for ``summary.json``."""
        ...

    def close(self) -> None:
        """End all controllers."""
        ...

    def at_line(
        self, number: int, stamp: Stamp, now_s: float, shares: tuple[float, float], *, free: bool
    ) -> Answer:
        """Tell a controller that its vehicle is at its stop line.

        `stamp`: since when [s], and the vehicle's number. `now_s`: its clock [s]. `shares`: the shares of
        slots taken in the next place and in its own. `free`: whether it sees its crossing free.
        """
        ...

    def hear(self, number: int, message: ToVehicle) -> Answer:
        """Give a controller a message; return what it answers."""
        ...

    def crossing(self, number: int, now_s: float, *, free: bool) -> Answer:
        """Tell a controller that holds a grant whether its crossing is free; `now_s` is its clock [s]."""
        ...

    def rear_out(self, number: int) -> Answer:
        """Tell a controller that the rear of its vehicle has left a place."""
        ...

    def remind(self, number: int) -> Answer:
        """Tell a controller that time has passed without the answer that it waits for."""
        ...


class ControllersHere:
    """Controllers that run in this process and never fail."""

    def __init__(self) -> None:
        self.all: list[Controller] = []

    def begin(self, stands: Sequence[Stand], crowded: float) -> None:
        """Start a controller for each vehicle."""
        self.all = [Controller(AskingVehicle(n, loop, at), crowded) for n, (loop, at, _) in enumerate(stands)]

    def look(self, now_s: float, stand: Callable[[int], Stand]) -> list[tuple[int, Answer]]:
        """Return nothing: these controllers never fail."""
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
        """Tell a controller that its vehicle is at its stop line."""
        return self.all[number].at_line(stamp, now_s, shares, free=free)

    def hear(self, number: int, message: ToVehicle) -> Answer:
        """Give a controller a message; return what it answers."""
        return self.all[number].hear(message)

    def crossing(self, number: int, now_s: float, *, free: bool) -> Answer:
        """Tell a controller that holds a grant whether its crossing is free; `now_s` is its clock [s]."""
        return self.all[number].crossing(now_s, free=free)

    def rear_out(self, number: int) -> Answer:
        """Tell a controller that the rear of its vehicle has left a place."""
        return self.all[number].rear_out()

    def remind(self, number: int) -> Answer:
        """Tell a controller that time has passed without the answer that it waits for."""
        return self.all[number].remind()
