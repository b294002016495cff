"""The largest number of vehicles in a run; a run with more is refused early."""

from loopgate.errors import ScenarioError
from loopgate.network.vehicle_demand import RoutesFile, VehicleDemand

MOST_VEHICLES = 100_000
"""Most vehicles that depart in one run; they take about a gigabyte of memory."""


def check_number(file: RoutesFile, begin_s: float, end_s: float) -> None:
    """Raise an error if more than `MOST_VEHICLES` vehicles of a route file would depart in a run.

    Raises
    ------
    ScenarioError
        The text names the vehicle or flow that makes most of them.
    """

    def number(vehicle: VehicleDemand) -> float:
        return vehicle.number(begin_s, end_s)

    total = sum(map(number, file.vehicles))
    if total > MOST_VEHICLES:
        first = max(file.vehicles, key=number)
        msg = (
            f"{file.file}: about {total:.0f} vehicles depart from {begin_s:g} to {end_s:g} s, "
            f"{number(first):.0f} of them of {first.id}; expected at most {MOST_VEHICLES}: lower number or "
            f"rate, shorten the run (--duration), or give ordinary vehicles by --traffic"
        )
        raise ScenarioError(msg)
