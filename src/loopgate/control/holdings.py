"""Holdings: the vehicles in the lines of places, what each vehicle holds, and which of them ask."""

from __future__ import annotations

from math import inf
from typing import Final

from loopgate.control.chain import closes_by_entering
from loopgate.control.places import POINT, TOLERANCE_M, Body, Leg, Make, Place, Vehicle

GRANTED: Final = "granted"
REFUSED: Final = "refused"
LEFT: Final = "left"
TRESPASSED: Final = "trespassed"
BRAKES: Final = "brakes"


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
        self._requests = 0
        self._answering = False
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
        self._go_in(vehicle, vehicle.laps_m + vehicle.leg.begin_m)
        return vehicle

    def leave(self, vehicle: Vehicle) -> None:
        """Remove a vehicle from the ledger: from its line, with all slots and crossings that it holds."""
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
        """Return whether a vehicle may join the line on a leg: a slot is free, and no circle closes."""
        return not leg.place.is_full() and not closes_by_entering(leg)

    def ask(self, vehicle: Vehicle) -> None:
        """Take a vehicle's request for its next place; the answer comes once the vehicle heads its line."""
        if not vehicle.asks:
            vehicle.asks = True
            vehicle.since_s = self.now_s
            vehicle.reason = ""
            vehicle.answered = False
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
        if body.place.is_full():
            for other in body.place.bodies:
                if len(other.vehicle.bodies) > 1:
                    other.vehicle.back_m = other.vehicle.gives_back_m()
                    self._aim(other.vehicle)  # a slot here is wanted as soon as a rear is out

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
        if vehicle.trips:
            due_m = min(due_m, vehicle.trips[0].clear_m)
        due_m = min(due_m, vehicle.back_m)
        for watched_m, _ in vehicle.watchers:
            due_m = min(due_m, watched_m)
        vehicle.due_m = due_m

    def _go_in(self, vehicle: Vehicle, begins_m: float) -> Body:
        """Put a vehicle last into the line of its place, with a slot; return its body there."""
        place = vehicle.leg.place
        place.line.append(vehicle)
        body = Body(vehicle, place, begins_m, vehicle.line_m + vehicle.make.length_m)
        self.take_slot(body, len(place.bodies))
        self.wake(place.line[0])
        return body

    def _go_out(self, vehicle: Vehicle) -> None:
        """Take a vehicle out of its line; wake vehicles that wait for this, and the line behind it."""
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
        """Give back the slot of a body whose rear has left, and log it."""
        self.log.append((LEFT, body.vehicle, body.place, "", ""))
        self._give_back(body)

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
