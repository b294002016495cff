"""Times of vehicles that drive once, as SUMO's own tripinfo defines them: gated or not, alike."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from math import isnan, nan
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from loopgate.errors import ResultsError

__all__ = ["Trip", "gated_trips", "read_trips", "trip_figures"]

_ROUNDING_M = 1.0
"""Room for what SUMO rounds [m]."""


@dataclass(frozen=True, slots=True)
class Trip:
    """SUMO's figures of one vehicle's trip.

    Attributes
    ----------
    vehicle
        Its name.
    arrived
        Whether it is at the end of its route.
    departed
        Whether it has departed.
    depart_delay_s
        From when it wanted to depart until it did, or until the end [s].
    duration_s
        Time under way [s].
    time_loss_s
        Time lost of that against driving at its ideal speed all the way [s]; stops of its own are none.
    distance_m
        How far it drove [m].
    waiting_s
        How long it stood on its way [s], stops of its own left out.
    stopped_s
        How long it was at stops [s], those of a gate too.
    arrival_s
        When it arrived [s]; NaN if it has not.
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
            What its odometer read in the step before [m].
        most_m
            How far it can drive in a step [m]: more is none of its way.
        """
        part_m = self.distance_m - odometer_m
        return part_m if self.arrived and 0.0 <= part_m <= most_m + _ROUNDING_M else 0.0


def read_trips(file: Path, *, held: bool = False, interrupted: bool = False) -> dict[str, Trip]:
    """Read the trips in SUMO's output ``tripinfo.xml``.

    Parameters
    ----------
    file
        As SUMO wrote it, with those that are under way and those that have not departed.
    held
        Whether vehicles were held at stops: then the time at stops is lost, as if they had waited in traffic.
    interrupted
        Whether the run was, so that the file may be cut off.

    Raises
    ------
    ResultsError
        If it cannot be read.
    """
    try:
        top = ET.parse(file).getroot()  # noqa: S314  SUMO has just written it
    except (OSError, ET.ParseError) as error:
        if interrupted:
            return {}  # before SUMO could finish it
        # SUMO does not say so when it cannot write.
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
        As SUMO has them.
    delays_s
        Depart delays of all that wanted to depart [s].
    stopped_s
        How long vehicles stood at stops of their own [s].
    arrived
        The vehicles that have arrived.
    outside
        The vehicles that still wait to depart; the gate may have put some in and taken them out again.
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


def trip_figures(trips: Iterable[Trip]) -> dict[str, Any]:
    """Return the figures of all trips that were due, for ``summary.json``; empty without trips.

    Means are over all of them: one that is still under way counts with what it has lost so far, one that has
    not departed with its wait to depart, and has lost nothing on the way. Only the mean time of a trip is
    over those that have arrived; it is None if none has.
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
