"""Figures of obeyed lights: how often vehicles stood at them, and which lights never turn green."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from loopgate.abstraction.itinerary import Itinerary
from loopgate.drive.engine import Engine
from loopgate.drive.timetable import Signal, Timetable
from loopgate.network import RoadNetwork

__all__ = ["Lights", "signals_of"]

_LONG_RED_S = 300.0
"""A red this long is worth a warning [s]."""


def signals_of(network: RoadNetwork) -> list[Signal]:
    """Return the signals of a network's lights for its movements."""
    found = []
    for movement in network.connections:
        if movement.signal is not None:
            speed_mps = min((network.lanes[lane].speed_mps for lane in movement.via), default=math.inf)
            found.append(Signal(movement.id, *movement.signal, speed_mps))
    return found


class Lights:
    """Tells of lights that the vehicles of an engine obey (`loopgate.drive.lights`).

    Parameters
    ----------
    engine
        Drives the vehicles.
    timetable
        What the lights show.
    """

    def __init__(self, engine: Engine, timetable: Timetable) -> None:
        self._engine, self._timetable = engine, timetable
        self._used: dict[tuple[str, int], str] = {}
        """Movements on the loops by light and link."""

    def plan(self, itineraries: Iterable[Itinerary]) -> None:
        """Take the tables of the vehicles, for the first time or again."""
        self._used.clear()
        for itinerary in {itinerary.loop: itinerary for itinerary in itineraries}.values():
            for crossing in (crossing for leg in itinerary.legs for crossing in leg.crossings):
                number = self._timetable.numbers.get(crossing.id)
                if number is not None:
                    signal = self._timetable.signals[number]
                    self._used[signal.light, signal.link] = signal.movement

    def _longest(self) -> tuple[float, Signal | None]:
        """Return the longest wait for green so far [s], and before which light."""
        longest_s, since_s, at = (self._engine.run[name][0] for name in ("red_s", "red_since_s", "red_at"))
        signal = self._timetable.signals[at] if longest_s > 0.0 else None
        return max(0.0, min(float(longest_s), float(self._engine.run["now_s"][0] - since_s))), signal

    def figures(self) -> dict[str, Any]:
        """Return the figures of obeyed lights for ``summary.json``."""
        run = self._engine.run
        longest_s, signal = self._longest()
        return {
            "grants": int(run["let_go"][0]),
            "stood": int(run["stood"][0]),
            "stood_s": round(float(run["stood_s"][0]), 3),
            "on_red": int(run["on_red"][0]),
            "longest_red_s": round(longest_s, 3),
            "longest_red_at": signal.movement if signal else "",
        }

    def warnings(self) -> list[str]:
        """Return lines about lights on the loops that never or rarely turn green."""
        never, rarely = [], []
        for (light, link), movement in self._used.items():
            closed_s = self._timetable.longest_closed_s(light, link)
            if not self._timetable.ever_open(light, link):
                never.append(f"{movement} (light {light})")
            elif closed_s > _LONG_RED_S:
                rarely.append(f"{movement} (light {light}, red for {closed_s:.0f} s on end)")
        lines = []
        if never:
            lines.append(
                f"lights: {len(never)} of {len(self._used)} movements with a light never get green in its "
                f"program, first {never[0]}: vehicles wait there for ever, which is no deadlock; "
                "try --lights off"
            )
        if rarely:
            lines.append(
                f"lights: {len(rarely)} of {len(self._used)} movements with a light stay red for more than "
                f"{_LONG_RED_S:.0f} s, first {rarely[0]}: a queue there is no deadlock; try --lights off"
            )
        seconds, signal = self._longest()
        if signal is not None and seconds > _LONG_RED_S and not lines:
            lines.append(
                f"lights: a vehicle waited {seconds:.0f} s for green at movement {signal.movement} "
                f"(light {signal.light})"
            )
        return lines
