"""Places, crossings, paths and vehicles, as plain objects that know one another."""

from __future__ import annotations

from math import inf
from typing import Final

from loopgate.control.lamps import Signal
from loopgate.control.motion import braking_m
from loopgate.control.roads import Lookout, Stretch

MARGIN_M: Final = 1.0
"""Room kept beyond the braking distance when a vehicle asks [m]."""

TOLERANCE_M: Final = 0.5
"""Rounding allowed before a front beyond its line counts as one [m]."""


class Place:
    """A piece of road where vehicles stand in line; the first in line leaves it first.

    `slots`: how many vehicles fit. `line`: the vehicles whose last grant it is, first in line first.
    `bodies`: those that hold a slot, from their grant until their rear is out, in that order. `waiting`:
    vehicles elsewhere whose request is looked at again when a vehicle leaves the line or its rear is out.
    `kept_for`: whose the last slot is. `mover`: whose it is before that, since its move lets a served vehicle
    go on; `barred`: whether no other vehicle may come in at all. `shut`: whether nobody comes in for now.
    `outside`: how many wait to depart there, or in places before it up to the junction.
    """

    __slots__ = (
        "barred", "bodies", "kept_for", "line", "mover", "name", "outside", "shut", "slots", "waiting",
    )  # fmt: skip

    def __init__(self, name: str, slots: int) -> None:
        self.name: Final = name
        self.slots: Final = slots
        self.line: list[Vehicle] = []
        self.bodies: list[Body] = []
        self.waiting: list[Vehicle] = []
        self.kept_for: Vehicle | None = None
        self.mover: Vehicle | None = None
        self.barred = self.shut = False
        self.outside = 0

    def is_full(self) -> bool:
        """Return whether no slot is free."""
        return len(self.bodies) >= self.slots


class Movement:
    """A way over a junction.

    `beside`: the other ways out of the same place. `kept_for`: who alone may set out on it, if anybody.
    """

    __slots__ = ("beside", "junction", "kept_for", "name")

    def __init__(self, name: str, junction: Junction) -> None:
        self.name: Final = name
        self.junction = junction
        self.beside: list[Movement] = []
        self.kept_for: Vehicle | None = None


class Junction:
    """Movements that conflict, directly or by others between them. `trips`: who is under way over them."""

    __slots__ = ("trips",)

    def __init__(self) -> None:
        self.trips: list[Trip] = []


class Foe:
    """What a movement shares with another: from where to where, in metres behind the line before it.

    `to_m` is infinite where the other is in the way all along. `soonest_s`: the least time at the limits from
    the line to there. `least`: the lowest limit on the way. `mean`: the mean speed as far as its end.
    """

    __slots__ = ("from_m", "least", "mean", "movement", "soonest_s", "to_m")

    def __init__(
        self, movement: Movement, from_m: float, to_m: float, soonest_s: float, least: float, mean: float
    ) -> None:
        self.movement: Final = movement
        self.from_m: Final = from_m
        self.to_m: Final = to_m
        self.soonest_s: Final = soonest_s
        self.least: Final = least
        self.mean: Final = mean


class Pass:
    """A movement as it lies behind a leg.

    `speed`: the lowest limit on it [m/s]. `wait_m`: how far behind the line SUMO may last let a vehicle wait.
    `ahead_m`: how far behind the line it begins. `first`: whether it is the first behind the line. `signal`:
    the light before it, if vehicles obey one. `foes`: by movement. `lookout`: what of ordinary traffic
    vehicles look out for on it.
    """

    __slots__ = ("ahead_m", "first", "foes", "lookout", "movement", "signal", "speed", "wait_m")

    def __init__(
        self,
        movement: Movement,
        speed: float,
        wait_m: float,
        ahead_m: float = 0.0,
        signal: Signal | None = None,
        *,
        first: bool = True,
    ) -> None:
        self.movement: Final = movement
        self.ahead_m: Final = ahead_m
        self.signal: Final = signal
        self.speed: Final = speed
        self.wait_m: Final = wait_m
        self.first: Final = first
        self.foes: dict[Movement, Foe] = {}
        self.lookout: Lookout | None = None


class Leg:
    """A place on a path, from where to where in arc length [m], and what lies behind it.

    `after`: the leg that follows it; None where the path ends. `passes`: the crossing between the two.
    `number`: its position on the path. `guided`: whether vehicles are steered between the two. `stretch`:
    where it lies on the road, if there is ordinary traffic. `slot_m`: the room that a vehicle needs [m].
    """

    __slots__ = ("after", "begin_m", "end_m", "guided", "number", "passes", "place", "slot_m", "stretch")

    def __init__(self, place: Place, number: int = 0, begin_m: float = 0.0, end_m: float = 0.0) -> None:
        self.place: Final = place
        self.number: Final = number
        self.begin_m: Final = begin_m
        self.end_m: Final = end_m
        self.after: Leg | None = None
        self.passes: list[Pass] = []
        self.guided = False
        self.stretch: Stretch | None = None
        self.slot_m = 0.0


def path_of(places: list[Place], *, closed: bool) -> list[Leg]:
    """Return the legs over `places`, at least one; on a `closed` path the first follows the last."""
    return joined([Leg(place, number) for number, place in enumerate(places)], closed=closed)


def joined(legs: list[Leg], *, closed: bool) -> list[Leg]:
    """Let each leg follow the one before it, and the first the last if the path is `closed`."""
    for number in range(1, len(legs)):
        legs[number - 1].after = legs[number]
    if closed:
        legs[-1].after = legs[0]
    return legs


class Body:
    """A vehicle in a place. Its front came in at `begin_m`; its rear is out when its front is at `out_m`."""

    __slots__ = ("begin_m", "out_m", "place", "vehicle")

    def __init__(self, vehicle: Vehicle, place: Place, begin_m: float, out_m: float) -> None:
        self.vehicle: Final = vehicle
        self.place: Final = place
        self.begin_m: Final = begin_m
        self.out_m: Final = out_m


class Trip:
    """A grant over one movement.

    `line_m`: where the line before it is on the vehicle's way. `clear_m`: its rear is over when its front is
    there. `number`: the how manieth grant it was. `into`: the vehicle's body in the place behind. `leg`: the
    leg before it. `light_m`: where its light is, if it has one; `lit`: whether the front is past that;
    `committed`: whether it drives on there at amber, once that is `known`. `stood`: whether it stood there.
    """

    __slots__ = (
        "clear_m", "committed", "into", "known", "leg", "light_m", "line_m", "lit", "number", "over",
        "stood", "vehicle",
    )  # fmt: skip

    def __init__(self, into: Body, leg: Leg, over: Pass, number: int, line_m: float, clear_m: float) -> None:
        self.leg: Final = leg
        self.light_m: Final = line_m + over.ahead_m
        self.lit = self.known = self.committed = self.stood = False
        self.vehicle: Final = into.vehicle
        self.into: Final = into
        self.over: Final = over
        self.number: Final = number
        self.line_m: Final = line_m
        self.clear_m: Final = clear_m


class Make:
    """What a vehicle is like: length [m], acceleration and deceleration [m/s2], top speed [m/s].

    `haste`: its speed factor, at least one: 1.2 is 20 % over the limits. `foreseen`: whether the time can be
    predicted at which it clears a crossing.
    """

    __slots__ = ("accel", "decel", "foreseen", "haste", "length_m", "top")

    def __init__(
        self, length_m: float, accel: float, decel: float, top: float, haste: float, *, foreseen: bool = True
    ) -> None:
        self.foreseen: Final = foreseen
        self.length_m: Final = length_m
        self.accel: Final = accel
        self.decel: Final = decel
        self.top: Final = top
        self.haste: Final = haste

    def with_top(self, top: float) -> Make:
        """Return the same with another top speed [m/s]."""
        return Make(self.length_m, self.accel, self.decel, top, self.haste, foreseen=self.foreseen)


POINT: Final = Make(0.0, 1.0, 1.0, 1.0, 1.0)
"""A vehicle without a body, for systems that lie on no road."""


class Vehicle:
    """A vehicle, where it is, and the last leg that was granted to it.

    `number`: no other vehicle ever has it. `row`: where it is in the lists of its driver.
    `asks`: whether it waits for an answer. `reason`: why it was refused last, or "". `since_s`: when it
    asked; `request`: the how manieth request that is. `held`: whether it is to stop at its line; `halted`:
    whether it stands there. `near`: whether it is looked at in each step until it asks. `woken`: whether it
    is to be looked at; `answered`: whether its request was looked at. `mover`: whether its move lets a served
    vehicle go on. `front_m`, `speed`: where its front is
    on its endless way [m], and how fast it is [m/s]. `line_m`: where the leg ends. `bodies`, `trips`: what it
    holds, in the order of its way. `back_m`: where its front is when it gives the first of these back.
    `watchers`: who is looked at again once its front is so far. `due_m`:
    where something is to be done next. `blocked_s`: when the chain rule refused it last. `refused_s`: since
    when it is refused, by reason. `steered`: whether it is led to a lane, and asks for nothing. `stop_m`:
    where it stops next by itself [m]. `parks`: whether it stands beside its lane there and holds its slot.
    `beside`: whether it stands there and holds none, or is not yet back on the road. `withheld`: why it
    is granted nothing for now, whatever the other rules say; or "". `astray`: whether it was
    seen past the end of its last granted leg.
    """

    __slots__ = (
        "answered", "asks", "astray", "back_m", "beside", "blocked_s", "bodies", "due_m", "front_m",
        "granted", "halted", "held", "lap_m", "laps_m", "leg", "line_m", "longest_s", "make", "mover", "name",
        "near", "number", "parks", "reason", "refused_s", "request", "row", "since_s", "speed", "steered",
        "stop_m", "trips", "watchers", "withheld", "woken",
    )  # fmt: skip

    def __init__(self, number: int, name: str, leg: Leg, make: Make = POINT, lap_m: float = 0.0) -> None:
        self.number: Final = number
        self.row = 0
        self.name: Final = name
        self.make = make
        self.lap_m = lap_m
        self.leg = leg
        self.granted = leg.number
        self.laps_m = 0.0
        self.front_m = 0.0
        self.speed = 0.0
        self.line_m = self._end_m()
        self.bodies: list[Body] = []
        self.trips: list[Trip] = []
        self.watchers: list[tuple[float, Vehicle]] = []
        self.due_m = self.back_m = inf
        self.asks = self.answered = self.mover = False
        self.request = 0
        self.held = self.halted = False
        self.woken = False
        self.near = False
        self.steered = False
        self.stop_m = inf
        self.parks = self.beside = self.astray = False
        self.withheld = ""
        self.reason = ""
        self.refused_s: dict[str, float] = {}
        self.blocked_s = -inf
        self.since_s = 0.0
        self.longest_s = 0.0

    def stops_here(self) -> bool:
        """Return whether it is to stop by itself, or does, before the end of its last granted leg."""
        return self.stop_m < self.line_m

    def idles(self) -> bool:
        """Return whether it goes nowhere for now by itself, so that nothing is to be kept for it."""
        return self.withheld == "stop" or self.stops_here()

    def is_settled(self) -> bool:
        """Return whether it is in one place, and holds nothing else."""
        return len(self.bodies) == 1 and not self.trips and self.front_m >= self.bodies[0].begin_m

    def trespasses(self) -> bool:
        """Return whether its front is past the end of its last granted leg."""
        return self.front_m > self.line_m + TOLERANCE_M

    def begins_to_trespass(self) -> bool:
        """Return whether its front is past that end, and was not when this was asked before."""
        before, self.astray = self.astray, self.trespasses()
        return self.astray and not before

    def left_m(self) -> float:
        """Return how far it is from there [m]."""
        return self.line_m - self.front_m

    def wanted(self) -> Place | None:
        """Return the place that it wants next; None where its path ends."""
        after = self.leg.after
        return None if after is None else after.place

    def go_on(self, after: Leg) -> None:
        """Let its last granted leg be the one after."""
        if after.number <= self.leg.number:
            self.laps_m += self.lap_m
        self.granted += 1
        self.leg = after
        self.line_m = self._end_m()

    def turn_off(self, leg: Leg, make: Make, lap_m: float) -> float:
        """Go on by another path from a leg in its place; return how much more arc lengths are on it [m]."""
        by_m = leg.end_m - self.line_m
        self.leg, self.granted, self.make, self.lap_m, self.laps_m = leg, leg.number, make, lap_m, 0.0
        self.line_m = self._end_m()
        self.front_m += by_m
        self.stop_m += by_m
        self.watchers = [(watched_m + by_m, other) for watched_m, other in self.watchers]
        return by_m

    def after_begins_m(self, after: Leg) -> float:
        """Return the arc length at which leg `after`, the one behind the last granted leg, begins [m]."""
        return (self.laps_m if after.number > self.leg.number else self.laps_m + self.lap_m) + after.begin_m

    def _end_m(self) -> float:
        """Return where its last granted leg ends [m]: never if that is the only one."""
        return inf if self.leg.after is self.leg else self.laps_m + self.leg.end_m

    def asks_from_m(self) -> float:
        """Return the earliest point at which it may have to ask [m], with steps of a second at most."""
        top = self.make.top
        return self.line_m - top - braking_m(top, self.make.decel, 1.0) - MARGIN_M

    def gives_back_m(self) -> float:
        """Return where its front is when it gives its first slot back [m]; infinite if it holds one only.

        It does so once its rear is out of a full place, and else over the crossing behind: nobody waits for
        a slot while there are others.
        """
        if len(self.bodies) > 1:
            first = self.bodies[0]
            if first.place.is_full():
                return first.out_m
            return max(first.out_m, self.bodies[1].begin_m + self.make.length_m)
        return inf

    def must_ask(self, step_s: float) -> bool:
        """Return whether the next step could take it past the point where it must brake."""
        make = self.make
        fast = min(make.top, self.speed + make.accel * step_s)
        return self.line_m - self.front_m < fast * step_s + braking_m(fast, make.decel, step_s) + MARGIN_M
