"""Gated vehicles give way to ordinary ones before junctions, never inside them."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from loopgate.drive.driver import Driver
from loopgate.drive.engine import Engine
from loopgate.drive.motion import time_s
from loopgate.drive.sense import MARGIN_M, STANDING_MPS, braking_m, safe_mps
from loopgate.drive.timetable import Timetable
from loopgate.simulation.around.coming import Arrival, Coming
from loopgate.simulation.around.crossing_ways import Movement, Way
from loopgate.simulation.around.sight import BEYOND_M, Sight
from loopgate.traffic.base import Traffic

__all__ = ["Yielding"]

_AT_LINE_M = 5.0
"""So far before its line a vehicle may stand that is about to set out [m]."""

_SHORT_OF_M = 0.5
"""So far before a junction a vehicle comes to rest that is kept out of it [m]."""

_MOST_KEPT_S = 60.0
"""After this time it is SUMO's right of way alone that says when it goes on [s]."""

_SETS_OUT_S = 5.0
"""A vehicle that stands in the queue at a line for longer, and may set out, waits for something else [s]."""

_PASSED_S = 2.0
"""Time in which an ordinary vehicle with the right of way is over the junction once it is there [s]."""

_HELD_UP_S = 5.0
"""A vehicle that stands at its line so long with nobody in its way waits for one with its own grant [s]."""

_APART_S = 1.0
"""Time to spare between a gated vehicle leaving and one with the right of way getting there [s]."""

_FIGURES = ("speed", "top", "accel", "decel")


class _Going(NamedTuple):
    """A vehicle with a grant, what the table says of it, and what is before it.

    Attributes
    ----------
    driver, ahead
        The vehicle, and its next movements: how far it is before each, and before where it may stand [m].
    speed_mps, top_mps, accel_mps2, decel_mps2
        Its speed and its top speed [m/s], acceleration and deceleration [m/s2].
    """

    driver: Driver
    ahead: Sequence[tuple[Movement, float, float]]
    speed_mps: float
    top_mps: float
    accel_mps2: float
    decel_mps2: float


class Yielding:
    """Tells whether somebody comes, and keeps vehicles that have their grants out of junctions meanwhile.

    SUMO lets who turns across others wait for them inside the junction, where they drive by so near that
    bodies touch; and of ways that touch though they are no foes it knows nothing. So a vehicle is slowed
    down before a junction as long as it can still stop there, and does not set out from one, while somebody
    is in its way or comes. What comes later is SUMO's to sort out, as it is after a minute; but who drove in
    when nobody came does not wait inside, in the way of one that departs just then and can still stop.
    Nor does it wait for ever before its line for another gated one: where lights are off SUMO lets each of
    two wait for the other whose ways do not even touch.

    Parameters
    ----------
    traffic
        The running simulation.
    engine
        Drives the gated vehicles: their grants, and where they are.
    ways
        By loop, then position.
    timetable
        What the lights show.
    sight, coming
        Where ordinary vehicles are, and who gets to which junction when.
    """

    def __init__(
        self,
        traffic: Traffic,
        engine: Engine,
        ways: Mapping[str, Sequence[Way]],
        timetable: Timetable,
        sight: Sight,
        coming: Coming,
    ) -> None:
        self._traffic, self._engine, self._ways = traffic, engine, ways
        self._timetable, self._sight, self._coming = timetable, sight, coming
        self._looked = False
        """Whether it has been seen who comes now."""
        self._since_s: dict[str, float] = {}
        """Since when vehicles with grants are before a junction with somebody in their way [s]."""
        self._kept: dict[str, float] = {}
        """How fast those of them may drive that are kept [m/s]; by name, as numbers change."""
        self._clear: dict[str, Movement] = {}
        """For whom nobody came when it was looked last, and on which movement, until they are past it."""
        self._first: set[str] = set()
        """The ones of them inside the junction, where they would be in the way if they waited."""
        self._standing_s: dict[str, float] = {}
        """Since when vehicles with grants stand at their lines with nobody in their way [s]."""
        self._freed: dict[str, Movement] = {}
        """Vehicles that did for too long: they go without giving way until they are past that movement."""
        self._may_set_out: dict[str, tuple[float, float]] = {}
        """Since when ordinary vehicles stand at their lines though they may drive, and were seen so last."""

    def look_around(self) -> None:
        """See who comes now."""
        if self._sight.look():
            self._looked = False

    def look(self) -> None:
        """Keep those out of the next junction who can stop before it and must not drive into it."""
        self.look_around()
        now, since_s, self._since_s = self._traffic.now_s, self._since_s, {}
        kept: dict[str, float] = {}
        first: set[str] = set()
        clear, self._clear = self._clear, {}
        freed, self._freed = self._freed, {}
        standing_s, self._standing_s = self._standing_s, {}
        for one in self._going({*since_s, *clear, *freed, *standing_s}):
            name = one.driver.id
            if name in clear:
                self._go_on(one, clear[name], first)
            speed = self._speed(one, before=name in since_s)
            if speed is None:
                if self._is_free(one, freed.get(name), standing_s.get(name, now)):
                    first.add(name)
                continue
            self._since_s[name] = since_s.get(name, now)
            if now - self._since_s[name] < _MOST_KEPT_S:
                kept[name] = speed
        here = self._engine.driver_of.keys()
        for vehicle in sorted((self._kept.keys() | kept) & here):
            if self._kept.get(vehicle) != kept.get(vehicle):
                self._traffic.keep_to(vehicle, kept.get(vehicle))
        self._kept = kept
        for vehicle in sorted((self._first ^ first) & here):
            self._traffic.give_way(vehicle, gives=vehicle not in first)
        self._first = first

    def _going(self, noted: Container[str]) -> Iterator[_Going]:
        """Yield those with grants that they have not driven by, and that are not steered.

        Without those that nothing is done about, unless they are `noted`: who could still stop before the
        first junction when it is looked next, or comes to one where nobody is in its way. All of them are
        looked at at once, since a figure of one alone takes ten times as long.
        """
        v, step_s = self._engine.vehicles, self._traffic.step_s
        robots = np.flatnonzero((v["crossed"] < v["granted"]) & ~v["steered"])
        crossed, speed, top, accel, decel = (v[name][robots] for name in ("crossed", *_FIGURES))
        laps, leg = np.divmod(crossed, v["legs"][robots])
        end_m = cast("Any", self._engine.tables.legs)["end_m"][v["leg_at"][robots] + leg]
        left_m = laps * v["lap_m"][robots] + end_m - v["front"][robots]
        fast = np.minimum(top, speed + accel * step_s)
        late_m = fast * step_s + fast * fast / (2 * decel) + MARGIN_M + _SHORT_OF_M
        soon = left_m < np.maximum(late_m, 2 * _AT_LINE_M)
        columns = crossed, v["granted"][robots], speed, top, accel, decel
        rows = zip(
            robots.tolist(), soon.tolist(), left_m.tolist(), *(c.tolist() for c in columns), strict=True
        )
        for robot, is_soon, line_m, first, granted, *figures in rows:
            driver = self._engine.drivers[robot]
            is_noted = driver.id in noted
            if is_soon or is_noted:
                one = _Going(driver, self._ahead(driver, first, granted, line_m), *figures)
                if is_noted or self._matters(one):
                    yield one

    def _matters(self, one: _Going) -> bool:
        """Return whether a vehicle stands before its next movement, or may not have that to itself."""
        movement = next((movement for movement, left_m, _ in one.ahead if left_m >= -BEYOND_M), None)
        if movement is None:
            return False
        return one.speed_mps < STANDING_MPS or movement.waits_in_way or not self.is_quiet(movement)

    def _ahead(
        self, driver: Driver, crossed: int, granted: int, line_m: float
    ) -> list[tuple[Movement, float, float]]:
        """Return the movements before a vehicle, whose line is so far ahead; see `_Going`."""
        ways, ahead = self._ways[driver.track.loop], []
        for leg in range(crossed, granted):
            if leg > crossed:
                line_m = driver.end_m(leg) - driver.front_m
            for number, movement in enumerate(ways[leg % len(ways)].movements):
                left_m = line_m + movement.from_m
                ahead.append((movement, left_m, left_m if number else line_m))
        return ahead

    def _go_on(self, one: _Going, clear: Movement, first: set[str]) -> None:
        """Take note of one that drives onto a clear movement, as long as it could have to wait there."""
        for movement, left_m, _ in one.ahead:
            if movement is clear and left_m > -movement.wait_m:
                self._clear[one.driver.id] = movement
                if left_m < 0.0 and not self._is_late(movement):
                    first.add(one.driver.id)

    def _is_free(self, one: _Going, freed: Movement | None, since_s: float) -> bool:
        """Return whether a vehicle goes on without giving way, as nobody is in its way who has no grant."""
        for movement, left_m, line_m in one.ahead:
            if left_m < -movement.length_m:
                continue
            goes = movement is freed
            if left_m >= 0.0 and line_m <= _AT_LINE_M and one.speed_mps < STANDING_MPS:
                self._standing_s[one.driver.id] = since_s
                goes |= self._traffic.now_s - since_s >= _HELD_UP_S
            if goes and not self._is_late(movement):
                self._freed[one.driver.id] = movement
                return True
            return False
        return False

    def _is_late(self, movement: Movement) -> bool:
        """Return whether somebody comes who cannot stop any more."""
        self.look_around()
        return any(arrival.near for arrival in self._comers(movement))

    def _speed(self, one: _Going, *, before: bool) -> float | None:
        """Return how fast a vehicle may drive that is to be kept out of a junction [m/s]; else None."""
        for movement, left_m, line_m in one.ahead:
            if left_m < -BEYOND_M:
                continue
            if one.speed_mps < STANDING_MPS:
                return 0.0 if line_m <= _AT_LINE_M and self._is_closed(one, movement, left_m) else None
            return self._slowed(one, movement, left_m, before=before)
        return None

    def _slowed(self, one: _Going, movement: Movement, left_m: float, *, before: bool) -> float | None:
        """Return how fast a vehicle may drive that is under way to a junction [m/s]; None for at will."""
        speed, decel, step_s = one.speed_mps, one.decel_mps2, self._traffic.step_s
        room_m = max(0.0, left_m - _SHORT_OF_M)
        fast = min(one.top_mps, speed + one.accel_mps2 * step_s)
        late = room_m < fast * step_s + braking_m(fast, decel, step_s) + MARGIN_M
        if not (late or before) or left_m < braking_m(speed, decel, step_s):
            return None
        return safe_mps(room_m, decel, step_s) if self._is_closed(one, movement, left_m) else None

    def _is_closed(self, one: _Going, movement: Movement, left_m: float) -> bool:
        """Return whether somebody is in the way of a vehicle that is so far before a junction, or comes."""
        waits = movement.wait_m > 0.0 or one.speed_mps < STANDING_MPS
        inside = self._sight.across(movement, movement.across if waits else movement.unseen)
        closed = bool(inside) or self.comes(one.driver, movement, left_m)
        self._clear.pop(one.driver.id, None)
        if movement.waits_in_way and not closed:
            self._clear[one.driver.id] = movement
        return closed

    def comes(self, driver: Driver, movement: Movement, left_m: float) -> bool:
        """Return whether somebody would get in the way of one that is so far before a junction."""
        comers = self._comers(movement)
        if not comers:
            return False
        speed, accel = driver.speed_mps, driver.accel_mps2
        top = min(driver.top_mps, movement.speed_mps)
        there_s = time_s(left_m, speed, accel, top)
        over_s = time_s(left_m + movement.wait_m, speed, accel, top) + _APART_S
        gained = math.sqrt(speed * speed + 2 * accel * max(0.0, left_m))
        going = 0.0 if movement.wait_m else min(top, gained)  # who may have to wait sets out from there
        over_s += time_s(movement.length_m - movement.wait_m + driver.length_m, going, accel, top)
        return any(
            arrival.last_s > there_s - _PASSED_S
            and arrival.first_s < over_s
            and (not arrival.stands or self._sets_out(arrival.stands))
            for arrival in comers
        )

    def _comers(self, movement: Movement) -> list[Arrival]:
        """Return who comes on the ways across a movement whose lights are open."""
        comers: list[Arrival] = []
        if self._expects(movement):
            for approach in movement.approaches:
                if approach.signal is None or self._timetable.is_open(*approach.signal):
                    comers += self._coming.arrivals(approach.from_edge, approach.to_edge)
        return comers

    def _expects(self, movement: Movement) -> bool:
        if not self._looked:
            self._looked = True
            self._coming.look()
        return self._coming.expects(movement.between)

    def is_quiet(self, movement: Movement) -> bool:
        """Return whether nobody is across a movement, and nobody on any way to it."""
        return self._sight.busy.isdisjoint(movement.across) and not self._expects(movement)

    def _sets_out(self, vehicle: str) -> bool:
        """Return whether one that stands at its line, and may drive, is about to set out."""
        now = self._traffic.now_s
        since_s, seen_s = self._may_set_out.get(vehicle, (now, now))
        if now - seen_s > _SETS_OUT_S:
            since_s = now
        self._may_set_out[vehicle] = since_s, now
        return now - since_s < _SETS_OUT_S
