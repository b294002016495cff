"""Detects vehicles that starve: they get no grant for long, because a vehicle ahead stands."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import inf
from typing import Any

from loopgate.arrays import Floats
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.drive import Drive
from loopgate.traffic.base import Traffic

__all__ = ["Sink", "StarvationWatch"]

_PASSED_M = 100.0
"""A vehicle that drives this far on one grant does not starve: its place is long [m]."""

_STANDS = 0.5
"""The last vehicle ahead counts as the cause if it has stood for this share of the starvation time."""

_SURELY = 0.05
"""A cause is reported after it was found for this share of the starvation time.

A vehicle that has just become first in line also waits for no other vehicle for a moment."""

_AT_GATES = 3.0
"""Without a cause, the queue may only be slow: it is reported after this many times the starvation time."""


@dataclass(slots=True)
class Sink:
    """A vehicle that stands, and the vehicles that starve behind it.

    Attributes
    ----------
    vehicle, lane, why
        The vehicle that stands, its lane, and the reason. If no such vehicle was found, `vehicle` is empty
        and `why` is the gate's reason.
    noticed_s, until_s
        Times when vehicles were first and last found starving behind the vehicle [s].
    victims
        All vehicles that starved behind the vehicle.
    """

    vehicle: str
    lane: str
    why: str
    noticed_s: float
    until_s: float
    victims: set[str]

    def figures(self) -> dict[str, Any]:
        """Return the facts about this vehicle for ``summary.json``."""
        return {
            "behind": self.vehicle,
            "lane": self.lane,
            "why": self.why,
            "noticed_s": self.noticed_s,
            "until_s": self.until_s,
            "vehicles": sorted(self.victims),
        }


def _unknown(_: str) -> str:
    return ""


class StarvationWatch:
    """Checks all gated vehicles at intervals, and reports vehicles that starve.

    A vehicle starves if it has had no grant for `after_s`, has driven less than 100 m in that time, and is
    not at a stop of its own. The watch follows from each vehicle to the vehicle that it waits for: the first
    in line in its place, then a vehicle that keeps that one from a grant, and so on. The last vehicle, which
    waits for no other, is the vehicle behind which it starves.

    Parameters
    ----------
    drive, traffic, recorder
        The drive, the running simulation, and the recorder of an event for each vehicle.
    after_s
        Time without a grant after which a vehicle starves [s].
    stands, reason
        Functions that return why a vehicle stands by itself, and why it stands at all; empty if not known.
    """

    def __init__(
        self,
        drive: Drive,
        traffic: Traffic,
        recorder: Recorder,
        *,
        after_s: float = 600.0,
        stands: Callable[[str], str] = _unknown,
        reason: Callable[[str], str] = _unknown,
    ) -> None:
        self._drive, self._traffic, self._after_s = drive, traffic, after_s
        self._recorder = recorder
        self._stands, self._reason = stands, reason
        self._seen: dict[str, tuple[int, float, float]] = {}
        """For each vehicle, its last grant, its odometer then [m], and the time [s]."""
        self._stood: dict[str, tuple[float, float]] = {}
        """For each vehicle, its odometer when it last moved [m], and the time when that was seen [s]."""
        self._alone: dict[str, float] = {}
        """For each vehicle found as a cause, since when every check has found it [s]."""
        self.sinks: dict[tuple[str, str], Sink] = {}
        """All causes found so far, by vehicle and reason."""

    def check(self, *, deadlocked: bool = False) -> None:
        """Check all vehicles; call every few seconds. O(vehicles)."""
        if deadlocked:
            return  # the deadlock explains which vehicle waits for which
        now = self._traffic.now_s
        ids, at_m = self._drive.odometers()
        starving = self._look(ids, at_m, now)
        for known in (self._seen, self._stood):  # forget vehicles that have left
            for vehicle in known.keys() - set(ids):
                del known[vehicle]
        behind = {
            vehicle: self._behind(vehicle, len(ids), now)
            for vehicle in starving
            if not self._stands(vehicle) and not self._traffic.at_own_stop(vehicle)
        }
        self._alone = {head: self._alone.get(head, now) for head, _ in behind.values() if head}
        for vehicle, (head, why) in behind.items():
            since_s, for_s = (self._alone[head], _SURELY) if head else (self._seen[vehicle][2], _AT_GATES)
            if now - since_s < for_s * self._after_s:
                continue
            lane = self._traffic.lane(head)[0] if head else ""
            sink = self.sinks.setdefault((head, why), Sink(head, lane, why, now, now, set()))
            sink.until_s = now
            if vehicle not in sink.victims:
                sink.victims.add(vehicle)
                self._recorder.note(now, vehicle, Event.STARVE, self._drive.wanted(vehicle), head or why)

    def _look(self, ids: Iterable[str], at_m: Floats, now: float) -> list[str]:
        """Store grants and distances; return the vehicles that have had neither for long."""
        long = []
        for vehicle, metres, leg in zip(ids, at_m.tolist(), self._drive.granted().tolist(), strict=True):
            last, from_m, since_s = self._seen.get(vehicle, (-1, 0.0, now))
            if leg != last or metres - from_m > _PASSED_M:
                self._seen[vehicle] = leg, metres, now
            elif now - since_s >= self._after_s:
                long.append(vehicle)
            if abs(metres - self._stood.get(vehicle, (-inf, now))[0]) > 0.5:  # noqa: PLR2004  it moved
                self._stood[vehicle] = metres, now
        return long

    def _behind(self, vehicle: str, everybody: int, now: float) -> tuple[str, str]:
        """Return the vehicle that stands ahead of a starving vehicle, and why it stands."""
        queue, seen = deque([vehicle]), {vehicle}
        while queue:
            one = queue.popleft()
            ahead = [] if self._stands(one) else self._drive.waits_behind(one)
            if len(ahead) >= everybody - 1 > 1:
                continue  # the gate refuses it because of all vehicles together
            if not ahead and now - self._stood[one][1] >= _STANDS * self._after_s:
                return one, self._why(one)
            fresh = [other for other in ahead if other not in seen]
            seen.update(fresh)
            queue.extend(fresh)
        return "", self._drive.reason(vehicle) or "queue"

    def _why(self, vehicle: str) -> str:
        """Return why a vehicle stands that waits for no other gated vehicle."""
        if known := self._reason(vehicle):
            return known
        if self._traffic.at_own_stop(vehicle):
            return "stop"
        if self._drive.asks(vehicle) and (reason := self._drive.reason(vehicle)):
            return reason
        return "light" if self._traffic.faces_red(vehicle) else "no reason known"
