"""Keeps slots and crossings for vehicles that have waited long.

A vehicle is *late* if other vehicles have passed it over for a while. The last slot of the place that it
wants is kept for it. Once that place has a slot, its crossing is kept too: a long crossing is hardly ever
clear by itself, and vehicles with a shorter crossing would take each slot that becomes free. Of two late
vehicles in each other's way, the older request keeps its crossing. So each vehicle waits only for older
requests.

A vehicle that has waited very long is *served*. `loopgate.control.chain.next_mover` names its *mover*: the
vehicle whose move brings the served vehicle nearer to its grant. A place in which ordinary vehicles leave no
space counts as full. Slots and crossing are kept for the mover, and no negotiation passes it over. If the
places on the way to the grant lead on from a circle, only the mover may enter one of these places until the
served vehicle has its grant. Several vehicles are served at the same time if the rule looks at different
places for each; otherwise the older request goes first.
`docs/proofs/roads.md` proves that each request is granted after finitely many moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from loopgate.control.chain import closes, full_before, next_mover
from loopgate.control.places import Movement, Place, Vehicle
from loopgate.control.refusal import Refusal, Rule
from loopgate.negotiation.formulas import PASSED_OVER_S

PATIENCE_S: Final = PASSED_OVER_S
"""A request is late if it has been passed over for this long [s]."""

SHORT_OF_SLOTS_S: Final = 30.0
"""A request that finds no slot for this long makes the vehicles late sooner that could leave one [s]."""

PATIENCE_THERE_S: Final = 10.0
"""These vehicles are late if they have been passed over for this long [s]."""

GIVES_WAY_S: Final = 10.0
"""A vehicle that the chain rule has refused keeps nothing for itself for this long [s]."""

PASSED_OVER: Final = ("crossing", "occupied")
"""Reasons of refusals because of which other vehicles pass a vehicle over."""

_THROUGH_RED_S: Final = 120.0
"""After this long as a mover, its crossing is kept even if a light or ordinary traffic holds it [s]."""


_SERVICE: Final = Refusal("service")
_OCCUPIED: Final = Refusal("occupied")
_CROSSING: Final = Refusal("crossing")


def kept(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse the last slot of a place, or a crossing, that is kept for another vehicle."""
    wanted = vehicle.wanted()
    if wanted is None:
        return None
    free = wanted.free()
    if wanted.mover is not None and wanted.mover is not vehicle:
        # From a place that is not full: no vehicle needs the slot that it gives back, so it leaves one more.
        here = vehicle.leg.place
        leaves = wanted.mover.takes_in(wanted) + (len(here.line) < here.slots)
        if wanted.barred or free < vehicle.takes_in(wanted) + leaves:
            return _SERVICE
    other = None if wanted.mover is vehicle else wanted.kept_for
    if (
        other is not None
        and other is not vehicle
        and free < vehicle.takes_in(wanted) + other.takes_in(wanted)
    ):
        return _OCCUPIED
    for over in vehicle.leg.passes:
        other = over.movement.kept_for
        if other is not None and other is not vehicle:
            return _SERVICE if other.mover else _CROSSING
    return None


class Keeping:
    """Decides in each step, before requests are answered, what is kept for which vehicle."""

    def __init__(self, waiting: Iterable[Vehicle]) -> None:
        self._waiting = waiting
        """The vehicles that wait, oldest request first."""
        self._places: list[Place] = []
        self._movements: list[Movement] = []
        self._turned: dict[Vehicle, list[Place]] = {}
        """By served vehicle whose places lead on from a circle: all these places so far."""
        self._named_s: dict[Vehicle, float] = {}
        """Since when each mover is one [s]."""
        self.most_served = 0
        self.serve_after_s = PATIENCE_S
        """Age from which the oldest requests are served [s]."""
        self.outside: Sequence[Rule] = ()
        """The rules about lights and ordinary traffic: no crossing is kept for a mover that they refuse."""
        self.is_too_full: Callable[[Vehicle], bool] = lambda _: False
        """Returns whether ordinary vehicles leave no space in the place that a vehicle wants next."""
        self.is_behind: Callable[[Vehicle], bool] = lambda _: False
        """Returns whether a vehicle is behind on its loop: then it is late sooner."""

    def look(self, now_s: float) -> None:
        """Keep slots and crossings for the vehicles that are late or served now, and release all others."""
        held = {mover for mover in self._named_s if mover.asks and self._is_held(mover, now_s)}
        for place in self._places:
            place.kept_for = place.mover = None
            place.barred = False
        for movement in self._movements:
            movement.kept_for = None
        self._places.clear()
        self._movements.clear()
        for vehicle in self._late(now_s):
            self._keep_for(vehicle)
        self._serve(held, now_s)

    def _is_held(self, mover: Vehicle, now_s: float) -> bool:
        """Return whether a light, ordinary traffic or an incident keeps a mover from its move."""
        for rule in self.outside:
            if rule(mover, now_s) is not None:
                return True
        return mover.withheld != ""

    def _late(self, now_s: float) -> list[Vehicle]:
        """Return the late vehicles, oldest request first."""
        old: list[Vehicle] = []
        short: set[Place] = set()
        for vehicle in self._waiting:
            waited_s, wanted = now_s - vehicle.since_s, vehicle.wanted()
            if waited_s < PATIENCE_THERE_S:
                break
            if vehicle.reason in PASSED_OVER and wanted is not None and not vehicle.idles():
                old.append(vehicle)
                if (
                    vehicle.reason == "occupied"
                    and waited_s >= SHORT_OF_SLOTS_S
                    and not vehicle.finds_room(wanted)
                ):
                    short.add(wanted)
        late: list[tuple[float, int, Vehicle]] = []
        for vehicle in old:
            if now_s - vehicle.blocked_s < GIVES_WAY_S:
                continue
            soon = vehicle.leg.place in short or self.is_behind(vehicle)
            if soon or now_s - vehicle.since_s >= PATIENCE_S:
                late.append((vehicle.since_s, vehicle.number, vehicle))
        late.sort()
        return [vehicle for _, _, vehicle in late]

    def _keep_for(self, vehicle: Vehicle) -> None:
        """Keep the last slot for a vehicle, and its crossing if it finds a slot, unless already kept."""
        wanted = vehicle.wanted()
        if wanted is None:
            return
        if wanted.kept_for is None:
            wanted.kept_for = vehicle
            self._places.append(wanted)
        others = 0 if wanted.kept_for is vehicle else 1
        if wanted.free() < vehicle.takes_in(wanted) + others:
            return
        for over in vehicle.leg.passes:
            if over.movement.kept_for is not None:
                return
        for over in vehicle.leg.passes:
            for movement in over.foes:
                if movement.kept_for is None:
                    movement.kept_for = vehicle
                    self._movements.append(movement)

    def _serve(self, held: set[Vehicle], now_s: float) -> None:
        """Keep slots and crossings for the movers of served vehicles, oldest request first."""
        named_s, self._named_s = self._named_s, {}
        turned, self._turned = self._turned, {}
        for before in named_s:
            before.mover = False
        for vehicle in self._waiting:
            if vehicle.reason == "stop" or vehicle.idles() or vehicle.leg.place.line[0] is not vehicle:
                continue
            if now_s - vehicle.since_s < self.serve_after_s:
                break
            places, mover = self._way_of(vehicle)
            last = places[-1].line[0]
            end = last.wanted()
            if mover is None or end is None or mover.idles() or mover.beside:
                continue
            places.append(end)
            if any(place.mover is not None for place in places):
                continue  # the places of an older request lead there
            turns = vehicle in turned or len(closes(last)) > 0
            if turns:
                places += [place for place in turned.get(vehicle, []) if place.mover is None]
                self._turned[vehicle] = places
            for place in places:
                place.mover, place.barred = mover, turns
            self._places += places
            mover.mover = True
            self._named_s[mover] = named_s.get(mover, now_s)
            if mover.asks and (mover not in held or now_s - self._named_s[mover] >= _THROUGH_RED_S):
                self._clear_way(mover)
        self.most_served = max(self.most_served, len(self._named_s))

    def _way_of(self, served: Vehicle) -> tuple[list[Place], Vehicle | None]:
        """Return the full places that a served vehicle waits for, from its own on, and its mover.

        A place also counts as full if ordinary vehicles leave no space in it, or too little for a long mover.
        """
        places, mover = full_before(served), next_mover(served)
        while mover is not None and (self.is_too_full(mover) or _is_too_long(mover)):
            wanted = mover.wanted()
            if wanted is None or wanted in places or not wanted.line:
                break
            first = wanted.line[0]
            places, mover = places + full_before(first), next_mover(first)
        return places, mover

    def _clear_way(self, mover: Vehicle) -> None:
        """Keep a mover's crossing clear, unless the mover of an older request needs a part of it."""
        wanted, passes = mover.wanted(), mover.leg.passes
        if wanted is None or not mover.finds_room(wanted):
            return
        for over in passes:
            other = over.movement.kept_for
            if other is not None and other.mover:
                return
        for over in passes:
            over.movement.kept_for = None
        for over in passes:
            for movement in over.foes:
                other = movement.kept_for
                if other is None or not other.mover:
                    movement.kept_for = mover
                    self._movements.append(movement)


def _is_too_long(vehicle: Vehicle) -> bool:
    """Return whether a vehicle finds no room in a place that has a free slot."""
    wanted = vehicle.wanted()
    return wanted is not None and wanted.free() > 0 and not vehicle.finds_room(wanted)
