"""The ledger: who holds which place, who waits for what, and who goes on first."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from math import inf
from typing import Final

from loopgate.control.chain import closes_by_entering
from loopgate.control.keeping import Keeping
from loopgate.control.places import POINT, TOLERANCE_M, Body, Leg, Make, Place, Trip, Vehicle
from loopgate.control.pressure import Pressure
from loopgate.control.refusal import CHAIN, Refusal, Rule

GRANTED: Final = "granted"
REFUSED: Final = "refused"
LEFT: Final = "left"
TRESPASSED: Final = "trespassed"
BRAKES: Final = "brakes"

Order = Callable[[list[Vehicle], float], list[Vehicle]]
"""What puts vehicles that no rule refuses in order, at a time [s]; those that it leaves out wait."""


class Ledger:
    """Vehicles in places, and their requests.

    Every change goes through `take_in`, `ask`, `answer` and `leave`, so whatever may lift a refusal wakes the
    vehicles that were refused for it.

    Parameters
    ----------
    rules
        Asked in this order until one refuses. The last decides where the others let a vehicle go.
    everybody
        Ask every vehicle that waits in every answer instead of those that were woken. It is slow, gives the
        same grants, and judges the wake lists.
    order
        By default the vehicle with most pressure goes first.

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
        *,
        everybody: bool = False,
        step_s: float = 1.0,
        order: Order | None = None,
    ) -> None:
        self.rules: Final = rules
        self.order: Final = order or Pressure().order
        self.everybody: Final = everybody
        self.step_s: Final = step_s
        self.vehicles: dict[str, Vehicle] = {}
        self.waiting: dict[Vehicle, None] = {}
        """The vehicles that ask, oldest request first."""
        self.keeping: Final = Keeping(self.waiting)
        self.on_grant: Callable[[Vehicle], None] = lambda _: None
        self.stage_of: Callable[[Vehicle], str] = lambda _: CHAIN
        """Returns which stage of the gate decides for a vehicle that is let go."""
        self.now_s = 0.0
        self.looked_at = self.decisions = 0
        self.log: list[tuple[str, Vehicle, Place, str, str]] = []
        """What has happened since somebody took note of it: each with vehicle, place, reason and stage.

        `GRANTED`, `REFUSED` (for a new reason), `LEFT` by a rear, `TRESPASSED` by a front, `BRAKES` (behind
        one that has not asked).
        """
        self.trespasses = 0
        """How often a front was past the end of the last granted leg: should be never."""
        self.refusals: dict[str, int] = {}
        """How often each reason was given."""
        self.made = 0
        """How many numbers vehicles have had."""
        self.grants = self._requests = 0
        self.look: Callable[[float], None] = self.keeping.look
        """Called with the time [s] before requests are answered."""
        self.decide: Callable[[list[Vehicle]], list[Vehicle]] = self._decide
        """Lets vehicles go on, or stay, that no rule but the last refuses; returns those let go."""
        self._answering = False
        self._woken: list[Vehicle] = []
        self._later: list[Vehicle] = []
        """Woken in an answer for the next one."""
        self._near: list[Vehicle] = []
        self._in_order = 0
        """So many of them, the first, are in the order of their numbers."""
        self._alarms: list[tuple[float, int, Vehicle]] = []
        self._shut: list[Place] = []
        self._opening: list[Place] = []

    def take_in(
        self,
        name: str,
        path: list[Leg],
        position: int,
        make: Make = POINT,
        lap_m: float = 0.0,
        beyond: int = 0,
        number: int | None = None,
    ) -> Vehicle:
        """Put a new vehicle last in line in a place of its path; it may hold so many `beyond` its slots.

        `number`: one that no vehicle has had; by default the next.

        `loopgate.control.chain.closes_by_entering` says before whether it closes a circle there. Raises
        `ValueError` if the name is taken or no slot is free there.
        """
        place = path[position].place
        if name in self.vehicles:
            msg = f"vehicle {name} is there already, in place {self.vehicles[name].leg.place.name}"
            raise ValueError(msg)
        if len(place.bodies) >= place.slots + beyond:
            msg = f"vehicle {name} does not fit into place {place.name}: its {place.slots} slots are taken"
            raise ValueError(msg)
        vehicle = Vehicle(self.made if number is None else number, name, path[position], make, lap_m)
        self.made = max(self.made, vehicle.number + 1)
        self.vehicles[name] = vehicle
        self._go_in(vehicle, vehicle.laps_m + vehicle.leg.begin_m)
        return vehicle

    def leave(self, vehicle: Vehicle) -> None:
        """Strike a vehicle out of the ledger, wherever it stands in line and whatever it holds."""
        del self.vehicles[vehicle.name]
        vehicle.asks = vehicle.near = False
        self.waiting.pop(vehicle, None)
        if vehicle in vehicle.leg.place.line:
            self._go_out(vehicle)
        for trip in vehicle.trips:
            trip.over.movement.junction.trips.remove(trip)
        vehicle.trips = []
        for body in vehicle.bodies:
            self._take_out(body)
        vehicle.bodies = []
        self._wake_watchers(vehicle, inf)

    def fits(self, leg: Leg) -> bool:
        """Return whether one more vehicle may come in last in line on a leg: a slot, and no circle."""
        return not leg.place.is_full() and not closes_by_entering(leg)

    def ask(self, vehicle: Vehicle) -> None:
        """Take a vehicle's request for its next place; it is answered when it heads its line."""
        if not vehicle.asks:
            vehicle.asks = True
            vehicle.since_s = self.now_s
            vehicle.reason = ""
            vehicle.answered = False
            self._requests += 1
            vehicle.request = self._requests
            self.waiting[vehicle] = None
            self.wake(vehicle)

    def wake(self, vehicle: Vehicle) -> None:
        """Look at a vehicle in the next answer, or in the one under way if it was never answered."""
        if vehicle.asks and not vehicle.woken and vehicle.leg.place.line[0] is vehicle:
            vehicle.woken = True
            (self._later if self._answering and vehicle.answered else self._woken).append(vehicle)

    def passed(self, vehicle: Vehicle) -> None:
        """Record that the front of a vehicle has come to where it has something to do, or beyond."""
        front_m = vehicle.front_m
        if vehicle.begins_to_trespass():
            self.trespasses += 1
            wanted = vehicle.wanted()
            if wanted is not None:
                self.log.append((TRESPASSED, vehicle, wanted, "not granted", ""))
        gave_back = front_m >= vehicle.back_m
        if gave_back:
            while len(vehicle.bodies) > 1 and front_m >= vehicle.bodies[0].out_m:
                self._take_out(vehicle.bodies.pop(0))
        while vehicle.trips and front_m >= vehicle.trips[0].clear_m:
            trip = vehicle.trips.pop(0)
            trip.over.movement.junction.trips.remove(trip)
            gave_back = True
        if gave_back:
            vehicle.back_m = vehicle.gives_back_m()
        if vehicle.watchers:
            self._wake_watchers(vehicle, front_m)
        self._aim(vehicle)

    def why_not(self, vehicle: Vehicle) -> str:
        """Return why a vehicle may not go on now, or "". Changes nothing."""
        for rule in self.rules:
            refusal = rule(vehicle, self.now_s)
            if refusal is not None:
                return refusal.reason
        return ""

    def answer(self, now_s: float | None = None) -> list[Vehicle]:
        """Answer all requests; return the vehicles that were let go, in that order.

        Each is answered once: the vehicles that wait in one go, then the vehicles that ask since others were
        let go. What a grant changes for a vehicle that was refused counts in the next answer.

        `now_s`: the time [s]; by default it is a second later than in the answer before.
        """
        self.now_s = self.now_s + 1.0 if now_s is None else now_s
        while self._alarms and self._alarms[0][0] < self.now_s:
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
        """Return the vehicles that no rule but the last refuses; note why the others may not go on."""
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
        """Let vehicles go on in order, or note why not; return those that were let go."""
        going = self.order(ready, self.now_s) if ready else ready
        if len(going) < len(ready):
            goes = set(going)
            for vehicle in ready:
                if vehicle not in goes:
                    self.refuse(vehicle, Refusal("reserve"))
        grants = self.grants
        return [one for one in going if self._settle(one, again=self.grants > grants)]

    def _wake_watchers(self, vehicle: Vehicle, front_m: float) -> None:
        watchers, vehicle.watchers = vehicle.watchers, []
        for watched_m, other in watchers:
            if front_m >= watched_m:
                self.wake(other)
            else:
                vehicle.watchers.append((watched_m, other))

    def _look_near(self) -> None:
        """Let vehicles ask that must brake soon; keep those that must not yet."""
        still: list[Vehicle] = []
        step_s = self.step_s
        if len(self._near) > self._in_order:
            self._near.sort(key=_number)
        for vehicle in self._near:
            if vehicle.near and not vehicle.asks and not vehicle.steered:
                if vehicle.must_ask(step_s):
                    self._must_ask(vehicle)
                else:
                    still.append(vehicle)
            vehicle.near = False
        for vehicle in still:
            vehicle.near = True
        self._near, self._in_order = still, len(still)

    def consider(self, vehicle: Vehicle) -> None:
        """Let a vehicle ask again that was steered or stopped: now if it must, else in time."""
        if not (vehicle.asks or vehicle.beside) and vehicle.line_m < inf and vehicle.must_ask(self.step_s):
            self._must_ask(vehicle)
        self._aim(vehicle)

    def withdraw(self, vehicle: Vehicle) -> None:
        """Forget the request of a vehicle, if it has one."""
        vehicle.asks = False
        self.waiting.pop(vehicle, None)

    def shut(self, place: Place) -> None:
        """Let nobody into a place in the next answer, nor after that until `open_up`."""
        place.shut = True
        self._shut.append(place)

    def open_up(self) -> None:
        """Let vehicles again into places that were shut in the last answer."""
        for place in self._opening:
            if place not in self._shut:
                place.shut = False
                self._wake_waiting(place)
        self._opening.clear()

    def step_aside(self, vehicle: Vehicle) -> bool:
        """Let a vehicle that parks give up its slot; return whether it does.

        It does so only if its whole body is in one place. Until it gets a slot again, it is in no place.
        """
        if vehicle.trips or len(vehicle.bodies) != 1 or vehicle.beside:
            return False
        self.withdraw(vehicle)
        vehicle.near, vehicle.beside = False, True
        self._go_out(vehicle)
        self._give_back(vehicle.bodies.pop())
        self._aim(vehicle)
        return True

    def take_slot(self, body: Body, at: int) -> None:
        """Let a body hold a slot of its place, behind so many others."""
        body.place.bodies.insert(at, body)
        body.vehicle.bodies.append(body)
        if body.place.is_full():
            for other in body.place.bodies:
                if len(other.vehicle.bodies) > 1:
                    other.vehicle.back_m = other.vehicle.gives_back_m()
                    self._aim(other.vehicle)  # a slot here is wanted as soon as a rear is out

    def _must_ask(self, vehicle: Vehicle) -> None:
        first = vehicle.leg.place.line[0]
        if first is vehicle:
            self.ask(vehicle)
        elif not vehicle.held and not (first.held and first.halted and not first.beside):
            # The first asks, and so does it, too late to stop at the line.
            self.log.append((BRAKES, vehicle, vehicle.leg.place, "", ""))

    def _aim(self, vehicle: Vehicle) -> None:
        """Say where something is to be done next for a vehicle."""
        due_m = vehicle.line_m + TOLERANCE_M if vehicle.line_m > vehicle.front_m - TOLERANCE_M else inf
        if not (vehicle.asks or vehicle.near or vehicle.steered or vehicle.beside):
            asks_m = vehicle.asks_from_m()
            if vehicle.front_m < asks_m:
                due_m = asks_m
            elif vehicle.line_m < inf and vehicle.make is not POINT:
                vehicle.near = True
                self._near.append(vehicle)
        if vehicle.trips:
            due_m = min(due_m, vehicle.trips[0].clear_m)
        due_m = min(due_m, vehicle.back_m)
        for watched_m, _ in vehicle.watchers:
            due_m = min(due_m, watched_m)
        vehicle.due_m = due_m

    def refusal_of(self, vehicle: Vehicle) -> Refusal | None:
        """Return what the first of all rules but the last says that refuses a vehicle, if one does."""
        rules, now_s = self.rules, self.now_s
        for number in range(len(rules) - 1):
            refusal = rules[number](vehicle, now_s)
            if refusal is not None:
                return refusal
        return None

    def _settle(self, vehicle: Vehicle, *, again: bool = True) -> bool:
        """Let a vehicle go on, or note why not. `again`: whether others were let go since all were asked."""
        refusal = self.refusal_of(vehicle) if again else None
        if refusal is None:
            self.decisions += 1
            refusal = self.rules[-1](vehicle, self.now_s)
            if refusal is not None:
                vehicle.blocked_s = self.now_s
        if refusal is not None:
            self.refuse(vehicle, refusal)
            return False
        self.grant(vehicle)
        return True

    def grant(self, vehicle: Vehicle) -> None:
        """Let a vehicle that asks go on."""
        self.withdraw(vehicle)
        vehicle.reason = ""
        vehicle.refused_s.clear()
        vehicle.longest_s = max(vehicle.longest_s, self.now_s - vehicle.since_s)
        self._go_on(vehicle)

    def refuse(self, vehicle: Vehicle, refusal: Refusal) -> None:
        """Note why a vehicle that asks may not go on, and see to it that whatever may lift that wakes it."""
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
        self.log.append((GRANTED, vehicle, after.place, "", self.stage_of(vehicle)))
        self.on_grant(vehicle)
        body = self._go_in(vehicle, begins_m)
        if was_settled:  # else it still leaves an earlier place
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

    def _go_in(self, vehicle: Vehicle, begins_m: float) -> Body:
        """Put a vehicle last into the line of the place of its last granted leg."""
        place = vehicle.leg.place
        place.line.append(vehicle)
        body = Body(vehicle, place, begins_m, vehicle.line_m + vehicle.make.length_m)
        self.take_slot(body, len(place.bodies))
        self.wake(place.line[0])
        return body

    def _go_out(self, vehicle: Vehicle) -> None:
        """Take a vehicle out of its line; wake those that wait for that, and those behind it."""
        place = vehicle.leg.place
        place.line.remove(vehicle)
        self._wake_waiting(place)
        for number, other in enumerate(place.line):
            if other.asks:
                self.wake(other)
            elif not other.near and (number == 0 or not other.held):
                self._aim(other)
            if number == 0 and other.near and not other.steered and other.must_ask(self.step_s):
                other.near = False
                self._must_ask(other)

    def _take_out(self, body: Body) -> None:
        """Give back the slot of a body, whose rear has left."""
        self.log.append((LEFT, body.vehicle, body.place, "", ""))
        self._give_back(body)

    def _give_back(self, body: Body) -> None:
        body.place.bodies.remove(body)
        self._wake_waiting(body.place)

    def _wake_waiting(self, place: Place) -> None:
        waiting, place.waiting = place.waiting, []
        for other in waiting:
            self.wake(other)


def _request(vehicle: Vehicle) -> int:
    return vehicle.request


def _number(vehicle: Vehicle) -> int:
    return vehicle.number
