"""Interface of the parts of a run that report figures, and the figures of stops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from loopgate.control.driving import Driving


@dataclass(frozen=True, slots=True)
class Made:
    """How many stops a vehicle has made, and for how long it stood at them [s]."""

    served: int = 0
    stood_s: float = 0.0


class Reports(Protocol):
    """A part of a run that reports figures at the end."""

    def report(self) -> Mapping[str, Any]:
        """Return figures for ``summary.json``."""


class StopFigures:
    """Figures of the stops that vehicles make in a run."""

    def __init__(self, driving: Driving) -> None:
        self._stops, self._parking = driving.stops, driving.parking

    def of(self, vehicle: str) -> Made:
        """Return the figures of the stops of a vehicle."""
        return Made(*self._stops.made.get(vehicle, (0, 0.0)))

    def report(self) -> dict[str, Any]:
        """Return the figures of stops for ``summary.json``."""
        stops, parking = self._stops, self._parking
        if not stops:
            return {}
        return {
            "stops": {
                "served": stops.served,
                "missed": stops.missed,
                "stopped_s": round(sum(stood_s for _, stood_s in stops.made.values()), 3),
                "under_way": sum(1 for _ in stops.made_now()),
                "late_back_s": round(parking.late_s, 3),
                "longest_late_back_s": round(parking.latest_s, 3),
            }
        }
