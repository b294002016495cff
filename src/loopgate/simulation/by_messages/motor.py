"""What a vehicle that decides by messages can sense and do on the road, through the ledger."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from loopgate.control.ledger import Ledger
from loopgate.control.places import Vehicle
from loopgate.control.refusal import Refusal
from loopgate.gates import Reason
from loopgate.simulation.by_messages.whereabouts import DistancesToPosts

__all__ = ["Motor"]

_REASK_S: Final = 1.0 - 1e-6
"""A vehicle asks again this long after a refusal that does not end by itself [s]."""

_PASSING: Final = (Reason.ANSWER, Reason.CROSSING)
"""Refusals after which a vehicle may ask again in each step."""


class Motor:
    """The senses and motors of vehicles, each of which has a number.

    Parameters
    ----------
    ledger
        Its rules are what a vehicle senses by itself.
    admits
        Returns whether the gate would let a vehicle go; only for figures.
    """

    def __init__(self, ledger: Ledger, admits: Callable[[Vehicle], bool]) -> None:
        self._ledger, self._admits = ledger, admits
        self._setting_out: dict[int, int] = {}
        """The vehicles that others do not yet see go, with the numbers of their grants."""
        self._tails: list[int] = []

    def begin(self, names: Sequence[str]) -> None:
        """Set the vehicles, which are in the ledger; their numbers follow the order of `names`."""
        self.vehicles = [self._ledger.vehicles[name] for name in names]
        self._number = {vehicle: number for number, vehicle in enumerate(self.vehicles)}
        self.where = DistancesToPosts(self.vehicles)
        self._tails = [self.where.tail(number) for number in range(len(self.vehicles))]

    @property
    def now_s(self) -> float:
        """The time [s]."""
        return self._ledger.now_s

    @property
    def step_s(self) -> float:
        """The length of a step [s]."""
        return self._ledger.step_s

    def line(self, place: int) -> list[int]:
        """Return the vehicles in the line of a place, first in line first."""
        return [self._number[one] for one in self.where.places[place].line]

    def asking(self) -> list[int]:
        """Return the vehicles that wait for a grant, oldest request first."""
        return [self._number[vehicle] for vehicle in self._ledger.waiting]

    def asks(self, number: int) -> bool:
        """Return whether a vehicle waits for a grant."""
        return self.vehicles[number].asks

    def since_s(self, number: int) -> float:
        """Return since when a vehicle has been at its stop line [s]."""
        return self.vehicles[number].since_s

    def reason(self, number: int) -> str:
        """Return why a vehicle did not go on when it last looked."""
        return self.vehicles[number].reason

    def rears_out(self) -> list[int]:
        """Return the vehicles whose rears have left places since the last call, once for each place."""
        out: list[int] = []
        for number, before in enumerate(self._tails):
            tail = self.where.tail(number)
            if tail != before:
                out += [number] * (tail - before)
                self._tails[number] = tail
        return out

    def ready(self, vehicles: Sequence[Vehicle]) -> list[int]:
        """Return the numbers of vehicles that sense no obstacle now."""
        return [self._number[vehicle] for vehicle in vehicles]

    def free_way(self, number: int) -> bool:
        """Return whether a vehicle that was ready still senses no obstacle; otherwise refuse it."""
        vehicle = self.vehicles[number]
        refusal = self._ledger.refusal_of(vehicle)
        if refusal is not None:
            self._ledger.refuse(vehicle, refusal)
            return False
        return True

    def seen_to_go(self) -> list[int]:
        """Return the vehicles that others see go since the last step.

        A vehicle that sets out shows it by a light, or by its speed. Others at the crossing see that in the
        next step: until then only its lease keeps them away.
        """
        found = list(self._setting_out)
        for number, grant in self._setting_out.items():
            for trip in self.vehicles[number].trips:
                trip.seen = trip.seen or trip.number == grant
        self._setting_out.clear()
        return found

    def look_again(self, numbers: Sequence[int]) -> None:
        """Let vehicles check in this step whether they are ready."""
        for number in numbers:
            self._ledger.wake(self.vehicles[number])

    def go(self, number: int) -> None:
        """Let a vehicle go on to its next place."""
        self._ledger.decisions += 1
        vehicle = self.vehicles[number]
        self._ledger.grant(vehicle)
        self._setting_out[number] = self._ledger.numbered
        for trip in vehicle.trips:
            if trip.number == self._ledger.numbered:
                trip.seen = False

    def refuse(self, number: int, reason: Reason) -> None:
        """Refuse a vehicle for a reason that a message gave it."""
        again_s = None if reason in _PASSING else self._ledger.now_s + _REASK_S
        self._ledger.decisions += 1
        refusal = Refusal(str(reason)) if again_s is None else Refusal(str(reason), at_s=again_s)
        self._ledger.refuse(self.vehicles[number], refusal)

    def would_close(self, number: int) -> bool:
        """Return whether the gate would refuse a vehicle; only for figures."""
        return not self._admits(self.vehicles[number])
