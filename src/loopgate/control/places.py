"""Places, movements, paths and vehicles, as plain objects that know one another."""

from __future__ import annotations

from math import floor, inf, log, sqrt
from typing import Final

from loopgate.control.lamps import Signal
from loopgate.control.roads import Lookout, RoadStretch

STANDING_MPS: Final = 0.1
"""A vehicle slower than this stands, as in SUMO's waiting time [m/s]."""


def braking_m(speed: float, decel: float, step_s: float) -> float:
    """Return SUMO's braking distance from `speed` [m]: one step at each lower speed, down to zero."""
    loss = decel * step_s
    steps = float(int(speed / loss))
    return step_s * (steps * speed - loss * steps * (steps + 1.0) / 2.0)


def safe_speed(room_m: float, decel: float, step_s: float) -> float:
    """Return the highest speed in the next step from which a vehicle can stop within `room_m` [m/s].

    It drives one step at that speed, and then brakes over `braking_m`.
    """
    loss = decel * step_s
    steps = float(floor((sqrt(1.0 + 8.0 * room_m / (step_s * loss)) - 1.0) / 2.0))
    return (room_m / step_s + loss * steps * (steps + 1.0) / 2.0) / (steps + 1.0)


def time_s(distance_m: float, speed: float, accel: float, top: float) -> float:
    """Return the time to drive a distance while accelerating from `speed` to `top` [s]."""
    if distance_m <= 0.0:
        return 0.0
    if speed > top:  # noqa: PLR1730  a call of `min` costs three times this
        speed = top
    gaining_m = (top * top - speed * speed) / (2.0 * accel)
    if gaining_m >= distance_m:
        return (sqrt(speed * speed + 2.0 * accel * distance_m) - speed) / accel
    return (top - speed) / accel + (distance_m - gaining_m) / top


def braking_time_s(distance_m: float, room_m: float, top: float, decel: float) -> float:
    """Return how long a vehicle takes at most for a distance if it brakes behind one `room_m` ahead [s].

    SUMO's drivers take a second to react: at distance ``g`` from where they must stop, they drive at most at
    ``v`` with ``g = v + v^2 / 2b``. So slowing down from ``v`` to ``w`` takes ``ln(v / w) + (v - w) / b``.
    The result is infinite if the vehicle stops before the end of the distance. It is 0 if no vehicle stands
    ahead (infinite `room_m`), since the vehicle need not brake.
    """
    if room_m == inf:
        return 0.0
    if room_m <= distance_m:
        return inf
    last = sqrt(decel * decel + 2.0 * decel * (room_m - distance_m)) - decel
    if last >= top:
        return distance_m / top
    first = min(top, sqrt(decel * decel + 2.0 * decel * room_m) - decel)
    freely_m = max(0.0, room_m - first - first * first / (2.0 * decel))
    return freely_m / first + log(first / last) + (first - last) / decel


MARGIN_M: Final = 1.0
"""A vehicle asks when its stop line is nearer than its braking distance plus this margin [m]."""

_REACTION_S: Final = 0.5
"""Drivers who brake late may need this long to change from accelerating to braking [s]."""

TOLERANCE_M: Final = 0.5
"""A front up to this far beyond its stop line does not count as beyond it [m]."""


_ROUNDING: Final = 1e-9


class Place:
    """A piece of road where vehicles stand in line; the first in line leaves it first.

    `slots`: how many vehicles fit. `line`: the vehicles whose last grant is this place, first in line first.
    `bodies`: the vehicles that hold a slot, from their grant until their rear has left, in the order of the
    road. `waiting`: vehicles elsewhere that are woken when a vehicle leaves the line or a rear leaves the
    place. `kept_for`: the vehicle for which the last slot is kept. `mover`: the vehicle for which slots are
    kept because its move lets a served vehicle go on. `barred`: whether only the mover may enter. `shut`:
    whether no vehicle may enter for now. `closed`: the reason of refusal while it is closed or blocked, or
    ""; `cause`: as in `Refusal`.

    Where `room_m`, the length for vehicles [m], is above 0, a slot is `slot_m` long [m], and `credit_m` of
    the room is kept for the extra metres of longer vehicles (`loopgate.control.credits`), `most_kept_m` at
    most. There are `least` slots at any time: as many as the longest vehicles that come would fill, or two.
    `circled`: whether the place lies in a circle of ways (`loopgate.control.circles`). `stretch`: the stretch
    before the place on which vehicles change lanes, `overhang_m` long [m]; None if none stand there.
    """

    __slots__ = (
        "barred", "bodies", "cause", "circled", "closed", "credit_m", "kept_for", "least", "line",
        "most_kept_m", "mover", "name", "overhang_m", "room_m", "shut", "slot_m", "slots", "stretch",
        "waiting",
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        slots: int,
        room_m: float = 0.0,
        slot_m: float = 0.0,
        most_kept_m: float = inf,
        overhang_m: float = 0.0,
    ) -> None:
        self.name: Final = name
        self.least: Final = slots
        self.room_m: Final = room_m
        self.slot_m: Final = slot_m
        self.most_kept_m: Final = most_kept_m
        self.overhang_m: Final = overhang_m
        self.stretch: ChangeStretch | None = None
        self.circled = True
        self.credit_m = 0.0
        self.slots = slots
        self.slots = self.slots_with(0.0)
        self.line: list[Vehicle] = []
        self.bodies: list[Body] = []
        self.waiting: list[Vehicle] = []
        self.kept_for: Vehicle | None = None
        self.mover: Vehicle | None = None
        self.barred = self.shut = False
        self.closed = self.cause = ""

    def is_full(self) -> bool:
        """Return whether vehicles hold all slots."""
        return len(self.bodies) >= self.slots

    def free(self) -> int:
        """Return how many more vehicles may come: slots of vehicles that surely leave count as free.

        Not in a place for one: there vehicles do not queue. Negative if a vehicle no longer surely leaves.
        """
        held = len(self.bodies)
        if held > len(self.line) and self.least > 1:
            for body in self.bodies:
                held -= body.vehicle.surely_leaves(body)
        return self.slots - held

    def slots_with(self, credit_m: float) -> int:
        """Return how many slots there are with so many metres kept for longer vehicles."""
        if self.room_m <= 0.0:
            return self.least
        room_m = self.room_m - credit_m
        if self.stretch is not None and not (self.circled or self.stretch.wanted):
            room_m += self.overhang_m
        return max(self.least, floor(room_m / self.slot_m + _ROUNDING))

    def extra_m(self, needed_m: float) -> float:
        """Return the metres that a vehicle that needs so many with its gap needs beyond a slot [m]."""
        return max(0.0, needed_m - self.slot_m) if self.room_m > 0.0 else 0.0


class ChangeStretch:
    """A stretch of an edge on which vehicles change lanes; others may stand there while none comes to do so.

    `before`: the places from which vehicles come to change lanes, up to two places before it. `behind`: the
    places after it. `wanted`: whether a vehicle in the line of a place before it will change lanes on it.
    """

    __slots__ = ("before", "behind", "wanted")

    def __init__(self) -> None:
        self.before: list[Place] = []
        self.behind: list[Place] = []
        self.wanted = False

    def is_wanted(self) -> bool:
        """Return whether a vehicle before it will change lanes on it. O(vehicles before it)."""
        for place in self.before:
            for vehicle in place.line:
                if vehicle.leg.nears is self:
                    return True
        return False


class Movement:
    """A way over a junction, between two lanes.

    `lane`: the lane before it. `beside`: the other movements out of the same place. `kept_for`: the only
    vehicle that may set out on it now, if any.
    """

    __slots__ = ("beside", "junction", "kept_for", "lane", "name")

    def __init__(self, name: str, junction: ConflictGroup) -> None:
        self.name: Final = name
        self.lane: Final = name.partition(">")[0]
        self.junction = junction
        self.beside: list[Movement] = []
        self.kept_for: Vehicle | None = None


class ConflictGroup:
    """Movements that conflicts link, directly or not. `trips`: the grants over them that still hold."""

    __slots__ = ("trips",)

    def __init__(self) -> None:
        self.trips: list[GrantedPass] = []


class Foe:
    """The stretch that a movement shares with a conflicting movement, from `from_m` to `to_m` [m].

    Distances count from the stop line before the movement. `to_m` is infinite if the foe is in the way all
    along. `soonest_s`: the shortest time at the speed limits from the stop line to the stretch [s]. `least`:
    the lowest limit before the stretch [m/s]. `mean`: the mean of the limits up to its end [m/s].

    `sizes`, `among`: where the stretch depends on the lengths of the two vehicles, the lengths [m], and the
    stretches by the own length, then by the other's; None where the two never touch.
    """

    __slots__ = ("among", "from_m", "least", "mean", "movement", "sizes", "soonest_s", "to_m")

    def __init__(
        self, movement: Movement, from_m: float, to_m: float, soonest_s: float, least: float, mean: float
    ) -> None:
        self.movement: Final = movement
        self.from_m: Final = from_m
        self.to_m: Final = to_m
        self.soonest_s: Final = soonest_s
        self.least: Final = least
        self.mean: Final = mean
        self.sizes: list[float] = []
        self.among: list[list[Foe | None]] = []


def shared_by(foe: Foe | None, mine_m: float, theirs_m: float) -> Foe | None:
    """Return the stretch that vehicles of two lengths [m] share, the own first; None if there is none."""
    if foe is None or not foe.sizes:
        return foe
    sizes, last = foe.sizes, len(foe.sizes) - 1
    if mine_m > sizes[last] or theirs_m > sizes[last]:
        return foe
    mine = theirs = 0
    while sizes[mine] < mine_m:
        mine += 1
    while sizes[theirs] < theirs_m:
        theirs += 1
    return foe.among[mine][theirs]


class Pass:
    """A movement that follows a leg on a path.

    `speed`: the lowest speed limit on it [m/s]. `wait_m`: the last position at which SUMO may let a vehicle
    wait [m]. `ahead_m`: where it begins [m]; both count from the stop line. `first`: whether it is the first
    movement after the stop line. `signal`: the light before it, if vehicles obey one. `foes`: the shared
    stretches, by movement. `lookout`: what a vehicle checks about ordinary traffic. `walked`: whether persons
    may cross the movement, for whom a vehicle waits on the junction.
    """

    __slots__ = ("ahead_m", "first", "foes", "lookout", "movement", "signal", "speed", "wait_m", "walked")

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
        self.walked = False


class Leg:
    """A place on a path, from `begin_m` to `end_m` in arc length [m], and the crossing after it.

    `after`: the next leg; None where the path ends. `passes`: the movements between the two. `number`: index
    on the path. `inner`: the movements with a light that stands inside the crossing. `guided`: whether
    vehicles are steered between the two; `guide_m`: how far after `end_m` the first stop is by which they are
    [m]. `stretch`: where it lies on the road, if there is ordinary traffic. `slot_m`: the length that a
    vehicle needs [m]. `change`: the stretch after it on which the vehicle changes lanes, if any.
    `nears`: the same, or else that after the next leg.
    """

    __slots__ = (
        "after", "begin_m", "change", "end_m", "guide_m", "guided", "inner", "nears", "number", "passes",
        "place", "slot_m", "stretch",
    )  # fmt: skip

    def __init__(self, place: Place, number: int = 0, begin_m: float = 0.0, end_m: float = 0.0) -> None:
        self.place: Final = place
        self.number: Final = number
        self.begin_m: Final = begin_m
        self.end_m: Final = end_m
        self.after: Leg | None = None
        self.passes: list[Pass] = []
        self.inner: list[Pass] = []
        self.guided = False
        self.guide_m = inf
        self.stretch: RoadStretch | None = None
        self.slot_m = 0.0
        self.change: ChangeStretch | None = None
        self.nears: ChangeStretch | None = None

    def is_quiet(self, now_s: float) -> bool:
        """Return whether no ordinary vehicle is on the crossing after the leg or beyond, or comes to it soon.

        Among ordinary vehicles only, where the leg lies on the road.
        """
        here, after = self.stretch, self.after
        there = None if after is None else after.stretch
        if here is None or there is None or there.lane.fronts or there.lane.edge.coming:
            return False
        for over in self.passes:
            lookout = over.lookout
            if lookout is not None and not (lookout.is_quiet() and lookout.was_quiet(now_s)):
                return False
        for lane in here.between:
            if lane.is_used(inf):
                return False
        for lane in there.into:  # noqa: SIM110  a generator costs five times this
            if lane.fronts:
                return False
        return True


def path_of(places: list[Place], *, closed: bool) -> list[Leg]:
    """Return the legs over `places`, at least one; on a `closed` path the last leads to the first."""
    return joined([Leg(place, number) for number, place in enumerate(places)], closed=closed)


def joined(legs: list[Leg], *, closed: bool) -> list[Leg]:
    """Link each leg to the next, and the last to the first if the path is `closed`; return the legs."""
    for number in range(1, len(legs)):
        legs[number - 1].after = legs[number]
    if closed:
        legs[-1].after = legs[0]
    return legs


class Body:
    """A slot of a place that a vehicle holds.

    `begin_m`: arc length of the front when it enters the place [m]. `out_m`: arc length of the front when the
    rear has left the place [m].
    """

    __slots__ = ("begin_m", "out_m", "place", "vehicle")

    def __init__(self, vehicle: Vehicle, place: Place, begin_m: float, out_m: float) -> None:
        self.vehicle: Final = vehicle
        self.place: Final = place
        self.begin_m: Final = begin_m
        self.out_m: Final = out_m


class GrantedPass:
    """A vehicle's grant over one movement.

    `line_m`: arc length of the stop line before it [m]. `clear_m`: arc length of the front when the rear is
    over the crossing [m]. `number`: the number of the grant. `into`: the vehicle's slot in the place after
    it. `leg`: the leg before it. `light_m`: arc length of its light [m]. `lit`: whether the front is past the
    light. `committed`: whether the vehicle drives on at amber there; valid once `known`. `stood`: whether the
    vehicle stood at the light. `seen`: whether other vehicles know of the grant; vehicles that decide by
    messages see it in the next step. `quiet`: whether no ordinary vehicle may come into its way (`Courtesy`).
    `lent`: whether the vehicle stands at a red light before it and lets others go first (`Lending`).
    """

    __slots__ = (
        "clear_m", "committed", "into", "known", "leg", "lent", "light_m", "line_m", "lit", "number", "over",
        "quiet", "seen", "stood", "vehicle",
    )  # fmt: skip

    def __init__(self, into: Body, leg: Leg, over: Pass, number: int, line_m: float, clear_m: float) -> None:
        self.leg: Final = leg
        self.light_m: Final = line_m + over.ahead_m
        self.lit = self.known = self.committed = self.stood = False
        self.seen, self.lent = True, False
        self.quiet = leg.stretch is None
        self.vehicle: Final = into.vehicle
        self.into: Final = into
        self.over: Final = over
        self.number = number
        self.line_m: Final = line_m
        self.clear_m: Final = clear_m


_SLOW: Final = 0.7
"""Share of a speed limit that drivers surely reach: a draw of the speed factor, and dawdling, are in it."""

_SLOWEST: Final = 0.8
"""The lowest speed factor for which that share holds; whoever is slower reaches less in proportion."""

_WEAK: Final = 0.5
"""Share of the acceleration that a driver who starts surely uses: 1 less SUMO's default sigma."""

_DAWDLING_MPS: Final = 1.75
"""Speed that a driver may lose in a second by dawdling without being slower than that share of the limit."""

_CREEPS_MPS: Final = 0.1
"""Lowest speed that predictions use, so that their times are finite [m/s]."""


class Make:
    """Properties of a vehicle: length [m], acceleration and deceleration [m/s2], top speed [m/s].

    `haste`: its speed factor, at least 1; 1.2 is 20 % over the limits. `gap_m`: its gap to a vehicle ahead
    when it stands, `needed_m`: both [m]. `foreseen`: whether the time at which it clears a crossing can be
    predicted. `brakes_late`: whether its driver may brake later than SUMO's default. `stops_m`: braking
    distance from top speed, in steps of a second [m].

    For such predictions: `pace`: its speed factor. `own_top`: its top speed whatever the limits [m/s].
    `dawdles`: the share of its acceleration that its driver may leave unused, SUMO's sigma. From these follow
    `sure_accel`, `weak_accel`: what it accelerates at least, under way and from a standstill [m/s2].
    """

    __slots__ = (
        "_dawdling",
        "_sure",
        "accel",
        "brakes_late",
        "dawdles",
        "decel",
        "foreseen",
        "gap_m",
        "haste",
        "length_m",
        "needed_m",
        "own_top",
        "pace",
        "stops_m",
        "sure_accel",
        "top",
        "weak_accel",
    )

    def __init__(  # noqa: PLR0913  as many figures as SUMO gives, all after the gap by name
        self,
        length_m: float,
        accel: float,
        decel: float,
        top: float,
        haste: float,
        gap_m: float = 2.5,
        *,
        pace: float = 1.0,
        own_top: float = inf,
        dawdles: float = 0.5,
        foreseen: bool = True,
        brakes_late: bool = False,
    ) -> None:
        self.brakes_late: Final = brakes_late
        self.foreseen: Final = foreseen and dawdles < 1.0
        self.gap_m: Final = gap_m
        self.length_m: Final = length_m
        self.needed_m: Final = length_m + gap_m
        self.accel: Final = accel
        self.decel: Final = decel
        self.top: Final = top
        self.haste: Final = haste
        self.stops_m: Final = braking_m(top, decel, 1.0)
        self.pace: Final = pace
        self.own_top: Final = own_top
        self.dawdles: Final = dawdles
        self.weak_accel: Final = accel * min(_WEAK, 1.0 - dawdles)
        self.sure_accel: Final = min(accel, self.weak_accel / _WEAK)
        self._dawdling: Final = max(0.0, dawdles * accel - _DAWDLING_MPS)
        self._sure: dict[float, float] = {}
        """What `surely` has returned, by limit."""

    def surely(self, limit: float) -> float:
        """Return the speed that the vehicle surely keeps where it is free to drive at a limit [m/s]."""
        if limit not in self._sure:
            wanted = min(self.top, self.own_top, limit * min(1.0, self.pace / _SLOWEST))
            self._sure[limit] = max(_CREEPS_MPS, _SLOW * wanted - self._dawdling)
        return self._sure[limit]

    def asks_within_m(self) -> float:
        """Return the distance to its stop line within which the vehicle may have to ask [m]."""
        return self.top + self.stops_m + MARGIN_M

    @property
    def figures(self) -> tuple[float, ...]:
        """All that distinguishes the vehicle from others under the gate."""
        size = self.length_m, self.gap_m
        drives = self.accel, self.decel, self.top, self.haste
        return *size, *drives, self.pace, self.own_top, self.dawdles

    def with_top(self, top: float) -> Make:
        """Return the same properties with another top speed [m/s]."""
        now = self.length_m, self.accel, self.decel, top, self.haste, self.gap_m
        return Make(
            *now,
            pace=self.pace,
            own_top=self.own_top,
            dawdles=self.dawdles,
            foreseen=self.foreseen,
            brakes_late=self.brakes_late,
        )


POINT: Final = Make(0.0, 1.0, 1.0, 1.0, 1.0)
"""A vehicle without length, for systems that lie on no road."""


class Vehicle:
    """A vehicle in the ledger: its request, what it holds, and where it is on its endless path.

    `number`: no other vehicle ever has it. `row`: index in the lists of `Driving`.

    The request: `asks`: whether it waits for an answer. `since_s`: when it asked [s]. `request`: the number
    of the request. `answered`: whether an answer has looked at it. `woken`: whether the next answer looks at
    it. `reason`: why it was last refused, or "". `refused_s`: since when it is refused, by reason [s].
    `blocked_s`: when the chain rule last refused it [s]. `mover`: whether its move lets a served vehicle go
    on. `withheld`: why it gets no grant for now, or "". `cause`: of its last refusal, see `Refusal`.

    `stands`: the cause for which it stands for long and blocks other vehicles, or "".

    What it holds: `leg`, `granted`: the last granted leg, and its number on the endless path. `bodies`,
    `trips`: its slots and its grants over movements, in the order of its path. `back_m`: arc length of its
    front at which it gives the first slot back [m].

    Where it is: `front_m`, `speed`: arc length of its front [m] and speed [m/s]. `line_m`: arc length of its
    stop line, the end of the last granted leg [m]. `due_m`: arc length at which the ledger must act next [m].
    `noted_m`: arc length at which there is something to record next [m]. `offset_m`: arc length of its front
    less its odometer [m].
    `near`: whether it is checked in each step until it asks. `watchers`: the vehicles to wake when its front
    is at an arc length. `held`: whether it must stop at its stop line; `halted`: whether it stands there.
    `lends`: whether it lets others over the rest of its crossing first (`Lending`); `claims`: whether only
    such as have a grant already. `behind`: whether it is behind one that lends, or behind another behind it.
    `credits`: the places that lack room for it in one slot, and how often its path still comes there.
    `kept`: the extra metres that it keeps now, by place [m].
    `steered`: whether it is led to a lane, and makes no request. `guide_m`: arc length of the stop by which
    it is led [m]; infinite if there is none, minus infinity while it is led back to the lane of its path.
    `stood_s`: how long it has stood, anywhere [s]. `stop_m`: arc length at which it stops by itself [m].
    `parks`: whether it stands there beside its lane and holds its slot. `beside`: whether it is parked; it
    then holds no slot, unless it will be on the road after the next step. `lot_m`: how far ahead of its front
    it then returns to its lane [m]. `astray`: whether it was last seen beyond its stop line.
    """

    __slots__ = (
        "answered", "asks", "astray", "back_m", "behind", "beside", "blocked_s", "bodies", "cause",
        "claims", "credits", "due_m", "front_m", "granted", "guide_m", "halted", "held", "kept", "lap_m",
        "laps_m", "leg", "lends", "line_m", "longest_s", "lot_m", "make", "mover", "name", "near",
        "noted_m", "number", "offset_m", "parks", "reason", "refused_s", "request", "row", "since_s",
        "speed", "stands", "steered", "stood_s", "stop_m", "trips", "watchers", "withheld", "woken",
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
        self.front_m = self.offset_m = 0.0
        self.speed = 0.0
        self.line_m = self._end_m()
        self.bodies: list[Body] = []
        self.credits: dict[Place, int] = {}
        self.kept: dict[Place, float] = {}
        self.trips: list[GrantedPass] = []
        self.watchers: list[tuple[float, Vehicle]] = []
        self.due_m = self.noted_m = self.back_m = inf
        self.asks = self.answered = self.mover = False
        self.request = 0
        self.held = self.halted = self.lends = self.claims = self.behind = False
        self.woken = False
        self.near = False
        self.steered = False
        self.guide_m = inf
        self.stop_m = inf
        self.lot_m = 0.0
        self.parks = self.beside = self.astray = False
        self.withheld = self.cause = self.stands = ""
        self.reason = ""
        self.refused_s: dict[str, float] = {}
        self.blocked_s = -inf
        self.since_s = self.longest_s = self.stood_s = 0.0

    def stops_here(self) -> bool:
        """Return whether it stops by itself before its stop line."""
        return self.stop_m < self.line_m

    def takes_in(self, place: Place) -> int:
        """Return how many slots fewer are free in a place once it has come: 1, more if it is long."""
        if place not in self.credits or place in self.kept:
            return 1
        credit_m = place.credit_m + place.extra_m(self.make.needed_m)
        if credit_m > place.most_kept_m + _ROUNDING:
            return place.slots + 1
        return 1 + place.slots - place.slots_with(credit_m)

    def finds_room(self, place: Place) -> bool:
        """Return whether there are slots for it in a place."""
        return place.free() >= self.takes_in(place)

    def surely_leaves(self, body: Body) -> bool:
        """Return whether it has its grant to leave the place of a body, and nothing keeps it there.

        A light may, a vehicle ahead that lends its crossing, a change of lanes, a stop, or ordinary traffic.
        """
        if body is self.bodies[-1] or self.lends or self.behind or self.steered or self.stands:
            return False
        if self.stop_m < self.line_m or self.parks:
            return False
        for trip in self.trips:
            if not trip.quiet or (
                trip.light_m < body.out_m and trip.over.signal is not None and not trip.lit
            ):
                return False
        return True

    def idles(self) -> bool:
        """Return whether it stays where it is for now, so that nothing should be kept for it."""
        if self.withheld == "stop" or self.stops_here():
            return True
        return self.reason in ("closed", "blocked") or self.withheld == "blocked"

    def holds(self) -> range:
        """Return the numbers of the legs in whose places it holds a slot."""
        return range(self.granted + 1 - len(self.bodies), self.granted + 1)

    def crosses(self) -> range:
        """Return the numbers of the legs whose crossings its rear has not cleared."""
        if not self.trips:
            return range(0)
        return range(self.holds()[self.bodies.index(self.trips[0].into)] - 1, self.granted)

    def is_settled(self) -> bool:
        """Return whether it is in one place with its full length, and holds nothing else."""
        return len(self.bodies) == 1 and not self.trips and self.front_m >= self.bodies[0].begin_m

    def trespasses(self) -> bool:
        """Return whether its front is beyond its stop line, which is the end of its last granted leg."""
        return self.front_m > self.line_m + TOLERANCE_M

    def begins_to_trespass(self) -> bool:
        """Return whether its front is beyond its stop line now and was not at the last call."""
        before, self.astray = self.astray, self.trespasses()
        return self.astray and not before

    def left_m(self) -> float:
        """Return the distance to its stop line [m], of a parked vehicle from where it returns to its lane."""
        return self.line_m - self.front_m - self.lot_m

    def wanted(self) -> Place | None:
        """Return the place that it wants next; None where its path ends."""
        after = self.leg.after
        return None if after is None else after.place

    def go_on(self, after: Leg) -> None:
        """Make the next leg the last granted leg."""
        if after.number <= self.leg.number:
            self.laps_m += self.lap_m
        self.granted += 1
        self.leg = after
        self.line_m = self._end_m()

    def turn_off(self, leg: Leg, make: Make, lap_m: float) -> float:
        """Change to another path at a leg in its place; return how much larger arc lengths are there [m]."""
        by_m = leg.end_m - self.line_m
        self.leg, self.granted, self.make, self.lap_m, self.laps_m = leg, leg.number, make, lap_m, 0.0
        self.line_m = self._end_m()
        self.front_m += by_m
        self.stop_m += by_m
        self.watchers = [(watched_m + by_m, other) for watched_m, other in self.watchers]
        return by_m

    def after_begins_m(self, after: Leg) -> float:
        """Return the arc length at which the leg after the last granted leg begins [m]."""
        return (self.laps_m if after.number > self.leg.number else self.laps_m + self.lap_m) + after.begin_m

    def _end_m(self) -> float:
        """Return the arc length at which the last granted leg ends [m]; infinite if it is the only leg."""
        return inf if self.leg.after is self.leg else self.laps_m + self.leg.end_m

    def asks_from_m(self) -> float:
        """Return the first arc length at which it may have to ask, with steps of up to a second [m]."""
        return self.line_m - self.make.asks_within_m()

    def gives_back_m(self) -> float:
        """Return the arc length of its front at which it gives its first slot back [m].

        If that place is full, this is where its rear leaves the place; otherwise where its rear is over the
        crossing, since no vehicle waits for a slot while others are free. Infinite if it holds one slot only.
        """
        if len(self.bodies) > 1:
            first = self.bodies[0]
            if first.place.is_full():
                return first.out_m
            return max(first.out_m, self.bodies[1].begin_m + self.make.length_m)
        return inf

    def must_ask(self, step_s: float) -> bool:
        """Return whether the next step could take it beyond the point where it must brake."""
        return self.must_brake_for(self.line_m, step_s)

    def must_brake_for(self, at_m: float, step_s: float) -> bool:
        """Return whether it may be too late after the next step to stop before an arc length [m]."""
        make = self.make
        fast = self.speed + make.accel * step_s
        if fast > make.top:  # noqa: PLR1730  a call of `min` costs three times this
            fast = make.top
        within_s = max(step_s, _REACTION_S) if make.brakes_late else step_s
        return at_m - self.front_m < fast * within_s + braking_m(fast, make.decel, step_s) + MARGIN_M
