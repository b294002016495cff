"""`loopgate inspect`: what loops on a network come to, before anything drives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.errors import ScenarioError

if TYPE_CHECKING:
    from loopgate.abstraction.itinerary import Abstraction
    from loopgate.abstraction.segments import Layout
    from loopgate.abstraction.survey import Survey

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
@click.option("--abstraction", type=click.Choice(["segments"]), default="segments", show_default=True)
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
    from loopgate.abstraction.segments import lay_out_segments, place_vehicles
    from loopgate.abstraction.survey import survey
    from loopgate.model import write_system
    from loopgate.network import RoadNetwork, read_loops
    from loopgate.network.sumo_config import is_sumo_config

    del abstraction
    if routes is None and not is_sumo_config(network):
        msg = f"{network}: which loops? Give --routes FILE ('loopgate loops {network} -o FILE' makes some)"
        raise ScenarioError(msg)
    roads = RoadNetwork.open(network)
    file = read_loops(roads, routes or network)
    length, gap = file.longest_vehicle()
    length = length if vehicle_length_m is None else vehicle_length_m
    names, loops, starts_m = file.robots()
    layout = lay_out_segments(loops, rho_m=rho_m, vehicle_length_m=length, min_gap_m=gap, piece_m=piece_m)
    placed: Abstraction | None = None
    problem: ScenarioError | None = None
    try:
        placed = place_vehicles(layout, vehicle_length_m=length, seed=seed, names=names, starts_m=starts_m)
    except ScenarioError as error:
        problem = error
    found = survey(layout.itineraries)
    if as_json:
        click.echo(json.dumps(_data(layout, found, placed)))
    else:
        _print(layout, found)
    if plot is not None:
        from loopgate.report.network_map import draw_map

        title = f"{network}: {_count(len(loops), 'loop')}, {found.shared:.0%} shared"
        fronts = placed.starts_m if placed else ()
        draw_map(roads, layout.loops, layout.itineraries, plot, starts_m=fronts, title=title)
    if problem is not None:
        raise problem
    if out is not None and placed is not None:
        write_system(placed.system, out, note=f"{network}, {file.file.name}: segments, rho {rho_m:g} m")


def _data(layout: Layout, found: Survey, placed: Abstraction | None) -> dict[str, Any]:
    legs = {itinerary.loop: itinerary.legs for itinerary in layout.itineraries}
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
            {"id": z.state, "loops": z.loops, "visits": z.visits, "length_m": round(z.length_m, 2)}
            for z in found.zones
        ],
        "private_states": found.private_states,
        "shared": round(found.shared, 4),
        "starts_m": None if placed is None else [round(front, 2) for front in placed.starts_m],
        "warnings": layout.warnings,
    }


def _print(layout: Layout, found: Survey) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    table = Table(title=_count(len(found.loops), "loop"), title_justify="left")
    for column in ("loop", "length [m]", "states", "zones passed", "shared [m]", "shared", "meets"):
        table.add_column(column, justify="left" if column in {"loop", "meets"} else "right")
    for loop in found.loops[:_MOST_ROWS]:
        table.add_row(
            loop.loop,
            f"{loop.length_m:.0f}",
            str(loop.states),
            str(loop.visits),
            f"{loop.shared_m:.0f}",
            f"{loop.shared:.0%}",
            _listed(loop.meets),
        )
    console.print(table)
    _print_rest(console, len(found.loops), "loops")
    zones = Table(
        title=f"{len(found.zones)} zones, {found.private_states} private states", title_justify="left"
    )
    for column in ("zone", "length [m]", "visits", "loops"):
        zones.add_column(column, justify="left" if column in {"zone", "loops"} else "right")
    for zone in found.zones[:_MOST_ROWS]:
        zones.add_row(zone.state, f"{zone.length_m:.0f}", str(zone.visits), _listed(zone.loops))
    console.print(zones)
    _print_rest(console, len(found.zones), "zones")
    km = sum(loop.length_m for loop in found.loops) / 1000.0
    console.print(f"{found.shared:.1%} of {km:.1f} km lie in zones with others")
    for warning in layout.warnings:
        console.print(f"warning: {warning}", style="yellow")


def _print_rest(console: Any, count: int, what: str) -> None:  # noqa: ANN401  rich's console, imported late
    if count > _MOST_ROWS:
        console.print(f"... and {count - _MOST_ROWS} more {what} (--json lists all)")


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _listed(names: tuple[str, ...]) -> str:
    more = len(names) - _MOST_NAMES
    return ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
