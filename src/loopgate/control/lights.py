"""Traffic lights that vehicles obey: grants only into green, and what a granted vehicle does at amber.

The rule `light` lets a vehicle go if the light at its stop line is open in the next step, and if even a slow
driver passes the stop line before red by the light's program. Each further light on the crossing must be open
when the vehicle gets there. A light farther than `FAR_M` beyond the stop line does not refuse the grant; it
stops the vehicle later.

A granted vehicle is committed. It drives on at amber, like SUMO's drivers that are too near to brake. It
stops at a red light if it still can, and keeps its grant: the gate has admitted other vehicles because of
that grant. A vehicle with a grant beyond a light still obeys the light. `on_red` counts the vehicles that
pass a light on red because they could not brake.

Lights only delay. The promise of the gate holds as long as every light turns green again and again. Two
lights on one crossing need not be green together, so after `PATIENCE_S` the rule asks for green only at the
stop line.
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
"""A light farther than this beyond the stop line does not count for a grant [m]."""

PATIENCE_S: Final = 180.0
"""After so long a wait for green, only the light at the stop line refuses a vehicle [s]."""

_ARROW_STOP_S: Final = 3.0
_BEFORE_RED_S: Final = 1.0
_SLOW_ACCEL: Final = 0.6
_SLOW_SPEED: Final = 0.9
_START_S: Final = 1.0
_JUST_S: Final = 1e-3


def light(vehicle: Vehicle, now_s: float) -> Refusal | None:
    """Refuse a vehicle if a light on its crossing is closed, or closes before the vehicle is past it."""
    leg, first = vehicle.leg, True
    patient = now_s - vehicle.refused_s.get("red", inf) < PATIENCE_S
    for over in leg.passes:
        signal = over.signal
        if signal is None:
            continue
        if first and _is_at_line(over, leg) and signal.next_letter(now_s) not in OPEN:
            lamp = signal.lamp
            # A fixed program says when to ask again; others are looked at in each step.
            fixed = lamp.program.fixed and lamp.changes_s > now_s
            return Refusal("red", at_s=lamp.changes_s - _JUST_S if fixed else inf)
        first = False
        if patient and over.ahead_m <= FAR_M and not _may_pass(vehicle, over, signal, now_s):
            return Refusal("red")
    return None


def passes_lights(vehicle: Vehicle, now_s: float) -> bool:
    """Return whether a vehicle that `light` lets go will surely pass all lights on its crossing."""
    for number, over in enumerate(vehicle.leg.passes):
        signal = over.signal
        if signal is None:
            continue
        if now_s - vehicle.refused_s.get("red", inf) >= PATIENCE_S or over.ahead_m > FAR_M:
            return False
        if number > 0 and not signal.lamp.program.fixed:
            return False
    return True


def _is_at_line(over: Pass, leg: Leg) -> bool:
    """Return whether the light of a movement stands at the stop line, and not farther on."""
    return over is leg.passes[0] and over.ahead_m <= FAR_M


def _may_pass(vehicle: Vehicle, over: Pass, signal: Signal, now_s: float) -> bool:
    """Return whether a light is open when a vehicle that sets out now gets there."""
    distance_m = vehicle.line_m - vehicle.front_m + over.ahead_m
    slow_s = _slow_s(vehicle, signal, distance_m)
    if _is_at_line(over, vehicle.leg):
        spare_s = _ARROW_STOP_S if signal.next_letter(now_s) == ARROW else _BEFORE_RED_S
        return now_s + slow_s + spare_s <= signal.red_at_s(now_s)
    make = vehicle.make
    fast_s = time_s(distance_m, vehicle.speed, make.accel, make.top)
    return signal.may_be_open(now_s, fast_s, _START_S + slow_s)


def _slow_s(vehicle: Vehicle, signal: Signal, distance_m: float) -> float:
    """Return how long a slow driver takes to a light [s]."""
    make = vehicle.make
    top = min(make.top, max(vehicle.speed, signal.speed))
    return time_s(distance_m, vehicle.speed, _SLOW_ACCEL * make.accel, _SLOW_SPEED * top)


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
    return now_s + _slow_s(vehicle, signal, left_m) > signal.red_at_s(now_s)
