"""Input and output of `loopgate inspect` that do not depend on the abstraction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loopgate.errors import ScenarioError

if TYPE_CHECKING:
    from rich.console import Console

    from loopgate.abstraction.itinerary import Abstraction, Itinerary
    from loopgate.abstraction.survey import Survey
    from loopgate.network import RoadNetwork, RoutesFile
    from loopgate.network.coverage import Coverage


def undrivable(roads: RoadNetwork, file: RoutesFile, step_s: float) -> ScenarioError | None:
    """Return why `loopgate run` refuses a vehicle type of the file, or None."""
    from loopgate.simulation.settings import check_types, highest_limits

    _, loops, _ = file.robots()
    try:
        limits = highest_limits(roads, zip(loops, file.robot_types(), strict=True))
        check_types(limits, step_s=step_s, obeys=False, source=str(file.file))
    except ScenarioError as error:
        return error
    return None


@dataclass(frozen=True, slots=True)
class Wanted:
    """Options of the command `loopgate inspect`."""

    vehicle_length_m: float | None
    """Length that replaces the length in the file [m]."""
    seed: int
    """Seed of the start positions."""
    picture: Path | None
    additional: Path | None
    out: Path | None
    """`picture`, `additional` and `out`: files to write, if any: the map, the shapes for SUMO's own tools,
    the system."""
    step_s: float
    """Length of a step of the simulation [s]."""
    as_json: bool
    """Whether JSON is printed instead of tables."""


def loops_data(
    found: Survey, itineraries: Iterable[Itinerary], *, state: str, crossings: bool
) -> list[dict[str, Any]]:
    """Return loops and their legs for JSON; `state` is the key of a state."""
    legs = {itinerary.loop.id: itinerary.legs for itinerary in itineraries}
    return [
        {
            "id": loop.loop,
            "length_m": round(loop.length_m, 2),
            f"{state}s": loop.states,
            "shared_visits": loop.visits,
            "shared_m": round(loop.shared_m, 2),
            "shared": round(loop.shared, 4),
            "meets": loop.meets,
            "legs": [
                {
                    state: leg.state,
                    "begin_m": round(leg.begin_m, 2),
                    "end_m": round(leg.end_m, 2),
                    **({"crossings": [crossing.id for crossing in leg.crossings]} if crossings else {}),
                }
                for leg in legs[loop.loop]
            ],
        }
        for loop in found.loops
    ]


def common_data(
    found: Survey, coverage: Coverage, placed: Abstraction | None, warnings: Sequence[str]
) -> dict[str, Any]:
    """Return the figures of all loops, where vehicles start, and the warnings."""
    return {
        "shared": round(found.shared, 4),
        "coverage_edges": round(coverage.of_edges, 6),
        "coverage_lane_km": round(coverage.of_lane_km, 6),
        "starts_m": [round(front, 2) for front in placed.starts_m] if placed else None,
        "warnings": warnings,
    }


def print_reach(out: Console, coverage: Coverage, *, begin: str = "") -> None:
    """Print how much of the network the loops reach."""
    out.print(
        f"{begin}loops reach {coverage.of_edges:.0%} of the network's edges, "
        f"{coverage.of_lane_km:.0%} of its lane-km"
    )


def print_warnings(out: Console, warnings: Iterable[str]) -> None:
    """Print a line for each warning."""
    for warning in warnings:
        out.print(f"warning: {warning}", style="yellow", markup=False)
