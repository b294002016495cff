"""`loopgate loops`: closed loops, random ones or such that cover streets, as a SUMO route file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from loopgate.cli.length_range import LENGTH_RANGE
from loopgate.cli.numbers import FiniteRange

if TYPE_CHECKING:
    from loopgate.network import Loop, LoopVehicle, VehicleType

__all__ = ["loops"]


@click.command(
    epilog="""
    \b
    Examples:
      loopgate loops sumo:DRT --count 40 --length 400:2000 --seed 1 -o routes/drt.rou.xml
      loopgate loops my.net.xml --count 12 --max-shared 0.4 -o routes/sparse.rou.xml
      loopgate loops my.net.xml --count 3 --vclass bus --via station,market --avoid park.txt -o bus.rou.xml
      loopgate loops sumo:DRT --cover all --count 18 --vehicles 40 -o routes/watch.rou.xml --plot watch.png
      loopgate loops sumo:DRT --cover all --revisit 600 -o routes/every10min.rou.xml
    """
)
@click.argument("network")
@click.option(
    "--count",
    type=click.IntRange(1, 1_000_000),
    help="How many loops; 12 random ones by default, of those that cover streets as few as there have to be.",
)
@click.option(
    "--length",
    "length_m",
    type=LENGTH_RANGE,
    help="Shortest and longest random loop [m]; default 400:2000.",
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
    "--cover",
    metavar="all|FILE|POLYGON",
    help="Cover streets: all, those a file names (edges, a netedit selection, or <poly>), or those in a "
    "polygon 'x,y x,y x,y' [m]. The longest loop is made as short as can be.",
)
@click.option("--max-length", "max_length_m", type=FiniteRange(1.0, 1e7), help="Longest covering loop [m].")
@click.option("--either-way", is_flag=True, help="One direction of each street is enough.")
@click.option("--vclass", default="passenger", show_default=True, help="SUMO's class of the vehicles.")
@click.option(
    "--via",
    metavar="EDGES|FILE",
    help="Lead every random loop over all these edges: EDGE,EDGE,... or a file.",
)
@click.option(
    "--avoid",
    metavar="EDGES|FILE|POLYGON",
    help="Use none of these streets, given as for --cover or as EDGE,EDGE,...",
)
@click.option("--start", metavar="EDGE", help="Lead every covering loop over this edge.")
@click.option(
    "--weights",
    type=click.Path(dir_okay=False),
    help="File of lines EDGE WEIGHT: streets to be seen so many times as often; they get loops of their own.",
)
@click.option(
    "--vehicles",
    type=click.IntRange(1, 100_000),
    help="Write so many vehicles into the file, in proportion to laps and evenly round each covering loop.",
)
@click.option(
    "--revisit",
    "revisit_s",
    type=FiniteRange(1.0, 1e6),
    help="Write as many vehicles as it takes to see every covered street every so many seconds.",
)
@click.option(
    "--margin",
    type=FiniteRange(1.0, 100.0),
    default=1.5,
    show_default=True,
    help="How many times as long as at the speeds allowed laps take, for --revisit.",
)
@click.option(
    *("--plot", "--picture", "plot"),
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the map of covering loops (PNG, SVG, PDF).",
)
@click.option(
    "-o", "--out", type=click.Path(path_type=Path, dir_okay=False), help="Route file; else standard output."
)
@click.option("--json", "as_json", is_flag=True, help="Print the loops' lengths and edges as JSON.")
def loops(  # noqa: PLR0913  one per option
    network: str,
    *,
    count: int | None,
    length_m: tuple[float, float] | None,
    seed: int,
    max_shared: float | None,
    rho_m: float | None,
    u_turns: bool,
    cover: str | None,
    max_length_m: float | None,
    either_way: bool,
    vclass: str,
    via: str | None,
    avoid: str | None,
    start: str | None,
    weights: str | None,
    vehicles: int | None,
    revisit_s: float | None,
    margin: float,
    plot: Path | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Make distinct closed loops that a car can drive in NETWORK, none using an edge twice.

    Where there are fewer than asked for, those that there are; how many is said on stderr. With --cover,
    loops by design: together they cover the streets, and Ctrl-C takes the best found so far.

    NETWORK is a .net.xml or .net.xml.gz file, or sumo:NAME for a network of the SUMO package. The loops are
    written as an ordinary SUMO route file, which netedit and sumo-gui open.
    """
    _check_together(
        covers=cover is not None,
        random={"--length": length_m, "--max-shared": max_shared, "--rho": rho_m, "--via": via},
        covering={
            "--max-length": max_length_m,
            "--either-way": either_way or None,
            "--start": start,
            "--weights": weights,
            "--vehicles": vehicles,
            "--revisit": revisit_s,
            "--plot": plot,
        },
    )
    if cover is not None:
        from loopgate.cli.cover_loops import CoverWish, cover_loops

        cover_loops(
            CoverWish(
                network=network,
                cover=cover,
                count=count or 1,
                max_length_m=max_length_m,
                either_way=either_way,
                vclass=vclass,
                u_turns=u_turns,
                avoid=avoid,
                start=start,
                weights=weights,
                vehicles=vehicles,
                revisit_s=revisit_s,
                margin=margin,
                seed=seed,
                plot=plot,
                out=out,
                as_json=as_json,
            )
        )
        return
    count, length_m = count or 12, length_m or (400.0, 2000.0)
    from loopgate.abstraction.segments import DEFAULT_RHO_M
    from loopgate.abstraction.sharing import SharingBound
    from loopgate.cli.progress import show_progress
    from loopgate.network import RoadNetwork, find_loops
    from loopgate.network.cover.wishes import read_streets
    from loopgate.network.routes_file import routes_text, write_text
    from loopgate.network.vehicle_type import type_of_class

    kind = type_of_class(vclass, "--vclass")
    roads = RoadNetwork.open(network)
    if avoid is not None:
        roads = roads.without(read_streets(roads, avoid, vclass, option="--avoid"))
    over = read_streets(roads, via, vclass, option="--via") if via is not None else ()
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
            vclass=vclass,
            via=over,
            admits=bound.admits if bound else None,
            progress=report,
        )
    note = f"loopgate loops {network}: count {count}, length {length_m[0]:g}:{length_m[1]:g}, seed {seed}"
    note += "" if max_shared is None else f", max-shared {max_shared:g}"
    note += "" if rho_m is None else f", rho {rho_m:g}"
    note += ", u-turns" if u_turns else ""
    note += "" if vclass == "passenger" else f", vclass {vclass}"
    note += "" if via is None else f", via {via}"
    note += "" if avoid is None else f", avoid {avoid}"
    text = routes_text(found.loops, note=note, vehicles=_vehicles(found.loops, kind))
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


def _vehicles(made: Sequence[Loop], kind: VehicleType) -> list[LoopVehicle]:
    """Return a vehicle for each loop where it has to be said of what class they are."""
    from loopgate.network import LoopVehicle

    if kind.vclass == "passenger":
        return []
    return [LoopVehicle(f"{loop.id}.0", loop.id, kind) for loop in made]


def _check_together(*, covers: bool, random: Mapping[str, object], covering: Mapping[str, object]) -> None:
    """Raise a usage error for an option that belongs to the other kind of loops, or to another option."""
    for option in (name for name, value in (random if covers else covering).items() if value is not None):
        other = "random loops, not to --cover" if covers else "--cover"
        msg = f"{option} belongs to {other}"
        raise click.UsageError(msg)
    for one, other in (("--revisit", "--vehicles"), ("--revisit", "--max-length")):
        if covering[one] is not None and covering[other] is not None:
            msg = f"{one} and {other} do not go together: one of them decides; leave the other out"
            raise click.UsageError(msg)
