"""The ledger: who holds which place, who waits for what, and who goes on first."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Final

from loopgate.control.places import Leg, Place, Vehicle
from loopgate.control.rules import Rule

WAIT_TURNS: Final = 5
"""So many turns of waiting count as much as one vehicle more behind than before."""


class Ledger:
    """Vehicles in places, and their requests.

    Every change goes through `take_in`, `ask`, `answer` and `leave`, so whatever may lift a refusal wakes the
    vehicles that were refused for it.

    Parameters
    ----------
    rules
        Asked in this order until one refuses.
    everybody
        Ask every vehicle that waits in every answer instead of those that were woken. It is slow, gives the
        same grants, and judges the wake lists.

    Examples
    --------
    >>> from loopgate.control.places import Place, path_of
    >>> from loopgate.control.rules import usual
    >>> ledger = Ledger(usual())
    >>> a, b = Place("a", 2), Place("b", 2)
    >>> car = ledger.take_in("car", path_of([a, b], closed=True), 0)
    >>> ledger.ask(car)
    >>> [vehicle.name for vehicle in ledger.answer()], car.leg.place.name
    (['car'], 'b')
    """

    def __init__(self, rules: list[Rule], *, everybody: bool = False) -> None:
        self.rules: Final = rules
        self.everybody: Final = everybody
        self.vehicles: dict[str, Vehicle] = {}
        self.turn = 0
        self.looked_at = 0
        self._made = 0
        self._woken: list[tuple[float, int, Vehicle]] = []
        self._looking: list[Vehicle] = []

    def take_in(self, name: str, path: list[Leg], position: int) -> Vehicle:
        """Put a new vehicle last in line in the place at `position` of its path.

        `loopgate.control.chain.closes_by_entering` says before whether it closes a circle there. Raises
        `ValueError` if the name is taken or no slot is free there.
        """
        place = path[position].place
        if name in self.vehicles:
            msg = f"vehicle {name} is there already, in place {self.vehicles[name].leg.place.name}"
            raise ValueError(msg)
        if place.is_full():
            msg = f"vehicle {name} does not fit into place {place.name}: its {place.slots} slots are taken"
            raise ValueError(msg)
        vehicle = Vehicle(self._made, name, path[position])
        self._made += 1
        self.vehicles[name] = vehicle
        self._change(place)
        place.line.append(vehicle)
        return vehicle

    def leave(self, vehicle: Vehicle) -> None:
        """Strike a vehicle out of the ledger, wherever it stands in line."""
        del self.vehicles[vehicle.name]
        vehicle.asks = False
        self._go_out(vehicle)

    def ask(self, vehicle: Vehicle) -> None:
        """Take a vehicle's request for its next place; it is answered when it heads its line."""
        if not vehicle.asks:
            vehicle.asks = True
            vehicle.since = self.turn
            vehicle.reason = ""
            self.wake(vehicle)

    def wake(self, vehicle: Vehicle) -> None:
        """Look at a vehicle in the next answer, or in this one if it is under way."""
        if vehicle.asks and not vehicle.woken and vehicle.leg.place.line[0] is vehicle:
            vehicle.woken = True
            heappush(self._woken, (self._rank(vehicle), vehicle.number, vehicle))

    def why_not(self, vehicle: Vehicle) -> str:
        """Return why a vehicle may not go on now, or "". Changes nothing."""
        for rule in self.rules:
            refusal = rule(vehicle)
            if refusal is not None:
                return refusal.reason
        return ""

    def answer(self) -> list[Vehicle]:
        """Answer all requests; return the vehicles that were let go, in that order.

        The vehicle with most pressure behind it, as it was before the first grant of this turn, is asked
        about first. A refused vehicle is looked at again after each grant that may have lifted its refusal;
        one that was refused for something that no grant lifts, once in each turn.
        """
        self.turn += 1
        woken, self._woken = self._woken, []
        looking, self._looking = self._looking, []
        for _, _, vehicle in woken:
            vehicle.woken = False
            self.wake(vehicle)
        for vehicle in looking:
            self.wake(vehicle)
        gone: list[Vehicle] = []
        if self.everybody:
            self._wake_everybody()
        while self._woken:
            vehicle = heappop(self._woken)[2]
            vehicle.woken = False
            if vehicle.asks and vehicle.leg.place.line[0] is vehicle and self._settle(vehicle):
                gone.append(vehicle)
                if self.everybody:
                    self._wake_everybody()
        return gone

    def _wake_everybody(self) -> None:
        for vehicle in self.vehicles.values():
            self.wake(vehicle)

    def _rank(self, vehicle: Vehicle) -> float:
        """Return the less the sooner it is asked about in this turn; grants of the turn do not change it."""
        leg = vehicle.leg
        before = 0 if leg.after is None else self._length(leg.after.place)
        return before - self._length(leg.place) - (self.turn - vehicle.since) / WAIT_TURNS

    def _length(self, place: Place) -> int:
        """Return how many stood in a place before the first grant of this turn."""
        return place.length_before if place.changed == self.turn else len(place.line)

    def _change(self, place: Place) -> None:
        """Note how many stand in a place before its line changes."""
        if place.changed != self.turn:
            place.changed = self.turn
            place.length_before = len(place.line)

    def _settle(self, vehicle: Vehicle) -> bool:
        """Let a vehicle go on, or note why not and what wakes it."""
        self.looked_at += 1
        for rule in self.rules:
            refusal = rule(vehicle)
            if refusal is not None:
                vehicle.reason = refusal.reason
                if not refusal.until:
                    self._looking.append(vehicle)
                for place in refusal.until:
                    if vehicle not in place.waiting:
                        place.waiting.append(vehicle)
                return False
        vehicle.asks = False
        vehicle.reason = ""
        self._go_on(vehicle)
        return True

    def _go_on(self, vehicle: Vehicle) -> None:
        after = vehicle.leg.after
        if after is None:
            self.leave(vehicle)
            return
        self._go_out(vehicle)
        vehicle.leg = after
        self._change(after.place)
        after.place.line.append(vehicle)

    def _go_out(self, vehicle: Vehicle) -> None:
        """Take a vehicle out of its line; wake those that wait for that, and the one that is first now."""
        place = vehicle.leg.place
        self._change(place)
        place.line.remove(vehicle)
        waiting, place.waiting = place.waiting, []
        for other in waiting:
            self.wake(other)
        if place.line:
            self.wake(place.line[0])
