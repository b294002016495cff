"""Traffic lights that are obeyed: grants only into green, and what is held through a red all the same."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from loopgate.abstraction.itinerary import Itinerary, Leg
from loopgate.drive.driver import Driver
from loopgate.drive.motion import time_s
from loopgate.drive.sense import STANDING_MPS, braking_m
from loopgate.gates import Reason
from loopgate.network import RoadNetwork
from loopgate.network.records import Connection
from loopgate.simulation.around.timetable import Timetable
from loopgate.traffic.base import Traffic

__all__ = ["Lights", "Signal", "signals_of"]

_LONG_RED_S = 300.0
"""A red this long is worth a warning [s]."""

_PATIENCE_S = 180.0
"""After this long a vehicle with green before it no longer waits for the lights further on its crossing, nor
for a green that lasts until it is there [s]: lights that are never green together would keep it for ever."""

_FAR_M = 50.0
"""A light farther than this from where vehicles are held is of no account to one that sets out
there [m]: it is too early to tell, and an actuated one waits for somebody to come near."""

_RED = frozenset("ru")

_BEFORE_RED_S = 1.0
"""So long before red a slow driver has to be over the line for a grant [s]."""

_ARROW, _ARROW_STOP_S = "s", 3.0
"""SUMO's letter for a green arrow, before which a vehicle stops first, and the time that this takes [s]."""

_SLOW_ACCEL, _SLOW_SPEED, _START_S = 0.6, 0.9, 1.0
"""Drivers dawdle: what share of their acceleration and of the speed limit is counted on to reach a line in
time, and the time to get going [s]."""


@dataclass(frozen=True, slots=True)
class Signal:
    """A light on the way over a crossing.

    Attributes
    ----------
    movement
        The movement over the junction.
    light, link
        SUMO's name of the light and the number of its link.
    ahead_m
        How far its stop line is after the ``end_m`` of the leg before the crossing [m].
    speed_mps
        Lowest speed limit on the movement.
    at_line
        Whether it stands where the vehicle is held, and not farther on.
    """

    movement: str
    light: str
    link: int
    ahead_m: float
    speed_mps: float
    at_line: bool = True


Signals = Mapping[str, tuple[tuple[Signal, ...], ...]]
"""By loop, then position: the lights on the crossings that follow the leg, in driving order."""


class _Red(NamedTuple):
    """How long a vehicle waits for green, as far as can be known, since when [s], and before which light."""

    waited_s: float = 0.0
    since_s: float = 0.0
    signal: Signal | None = None


def signals_of(network: RoadNetwork, itineraries: Sequence[Itinerary]) -> Signals:
    """Find the lights on the crossings of all loops."""
    movements = {movement.id: movement for movement in network.connections}
    loops = {itinerary.loop: itinerary for itinerary in itineraries}
    return {
        name: tuple(_signals(network, movements, leg) for leg in itinerary.legs)
        for name, itinerary in loops.items()
    }


def _signals(network: RoadNetwork, movements: Mapping[str, Connection], leg: Leg) -> tuple[Signal, ...]:
    found: list[Signal] = []
    for number, crossing in enumerate(leg.crossings):
        movement = movements.get(crossing.id)
        if movement is not None and movement.signal is not None:
            light, link = movement.signal
            speed_mps = min((network.lanes[lane].speed_mps for lane in movement.via), default=math.inf)
            at_line = not number and crossing.ahead_m <= _FAR_M
            found.append(Signal(movement.id, light, link, crossing.ahead_m, speed_mps, at_line))
    return tuple(found)


def _slow_s(driver: Driver, signal: Signal, distance_m: float) -> float:
    """Return how long a slow driver takes to a light [s]."""
    top_mps = min(driver.top_mps, max(driver.speed_mps, signal.speed_mps))
    return time_s(distance_m, driver.speed_mps, _SLOW_ACCEL * driver.accel_mps2, _SLOW_SPEED * top_mps)


@dataclass(slots=True)
class _Passage:
    """A vehicle that was let go towards a light: its way is clear, so only the light can stop it there.

    `leg` is that which it was granted; the driver is another one when others have joined or left.
    """

    driver: Driver
    signal: Signal
    leg: int
    line_m: float
    stands: bool = False
    committed: bool = False
    was_open: bool = False


class Lights:
    """An obstacle: no grant but into green.

    A request is granted if the light at its line is open in the next step and even a slow driver is over the
    line before it is red, as far as the light's program tells; where a crossing leads over several lights,
    each of the others has to be green when the vehicle gets to it; but a light far ahead, as where nobody may
    wait on much of a road, only stops it there. Who was granted that is *committed*, as
    SUMO's own drivers are who are too near to brake: it drives on at amber. It stops for a red all the same
    if it still can; it then keeps what it was granted while it stands there: the gate knew it there when it
    admitted others, so taking it back could undo what was promised to them. What it was granted beyond such a
    light is no reason to drive on there: the first light before it is what counts. How often vehicles stand
    so, and how often one crosses its line on red since it could not brake, is counted.

    Lights only delay, so what the gate promises holds as long as every light turns green again and again.
    Two lights on one crossing need not be green together for that: after a while only the first one counts.

    Parameters
    ----------
    traffic
        The running simulation.
    drivers
        Of all robots: their grants, and where they are.
    signals
        From `signals_of`.
    timetable
        What the lights show.
    """

    heeds_grants = False

    def __init__(
        self,
        traffic: Traffic,
        drivers: Sequence[Driver],
        signals: Signals,
        timetable: Timetable,
    ) -> None:
        self._traffic = traffic
        self._drivers = drivers
        self._signals = signals
        self._timetable = timetable
        self._red_since: dict[str, float] = {}
        self._under_way: list[_Passage] = []
        self._told: set[str] = set()
        """The vehicles that drive on whatever the light before them shows, as SUMO knows."""
        self._longest = _Red()
        self._grants = 0
        self._stood = 0
        self._stood_s = 0.0
        self._on_red = 0

    def in_the_way(self, robot: int) -> Reason | None:
        """Return RED unless every light on the crossing before `robot` lets it pass, and in time."""
        driver = self._drivers[robot]
        signals = self._behind(driver, driver.granted)
        if not signals:
            return None
        now_s = self._traffic.now_s
        since = self._red_since.get(driver.id)
        if self._lets_pass(driver, signals, patient=since is None or now_s - since < _PATIENCE_S):
            return None
        if since is None:
            since = self._red_since[driver.id] = now_s
        until_s, first = now_s, signals[0]
        if first.at_line:
            showing = self._timetable.next(first.light, first.link)
            if not showing.is_open:
                driver.row["red_until_s"] = showing.until_s
                # It is not asked about before that.
                until_s = max(now_s, showing.until_s - self._traffic.step_s)
        if until_s - since > self._longest.waited_s:
            self._longest = _Red(until_s - since, since, first)
        return Reason.RED

    def _longest_s(self) -> float:
        """Return the longest wait for green so far [s]."""
        return max(0.0, min(self._longest.waited_s, self._traffic.now_s - self._longest.since_s))

    def _behind(self, driver: Driver, leg: int) -> Sequence[Signal]:
        return self._signals[driver.track.loop][leg % len(driver.track.legs)]

    def _lets_pass(self, driver: Driver, signals: Sequence[Signal], *, patient: bool) -> bool:
        opens = self._timetable
        first = signals[0]
        if first.at_line and not opens.next(first.light, first.link).is_open:
            return False
        speed = driver.speed_mps
        to_end_m = driver.line_m - driver.front_m
        for signal in signals:
            if signal.ahead_m > _FAR_M:
                continue
            distance_m = to_end_m + signal.ahead_m
            slow_s = _slow_s(driver, signal, distance_m)
            if signal.at_line:
                showing = opens.next(signal.light, signal.link)
                spare_s = _ARROW_STOP_S if showing.letter == _ARROW else _BEFORE_RED_S
                may_pass = self._traffic.now_s + slow_s + spare_s <= showing.red_at_s
            else:
                fast_s = time_s(distance_m, speed, driver.accel_mps2, driver.top_mps)
                may_pass = opens.may_be_open(signal.light, signal.link, fast_s, _START_S + slow_s)
            if patient and not may_pass:
                return False
        return True

    def granted(self, robot: int) -> None:
        """Take note that `robot` sets out."""
        driver = self._drivers[robot]
        self._red_since.pop(driver.id, None)
        for signal in self._behind(driver, driver.granted - 1):
            self._grants += 1
            letter = self._timetable.next(signal.light, signal.link).letter
            committed = signal.at_line and letter != _ARROW
            line_m = driver.line_m + signal.ahead_m
            self._under_way.append(_Passage(driver, signal, driver.granted, line_m, committed=committed))
        self._tell_of_first()

    def _tell_of_first(self) -> None:
        """Let SUMO know who drives on whatever the first light before it shows."""
        first: dict[str, bool] = {}
        for passage in self._under_way:
            first.setdefault(passage.driver.id, passage.committed)
        for vehicle in sorted(self._told - first.keys()):
            first[vehicle] = False
        for vehicle, committed in first.items():
            if committed != (vehicle in self._told):
                (self._told.add if committed else self._told.discard)(vehicle)
                self._traffic.heed_lights(vehicle, heeds=not committed)

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return nobody: a light turns by itself."""
        del robot
        return ()

    def look(self) -> None:
        """Let vehicles stop for a red if they can, and count those who stand at one; call once per step.

        O(vehicles) while any is between a grant and the line of a light.
        """
        if not self._under_way:
            return
        here = {driver.id: driver for driver in self._drivers}
        still: list[_Passage] = []
        for passage in self._under_way:
            driver, signal = here.get(passage.driver.id), passage.signal
            if driver is None or driver.granted < passage.leg:  # it has left, or has joined anew
                self._told.discard(passage.driver.id)
                continue
            passage.driver = driver
            showing = self._timetable.next(signal.light, signal.link)
            if driver.front_m > passage.line_m:
                self._on_red += self._timetable.shows(signal.light, signal.link) in _RED
                continue
            still.append(passage)
            if passage.was_open and not showing.is_open and self._stops(passage, showing.red_at_s):
                passage.committed = False
            passage.was_open |= showing.is_open
            if driver.speed_mps < STANDING_MPS and not showing.is_open:
                self._stood_s += self._traffic.step_s
                if not passage.stands:
                    passage.stands = True
                    self._stood += 1
        self._under_way = still
        self._tell_of_first()

    def _stops(self, passage: _Passage, red_at_s: float) -> bool:
        """Return whether a vehicle whose light has closed can still stop, and may be late if it does not."""
        driver = passage.driver
        left_m = passage.line_m - driver.front_m
        if left_m < braking_m(driver.speed_mps, float(driver.row["decel"]), self._traffic.step_s):
            return False
        return self._traffic.now_s + _slow_s(driver, passage.signal, left_m) > red_at_s

    def figures(self) -> dict[str, Any]:
        """Return what ``summary.json`` says of lights that are obeyed."""
        return {
            "grants": self._grants,
            "stood": self._stood,
            "stood_s": round(self._stood_s, 3),
            "on_red": self._on_red,
            "longest_red_s": round(self._longest_s(), 3),
            "longest_red_at": self._longest.signal.movement if self._longest.signal else "",
        }

    def warnings(self) -> list[str]:
        """Return lines about lights on the loops that never or rarely turn green."""
        used = {
            (signal.light, signal.link): signal.movement
            for legs in self._signals.values()
            for signals in legs
            for signal in signals
        }
        never, rarely = [], []
        for (light, link), movement in used.items():
            closed_s = self._timetable.longest_closed_s(light, link)
            if not self._timetable.ever_open(light, link):
                never.append(f"{movement} (light {light})")
            elif closed_s > _LONG_RED_S:
                rarely.append(f"{movement} (light {light}, red for {closed_s:.0f} s on end)")
        lines = []
        if never:
            lines.append(
                f"lights: {len(never)} of {len(used)} movements with a light never get green in its program, "
                f"first {never[0]}: vehicles wait there for ever, which is no deadlock; try --lights off"
            )
        if rarely:
            lines.append(
                f"lights: {len(rarely)} of {len(used)} movements with a light stay red for more than "
                f"{_LONG_RED_S:.0f} s, first {rarely[0]}: what stands there is no deadlock; try --lights off"
            )
        seconds, signal = self._longest_s(), self._longest.signal
        if signal is not None and seconds > _LONG_RED_S and not lines:
            lines.append(
                f"lights: a vehicle waited {seconds:.0f} s for green at movement {signal.movement} "
                f"(light {signal.light})"
            )
        return lines
