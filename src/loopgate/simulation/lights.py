"""Traffic lights that are obeyed: grants only into green, and what is held through a red all the same."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loopgate.abstraction.itinerary import Itinerary, Leg
from loopgate.drive.driver import Driver
from loopgate.drive.motion import time_s
from loopgate.gates import Reason
from loopgate.network import RoadNetwork
from loopgate.network.records import Connection
from loopgate.simulation.timetable import Timetable
from loopgate.traffic.base import Traffic

__all__ = ["Lights", "Signal", "signals_of"]

_LONG_RED_S = 300.0
"""A red this long is worth a warning [s]."""

_PATIENCE_S = 180.0
"""After this long a vehicle with green before it no longer waits for the lights further on its crossing, nor
for a green that lasts until it is there [s]: lights that are never green together would keep it for ever."""

_STANDING_MPS = 0.1

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
            found.append(Signal(movement.id, light, link, crossing.ahead_m, speed_mps, at_line=not number))
    return tuple(found)


@dataclass(slots=True)
class _Passage:
    """A vehicle that was let go towards a light: its way is clear, so only the light can stop it there."""

    driver: Driver
    signal: Signal
    line_m: float
    stands: bool = False


class Lights:
    """An obstacle: no grant but into green.

    A request is refused unless the light at its line is green, and stays so until the vehicle is there, as
    far as the light's program tells; where a crossing leads over several lights, each has to be green when
    the vehicle gets to it. A light that follows the traffic may turn early all the same, and a vehicle may
    be slower than counted on. It then keeps what it was granted while it stands at the red: the gate knew it
    there when it admitted others, so taking it back could undo what was promised to them. How often that
    happens is counted.

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
        self._longest = (0.0, "", "")
        self._grants = 0
        self._stood = 0
        self._stood_s = 0.0

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
        if now_s - since > self._longest[0]:
            self._longest = now_s - since, signals[0].movement, signals[0].light
        return Reason.RED

    def _behind(self, driver: Driver, leg: int) -> Sequence[Signal]:
        return self._signals[driver.track.loop][leg % len(driver.track.legs)]

    def _lets_pass(self, driver: Driver, signals: Sequence[Signal], *, patient: bool) -> bool:
        opens = self._timetable
        first = signals[0]
        if first.at_line and not opens.is_open(first.light, first.link):
            return False
        if not patient:
            return True
        speed = driver.speed_mps
        to_end_m = driver.line_m - driver.front_m
        for signal in signals:
            distance_m = to_end_m + signal.ahead_m
            top = min(driver.top_mps, max(speed, signal.speed_mps))
            slow_s = _START_S + time_s(distance_m, speed, _SLOW_ACCEL * driver.accel_mps2, _SLOW_SPEED * top)
            fast_s = 0.0
            if not signal.at_line:
                fast_s = time_s(distance_m, speed, driver.accel_mps2, driver.top_mps)
            if not opens.may_be_open(signal.light, signal.link, fast_s, slow_s):
                return False
        return True

    def granted(self, robot: int) -> None:
        """Take note that `robot` sets out."""
        driver = self._drivers[robot]
        self._red_since.pop(driver.id, None)
        for signal in self._behind(driver, driver.granted - 1):
            self._grants += 1
            line_m = driver.line_m + signal.ahead_m
            self._under_way.append(_Passage(driver, signal, line_m))

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return nobody: a light turns by itself."""
        del robot
        return ()

    def look(self) -> None:
        """Count the vehicles that stand at a red with a grant; call once per step.

        O(vehicles between a grant and the line of a light).
        """
        if not self._under_way:
            return
        still: list[_Passage] = []
        for passage in self._under_way:
            driver, signal = passage.driver, passage.signal
            if driver.front_m > passage.line_m:
                continue
            still.append(passage)
            standing = driver.speed_mps < _STANDING_MPS
            if standing and not self._timetable.is_open(signal.light, signal.link):
                self._stood_s += self._traffic.step_s
                if not passage.stands:
                    passage.stands = True
                    self._stood += 1
        self._under_way = still

    def figures(self) -> dict[str, Any]:
        """Return what ``summary.json`` says of lights that are obeyed."""
        return {
            "grants": self._grants,
            "stood": self._stood,
            "stood_s": round(self._stood_s, 3),
            "longest_red_s": round(self._longest[0], 3),
            "longest_red_at": self._longest[1],
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
        seconds, movement, light = self._longest
        if seconds > _LONG_RED_S and not lines:
            lines.append(
                f"lights: a vehicle waited {seconds:.0f} s for green at movement {movement} (light {light})"
            )
        return lines
