"""The ledger: it answers the requests of vehicles by rules, and grants places."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from heapq import heappop, heappush
from math import inf
from typing import Final

from loopgate.control.chain import ChainGate, RoadGate
from loopgate.control.circles import Circles
from loopgate.control.credits import (
    collect,
    enters,
    give_up,
    keep,
    left,
    may_enter,
    may_turn,
    recount,
    release,
    reserve,
)
from loopgate.control.crossings import comes_behind
from loopgate.control.keeping import Keeping
from loopgate.control.places import (
    POINT,
    TOLERANCE_M,
    Body,
    ChangeStretch,
    ConflictGroup,
    GrantedPass,
    Leg,
    Make,
    Place,
    Vehicle,
)
from loopgate.control.pressure import PressureOrder
from loopgate.control.refusal import Refusal, Rule

GRANTED: Final = "granted"
REFUSED: Final = "refused"
LEFT: Final = "left"
TRESPASSED: Final = "trespassed"
BRAKES: Final = "brakes"

_NOTHING: Final[dict[Place, float]] = {}


class Holdings:
    """Vehicles in the lines of places, the slots and crossings that they hold, and their requests.

    A change that may lift a refusal *wakes* the refused vehicles: the next answer looks at their requests.

    Parameters
    ----------
    step_s
        The step of the simulation [s].
    """

    def __init__(self, step_s: float) -> None:
        self.step_s: Final = step_s
        self.now_s = 0.0
        self.vehicles: dict[str, Vehicle] = {}
        self.waiting: dict[Vehicle, None] = {}
        """The vehicles that ask, oldest request first."""
        self.log: list[tuple[str, Vehicle, Place, str, str]] = []
        """What has happened since the log was emptied: kind, vehicle, place, reason, stage of the gate.

        The kinds: `GRANTED`; `REFUSED` for a new reason; `LEFT`, a rear has left the place; `TRESPASSED`, a
        front has entered it without a grant; `BRAKES`, a vehicle must brake behind one that has not asked.
        """
        self.trespasses = 0
        """How often a front has passed the end of the last granted leg; in a sound run never."""
        self.made = 0
        """The number of the next vehicle."""
        self.circles: Circles | None = None
        """The circles of ways; without them, all places count as circled."""
        self.lenders = 0
        """How many vehicles lend the rest of their crossing."""
        self._requests = 0
        self._answering = False
        self._gave_back = False
        """Whether slots or crossings were given back since requests were last decided about."""
        self._woken: list[Vehicle] = []
        self._later: list[Vehicle] = []
        """Vehicles that were woken in an answer for the next one."""
        self._near: list[Vehicle] = []
        """Vehicles that must ask soon. The first `_in_order` are in the order of their numbers."""
        self._in_order = 0

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
        """Put a new vehicle last into the line of a place on its path.

        `loopgate.control.chain.closes_by_entering` tells beforehand whether it closes a circle there.

        Parameters
        ----------
        position
            The index of the place's leg in the path.
        beyond
            How many vehicles more than its slots the place may hold.
        number
            A number that no vehicle has had; by default the next.

        Raises
        ------
        ValueError
            If the name is taken or the place is full.
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
        self._know_way(vehicle)
        self._go_in(vehicle, vehicle.laps_m + vehicle.leg.begin_m)
        return vehicle

    def leave(self, vehicle: Vehicle) -> None:
        """Remove a vehicle from the ledger: from its line, with all slots and crossings that it holds."""
        del self.vehicles[vehicle.name]
        vehicle.asks = vehicle.near = False
        self.waiting.pop(vehicle, None)
        if vehicle in vehicle.leg.place.line:
            self._go_out(vehicle)
        if self.circles is not None:
            self.circles.goes(vehicle)
        if vehicle.lends:
            self.lenders -= 1
        for trip in vehicle.trips:
            trip.over.movement.junction.trips.remove(trip)
        vehicle.trips = []
        for body in vehicle.bodies:
            self._take_out(body)
        vehicle.bodies = []
        give_up(vehicle, self._slots_changed)
        self._gave_back = True
        self._wake_watchers(vehicle, inf)

    def fits(self, leg: Leg, needed_m: float = 0.0, held: Mapping[Place, float] = _NOTHING) -> bool:
        """Return whether a vehicle may join the line on a leg: open, with a slot, and no circle closes.

        `needed_m`: its length with its gap [m]. `held`: what `collect` has kept for it.
        """
        return not leg.place.closed and self._allows(leg, lambda: may_enter(leg, needed_m, held))

    def may_turn(self, vehicle: Vehicle, leg: Leg) -> bool:
        """Return whether a vehicle in a place may change to another path at `leg`, and no circle closes."""
        return self._allows(leg, lambda: may_turn(vehicle, leg))

    def _allows(self, leg: Leg, may: Callable[[], bool]) -> bool:
        """Return whether a vehicle may take a way from a leg on. `may`: whether it may with its circles."""
        return may() if self.circles is None else self.circles.allows(leg, self.vehicles.values(), may)

    def reserve(self, leg: Leg, needed_m: float) -> dict[Place, float]:
        """Keep the extra metres of a vehicle that is about to join on a leg, until `come`."""
        if self.circles is not None:
            self.circles.close(leg, self.vehicles.values(), self._slots_changed)
            self.circles.add(leg)
        return reserve(leg, needed_m, self._slots_changed)

    def come(self, leg: Leg, reserved: dict[Place, float]) -> None:
        """Keep no longer what `reserve` has returned."""
        if self.circles is not None:
            self.circles.drop(leg)
        release(reserved, self._slots_changed)

    def collect(self, leg: Leg, needed_m: float, held: dict[Place, float]) -> list[Place]:
        """Keep the extra metres of a vehicle that waits to join, where it can; return too full places."""
        return collect(leg, needed_m, held, self._slots_changed)

    def release(self, reserved: dict[Place, float]) -> None:
        """Keep no longer what `collect` has kept."""
        release(reserved, self._slots_changed)

    def turn_off(self, vehicle: Vehicle, leg: Leg, make: Make, lap_m: float) -> float:
        """Move a vehicle to another path, where it goes on from `leg`; call it only if it `may_turn`.

        Return by how much arc lengths on the new path are larger [m]. `make`, `lap_m`: properties of the
        vehicle and length of the lap on the new path.
        """
        if self.circles is not None:
            self.circles.goes(vehicle)
        before = vehicle.leg.nears
        by_m = vehicle.turn_off(leg, make, lap_m)
        body, place = vehicle.bodies[0], leg.place
        out_m = vehicle.line_m + make.length_m
        vehicle.bodies[0] = place.bodies[place.bodies.index(body)] = Body(vehicle, place, leg.begin_m, out_m)
        self._know_way(vehicle)
        for stretch in (before, leg.nears):
            self.note_changes(stretch)
        return by_m

    def _know_way(self, vehicle: Vehicle) -> None:
        """Note the way of a vehicle, and keep its extra metres ahead."""
        if self.circles is not None:
            self.circles.close(vehicle.leg, self.vehicles.values(), self._slots_changed)
            self.circles.comes(vehicle)
        keep(vehicle, self._slots_changed)

    def note_changes(self, stretch: ChangeStretch | None) -> None:
        """Note whether vehicles want to change lanes on a stretch: then no other vehicle may stand there."""
        if stretch is not None and stretch.wanted != stretch.is_wanted():
            stretch.wanted = not stretch.wanted
            for place in stretch.behind:
                recount(place, self._slots_changed)

    def ask(self, vehicle: Vehicle) -> None:
        """Take a vehicle's request for its next place; the answer comes once the vehicle heads its line."""
        if not vehicle.asks:
            vehicle.asks = True
            vehicle.since_s = self.now_s
            vehicle.reason = vehicle.cause = ""
            vehicle.answered = False
            if vehicle.woken and vehicle in self._later:  # for its last request: this one is answered now
                self._later.remove(vehicle)
                vehicle.woken = False
            self._requests += 1
            vehicle.request = self._requests
            self.waiting[vehicle] = None
            self.wake(vehicle)

    def withdraw(self, vehicle: Vehicle) -> None:
        """Remove the request of a vehicle, if it has one."""
        vehicle.asks = False
        self.waiting.pop(vehicle, None)

    def consider(self, vehicle: Vehicle) -> None:
        """Let a vehicle ask that was steered or stopped: now if it must brake soon, else later."""
        if not (vehicle.asks or vehicle.beside) and vehicle.line_m < inf and vehicle.must_ask(self.step_s):
            self._must_ask(vehicle)
        self._aim(vehicle)

    def wake(self, vehicle: Vehicle) -> None:
        """Let the next answer consider a vehicle's request; the present answer if the request is new."""
        if vehicle.asks and not vehicle.woken and vehicle.leg.place.line[0] is vehicle:
            vehicle.woken = True
            (self._later if self._answering and vehicle.answered else self._woken).append(vehicle)

    def passed(self, vehicle: Vehicle) -> None:
        """Give back what a vehicle has left, and wake the vehicles that wait for this; call it at `due_m`."""
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
            self._gave_back = True
            vehicle.back_m = vehicle.gives_back_m()
        if vehicle.watchers:
            self._wake_watchers(vehicle, front_m)
        self._aim(vehicle)

    def step_aside(self, vehicle: Vehicle) -> bool:
        """Take the slot away from a vehicle beside the road; return whether this was possible.

        It is possible if the whole body of the vehicle is in one place. Afterwards the vehicle is in no place
        until it gets a slot again.
        """
        if vehicle.trips or len(vehicle.bodies) != 1:
            return False
        self.withdraw(vehicle)
        vehicle.near, vehicle.beside = False, True
        self._go_out(vehicle)
        self._give_back(vehicle.bodies.pop())
        self._aim(vehicle)
        return True

    def take_slot(self, body: Body, at: int) -> None:
        """Give a body a slot of its place. `at`: how many bodies of the place are ahead of it.

        If that fills the place, vehicles that are leaving it give their slot back sooner: as soon as their
        rear is out.
        """
        body.place.bodies.insert(at, body)
        body.vehicle.bodies.append(body)
        self._filled(body.place)

    def _filled(self, place: Place) -> None:
        """Let vehicles that are leaving a full place give their slot back as soon as their rear is out."""
        if place.is_full():
            for other in place.bodies:
                if len(other.vehicle.bodies) > 1:
                    other.vehicle.back_m = other.vehicle.gives_back_m()
                    self._aim(other.vehicle)

    def _slots_changed(self, place: Place) -> None:
        """Act on another number of slots."""
        self._filled(place)
        self._wake_waiting(place)

    def _must_ask(self, vehicle: Vehicle) -> None:
        first = vehicle.leg.place.line[0]
        if first is vehicle:
            self.ask(vehicle)
        elif not vehicle.held and not (
            first.held and first.halted and not first.beside and not vehicle.make.brakes_late
        ):
            # It would ask only after the first vehicle does, too late to stop at its stop line.
            self.log.append((BRAKES, vehicle, vehicle.leg.place, "", ""))

    def _look_near(self) -> None:
        """Let vehicles ask that must brake in the next step; the others stay in the list."""
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

    def _aim(self, vehicle: Vehicle) -> None:
        """Set `due_m`, the next arc length at which the ledger must act for a vehicle."""
        due_m = vehicle.line_m + TOLERANCE_M if vehicle.line_m > vehicle.front_m - TOLERANCE_M else inf
        if not (vehicle.asks or vehicle.near or vehicle.steered or vehicle.beside):
            asks_m = vehicle.asks_from_m()
            if vehicle.front_m < asks_m:
                due_m = asks_m
            elif vehicle.line_m < inf and vehicle.make is not POINT:
                vehicle.near = True
                self._near.append(vehicle)
        if vehicle.trips and vehicle.trips[0].clear_m < due_m:
            due_m = vehicle.trips[0].clear_m
        if vehicle.back_m < due_m:  # noqa: PLR1730  a call of `min` costs three times this
            due_m = vehicle.back_m
        for watched_m, _ in vehicle.watchers:
            if watched_m < due_m:  # noqa: PLR1730  as above
                due_m = watched_m
        vehicle.due_m = due_m

    def _go_in(self, vehicle: Vehicle, begins_m: float) -> Body:
        """Put a vehicle last into the line of its place, with a slot; return its body there."""
        place = vehicle.leg.place
        place.line.append(vehicle)
        if vehicle.credits:
            enters(vehicle, place, self._slots_changed)
        self.note_changes(vehicle.leg.nears)
        body = Body(vehicle, place, begins_m, vehicle.line_m + vehicle.make.length_m)
        self.take_slot(body, len(place.bodies))
        self.wake(place.line[0])
        return body

    def _go_out(self, vehicle: Vehicle) -> None:
        """Take a vehicle out of its line; wake vehicles that wait for this, and the line behind it."""
        place = vehicle.leg.place
        place.line.remove(vehicle)
        self.note_changes(vehicle.leg.nears)
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
        """Give back the slot of a body whose rear has left, and log it."""
        self.log.append((LEFT, body.vehicle, body.place, "", ""))
        self._give_back(body)
        if body.vehicle.credits:
            left(body.vehicle, body.place, self._slots_changed)

    def _give_back(self, body: Body) -> None:
        body.place.bodies.remove(body)
        self._wake_waiting(body.place)

    def _wake_waiting(self, place: Place) -> None:
        waiting, place.waiting = place.waiting, []
        for other in waiting:
            self.wake(other)

    def _wake_watchers(self, vehicle: Vehicle, front_m: float) -> None:
        watchers, vehicle.watchers = vehicle.watchers, []
        for watched_m, other in watchers:
            if front_m >= watched_m:
                self.wake(other)
            else:
                vehicle.watchers.append((watched_m, other))


def _number(vehicle: Vehicle) -> int:
    return vehicle.number


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
        pressing: PressureOrder | None = None,
    ) -> None:
        super().__init__(step_s)
        self.rules: Final = rules
        self.gate: RoadGate = gate or ChainGate()
        self.order: Final = order or PressureOrder().order
        self.pressing: Final = pressing
        self.everybody: Final = everybody
        self.keeping: Final = Keeping(self.waiting)
        self.looked_at = self.decisions = 0
        self.refusals: dict[str, int] = {}
        """How often each reason was given."""
        self.grants = 0
        self.numbered = 0
        """The number of the last grant; a vehicle that takes back what it has lent gets a new one."""
        self.look: Callable[[float], None] = self.keeping.look
        """Called with the time [s] before requests are answered."""
        self.decide: Callable[[list[Vehicle]], list[Vehicle]] = self._decide
        """Takes vehicles that no rule refuses; lets some go on, and returns these."""
        self.rules_look_near = False
        """Whether no rule looks farther than a vehicle's place, the next place, and the crossing between."""
        self._changed: set[Place | ConflictGroup] = set()
        """What the grants since the rules were asked have changed."""
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
        if self.circles is not None:
            self.circles.look(self.now_s, self.vehicles.values(), self._slots_changed)
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
        vehicle.reason = vehicle.cause = ""
        vehicle.refused_s.clear()
        vehicle.longest_s = max(vehicle.longest_s, self.now_s - vehicle.since_s)
        self._go_on(vehicle)

    def refuse(self, vehicle: Vehicle, refusal: Refusal) -> None:
        """Note the refusal of a vehicle; what the refusal names wakes the vehicle."""
        if vehicle.reason != refusal.reason or vehicle.cause != refusal.cause:
            vehicle.reason, vehicle.cause = refusal.reason, refusal.cause
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

    def lend(self, trip: GrantedPass) -> None:
        """Let others go first over a movement, and the movements after it that the vehicle was granted."""
        trip.vehicle.lends = True
        self.lenders += 1
        for later in trips_from(trip):
            later.lent = True
        self._gave_back = True
        self._wake_watchers(trip.vehicle, inf)

    def claim(self, vehicle: Vehicle, *, claims: bool) -> None:
        """Note whether no more vehicles may get a grant over what a vehicle has lent."""
        if vehicle.claims and not claims:
            self._wake_watchers(vehicle, inf)
        vehicle.claims = claims

    def take_back(self, trip: GrantedPass) -> None:
        """Make lent movements the vehicle's again, after all grants so far."""
        trip.vehicle.lends = trip.vehicle.claims = False
        self.lenders -= 1
        self.numbered += 1
        for later in trips_from(trip):
            later.lent, later.number = False, self.numbered

    def close(self, place: Place, reason: str, cause: str) -> None:
        """Refuse all vehicles that want to enter a place for this reason; an empty reason opens it again."""
        if (place.closed, place.cause) != (reason, cause):
            place.closed, place.cause = reason, cause
            self._wake_waiting(place)

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
        self._changed.clear()
        self._gave_back = False
        return [one for one in going if self._settle(one, again=self._may_differ(one))]

    def _may_differ(self, vehicle: Vehicle) -> bool:
        """Return whether the grants since its rules were asked may change what they say of a vehicle."""
        changed = self._changed
        if not changed:
            return False
        if self._gave_back or not self.rules_look_near:
            return True
        leg = vehicle.leg
        if leg.place in changed or (leg.after is not None and leg.after.place in changed):
            return True
        for over in leg.passes:
            if over.movement.junction in changed:
                return True
            for trip in over.movement.junction.trips:  # whether another vehicle may be held on its way
                if len(trip.leg.passes) > 1:
                    for other in trip.leg.passes:
                        if other.movement.junction in changed:
                            return True
        return False

    def _settle(self, vehicle: Vehicle, *, again: bool) -> bool:
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
        self.numbered += 1
        begins_m, line_m, before = vehicle.after_begins_m(after), vehicle.line_m, vehicle.leg
        was_settled = len(vehicle.bodies) == 1 and not vehicle.trips
        vehicle.behind = self.lenders > 0 and comes_behind(vehicle, before)
        if before.guided and not vehicle.steered:
            vehicle.steered, vehicle.guide_m = True, line_m + before.guide_m
        if self.circles is not None:
            self.circles.passes(vehicle)
        vehicle.go_on(after)
        self.log.append((GRANTED, vehicle, after.place, "", self.gate.stage(vehicle)))
        self.gate.moved(vehicle)
        body = self._go_in(vehicle, begins_m)
        if was_settled:  # otherwise it still leaves an earlier place
            vehicle.back_m = vehicle.gives_back_m()
        for over in before.passes:
            trip = GrantedPass(body, before, over, self.numbered, line_m, begins_m + vehicle.make.length_m)
            over.movement.junction.trips.append(trip)
            vehicle.trips.append(trip)
        changed = self._changed
        changed.add(before.place)
        changed.add(after.place)
        for trip in vehicle.trips:
            changed.add(trip.over.movement.junction)
        vehicle.near = False
        self.passed(vehicle)
        if vehicle.near and vehicle.must_ask(self.step_s):
            vehicle.near = False
            self._must_ask(vehicle)  # the place ahead may end within the braking distance


def trips_from(trip: GrantedPass) -> list[GrantedPass]:
    """Return a vehicle's grant over a movement, and its grants over the movements after it."""
    return [one for one in trip.vehicle.trips if one.light_m >= trip.light_m]


def _request(vehicle: Vehicle) -> int:
    return vehicle.request
