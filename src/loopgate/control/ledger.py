"""The ledger: it answers the requests of vehicles by rules, and grants places."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from math import inf
from typing import Final

from loopgate.control.gate import ChainGate, RoadGate
from loopgate.control.holdings import GRANTED, REFUSED, Holdings
from loopgate.control.keeping import Keeping
from loopgate.control.places import Place, Trip, Vehicle
from loopgate.control.pressure import Pressure
from loopgate.control.refusal import Refusal, Rule

_RESERVE: Final = Refusal("reserve")

Order = Callable[[list[Vehicle], float], list[Vehicle]]
"""Takes vehicles that no rule refuses, and the time [s]; returns them in the order in which they go on.

Vehicles that it leaves out wait.
"""


class Ledger(Holdings):
    """Vehicles in places, their requests, and the rules that answer the requests.

    Every change goes through `take_in`, `ask`, `answer` and `leave`. A change that may lift a refusal wakes
    the vehicles that were refused for it.

    Parameters
    ----------
    rules
        The ledger asks them in this order until one refuses.
    gate
        Decides about vehicles that no rule refuses; by default the chain rule.
    everybody
        Whether each answer looks at every vehicle that waits, not only at woken vehicles. This is slow and
        gives the same grants: tests of the wake lists use it.
    order
        The order in which vehicles go on; by default the vehicle with the highest pressure goes first.
    pressing
        The pressure order, if its share of crowded places follows from the number of vehicles on loops.

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

    def __init__(
        self,
        rules: list[Rule],
        gate: RoadGate | None = None,
        *,
        everybody: bool = False,
        step_s: float = 1.0,
        order: Order | None = None,
        pressing: Pressure | None = None,
    ) -> None:
        super().__init__(step_s)
        self.rules: Final = rules
        self.gate: RoadGate = gate or ChainGate()
        self.order: Final = order or Pressure().order
        self.pressing: Final = pressing
        self.everybody: Final = everybody
        self.keeping: Final = Keeping(self.waiting)
        self.looked_at = self.decisions = 0
        self.refusals: dict[str, int] = {}
        """How often each reason was given."""
        self.grants = 0
        self.look: Callable[[float], None] = self.keeping.look
        """Called with the time [s] before requests are answered."""
        self.decide: Callable[[list[Vehicle]], list[Vehicle]] = self._decide
        """Takes vehicles that no rule refuses; lets some go on, and returns these."""
        self._alarms: list[tuple[float, int, Vehicle]] = []
        self._shut: list[Place] = []
        self._opening: list[Place] = []

    @property
    def by_chain(self) -> bool:
        """Whether the chain rule decides. Any other gate knows only the paths for which it was made."""
        return isinstance(self.gate, ChainGate)

    def why_not(self, vehicle: Vehicle) -> str:
        """Return why a vehicle may not go on now, or an empty text. This changes nothing."""
        refusal = self.refusal_of(vehicle) or self.gate.allows(vehicle, self.now_s)
        return refusal.reason if refusal is not None else ""

    def answer(self, now_s: float | None = None) -> list[Vehicle]:
        """Answer all requests; return the vehicles that got a grant, in the order of the grants.

        The ledger answers each request once. It begins with the vehicles that wait. A grant can let more
        vehicles ask: the ledger then answers these. If a grant removes the cause of a refusal, the next
        answer looks at the refused vehicle again.

        `now_s`: the time [s]; by default a second after the last answer.
        """
        self.now_s = self.now_s + 1.0 if now_s is None else now_s
        while self._alarms and self._alarms[0][0] <= self.now_s:
            self.wake(heappop(self._alarms)[2])
        self._look_near()
        self.look(self.now_s)
        gone: list[Vehicle] = []
        due, self._answering = self._due(), True
        while due:
            gone += self.decide(self._ready(due))
            due = self._due()
        self._answering = False
        self._woken, self._later = self._later, []
        self._opening += self._shut
        self._shut.clear()
        return gone

    def refusal_of(self, vehicle: Vehicle) -> Refusal | None:
        """Return the refusal of the first rule that refuses a vehicle; this does not ask the gate."""
        now_s = self.now_s
        for rule in self.rules:
            refusal = rule(vehicle, now_s)
            if refusal is not None:
                return refusal
        return None

    def grant(self, vehicle: Vehicle) -> None:
        """Grant the request of a vehicle."""
        self.withdraw(vehicle)
        vehicle.reason = ""
        vehicle.refused_s.clear()
        vehicle.longest_s = max(vehicle.longest_s, self.now_s - vehicle.since_s)
        self._go_on(vehicle)

    def refuse(self, vehicle: Vehicle, refusal: Refusal) -> None:
        """Note the refusal of a vehicle; what the refusal names wakes the vehicle."""
        if vehicle.reason != refusal.reason:
            vehicle.reason = refusal.reason
            vehicle.refused_s.setdefault(refusal.reason, self.now_s)
            wanted = vehicle.wanted() or vehicle.leg.place
            self.log.append((REFUSED, vehicle, wanted, refusal.reason, refusal.stage))
            self.refusals[refusal.reason] = self.refusals.get(refusal.reason, 0) + 1
        if refusal.each_step:
            self.wake(vehicle)
        for place in refusal.until:
            if vehicle not in place.waiting:
                place.waiting.append(vehicle)
        if refusal.at_s < inf:
            heappush(self._alarms, (refusal.at_s, vehicle.number, vehicle))
        if refusal.passed is not None:
            refusal.passed.watchers.append((refusal.passed_m, vehicle))
            self._aim(refusal.passed)

    def shut(self, place: Place) -> None:
        """Close a place to vehicles for the next answer, until `open_up`."""
        place.shut = True
        self._shut.append(place)

    def open_up(self) -> None:
        """Open the places that were shut in the last answer."""
        for place in self._opening:
            if place not in self._shut:
                place.shut = False
                self._wake_waiting(place)
        self._opening.clear()

    def _due(self) -> list[Vehicle]:
        """Return the vehicles to be answered now, oldest request first."""
        woken, self._woken = self._woken, []
        for vehicle in woken:
            vehicle.woken = False
        if self.everybody:
            woken = [one for one in self.waiting if not (self._answering and one.answered)]
        due = [one for one in woken if one.asks and one.leg.place.line[0] is one]
        due.sort(key=_request)
        return due

    def _ready(self, due: list[Vehicle]) -> list[Vehicle]:
        """Return the vehicles that no rule refuses; note the refusals of the others."""
        ready: list[Vehicle] = []
        for vehicle in due:
            vehicle.answered = True
            self.looked_at += 1
            refusal = self.refusal_of(vehicle)
            if refusal is None:
                ready.append(vehicle)
            else:
                self.refuse(vehicle, refusal)
        return ready

    def _decide(self, ready: list[Vehicle]) -> list[Vehicle]:
        """Let vehicles go on in order, or note their refusals; return the vehicles that go."""
        going = self.order(ready, self.now_s) if ready else ready
        if len(going) < len(ready):
            goes = set(going)
            for vehicle in ready:
                if vehicle not in goes:
                    self.refuse(vehicle, _RESERVE)
        grants = self.grants
        return [one for one in going if self._settle(one, again=self.grants > grants)]

    def _settle(self, vehicle: Vehicle, *, again: bool = True) -> bool:
        """Let a vehicle go on, or note its refusal; return whether it goes.

        `again`: whether other vehicles got grants since its rules were asked.
        """
        refusal = self.refusal_of(vehicle) if again else None
        if refusal is None:
            self.decisions += 1
            refusal = self.gate.allows(vehicle, self.now_s)
            if refusal is not None:
                vehicle.blocked_s = self.now_s
        if refusal is not None:
            self.refuse(vehicle, refusal)
            return False
        self.grant(vehicle)
        return True

    def _go_on(self, vehicle: Vehicle) -> None:
        after = vehicle.leg.after
        if after is None:
            self.leave(vehicle)
            return
        self._go_out(vehicle)
        self.grants += 1
        begins_m, line_m, before = vehicle.after_begins_m(after), vehicle.line_m, vehicle.leg
        was_settled = len(vehicle.bodies) == 1 and not vehicle.trips
        vehicle.steered = vehicle.steered or before.guided
        vehicle.go_on(after)
        self.log.append((GRANTED, vehicle, after.place, "", self.gate.stage(vehicle)))
        self.gate.moved(vehicle)
        body = self._go_in(vehicle, begins_m)
        if was_settled:  # otherwise it still leaves an earlier place
            vehicle.back_m = vehicle.gives_back_m()
        for over in before.passes:
            trip = Trip(body, before, over, self.grants, line_m, begins_m + vehicle.make.length_m)
            over.movement.junction.trips.append(trip)
            vehicle.trips.append(trip)
        vehicle.near = False
        self.passed(vehicle)
        if vehicle.near and vehicle.must_ask(self.step_s):
            vehicle.near = False
            self._must_ask(vehicle)  # the place ahead may end within the braking distance


def _request(vehicle: Vehicle) -> int:
    return vehicle.request
