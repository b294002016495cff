"""Vehicles that stand at a red light inside a crossing let others over the rest of it first.

A grant over several movements may lead past a light that closes before the vehicle gets there. While the
vehicle stands there, the lights beyond let others go, so it *lends* its crossing from the light on: the rule
`crossing` does not count that part. Until its light may open, the light holds it. Once it is open, the
vehicle *claims*: no more vehicles get a grant over what it has lent. When those before are past all that
they share with it, it takes its crossing back and sets out.

It keeps its slot in the next place. So a vehicle that goes to the same place does not go first. Neither does
one that comes behind a lender, also if others are between. Such a lender does not take its crossing back
either: the one ahead does so first. A vehicle lends nothing while another with a grant has yet to pass a
stretch that they share, since one of the two may count on the other to go. `docs/proofs/roads.md` proves that
no vehicles wait for each other because of this.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from loopgate.control.crossings import is_unsettled
from loopgate.control.lamps import OPEN
from loopgate.control.ledger import Ledger, trips_from
from loopgate.control.lights import PATIENCE_S
from loopgate.control.part import Part
from loopgate.control.places import STANDING_MPS, GrantedPass, Vehicle
from loopgate.traffic.base import Traffic


class Lending(Part):
    """The vehicles that have lent the rest of their crossing.

    `lent`: how often vehicles have lent it.
    """

    def __init__(self, traffic: Traffic, ledger: Ledger) -> None:
        self._traffic: Final = traffic
        self._ledger: Final = ledger
        self._from: dict[Vehicle, tuple[GrantedPass, float]] = {}
        """For each of them, the grant over the movement behind its light, and since when it lends [s]."""
        self._some_behind = False
        """Whether a vehicle may be noted to be behind one that lends."""
        self._kept: set[Vehicle] = set()
        """Those that are held."""
        self.lent = 0

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._from.pop(vehicle, None)
        self._kept.discard(vehicle)

    def look(self, at_red: Iterable[GrantedPass]) -> None:
        """Lend the crossings of vehicles that stand at red, and give them back where the light is open.

        Call it once in each step, after all answers. `at_red`: the grants over the movements behind the
        lights at which vehicles stand.
        """
        now_s = self._traffic.now_s
        for trip in at_red:
            if not trip.lent and _may_lend(trip):
                self._from[trip.vehicle] = trip, now_s
                self.lent += 1
                self._ledger.lend(trip)
        if self._from or self._some_behind:
            _find_those_behind(self._ledger.vehicles.values(), self._from)
            self._some_behind = bool(self._from)
        for vehicle, (trip, since_s) in list(self._from.items()):
            gone = vehicle.front_m > trip.light_m  # the light has changed against its program
            signal = trip.over.signal
            is_open = gone or signal is None or signal.next_letter(now_s) in OPEN
            stays = (is_open or _may_open(trip, now_s)) and self._is_near(trip)
            if gone or (is_open and not (vehicle.behind or any(map(is_unsettled, trips_from(trip))))):
                stays = False
                self._ledger.take_back(trip)
                del self._from[vehicle]
            else:
                # It claims after a long wait, too: its light may be open too briefly for those before.
                self._ledger.claim(vehicle, claims=is_open or now_s - since_s >= PATIENCE_S)
            if stays != (vehicle in self._kept):
                (self._kept.add if stays else self._kept.discard)(vehicle)
                self._traffic.stand(vehicle.name, stands=stays)

    def _is_near(self, trip: GrantedPass) -> bool:
        """Return whether a vehicle stands, or may be too late to stop before its light after the next step.

        One that closes up behind others is left to SUMO's car following, which brakes harder than a limit of
        speed does, if it must.
        """
        vehicle = trip.vehicle
        return vehicle.speed < STANDING_MPS or vehicle.must_brake_for(trip.light_m, self._traffic.step_s)


def _may_lend(trip: GrantedPass) -> bool:
    """Return whether a vehicle may lend its crossing from a movement on: nobody waits for it to go on.

    Others that lend count where it has yet to pass before its light.
    """
    trips = trip.vehicle.trips
    kept, lent = trips[: trips.index(trip)], trips_from(trip)
    return not (any(is_unsettled(one, lent=True) for one in kept) or any(map(is_unsettled, lent)))


def _find_those_behind(vehicles: Iterable[Vehicle], lenders: Iterable[Vehicle]) -> None:
    """Note which vehicles come behind one that lends, or behind such a vehicle."""
    on: dict[str, list[tuple[float, Vehicle]]] = {}
    for vehicle in vehicles:
        vehicle.behind = False
        for trip, to_go_m in _ahead(vehicle):
            on.setdefault(trip.over.movement.lane, []).append((to_go_m, vehicle))
    found = list(lenders)
    while found:
        first = found.pop()
        for other in (*_come_behind(first, on), *_follow_out(first)):
            if not other.behind:
                other.behind = True
                found.append(other)


def _come_behind(first: Vehicle, on: Mapping[str, list[tuple[float, Vehicle]]]) -> Iterator[Vehicle]:
    """Yield the vehicles whose crossing leads over a lane that another is on or has yet to pass.

    `on`: for each lane the vehicles that it is ahead of, with how far they have to go to its end [m].
    """
    for trip, to_go_m in _ahead(first):
        for other_m, other in on[trip.over.movement.lane]:
            if other_m > to_go_m:
                yield other
        if trip.lent:
            break  # others may come there first


def _follow_out(first: Vehicle) -> Iterator[Vehicle]:
    """Yield the vehicles that come to places whose slots are all held, and which another leaves."""
    for body in first.bodies[:-1]:
        bodies = body.place.bodies
        if len(bodies) > body.place.slots:
            for after in bodies[bodies.index(body) + 1 :]:
                yield after.vehicle


def _ahead(vehicle: Vehicle) -> Iterator[tuple[GrantedPass, float]]:
    """Yield the grants of a vehicle over what leads on from the lanes that it has not left.

    With each, how far it has to go to the end of the lane [m].
    """
    for trip in vehicle.trips:
        to_go_m = trip.light_m - vehicle.front_m
        if to_go_m > -vehicle.make.length_m:
            yield trip, to_go_m


def _may_open(trip: GrantedPass, now_s: float) -> bool:
    """Return whether a red light may be open in the next step, as far as is known."""
    signal = trip.over.signal
    return signal is not None and not signal.lamp.program.fixed and signal.lamp.changes_s <= now_s
