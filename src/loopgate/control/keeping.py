"""Service and patience, as one rule: last slots and ways that are kept for vehicles that wait for long.

A vehicle that has been passed over for a while is *late*: the last slot of the place that it wants is its
own, and once there is a slot nobody sets out across its way. `loopgate.drive.patience` says why. One that
has waited for very long is *served*: slot and way are kept for its *mover*, whose move brings it nearer to
its grant. `loopgate.drive.service` says of that why each request is granted. Older requests come first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from loopgate.control.chain import closes, full_after, full_before, next_mover
from loopgate.control.places import Movement, Place, Vehicle
from loopgate.control.refusal import Refusal

PATIENCE_S: Final = 60.0
"""How long a request is passed over before others have to let it pass [s]."""

SHORT_OF_SLOTS_S: Final = 30.0
"""How old a request is that finds no slot when those who could leave one get more attention [s]."""

PATIENCE_THERE_S: Final = 10.0
"""How long these are passed over [s]."""

GIVES_WAY_S: Final = 10.0
"""How long one that the chain rule has refused keeps nothing for itself [s]."""

_OUTSIDE: Final = ("red", "traffic")
"""Refusals that something outside lifts."""

_THROUGH_RED_S: Final = 120.0
"""After this long a mover's way is kept clear all the same [s]."""


def kept(vehicle: Vehicle, now_s: float) -> Refusal | None:
    """Refuse the last slot, or a way, that is kept for another vehicle."""
    wanted = vehicle.wanted()
    if wanted is None:
        return None
    if wanted.kept_for not in (None, vehicle):
        # One with room behind it leaves a mover a slot more: nobody is short of the one that it gives back.
        here = vehicle.leg.place
        leaves = 2 if wanted.served and len(here.line) < here.slots else 1
        if wanted.barred or wanted.slots - len(wanted.bodies) <= leaves:
            return Refusal("service", [wanted], now_s)  # a grant of this step may leave another slot
    for over in vehicle.leg.passes:
        if over.movement.kept_for not in (None, vehicle):
            return Refusal("service")
    return None


class Keeping:
    """Says in each step, before requests are answered, what is kept for which vehicle."""

    def __init__(self, waiting: Iterable[Vehicle]) -> None:
        self._waiting = waiting
        """Those that wait, oldest request first."""
        self._places: list[Place] = []
        self._movements: list[Movement] = []
        self._looked_at: set[Place] = set()
        self._turned: dict[Vehicle, set[Place]] = {}
        """By served vehicle whose way leads on from a circle: all places on the way so far."""
        self._named_s: dict[Vehicle, float] = {}
        """Since when a vehicle is a mover [s]."""
        self.most_served = 0
        self.serve_after_s = PATIENCE_S
        """The age from which on the oldest requests are served [s]."""
        self.is_refused: Callable[[Vehicle], bool] = lambda vehicle: bool(full_after(vehicle).circle())
        """Whether what decides at last would refuse a vehicle, or did."""
        self.is_behind: Callable[[Vehicle], bool] = lambda _: False
        """Whether a vehicle is behind on its loop: then it is passed over for less long."""

    def look(self, now_s: float) -> None:
        """Keep slots and ways for those that are late now, and for nobody else."""
        for place in self._places:
            place.kept_for = None
            place.served = place.barred = False
        for movement in self._movements:
            movement.kept_for = None
        self._places.clear()
        self._movements.clear()
        old = self._old(now_s)
        self._serve(old, now_s)
        short: set[Place] = set()
        for vehicle in old:
            wanted = vehicle.wanted()
            if wanted is not None and wanted.is_full() and now_s - vehicle.since_s >= SHORT_OF_SLOTS_S:
                short.add(wanted)
        for vehicle in old:
            soon = vehicle.leg.place in short or self.is_behind(vehicle)
            patience_s = PATIENCE_THERE_S if soon else PATIENCE_S
            if self.is_refused(vehicle):
                vehicle.blocked_s = now_s  # whether it is asked about in this step or not
            late = now_s - vehicle.since_s >= patience_s and vehicle.reason not in _OUTSIDE
            if late and now_s - vehicle.blocked_s >= GIVES_WAY_S:
                self._keep_for(vehicle)

    def moves_next(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle is the mover of another, or its own."""
        return vehicle in self._named_s

    def _old(self, now_s: float) -> list[Vehicle]:
        """Return the vehicles that have waited for a while, but for those that idle: that ends by itself."""
        old: list[Vehicle] = []
        for vehicle in self._waiting:
            if now_s - vehicle.since_s < min(PATIENCE_THERE_S, self.serve_after_s):
                break
            if not vehicle.idles():
                old.append(vehicle)
        return old

    def _keep_for(self, vehicle: Vehicle) -> None:
        """Keep the last slot for a vehicle, and its way if a slot is left, unless they are kept already."""
        wanted = vehicle.wanted()
        if wanted is None:
            return
        if wanted.kept_for is None:
            wanted.kept_for = vehicle
            self._places.append(wanted)
        others = 0 if wanted.kept_for is vehicle else 1
        if wanted.slots - len(wanted.bodies) <= others:
            return
        if any(over.movement.kept_for is not None for over in vehicle.leg.passes):
            return
        for over in vehicle.leg.passes:
            for movement in over.foes:
                if movement.kept_for is None:
                    movement.kept_for = vehicle
                    self._movements.append(movement)

    def _serve(self, old: Iterable[Vehicle], now_s: float) -> None:
        """Keep slot and way for the movers of those that have waited for very long, oldest first."""
        self._looked_at.clear()
        named_s, self._named_s = self._named_s, {}
        turned, self._turned = self._turned, {}
        served = 0
        for vehicle in old:
            if now_s - vehicle.since_s < self.serve_after_s:
                break
            way = full_before(vehicle)
            mover = next_mover(vehicle)
            wanted = None if mover is None else mover.wanted()
            if mover is None or wanted is None or mover.idles():
                continue
            if not self._looked_at.isdisjoint([*way, wanted]):
                continue
            places = turned.get(vehicle, set()) | set(way)
            if vehicle in turned or len(closes(_last(way))) > 0:
                self._turned[vehicle] = places
                for place in places:
                    self._keep_place(place, mover)
                    place.barred = True
            self._keep_place(wanted, mover)
            self._looked_at |= places | {wanted}
            self._named_s[mover] = named_s.get(mover, now_s)
            served += 1
            outside = mover.reason in _OUTSIDE and now_s - self._named_s[mover] < _THROUGH_RED_S
            if mover.asks and not outside:
                self._keep_for(mover)
        self.most_served = max(self.most_served, served)

    def _keep_place(self, place: Place, mover: Vehicle) -> None:
        place.kept_for = mover
        place.served = True
        self._places.append(place)


def _last(way: list[Place]) -> Vehicle:
    """Return the first in line of the last place."""
    return way[-1].line[0]
