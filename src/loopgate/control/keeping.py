"""Service and patience, as one rule: last slots and ways that are kept for vehicles that wait for long.

A vehicle that has been passed over for a while is *late*. The last slot of the place that it wants is kept
for it, and once there is a slot, its way over the crossing too: a long crossing is hardly ever clear by
itself, and vehicles with a shorter way take each slot that a full place gives back. Of two late vehicles in
each other's way the older keeps its way, so each waits only for older ones.

A vehicle that has waited for very long is *served*. `loopgate.gates.certified.service` names its *mover*: the
vehicle whose move brings the served one nearer to its grant. Slots and way are kept for the mover, and no
negotiation passes it over. If the way leads on from a circle of places, no vehicle but the mover enters a
place that the rule has looked at, until the served vehicle has its grant. Several vehicles are served at the
same time if the rule looks at different places for each; else the older goes first. `docs/proofs/roads.md`
proves that each request is granted after finitely many moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from loopgate.control.chain import closes, full_before, next_mover
from loopgate.control.places import Movement, Place, Vehicle
from loopgate.control.refusal import Refusal, Rule

PATIENCE_S: Final = 60.0
"""How long a request is passed over before others have to let it pass [s]."""

SHORT_OF_SLOTS_S: Final = 30.0
"""How old a request is that finds no slot when those who could leave one get more attention [s]."""

PATIENCE_THERE_S: Final = 10.0
"""How long these are passed over [s]."""

GIVES_WAY_S: Final = 10.0
"""How long one that the chain rule has refused keeps nothing for itself [s]."""

PASSED_OVER: Final = ("crossing", "occupied")
"""Refusals of a vehicle that others pass over."""

_THROUGH_RED_S: Final = 120.0
"""After this long a mover's way is kept clear though a light or ordinary traffic holds it [s]."""


def kept(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse the last slot, or a way, that is kept for another vehicle."""
    wanted = vehicle.wanted()
    if wanted is None:
        return None
    free = wanted.slots - len(wanted.bodies)
    if wanted.mover is not None and wanted.mover is not vehicle:
        # One with room behind it leaves a mover a slot more: nobody is short of the one that it gives back.
        here = vehicle.leg.place
        leaves = 2 if len(here.line) < here.slots else 1
        if wanted.barred or free <= leaves:
            return Refusal("service")
    other = wanted.kept_for
    if free == 1 and other is not None and other is not vehicle and wanted.mover is not vehicle:
        return Refusal("occupied")
    for over in vehicle.leg.passes:
        other = over.movement.kept_for
        if other is not None and other is not vehicle:
            return Refusal("service" if other.mover else "crossing")
    return None


class Keeping:
    """Says in each step, before requests are answered, what is kept for which vehicle."""

    def __init__(self, waiting: Iterable[Vehicle]) -> None:
        self._waiting = waiting
        """Those that wait, oldest request first."""
        self._places: list[Place] = []
        self._movements: list[Movement] = []
        self._turned: dict[Vehicle, list[Place]] = {}
        """By served vehicle whose way leads on from a circle: all places on the way so far."""
        self._named_s: dict[Vehicle, float] = {}
        """Since when a vehicle is a mover [s]."""
        self.most_served = 0
        self.serve_after_s = PATIENCE_S
        """The age from which on the oldest requests are served [s]."""
        self.outside: Sequence[Rule] = ()
        """The rules about what comes from outside: no way is kept clear for a mover that one refuses."""
        self.is_behind: Callable[[Vehicle], bool] = lambda _: False
        """Whether a vehicle is behind on its loop: then it is passed over for less long."""

    def look(self, now_s: float) -> None:
        """Keep slots and ways for those that are late or served now, and for nobody else."""
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
        """Return whether something outside keeps a mover from its move."""
        for rule in self.outside:
            if rule(mover, now_s) is not None:
                return True
        return mover.withheld != ""

    def _late(self, now_s: float) -> list[Vehicle]:
        """Return the vehicles that others have to let pass, oldest request first."""
        old: list[Vehicle] = []
        short: set[Place] = set()
        for vehicle in self._waiting:
            waited_s, wanted = now_s - vehicle.since_s, vehicle.wanted()
            if waited_s < PATIENCE_THERE_S:
                break
            if vehicle.reason in PASSED_OVER and wanted is not None and not vehicle.idles():
                old.append(vehicle)
                if vehicle.reason == "occupied" and waited_s >= SHORT_OF_SLOTS_S and wanted.is_full():
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
        for over in vehicle.leg.passes:
            if over.movement.kept_for is not None:
                return
        for over in vehicle.leg.passes:
            for movement in over.foes:
                if movement.kept_for is None:
                    movement.kept_for = vehicle
                    self._movements.append(movement)

    def _serve(self, held: set[Vehicle], now_s: float) -> None:
        """Keep slots and ways for the movers of those that have waited for very long, oldest first."""
        named_s, self._named_s = self._named_s, {}
        turned, self._turned = self._turned, {}
        for before in named_s:
            before.mover = False
        for vehicle in self._waiting:
            if vehicle.reason == "stop" or vehicle.idles():
                continue
            if now_s - vehicle.since_s < self.serve_after_s:
                break
            places = full_before(vehicle)
            last, mover = places[-1].line[0], next_mover(vehicle)
            end = last.wanted()
            if mover is None or end is None or mover.idles() or mover.beside:
                continue
            places.append(end)
            if any(place.mover is not None for place in places):
                continue  # the way of an older one leads there
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

    def _clear_way(self, mover: Vehicle) -> None:
        """Let nobody set out across a mover's way, unless an older one's mover needs that."""
        wanted, passes = mover.wanted(), mover.leg.passes
        if wanted is None or wanted.is_full():
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
