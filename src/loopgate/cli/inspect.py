"""`loopgate inspect`: what loops on a network come to, before anything drives."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.errors import ScenarioError

if TYPE_CHECKING:
    from loopgate.abstraction.itinerary import Abstraction
    from loopgate.abstraction.segments import Layout
    from loopgate.abstraction.survey import Survey
    from loopgate.model import StateId
    from loopgate.network import Loop, RoadNetwork, RoutesFile

__all__ = ["inspect"]

_MOST_ROWS = 40
_MOST_NAMES = 6


@click.command(
    epilog="""
    \b
    Examples:
      loopgate inspect sumo:DRT --routes routes/drt.rou.xml --plot map.png
      loopgate inspect some.sumocfg -o system.json
    """
)
@click.argument("network")
@click.option("--routes", type=click.Path(path_type=Path), help="Route file or .sumocfg with closed loops.")
@click.option(
    "--abstraction", type=click.Choice(["segments", "queues"]), default="segments", show_default=True
)
@click.option("--rho", "rho_m", type=float, default=1.25, show_default=True, help="Safe radius [m].")
@click.option("--piece", "piece_m", type=float, default=100.0, show_default=True, help="Private pieces [m].")
@click.option(
    "--vehicle-length", "vehicle_length_m", type=float, help="Default: the file's longest, or 5 [m]."
)
@click.option("--seed", type=int, default=1, show_default=True, help="Seed of the starting places.")
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False), help="Draw the map (PNG, SVG, PDF).")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the system file (JSON)."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
def inspect(  # noqa: PLR0913  one per option
    network: str,
    *,
    routes: Path | None,
    abstraction: str,
    rho_m: float,
    piece_m: float,
    vehicle_length_m: float | None,
    seed: int,
    plot: Path | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Show robots, states and zones that the loops of a route file have in NETWORK.

    NETWORK is a .net.xml or .net.xml.gz file, sumo:NAME for a network of the SUMO package, or a .sumocfg
    with both. Ends with exit code 2 if the vehicles cannot all start.
    """
    from loopgate.abstraction.survey import survey
    from loopgate.model import write_system
    from loopgate.network import RoadNetwork, read_loops
    from loopgate.network.sumo_config import is_sumo_config

    if routes is None and not is_sumo_config(network):
        msg = f"{network}: which loops? Give --routes FILE ('loopgate loops {network} -o FILE' makes some)"
        raise ScenarioError(msg)
    roads = RoadNetwork.open(network)
    file = read_loops(roads, routes or network)
    if abstraction == "queues":
        seen = _queues(roads, file, seed, vehicle_length_m)
    else:
        seen = _segments(file, seed, vehicle_length_m, rho_m, piece_m)
    found = survey(seen.layout.itineraries)
    if as_json:
        click.echo(json.dumps(_data(seen, found)))
    else:
        _print(seen, found)
    if plot is not None:
        from loopgate.report.network_map import draw_map

        title = f"{network}: {_count(len(seen.layout.loops), 'loop')}, {found.shared:.0%} shared"
        draw_map(
            roads,
            seen.vehicles_on,
            seen.layout.itineraries if abstraction == "segments" else (),
            plot,
            starts_m=seen.placed.starts_m if seen.placed else (),
            title=title,
        )
    if seen.problem is not None:
        raise seen.problem
    if out is not None and seen.placed is not None:
        note = f"{network}, {file.file.name}: {abstraction}"
        write_system(
            seen.placed.system, out, note=note + (f", rho {rho_m:g} m" if abstraction == "segments" else "")
        )


@dataclass(frozen=True, slots=True)
class _Seen:
    """Loops with their states; the vehicles in them, or why they cannot start."""

    layout: Layout
    vehicles_on: Sequence[Loop]
    placed: Abstraction | None
    problem: ScenarioError | None
    shared_state: str

    def room(self, state: StateId) -> int:
        return self.placed.system.capacity.get(state, 1) if self.placed else 1


def _segments(
    file: RoutesFile, seed: int, vehicle_length_m: float | None, rho_m: float, piece_m: float
) -> _Seen:
    from loopgate.abstraction.segments import lay_out_segments, place_vehicles

    length, gap = file.longest_vehicle()
    length = length if vehicle_length_m is None else vehicle_length_m
    names, loops, starts_m = file.robots()
    layout = lay_out_segments(loops, rho_m=rho_m, vehicle_length_m=length, min_gap_m=gap, piece_m=piece_m)
    try:
        placed = place_vehicles(layout, vehicle_length_m=length, seed=seed, names=names, starts_m=starts_m)
    except ScenarioError as error:
        return _Seen(layout, loops, None, error, "zone")
    return _Seen(layout, loops, placed, None, "zone")


def _queues(roads: RoadNetwork, file: RoutesFile, seed: int, vehicle_length_m: float | None) -> _Seen:
    from loopgate.abstraction.queues import make_queues
    from loopgate.abstraction.segments import Layout

    names, loops, starts_m = file.robots()
    types = file.robot_types()
    if vehicle_length_m is not None:
        types = [replace(kind, length_m=vehicle_length_m) for kind in types]
    placed = make_queues(roads, loops, types, seed=seed, names=names, starts_m=starts_m)
    itineraries = {itinerary.loop: itinerary for itinerary in placed.itineraries}
    unique = {loop.id: loop for loop in loops}
    layout = Layout(tuple(unique.values()), tuple(itineraries[name] for name in unique), placed.warnings)
    return _Seen(layout, loops, placed, None, "shared lane")


def _data(seen: _Seen, found: Survey) -> dict[str, Any]:
    legs = {itinerary.loop: itinerary.legs for itinerary in seen.layout.itineraries}
    return {
        "loops": [
            {
                "id": loop.loop,
                "length_m": round(loop.length_m, 2),
                "states": loop.states,
                "shared_visits": loop.visits,
                "shared_m": round(loop.shared_m, 2),
                "shared": round(loop.shared, 4),
                "meets": loop.meets,
                "legs": [
                    {"state": leg.state, "begin_m": round(leg.begin_m, 2), "end_m": round(leg.end_m, 2)}
                    for leg in legs[loop.loop]
                ],
            }
            for loop in found.loops
        ],
        "zones": [
            {
                "id": zone.state,
                "loops": zone.loops,
                "visits": zone.visits,
                "length_m": round(zone.length_m, 2),
                "capacity": seen.room(zone.state),
            }
            for zone in found.zones
        ],
        "private_states": found.private_states,
        "shared": round(found.shared, 4),
        "starts_m": [round(front, 2) for front in seen.placed.starts_m] if seen.placed else None,
        "warnings": seen.layout.warnings,
    }


def _print(seen: _Seen, found: Survey) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console, what = Console(highlight=False), seen.shared_state
    table = Table(title=_count(len(found.loops), "loop"), title_justify="left")
    for column in ("loop", "length [m]", "states", f"{what}s passed", "shared [m]", "shared", "meets"):
        table.add_column(escape(column), justify="left" if column in {"loop", "meets"} else "right")
    for loop in found.loops[:_MOST_ROWS]:
        table.add_row(
            escape(loop.loop),
            f"{loop.length_m:.0f}",
            str(loop.states),
            str(loop.visits),
            f"{loop.shared_m:.0f}",
            f"{loop.shared:.0%}",
            _listed(loop.meets),
        )
    console.print(table)
    _print_rest(console, len(found.loops), "loops")
    title = f"{_count(len(found.zones), what)}, {_count(found.private_states, 'private state')}"
    zones = Table(title=title, title_justify="left")
    for column in (what, "length [m]", "holds", "visits", "loops"):
        zones.add_column(escape(column), justify="left" if column in {what, "loops"} else "right")
    for zone in found.zones[:_MOST_ROWS]:
        holds = str(seen.room(zone.state))
        zones.add_row(
            escape(zone.state), f"{zone.length_m:.0f}", holds, str(zone.visits), _listed(zone.loops)
        )
    console.print(zones)
    _print_rest(console, len(found.zones), f"{what}s")
    km = sum(loop.length_m for loop in found.loops) / 1000.0
    console.print(f"{found.shared:.1%} of {km:.1f} km lie in {what}s with others")
    for warning in seen.layout.warnings:
        console.print(f"warning: {warning}", style="yellow", markup=False)


def _print_rest(console: Any, count: int, what: str) -> None:  # noqa: ANN401  rich's console, imported late
    if count > _MOST_ROWS:
        console.print(f"... and {count - _MOST_ROWS} more {what} (--json lists all)")


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _listed(names: tuple[str, ...]) -> str:
    from rich.markup import escape

    more = len(names) - _MOST_NAMES
    return ", ".join(map(escape, names[:_MOST_NAMES])) + (f" and {more} more" if more > 0 else "")
