"""Vehicles that depart while others drive: put in when their place has room for them, and their way is free.

One departs when its place has a slot that the gate lets it have, and nobody stands or drives behind its front
there; no other vehicle gets into the place in that step. Where others keep driving into it, it is closed to
them for a while, now and then.
"""

from __future__ import annotations

from bisect import insort
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from loopgate.control.driving import Driving
from loopgate.control.places import Leg, Place
from loopgate.control.way import Way
from loopgate.traffic.base import Insertion, Traffic

_AGAIN_S: Final = 1.0
"""Time after which a vehicle that was refused is looked at again [s]."""

_AT_LEAST: Final = 0.05
"""Share of all slots up to which vehicles that drive once are let in however crowded their ways are."""

_LONG_S: Final = 120.0
_IN_TURN: Final = 20
"""Of so many that are let in one is that which has waited longest, if that long [s], however crowded its way.

With half more trips than a grid can take the worst waits a third less, and as many arrive."""

_PATIENCE_S: Final = 20.0
"""A vehicle that has waited so long for others to drive into its place keeps them out for as long, now and
then [s]."""

_TAKEN: Final = 0.2
"""Share of the slots on a way from which on one more vehicle may make less traffic.

With three times as many trips as a grid of one-lane roads can take, most arrive in an hour with a fifth; 3 %
fewer with 0.15 or 0.25, 18 % fewer with a fifth of all slots in the network."""

_LOST: Final = 0.09
"""And share of the slots on it that vehicles lose together that are slower than allowed.

A vehicle that stands loses a whole slot; a dense stream that rolls is no crowd. With 0.07 vehicles that
follow one another every three seconds wait to set out, with 0.11 trips on the grid take 5 % longer."""


@dataclass(frozen=True, slots=True)
class Due:
    """A vehicle that is to depart.

    `at_s`: when it wants to [s]. `turn`: the how manieth it is. `gap_m`: the gap that it keeps [m]. `limits`:
    the speed limit on each leg of its way [m/s].
    """

    at_s: float
    turn: int
    way: Way
    insertion: Insertion
    gap_m: float
    limits: Sequence[float]

    @property
    def again(self) -> bool:
        """Whether it drives round."""
        return not self.way.legs[-1].away

    @property
    def place(self) -> str:
        """The place in which it departs."""
        return str(self.way.legs[self.way.position].state)


class Departures:
    """Puts vehicles in, one in each place at a time; `look` is to be called after each step.

    A vehicle that drives once waits as long as its way is crowded.

    Parameters
    ----------
    due
        In the order in which they want to depart.
    slots
        How many all places on the road hold.
    admits
        Whether all can go on with one more, for ever.
    heeds_crowds
        Whether vehicles wait while their ways are crowded: not where lights are obeyed, since vehicles that
        queue at red are no crowd.
    """

    def __init__(
        self,
        traffic: Traffic,
        driving: Driving,
        due: Sequence[Due],
        slots: int,
        admits: Callable[[Way], bool] = lambda _: True,
        *,
        heeds_crowds: bool = True,
    ) -> None:
        self._heeds_crowds = heeds_crowds
        self._traffic, self._driving, self._admits = traffic, driving, admits
        self._coming = deque(due)
        self._by_name = {one.way.vehicle: one for one in due}
        self._outside: dict[tuple[str, bool], list[Due]] = {}
        self._tried_s: dict[str, float] = {}
        self._others = 0
        """How many were let in since it was the turn of the one that has waited longest."""
        loops = any(one.again for one in due) or bool(driving.ledger.vehicles)
        self._least = max(1.0, _AT_LEAST * slots * loops)
        """With fewer on the road that drive once, nobody waits for others to go."""

    def look(self) -> None:
        """Let those depart that are due and may."""
        now_s, driving = self._traffic.now_s, self._driving
        for way in driving.missed:
            self._wait(self._by_name[way.vehicle])
        while self._coming and self._coming[0].at_s <= now_s:
            self._wait(self._coming.popleft())
        first = sorted((line[0] for line in self._outside.values() if line), key=lambda one: one.turn)
        longest = (
            first[0] if first and self._others >= _IN_TURN and now_s >= first[0].at_s + _LONG_S else None
        )
        tried: set[str] = set()
        few = driving.once + len(driving.coming) < self._least
        for one in first:
            goes_on = one is longest or one.again or few
            if one.place in tried or not (goes_on or not self._is_crowded(one)):
                continue
            tried.add(one.place)
            if self._let_in(one, now_s):
                self._others = 0 if one is longest else self._others + 1
                few = driving.once + len(driving.coming) < self._least

    def _wait(self, one: Due) -> None:
        insort(self._outside.setdefault((one.place, one.again), []), one, key=lambda other: other.turn)
        self._count(one, 1)

    def _count(self, one: Due, change: int) -> None:
        """Let it count, or no longer, as a queue in its place and those up to the next junction."""
        path = self._driving.path(one.way)
        for leg in path[one.way.position :]:
            leg.place.outside += change
            if leg.passes:
                return

    def _is_crowded(self, one: Due) -> bool:
        """Return whether one more vehicle would reduce the traffic on the way."""
        if not self._heeds_crowds:
            return False
        limits: dict[Place, float] = {}
        path = self._driving.path(one.way)
        for leg, limit in zip(path[one.way.position :], one.limits[one.way.position :], strict=True):
            if not one.way.legs[leg.number].away:
                limits[leg.place] = limit
        return is_crowded(limits)

    def _let_in(self, one: Due, now_s: float) -> bool:
        """Let a vehicle depart in the next step if there is room for it; return whether it may."""
        driving, way = self._driving, one.way
        leg: Leg = driving.path(way)[way.position]
        if not driving.is_clear(way, one.gap_m):
            if (now_s - one.at_s) % (2.0 * _PATIENCE_S) >= _PATIENCE_S:
                driving.ledger.shut(leg.place)
            return False
        if now_s < self._tried_s.get(way.vehicle, now_s - _AGAIN_S) + _AGAIN_S:
            return False
        self._tried_s[way.vehicle] = now_s
        if not driving.ledger.fits(leg) or not self._admits(way):
            return False
        driving.ledger.shut(leg.place)
        if not driving.let_in(way, one.insertion):
            return False
        self._outside[one.place, one.again].remove(one)
        self._count(one, -1)
        return True


def is_crowded(limits: dict[Place, float]) -> bool:
    """Return whether too many slots of some places are taken, and too much time is lost there.

    `limits`: by place [m/s].
    """
    slots = sum(place.slots for place in limits)
    if sum(len(place.line) for place in limits) <= _TAKEN * slots:
        return False
    lost = 0.0
    for place, limit in limits.items():
        lost += max(0.0, len(place.line) - sum(vehicle.speed for vehicle in place.line) / limit)
    return lost > _LOST * slots
