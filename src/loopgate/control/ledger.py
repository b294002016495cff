"""The ledger: who holds which place, who waits for what, and who goes on first."""

from __future__ import annotations

from typing import Final

from loopgate.control.places import Leg, Vehicle
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
        self._woken: list[Vehicle] = []

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
        """Look at a vehicle in the next answer."""
        if vehicle.asks and not vehicle.woken:
            vehicle.woken = True
            self._woken.append(vehicle)

    def why_not(self, vehicle: Vehicle) -> str:
        """Return why a vehicle may not go on now, or "". Changes nothing."""
        for rule in self.rules:
            refusal = rule(vehicle)
            if refusal is not None:
                return refusal.reason
        return ""

    def answer(self) -> list[Vehicle]:
        """Answer all requests; return the vehicles that were let go, in that order.

        Those that were refused are looked at again after each grant that may have lifted their refusal.
        """
        self.turn += 1
        gone: list[Vehicle] = []
        while (vehicle := self._next()) is not None:
            gone.append(vehicle)
        return gone

    def _next(self) -> Vehicle | None:
        """Let the first go on that no rule refuses, the one with most pressure behind it first."""
        woken = list(self.vehicles.values()) if self.everybody else self._woken
        self._woken = []
        for vehicle in woken:
            vehicle.woken = False
        ready = [v for v in woken if v.asks and v.leg.place.line[0] is v]
        ready.sort(key=self._turn_of)
        for number, vehicle in enumerate(ready):
            if self._settle(vehicle):
                for other in ready[number + 1 :]:
                    self.wake(other)
                return vehicle
        return None

    def _turn_of(self, vehicle: Vehicle) -> tuple[float, int]:
        wanted = vehicle.wanted()
        before = 0 if wanted is None else len(wanted.line)
        behind = len(vehicle.leg.place.line)
        return before - behind - (self.turn - vehicle.since) / WAIT_TURNS, vehicle.number

    def _settle(self, vehicle: Vehicle) -> bool:
        """Let a vehicle go on, or note why not and what wakes it."""
        self.looked_at += 1
        for rule in self.rules:
            refusal = rule(vehicle)
            if refusal is not None:
                vehicle.reason = refusal.reason
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
        after.place.line.append(vehicle)

    def _go_out(self, vehicle: Vehicle) -> None:
        """Take a vehicle out of its line; wake those that wait for that, and the one that is first now."""
        place = vehicle.leg.place
        place.line.remove(vehicle)
        waiting, place.waiting = place.waiting, []
        for other in waiting:
            self.wake(other)
        if place.line:
            self.wake(place.line[0])
