"""Vehicles that depart during a run: wanted and real departure times, and figures of their arrivals."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from loopgate.control.start import VehicleStart


@dataclass(frozen=True, slots=True)
class Arrived:
    """What a vehicle did that has arrived.

    Attributes
    ----------
    at_s
        When it arrived [s].
    distance_m, hold_s, stood_s, longest_stood_s, longest_wait_s
        Its distance [m], hold time, standing time, longest time standing and longest wait for a grant [s].
    odometer_m, top_mps
        Its odometer one step before [m], and its top speed [m/s].
    """

    at_s: float
    distance_m: float
    hold_s: float
    stood_s: float
    longest_stood_s: float
    longest_wait_s: float
    odometer_m: float
    top_mps: float


class Departures:
    """Wanted and real departure times of vehicles.

    Parameters
    ----------
    departures
        In the order of the wanted times.
    """

    def __init__(self, departures: Sequence[VehicleStart]) -> None:
        self._coming = deque(departures)
        self.wanted_s = {one.vehicle: one.demand.depart_s for one in departures}
        """When vehicles wanted to depart [s]."""
        self.departed_s: dict[str, float] = {}
        """When vehicles departed [s]."""
        self.arrived: dict[str, Arrived] = {}
        """The vehicles that have driven their routes to the end, by name."""

    @property
    def over(self) -> bool:
        """Whether every vehicle has departed."""
        return not self._coming

    def look(self) -> None:
        """Let the vehicles depart that are due; call it after each step."""

    def delay_s(self, vehicle: str, now_s: float) -> float:
        """Return how long a vehicle waited to depart, or has waited so far [s]."""
        wanted_s = self.wanted_s.get(vehicle, now_s)
        return max(0.0, self.departed_s.get(vehicle, now_s) - wanted_s) if vehicle in self.wanted_s else 0.0

    def report(self, now_s: float) -> dict[str, Any]:
        """Return the figures of departures for ``summary.json``; empty if no vehicle departs later."""
        due = [vehicle for vehicle, at_s in self.wanted_s.items() if at_s <= now_s]
        if not self.wanted_s:
            return {}
        delays = [self.delay_s(vehicle, now_s) for vehicle in due]
        return {
            "departed": len(self.departed_s),
            "waiting_to_depart": len(due) - len(self.departed_s),
            "mean_depart_delay_s": round(sum(delays) / len(delays), 3) if delays else 0.0,
            "max_depart_delay_s": round(max(delays, default=0.0), 3),
        }
