"""`loopgate loops`: random closed loops as a SUMO route file."""

from __future__ import annotations

import json
from pathlib import Path

import click

from loopgate.cli.length_range import LENGTH_RANGE
from loopgate.cli.numbers import FiniteRange

__all__ = ["loops"]


@click.command(
    epilog="""
    \b
    Examples:
      loopgate loops sumo:DRT --count 40 --length 400:2000 --seed 1 -o routes/drt.rou.xml
      loopgate loops my.net.xml --count 12 --max-shared 0.4 -o routes/sparse.rou.xml
    """
)
@click.argument("network")
@click.option(
    "--count", type=click.IntRange(1, 1_000_000), default=12, show_default=True, help="How many loops."
)
@click.option(
    "--length",
    "length_m",
    type=LENGTH_RANGE,
    default="400:2000",
    show_default=True,
    help="Shortest and longest loop [m].",
)
@click.option("--seed", type=int, default=1, show_default=True, help="The same seed makes the same loops.")
@click.option(
    "--max-shared",
    type=FiniteRange(0.0, 1.0),
    help="Largest share of each loop's length that may lie in zones with others, 0 to 1.",
)
@click.option(
    "--rho", "rho_m", type=FiniteRange(0.01, 1e3), help="Safe radius for --max-shared [m]; default 1.25."
)
@click.option("--u-turns", is_flag=True, help="Let vehicles turn round at junctions.")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path, dir_okay=False), help="Route file; else standard output."
)
@click.option("--json", "as_json", is_flag=True, help="Print the loops' lengths and edges as JSON.")
def loops(  # noqa: PLR0913  one per option
    network: str,
    *,
    count: int,
    length_m: tuple[float, float],
    seed: int,
    max_shared: float | None,
    rho_m: float | None,
    u_turns: bool,
    out: Path | None,
    as_json: bool,
) -> None:
    """Make distinct closed loops that a car can drive in NETWORK, none using an edge twice.

    Where there are fewer than asked for, those that there are; how many is said on stderr.

    NETWORK is a .net.xml or .net.xml.gz file, or sumo:NAME for a network of the SUMO package. The loops are
    written as an ordinary SUMO route file, which netedit and sumo-gui open.
    """
    from loopgate.abstraction.segments import DEFAULT_RHO_M
    from loopgate.abstraction.sharing import SharingBound
    from loopgate.cli.progress import show_progress
    from loopgate.network import RoadNetwork, find_loops
    from loopgate.network.routes_file import routes_text, write_text

    roads = RoadNetwork.open(network)
    bound = None
    if max_shared is not None:
        bound = SharingBound(roads, max_shared, rho_m=DEFAULT_RHO_M if rho_m is None else rho_m)
    with show_progress("loops", total=count) as report:
        found = find_loops(
            roads,
            count,
            length_m=length_m,
            seed=seed,
            u_turns=u_turns,
            admits=bound.admits if bound else None,
            progress=report,
        )
    note = f"loopgate loops {network}: count {count}, length {length_m[0]:g}:{length_m[1]:g}, seed {seed}"
    note += "" if max_shared is None else f", max-shared {max_shared:g}"
    note += "" if rho_m is None else f", rho {rho_m:g}"
    note += ", u-turns" if u_turns else ""
    text = routes_text(found.loops, note=note)
    if out is not None:
        write_text(text, out)
    if as_json:
        data = [
            {"id": loop.id, "length_m": round(loop.length_m, 2), "edges": loop.edges} for loop in found.loops
        ]
        warnings = [found.shortfall] if found.shortfall else []
        click.echo(json.dumps({"loops": data, "warnings": warnings}))
    elif out is None:
        click.echo(text, nl=False)
    else:
        total = sum(loop.length_m for loop in found.loops) / 1000.0
        click.echo(f"{len(found.loops)} loops, {total:.1f} km in all, written to {out}")
    if found.shortfall:
        click.echo(f"warning: {found.shortfall}; for more {found.way_out}", err=True)
