"""`loopgate inspect --abstraction segments`: states of the loops, and the zones where loops meet."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from loopgate.abstraction.itinerary import Abstraction
from loopgate.abstraction.segments import SegmentLayout, lay_out_segments, place_vehicles
from loopgate.abstraction.sumo_shapes import write_shapes
from loopgate.abstraction.survey import Survey, survey
from loopgate.cli.inspect_shared import (
    Wanted,
    common_data,
    loops_data,
    print_reach,
    print_warnings,
    undrivable,
)
from loopgate.cli.tables import console
from loopgate.cli.terminal import print_json
from loopgate.errors import ScenarioError
from loopgate.model import write_system
from loopgate.network import Loop, RoadNetwork, RoutesFile
from loopgate.network.coverage import Coverage, measure_coverage
from loopgate.reading import counted


@dataclass(frozen=True, slots=True)
class _Seen:
    """Loops with their states, and their vehicles or the reason why these cannot start."""

    layout: SegmentLayout
    vehicles_on: Sequence[Loop]
    placed: Abstraction | None
    problem: ScenarioError | None
    coverage: Coverage
    warnings: tuple[str, ...]


def look_at_segments(
    roads: RoadNetwork, file: RoutesFile, wanted: Wanted, *, rho_m: float, piece_m: float
) -> ScenarioError | None:
    """Print and write the output of the options; return why the vehicles cannot start, or None.

    Parameters
    ----------
    roads, file, wanted
        Network, loops with their vehicles, and what to show.
    rho_m, piece_m
        Safe radius and longest private piece [m].
    """
    seen = _look(roads, file, wanted, rho_m, piece_m)
    found = survey(seen.layout.itineraries)
    if wanted.as_json:
        print_json(_data(seen, found))
    else:
        _print(seen, found)
    if wanted.picture is not None:
        from loopgate.report.network_map import draw_map

        draw_map(
            roads,
            seen.vehicles_on,
            seen.layout.itineraries,
            wanted.picture,
            starts_m=seen.placed.starts_m if seen.placed else (),
            title=f"{roads.name}: {counted(len(seen.layout.itineraries), 'loop')}, {found.shared:.0%} shared",
        )
    if wanted.additional is not None:
        capacity = seen.placed.system.capacity if seen.placed else {}
        room = {str(state): most for state, most in capacity.items()}
        write_shapes(wanted.additional, seen.layout.itineraries, room)
    if seen.problem is None and wanted.out is not None and seen.placed is not None:
        note = f"{roads.name}, {file.file.name}: segments, rho {rho_m:g} m"
        write_system(seen.placed.system, wanted.out, note=note)
    return seen.problem


def _look(roads: RoadNetwork, file: RoutesFile, wanted: Wanted, rho_m: float, piece_m: float) -> _Seen:
    length, gap = file.longest_vehicle()
    length = length if wanted.vehicle_length_m is None else wanted.vehicle_length_m
    names, loops, starts_m = file.robots()
    layout = lay_out_segments(loops, rho_m=rho_m, vehicle_length_m=length, min_gap_m=gap, piece_m=piece_m)
    coverage = measure_coverage(roads, loops)
    warnings = (*file.left_out, *layout.warnings)
    try:
        placed = place_vehicles(
            layout, vehicle_length_m=length, seed=wanted.seed, names=names, starts_m=starts_m
        )
    except ScenarioError as error:
        return _Seen(layout, loops, None, error, coverage, warnings)
    return _Seen(layout, loops, placed, undrivable(roads, file, wanted.step_s), coverage, warnings)


def _data(seen: _Seen, found: Survey) -> dict[str, Any]:
    return {
        "abstraction": "segments",
        "loops": loops_data(found, seen.layout.itineraries, state="state", crossings=False),
        "zones": [
            {
                "id": zone.state,
                "loops": zone.loops,
                "visits": zone.visits,
                "length_m": round(zone.length_m, 2),
                "capacity": seen.placed.system.capacity.get(zone.state, 1) if seen.placed else 1,
            }
            for zone in found.zones
        ],
        "private_states": found.private_states,
        **common_data(found, seen.coverage, seen.placed, seen.warnings),
    }


def _print(seen: _Seen, found: Survey) -> None:
    """Print the shared length and the reach."""
    out = console()
    out.print(
        f"{counted(len(found.loops), 'loop')}, {counted(len(found.zones), 'zone')} for one vehicle each, "
        f"{counted(found.private_states, 'private state')}",
        style="bold",
    )
    km = sum(loop.length_m for loop in found.loops) / 1000.0
    out.print(f"{found.shared:.1%} of {km:.1f} km lie in zones that loops share")
    print_reach(out, seen.coverage)
    print_warnings(out, seen.warnings)
    out.print("--json lists every loop and zone", style="dim")
