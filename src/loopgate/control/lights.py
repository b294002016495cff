"""Traffic lights that vehicles obey: grants only into green, and what a granted vehicle does at amber.

The rule `light` lets a vehicle go if the light at its stop line is open in the next step, and if even a slow
driver passes the stop line before red by the light's program. Each further light on the crossing must be open
when the vehicle gets there, or the vehicle would stand inside and keep others from their crossings. Where the
programs never let it through at once, as where one light is green while the next is red, it sets out when it
stands inside for the shortest time that the programs allow (`_least_s`). A light farther than `FAR_M` beyond
the stop line may also let it stand for `_SHORT_S`; if its program is not fixed, it does not count.

A granted vehicle is committed. It drives on at amber, like SUMO's drivers that are too near to brake. It
stops at a red light if it still can, and keeps its grant: the gate has admitted other vehicles because of
that grant. Inside a crossing it lends the rest of it (`loopgate.control.lending`). A vehicle with a grant
beyond a light still obeys the light. `on_red` counts the vehicles that
pass a light on red because they could not brake.

Lights only delay. The promise of the gate holds as long as every light turns green again and again. Two
lights on one crossing need not be green together, and programs need not be fixed, so after `PATIENCE_S` the
rule asks for green only at the stop line.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import Final

from loopgate.control.lamps import ARROW, OPEN, RED, Signal
from loopgate.control.part import Part
from loopgate.control.places import STANDING_MPS, GrantedPass, Leg, Pass, Vehicle, braking_m, time_s
from loopgate.control.refusal import Refusal
from loopgate.traffic.base import Traffic

FAR_M: Final = 50.0
"""At a light farther than this beyond the stop line, a vehicle may stand for a while [m]."""

_SHORT_S: Final = 15.0
"""So long a wait at such a light is no reason not to set out [s].

A vehicle that stands inside keeps others from their crossings, so a wait for a whole red is worse there than
at the stop line. On large roundabouts with many lights, each red for 5 s in 90 s, waits for all of them to be
green cost more than they save: three such run at 78, 74, 86 s with 15 s, and at 132, 116, 109 s without.
"""

_AS_GOOD_S: Final = 1.5
"""Waits that differ by less count as equal, since programs are looked at each second [s]."""

_HORIZON_S: Final = 240
"""So far ahead a moment with a shorter wait is looked for [s]."""

PATIENCE_S: Final = 180.0
"""After so long a wait for green, only the light at the stop line refuses a vehicle [s]."""

_ARROW_STOP_S: Final = 3.0
_BEFORE_RED_S: Final = 1.0
_SLOW_ACCEL: Final = 0.6
_SLOW_SPEED: Final = 0.9
_START_S: Final = 1.0
_JUST_S: Final = 1e-3


def light(vehicle: Vehicle, now_s: float) -> Refusal | None:
    """Refuse a vehicle if a light closes before it is past, or would let it stand inside needlessly long."""
    leg = vehicle.leg
    if not leg.passes:
        return None
    patient = now_s - vehicle.refused_s.get("red", inf) < PATIENCE_S
    first = leg.passes[0]
    signal = first.signal
    if signal is not None and is_at_line(first, leg):
        if signal.next_letter(now_s) not in OPEN:
            lamp = signal.lamp
            # A fixed program says when to ask again; others are looked at in each step.
            fixed = lamp.program.fixed and lamp.changes_s > now_s
            return Refusal("red", at_s=lamp.changes_s - _JUST_S if fixed else inf)
        if patient and not _may_pass(vehicle, first, signal, now_s):
            return Refusal("red")
    if patient and leg.inner and not _sets_out(vehicle, now_s):
        return Refusal("red")
    return None


def _sets_out(vehicle: Vehicle, now_s: float) -> bool:
    """Return whether the lights inside a crossing let a vehicle set out now."""
    for over in vehicle.leg.inner:
        signal = over.signal
        if signal is None:
            continue
        signal.lamp.look(now_s)
        if not (signal.lamp.program.fixed or over.ahead_m > FAR_M) and not _may_pass(
            vehicle, over, signal, now_s
        ):
            return False
    to_line_m = vehicle.line_m - vehicle.front_m
    stands_s = _stands_s(vehicle, now_s, 0.0, to_line_m, vehicle.speed, _SHORT_S)
    return stands_s == 0.0 or (stands_s < inf and stands_s <= _least_s(vehicle, now_s) + _AS_GOOD_S)


def _stands_s(
    vehicle: Vehicle, now_s: float, start_s: float, to_line_m: float, speed: float, spare_s: float
) -> float:
    """Return how long a vehicle would stand inside at lights with fixed programs [s].

    It sets out after `start_s` [s], `to_line_m` before its stop line [m]. `spare_s`: what does not count at
    each light farther than `FAR_M` [s].
    """
    make, from_m, stands_s = vehicle.make, -to_line_m, 0.0
    for over in vehicle.leg.inner:
        signal = over.signal
        if signal is None or not signal.lamp.program.fixed:
            continue
        way_m = over.ahead_m - from_m
        fast_s = start_s + time_s(way_m, speed, make.accel, make.top)
        slow_s = start_s + _slow_s(vehicle, signal, way_m, speed)
        opens_s = signal.opens_s(now_s, fast_s, _START_S + slow_s)
        if opens_s > fast_s:
            stands_s += max(0.0, opens_s - fast_s - (spare_s if over.ahead_m > FAR_M else 0.0))
            from_m, start_s, speed = over.ahead_m, opens_s, 0.0
    return stands_s


def _least_s(vehicle: Vehicle, now_s: float) -> float:
    """Return the shortest time that a vehicle must stand inside, whenever its first light lets it go [s]."""
    make, leg = vehicle.make, vehicle.leg
    figures = [make.accel, make.top]
    for over in leg.inner:
        if over.signal is not None:
            figures += (over.ahead_m, float(over.signal.link), float(id(over.signal.lamp.program)))
    first = leg.passes[0].signal
    if first is None or not first.lamp.program.fixed or not is_at_line(leg.passes[0], leg):
        first = None
    else:
        figures += (float(first.link), float(id(first.lamp.program)))
    known, key = leg.inner[0].signal, tuple(figures)
    if known is None:
        return 0.0
    least_s = known.least_s.get(key, inf)
    if key not in known.least_s:
        for second in range(_HORIZON_S):
            start_s, past_s = float(second), second + _BEFORE_RED_S + _AS_GOOD_S
            if first is not None and first.opens_s(now_s, start_s, past_s) > start_s:
                continue
            least_s = min(least_s, _stands_s(vehicle, now_s, start_s, 0.0, 0.0, _SHORT_S))
            if least_s == 0.0:
                break
        known.least_s[key] = least_s
    return least_s


def passes_lights(vehicle: Vehicle, now_s: float) -> bool:
    """Return whether a vehicle that `light` lets go will surely pass all lights on its crossing."""
    leg = vehicle.leg
    lit = leg.inner or (leg.passes and leg.passes[0].signal is not None)
    if lit and now_s - vehicle.refused_s.get("red", inf) >= PATIENCE_S:
        return False
    for over in leg.inner:
        if over.signal is not None:
            over.signal.lamp.look(now_s)
            if over.ahead_m > FAR_M or not over.signal.lamp.program.fixed:
                return False
    return _stands_s(vehicle, now_s, 0.0, vehicle.line_m - vehicle.front_m, vehicle.speed, 0.0) == 0.0


def is_at_line(over: Pass, leg: Leg) -> bool:
    """Return whether the light of a movement stands at the stop line, and not farther on."""
    return over is leg.passes[0] and over.ahead_m <= FAR_M


def _may_pass(vehicle: Vehicle, over: Pass, signal: Signal, now_s: float) -> bool:
    """Return whether a light is open when a vehicle that sets out now gets there."""
    distance_m = vehicle.line_m - vehicle.front_m + over.ahead_m
    slow_s = _slow_s(vehicle, signal, distance_m, vehicle.speed)
    if is_at_line(over, vehicle.leg):
        spare_s = _ARROW_STOP_S if signal.next_letter(now_s) == ARROW else _BEFORE_RED_S
        return now_s + slow_s + spare_s <= signal.red_at_s(now_s)
    make = vehicle.make
    fast_s = time_s(distance_m, vehicle.speed, make.accel, make.top)
    return signal.may_be_open(now_s, fast_s, _START_S + slow_s)


def _slow_s(vehicle: Vehicle, signal: Signal, distance_m: float, speed: float) -> float:
    """Return how long a slow driver takes to a light [s]."""
    make = vehicle.make
    top = min(make.top, max(speed, signal.speed))
    return time_s(distance_m, speed, _SLOW_ACCEL * make.accel, _SLOW_SPEED * top)


class Lights(Part):
    """Lets granted vehicles pass at amber, and stops them at red if they can still brake.

    `on_red`: how often a vehicle passed a light on red. `grants`: number of grants that led past a light.
    `stood`, `stood_s`: how often, and for how long in all [s], a vehicle with a grant stood at a light.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._under_way: dict[Vehicle, None] = {}
        self._heedless: set[Vehicle] = set()
        self._refused: dict[Vehicle, tuple[float, Pass]] = {}
        """Since when each vehicle waits for green [s], and before which movement."""
        self._longest: tuple[float, Pass | None] = (0.0, None)
        self.on_red = self.grants = self.stood = 0
        self.stood_s = 0.0
        self.at_red: list[GrantedPass] = []
        """The grants over the movements behind red lights at which vehicles stand, inside their crossings."""

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._under_way.pop(vehicle, None)
        self._heedless.discard(vehicle)
        self._refused.pop(vehicle, None)

    def longest(self) -> tuple[float, Pass | None]:
        """Return the longest wait for green so far [s], and the movement before which it was."""
        now_s = self._traffic.now_s
        waits = [(now_s - since_s, over) for since_s, over in self._refused.values()]
        return max([self._longest, *waits], key=lambda one: one[0])

    def look(self, granted: Iterable[Vehicle], refused: Iterable[Vehicle] = ()) -> None:
        """Check the lights ahead of granted vehicles; call it once in each step, after all answers.

        `granted`: the vehicles that got a grant in this step. `refused`: the vehicles that were refused for a
        new reason.
        """
        now_s = self._traffic.now_s
        self.at_red.clear()
        for vehicle in granted:
            self._waits_no_more(vehicle, now_s)
            if vehicle.trips:
                self._under_way[vehicle] = None
        for vehicle in refused:
            if vehicle.reason == "red":
                lit = next(over for over in vehicle.leg.passes if over.signal is not None)
                self._refused[vehicle] = vehicle.refused_s["red"], lit
            else:
                self._waits_no_more(vehicle, now_s)
        for vehicle in list(self._under_way):
            ahead = [trip for trip in vehicle.trips if trip.over.signal is not None and not trip.lit]
            self.grants += sum(not trip.known for trip in ahead)
            while ahead and vehicle.front_m > ahead[0].light_m:
                trip = ahead.pop(0)
                trip.lit = True
                self.on_red += self._letter(trip) in RED
            for trip in ahead:
                self._look_at(trip, now_s)
            if ahead and vehicle.speed < STANDING_MPS and _stands_inside(ahead[0], now_s):
                self.at_red.append(ahead[0])
            closes = bool(ahead) and (self._traffic.gives_way or _may_close(ahead[0], now_s))
            self._tell(vehicle, closes and ahead[0].committed)
            if not ahead:
                del self._under_way[vehicle]

    def _waits_no_more(self, vehicle: Vehicle, now_s: float) -> None:
        """Note that a vehicle no longer waits for green."""
        since_s, over = self._refused.pop(vehicle, (now_s, None))
        if now_s - since_s > self._longest[0]:
            self._longest = now_s - since_s, over

    def _letter(self, trip: GrantedPass) -> str:
        """Return the letter of the light on a trip, or "" without a light."""
        signal = trip.over.signal
        if signal is None:
            return ""
        signal.lamp.look(self._traffic.now_s)
        return signal.lamp.state[signal.link]

    def _look_at(self, trip: GrantedPass, now_s: float) -> None:
        vehicle, signal = trip.vehicle, trip.over.signal
        if signal is None:
            return
        letter = signal.next_letter(now_s)
        if not trip.known:
            trip.known = True
            trip.committed = trip.over.first and trip.over.ahead_m <= FAR_M and letter != ARROW
        if letter in OPEN:
            return
        if trip.committed and _stops(vehicle, signal, trip.light_m, now_s, self._traffic.step_s):
            trip.committed = False
        if vehicle.speed < STANDING_MPS:
            self.stood_s += self._traffic.step_s
            self.stood += not trip.stood
            trip.stood = True

    def _tell(self, vehicle: Vehicle, drives_on: bool) -> None:  # noqa: FBT001  what it is told
        if drives_on != (vehicle in self._heedless):
            self._traffic.heed_lights(vehicle.name, heeds=not drives_on)
            (self._heedless.add if drives_on else self._heedless.discard)(vehicle)


def _stands_inside(trip: GrantedPass, now_s: float) -> bool:
    """Return whether a vehicle that stands is inside its crossing, before a red light.

    `trip`: its grant over the movement behind the light. The light is red now and in the next step.
    """
    signal, begins_m = trip.over.signal, trip.line_m + trip.leg.passes[0].ahead_m
    if signal is None or trip.over.first or trip.vehicle.front_m <= begins_m:
        return False
    return signal.next_letter(now_s) in RED and signal.lamp.state[signal.link] in RED


def _may_close(trip: GrantedPass, now_s: float) -> bool:
    """Return whether a light may be closed in the next step."""
    signal = trip.over.signal
    if signal is None:
        return False
    letter = signal.next_letter(now_s)
    return letter not in OPEN or (not signal.lamp.program.fixed and signal.lamp.changes_s <= now_s)


def _stops(vehicle: Vehicle, signal: Signal, light_m: float, now_s: float, step_s: float) -> bool:
    """Return whether a vehicle stops at a closed light: if it can, and might otherwise pass on red."""
    left_m = light_m - vehicle.front_m
    if left_m < braking_m(vehicle.speed, vehicle.make.decel, step_s):
        return False
    return now_s + _slow_s(vehicle, signal, left_m, vehicle.speed) > signal.red_at_s(now_s)
