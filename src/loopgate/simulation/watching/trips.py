"""Times of trips, as SUMO's tripinfo defines them, for gated and ordinary vehicles alike."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from html import unescape
from math import isnan, nan
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from loopgate.errors import ResultsError

__all__ = ["Trip", "gated_trips", "read_trips", "trip_figures", "write_depart_delays"]

_DEPART_DELAY = re.compile(r'(<tripinfo id="([^"]*)"[^>]* departDelay=")[^"]*')

_ROUNDING_M = 1.0
"""Tolerance for SUMO's rounding [m]."""


@dataclass(frozen=True, slots=True)
class Trip:
    """SUMO's figures of one vehicle's trip.

    Attributes
    ----------
    vehicle
        Name of the vehicle.
    arrived
        Whether the vehicle has reached the end of its route.
    departed
        Whether the vehicle has departed.
    depart_delay_s
        Time from the planned to the real departure, or to the end of the run [s].
    duration_s
        Time under way [s].
    time_loss_s
        Time lost against driving at the ideal speed all the way [s], without stops of its own.
    distance_m
        Distance driven [m].
    waiting_s
        Time that the vehicle stood on its way [s], without stops of its own.
    stopped_s
        Time at stops [s], also at stops that a gate set.
    arrival_s
        Time of arrival [s]; NaN if the vehicle has not arrived.
    """

    vehicle: str
    arrived: bool
    departed: bool
    depart_delay_s: float
    duration_s: float = 0.0
    time_loss_s: float = 0.0
    distance_m: float = 0.0
    waiting_s: float = 0.0
    stopped_s: float = 0.0
    arrival_s: float = nan

    @property
    def delay_s(self) -> float:
        """The delay of the trip [s]: time loss and wait to depart together."""
        return self.time_loss_s + self.depart_delay_s

    def last_part_m(self, odometer_m: float, most_m: float) -> float:
        """Return the distance driven in the step of the arrival, which the odometer misses [m].

        Parameters
        ----------
        odometer_m
            The odometer's reading in the step before [m].
        most_m
            Largest distance that the vehicle can drive in a step [m].
        """
        part_m = self.distance_m - odometer_m
        return part_m if self.arrived and 0.0 <= part_m <= most_m + _ROUNDING_M else 0.0


def read_trips(file: Path, *, held: bool = False, interrupted: bool = False) -> dict[str, Trip]:
    """Read the trips in SUMO's output ``tripinfo.xml``.

    Parameters
    ----------
    file
        SUMO's output, with vehicles under way and vehicles that have not departed.
    held
        Whether a gate held vehicles by stops; then the time at stops counts as lost.
    interrupted
        Whether the run was interrupted, so that the file may be incomplete.

    Raises
    ------
    ResultsError
        If the file cannot be read.
    """
    try:
        top = ET.parse(file).getroot()  # noqa: S314  SUMO has just written it
    except (OSError, ET.ParseError) as error:
        if interrupted:
            return {}  # the run ended before SUMO finished the file
        # SUMO reports no error when it cannot write.
        msg = f"{file}: SUMO could not write all of it; is the disk full? Free some space and run it again"
        raise ResultsError(msg) from error
    return {trip.vehicle: trip for element in top.iter("tripinfo") for trip in (_trip(element, held=held),)}


def _trip(element: ET.Element, *, held: bool) -> Trip:
    def figure(name: str) -> float:
        return max(0.0, float(element.get(name, "0")))

    stood_s = figure("stopTime") if held else 0.0
    arrived = float(element.get("arrival", "-1")) >= 0.0 and not element.get("vaporized")
    return Trip(
        element.get("id", ""),
        arrived=arrived,
        departed=float(element.get("depart", "-1")) >= 0.0,
        depart_delay_s=figure("departDelay"),
        duration_s=figure("duration"),
        time_loss_s=figure("timeLoss") + stood_s,
        distance_m=figure("routeLength"),
        waiting_s=figure("waitingTime") + stood_s,
        stopped_s=figure("stopTime"),
        arrival_s=figure("arrival") if arrived else nan,
    )


def gated_trips(
    trips: Mapping[str, Trip],
    delays_s: Mapping[str, float],
    stopped_s: Mapping[str, float],
    arrived: Container[str],
    outside: Container[str] = (),
) -> dict[str, Trip]:
    """Return the trips of gated vehicles.

    Parameters
    ----------
    trips
        SUMO's trips.
    delays_s
        Depart delay of each vehicle that was due [s].
    stopped_s
        Time that each vehicle stood at stops of its own [s].
    arrived
        The vehicles that have arrived.
    outside
        The vehicles that still wait to depart.
    """
    found = {}
    for vehicle, delay_s in delays_s.items():
        trip = Trip(vehicle, arrived=False, departed=False, depart_delay_s=delay_s)
        if vehicle not in outside:
            trip = trips.get(vehicle, trip)
        own_s, is_there = stopped_s.get(vehicle, 0.0), vehicle in arrived
        is_there = is_there and (trip.arrived or vehicle not in trips)  # a calibrator may have taken it out
        found[vehicle] = replace(
            trip,
            arrived=is_there,
            arrival_s=trip.arrival_s if is_there else nan,
            depart_delay_s=delay_s,
            time_loss_s=max(0.0, trip.time_loss_s - own_s),
            waiting_s=max(0.0, trip.waiting_s - own_s),
        )
    return found


def write_depart_delays(file: Path, delays_s: Mapping[str, float]) -> None:
    """Write the depart delays of gated vehicles [s] into ``tripinfo.xml``.

    A gate inserts a vehicle when it may depart, so SUMO says 0.
    """

    def as_was(found: re.Match[str]) -> str:
        delay_s = delays_s.get(unescape(found[2]))
        return found[0] if delay_s is None else f"{found[1]}{delay_s:.2f}"

    text = file.read_text(encoding="utf-8")
    file.write_text(_DEPART_DELAY.sub(as_was, text), encoding="utf-8")


def trip_figures(trips: Iterable[Trip]) -> dict[str, Any]:
    """Return the figures of all trips that were due, for ``summary.json``; empty without trips.

    Means are over all trips that were due. A trip still under way counts with its time loss so far, a trip
    that has not departed with its wait to depart. Only the mean duration is over arrived trips; None without
    any.
    """
    every = list(trips)
    if not every:
        return {}
    took_s = [trip.duration_s for trip in every if not isnan(trip.arrival_s)]
    worst = max(every, key=lambda trip: trip.delay_s)
    count = sum(trip.arrived for trip in every)
    return {
        "trips": len(every),
        "arrived": count,
        "unfinished": len(every) - count,
        "mean_time_loss_s": _mean(trip.time_loss_s for trip in every),
        "mean_depart_delay_s": _mean(trip.depart_delay_s for trip in every),
        "mean_delay_s": _mean(trip.delay_s for trip in every),
        "mean_waiting_s": _mean(trip.waiting_s for trip in every),
        "mean_trip_s": _mean(took_s) if took_s else None,
        "worst_delay_s": round(worst.delay_s, 3),
        "worst_trip": worst.vehicle,
    }


def _mean(values: Iterable[float]) -> float:
    every = list(values)
    return round(sum(every) / len(every), 3)
