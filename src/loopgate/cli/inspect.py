"""`loopgate inspect`: the places, crossings and capacity of loops, before a run."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.cli.terminal import FiniteRange, print_json, without_way_out
from loopgate.errors import NobodyGatedError, ScenarioError

if TYPE_CHECKING:
    from loopgate.cli.inspect_shared import Wanted

_RHO_M, _PIECE_M = 1.25, 100.0
_LONGEST_VEHICLE_M = 1e3


@click.command(
    epilog="""
    \b
    Examples:
      loopgate inspect sumo:DRT --routes loops.rou.xml --picture queues.png
      loopgate inspect sumo:DRT --routes loops.rou.xml --abstraction segments --picture zones.svg
      loopgate inspect my.net.xml --routes loops.rou.xml --additional places.add.xml
      loopgate inspect some.sumocfg -o system.json
    """
)
@click.argument("network")
@click.option("--routes", type=click.Path(path_type=Path), help="Route file or .sumocfg with closed loops.")
@click.option("--stops", help="Additional files with the stops that the route file names: FILE,FILE.")
@click.option("--abstraction", type=click.Choice(["queues", "segments"]), default="queues", show_default=True)
@click.option(
    "--rho", "rho_m", type=FiniteRange(0.01, 1e3), help=f"Safe radius of segments; default {_RHO_M:g} [m]."
)
@click.option(
    *("--piece", "piece_m"),
    type=FiniteRange(0.01, 1e6),
    help=f"Longest private piece of segments; default {_PIECE_M:g} [m].",
)
@click.option(
    "--vehicle-length",
    "vehicle_length_m",
    type=float,
    help="Length of the vehicles [m]; default: as the file says, or 5.",
)
@click.option("--seed", type=int, default=1, show_default=True, help="Seed of the start positions.")
@click.option(
    *("--picture", "--plot", "picture"),
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the map (PNG, SVG, PDF).",
)
@click.option(
    "--additional",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write places, crossings and loops as shapes for sumo-gui and netedit (-a FILE).",
)
@click.option(
    "-o", "--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the system file (JSON)."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON only: every loop, place, crossing or zone.")
def inspect(
    network: str,
    *,
    routes: Path | None,
    stops: str | None,
    abstraction: str,
    rho_m: float | None,
    piece_m: float | None,
    **given: Any,  # noqa: ANN401  the other options, as `Wanted` has them
) -> None:
    """Show which loops of a route file work in NETWORK, and how many vehicles they hold.

    On queues: places with their capacity, crossings with their conflicts, how many vehicles can live on the
    loops, and the loops that cannot work and why. On segments: states and zones. Of vehicles that drive their
    route once: their ways, and who of them is ordinary traffic and why.

    NETWORK is a .net.xml or .net.xml.gz file, sumo:NAME for a network of the SUMO package, or a .sumocfg
    with both. Ends with exit code 2 if some loop cannot work, the vehicles cannot all start, or a run would
    refuse a vehicle type; what can be shown is shown all the same.
    """
    from loopgate.cli.inspect_shared import Wanted
    from loopgate.network import RoadNetwork, read_loops
    from loopgate.network.sumo_config import is_sumo_config

    if routes is None and not is_sumo_config(network):
        command = shlex.join(["loopgate", "loops", network, "-o", "FILE"])
        msg = f"{network}: no loops are given; give --routes FILE ({command} makes some)"
        raise ScenarioError(msg)
    if abstraction == "queues" and not (rho_m is None and piece_m is None):
        msg = "--rho and --piece belong to --abstraction segments; queues have neither"
        raise ScenarioError(msg)
    wanted = Wanted(**given, step_s=_step_s(network))
    length_m = wanted.vehicle_length_m
    if length_m is not None and not 0.0 < length_m <= _LONGEST_VEHICLE_M:
        msg = f"--vehicle-length is {length_m:g} m; expected more than 0, up to {_LONGEST_VEHICLE_M:g}"
        raise ScenarioError(msg)
    roads = RoadNetwork.open(network)
    places = [Path(name.strip()) for name in (stops or "").split(",") if name.strip()]
    try:
        file = read_loops(roads, routes or network, stops=places, once=abstraction == "queues")
        if any(vehicle.once for vehicle in file.vehicles):
            _look_at_trips(network, routes, stops, wanted)
            return
    except NobodyGatedError as error:
        if wanted.as_json:
            print_json({"vehicles": [], "warnings": [without_way_out(error)]})
        else:
            click.echo(f"{without_way_out(error)}; loopgate run lets all drive by SUMO's rules")
        return
    file = file.drawn(wanted.seed)
    if abstraction == "queues":
        from loopgate.cli.inspect_queues import look_at_queues

        problem = look_at_queues(roads, file, wanted)
    else:
        from loopgate.cli.inspect_segments import look_at_segments

        problem = look_at_segments(
            roads,
            file,
            wanted,
            rho_m=_RHO_M if rho_m is None else rho_m,
            piece_m=_PIECE_M if piece_m is None else piece_m,
        )
    if problem is not None:
        raise problem


def _step_s(network: str) -> float:
    """Return the length of a step of a run [s]: of the configuration, or the default."""
    from loopgate.simulation.scenario import Scenario
    from loopgate.simulation.sumo_options import from_configuration

    set_s = from_configuration(network).get("step_s")
    return set_s if isinstance(set_s, float) else Scenario(network=network).step_s


def _look_at_trips(network: str, routes: Path | None, stops: str | None, wanted: Wanted) -> None:
    from loopgate.cli.inspect_trips import look_at_trips
    from loopgate.simulation.scenario import Scenario

    loops_only = {
        "--picture": wanted.picture,
        "--additional": wanted.additional,
        "--out": wanted.out,
        "--vehicle-length": wanted.vehicle_length_m,
    }
    for option, given in loops_only.items():
        if given is not None:
            msg = f"{routes or network}: its vehicles drive their routes once; {option} is for loops only"
            raise ScenarioError(msg)
    said: dict[str, Any] = {
        "network": network,
        "routes": str(routes or ""),
        "stops": stops or "",
        "seed": wanted.seed,
    }
    # The configuration gives the step; its end does not matter: all vehicles are looked at.
    whole = {"duration_s": Scenario(network=network).duration_s}
    scenario = Scenario.from_dict({**said, **whole}, source="loopgate inspect")
    look_at_trips(scenario, as_json=wanted.as_json)
