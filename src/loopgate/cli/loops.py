"""`loopgate loops`: random loops, or loops that cover streets, as a SUMO route file."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.cli.terminal import LENGTH_RANGE, FiniteRange, Time, print_json
from loopgate.errors import RouteError
from loopgate.reading import counted, listed

if TYPE_CHECKING:
    from loopgate.network import Loop, RoadNetwork, VehicleDemand, VehicleType
    from loopgate.network.generate import FoundLoops, LoopOptions


@click.command(
    epilog="""
    \b
    Examples:
      loopgate loops sumo:DRT --count 40 --length 400:2000 --seed 1 -o routes/drt.rou.xml
      loopgate loops my.net.xml --count 12 --max-shared 0.4 -o routes/sparse.rou.xml
      loopgate loops my.net.xml --count 3 --vclass bus --via station,market --avoid park.txt -o bus.rou.xml
      loopgate loops my.net.xml --via station,market --via school --stops station --every 10min -o bus.rou.xml
      loopgate loops sumo:DRT --cover all --count 18 --vehicles 40 -o routes/watch.rou.xml --plot watch.png
      loopgate loops sumo:DRT --cover all --revisit 600 -o routes/every10min.rou.xml
      loopgate loops sumo:DRT --cover all --count 18 -o routes/watch.rou.xml --export maps
      loopgate loops sumo:DRT --cover all --shift 30 --driven out/watch -o routes/rest.rou.xml
      loopgate loops my.net.xml --cover all --by-district wards.xml --start e12,e80 -o wards.rou.xml
    """
)
@click.argument("network")
@click.option(
    "--count",
    type=click.IntRange(1, 1_000_000),
    help="Number of loops. Default: 12 random loops; with --cover as few as needed.",
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
    help="Largest share of a loop that may lie in zones with other loops, 0 to 1.",
)
@click.option(
    "--rho", "rho_m", type=FiniteRange(0.01, 1e3), help="Safe radius for --max-shared [m]; default 1.25."
)
@click.option("--u-turns", is_flag=True, help="Let vehicles turn round at junctions.")
@click.option(
    "--cover",
    metavar="all|STREETS|FILE|POLYGON",
    help="Cover streets: all, those named, of a file (edges or streets, a netedit selection, or <poly>), "
    "or of a polygon 'x,y x,y x,y' [m]. The longest loop is made as short as can be.",
)
@click.option("--max-length", "max_length_m", type=FiniteRange(1.0, 1e7), help="Longest covering loop [m].")
@click.option(
    "--shift",
    "shift_min",
    type=FiniteRange(0.1, 1e5),
    help="Longest covering loop [min], at lap times of --margin; as many loops as needed.",
)
@click.option(
    "--driven",
    metavar="RUN|FILE",
    help="Leave out the streets that were driven already: a run folder, or streets as for --cover.",
)
@click.option("--either-way", is_flag=True, help="One direction of each street is enough.")
@click.option(
    "--both-sides",
    metavar="FILE|POLYGON|EDGES",
    help="With --either-way: streets of which both directions are covered, as for --cover.",
)
@click.option(
    "--by-district",
    type=click.Path(dir_okay=False),
    metavar="FILE",
    help="XML file of polygons: each district gets loops of its own, which pass the depots (--start) in it.",
)
@click.option("--vclass", default="passenger", show_default=True, help="SUMO's class of the vehicles.")
@click.option(
    "--via",
    multiple=True,
    metavar="EDGES|STREETS|FILE",
    help="Edges that every random loop passes: EDGE,EDGE,... or a file. Of a street the longest edge. Given "
    "several times: a line over each, in one file.",
)
@click.option(
    "--stops",
    metavar="EDGES|STREETS",
    help="With --every: edges or streets at which vehicles stop for 20 s; the bus stops go beside --out.",
)
@click.option(
    "--every",
    "every_s",
    type=Time(),
    help="A timetable: a vehicle on each random loop every so often, as many as keep it at lap times of "
    "--margin.",
)
@click.option(
    "--first", "first_s", type=Time(), help="With --every: when the first vehicles depart, as 9:30."
)
@click.option(
    "--avoid",
    metavar="EDGES|STREETS|FILE|POLYGON",
    help="Streets that no loop uses: as for --cover, or EDGE,EDGE,... or names of streets.",
)
@click.option(
    "--start",
    metavar="EDGES|FILE",
    help="The depot: an edge that every covering loop passes. Of several depots a loop passes the nearest.",
)
@click.option(
    "--weights",
    type=click.Path(dir_okay=False),
    help="File of lines EDGE WEIGHT: streets to visit WEIGHT times as often. Each weight gets its own loops.",
)
@click.option(
    "--vehicles",
    type=click.IntRange(1, 100_000),
    help="Number of vehicles to write: more on longer loops, evenly spaced on each covering loop.",
)
@click.option(
    "--revisit",
    "revisit_s",
    type=FiniteRange(1.0, 1e6),
    help="Write enough vehicles to visit every covered street at least every SECONDS seconds.",
)
@click.option(
    "--margin",
    type=FiniteRange(1.0, 100.0),
    default=1.5,
    show_default=True,
    help="For --revisit, --shift and --every: lap time over the lap time at the speed limits.",
)
@click.option(
    *("--plot", "--picture", "plot"),
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the map of covering loops (PNG, SVG, PDF).",
)
@click.option(
    "--export",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for maps and receivers: GeoJSON of loops and streets, GPX and KML of each loop.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Route file. Default: standard output.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the loops' lengths and edges as JSON.")
def loops(**given: Any) -> None:  # noqa: ANN401  click has checked them
    """Make distinct closed loops in NETWORK that a car can drive. No loop uses an edge twice.

    If there are fewer loops than --count, a warning gives their number. With --cover the loops together cover
    the streets; Ctrl-C ends the search with the best loops so far.

    NETWORK is a .net.xml or .net.xml.gz file, or sumo:NAME for a network of the SUMO package. The loops are
    written as an ordinary SUMO route file, which netedit and sumo-gui open.
    """
    wish = LoopsWish(**given)
    _check_together(wish)
    if wish.cover is not None:
        from loopgate.cli.cover_loops import cover_loops

        cover_loops(wish)
    else:
        _random_loops(wish)


@dataclass(frozen=True, slots=True)
class LoopsWish:
    """The options of the command."""

    network: str
    count: int | None
    length_m: tuple[float, float] | None
    seed: int
    max_shared: float | None
    rho_m: float | None
    u_turns: bool
    cover: str | None
    max_length_m: float | None
    shift_min: float | None
    driven: str | None
    either_way: bool
    both_sides: str | None
    by_district: str | None
    vclass: str
    via: tuple[str, ...]
    stops: str | None
    every_s: float | None
    first_s: float | None
    avoid: str | None
    start: str | None
    weights: str | None
    vehicles: int | None
    revisit_s: float | None
    margin: float
    plot: Path | None
    export: Path | None
    out: Path | None
    as_json: bool

    def roads(self) -> RoadNetwork:
        """Return the network without the streets of `--avoid`."""
        from loopgate.network import RoadNetwork
        from loopgate.network.cover.wishes import read_streets

        roads = RoadNetwork.open(self.network)
        if self.avoid is None:
            return roads
        return roads.without(read_streets(roads, self.avoid, self.vclass, option="--avoid"))

    def put_out(self, text: str, data: Mapping[str, Any]) -> None:
        """Write the route file, or print it, or print the data as JSON."""
        from loopgate.network.routes_text import write_text

        if self.out is not None:
            write_text(text, self.out)
        if self.as_json:
            print_json(data)
        elif self.out is None:
            click.echo(text.encode("utf-8"), nl=False)  # as it says itself, whatever the stream is


def _random_loops(wish: LoopsWish) -> None:
    from loopgate.abstraction.segments import DEFAULT_RHO_M
    from loopgate.abstraction.sharing import SharingBound
    from loopgate.cli.terminal import show_progress
    from loopgate.network import find_loops
    from loopgate.network.cover.wishes import read_streets
    from loopgate.network.routes_text import routes_text
    from loopgate.network.vehicle_type import type_of_class
    from loopgate.simulation.demand.allotment import loops_for_queues

    count, length_m = wish.count or (1 if len(wish.via) > 1 else 12), wish.length_m or (400.0, 2000.0)
    kind = type_of_class(wish.vclass, "--vclass")
    roads = wish.roads()
    overs = [
        read_streets(roads, over, wish.vclass, option="--via", u_turns=wish.u_turns) for over in wish.via
    ] or [()]
    found_loops: list[Loop] = []
    short: list[FoundLoops] = []
    options: LoopOptions = {
        "length_m": length_m,
        "seed": wish.seed,
        "u_turns": wish.u_turns,
        "vclass": wish.vclass,
    }
    if wish.max_shared is not None:
        rho_m = DEFAULT_RHO_M if wish.rho_m is None else wish.rho_m
        options["admits"] = SharingBound(roads, wish.max_shared, rho_m=rho_m).admits
    for over in overs:
        options["via"] = over
        with show_progress("loops", total=count) as report:
            if wish.max_shared is None:
                found = loops_for_queues(roads, count, kinds=(kind,), progress=report, **options)
            else:  # a bound for segments, on which other loops work than on queues
                found = find_loops(roads, count, progress=report, **options)
        known = len(found_loops)
        found_loops += [replace(loop, id=f"loop{known + k}") for k, loop in enumerate(found.loops)]
        if found.shortfall:
            short.append(found)
    note = _note(wish, count, length_m)
    text = routes_text(found_loops, note=note, vehicles=_vehicles(found_loops, kind))
    then = ""
    if wish.every_s is not None:
        text, then = _timetable(wish, roads, found_loops, kind, note)
    data = [{"id": loop.id, "length_m": round(loop.length_m, 2), "edges": loop.edges} for loop in found_loops]
    if wish.export is not None:
        from loopgate.export import export_loops

        export_loops(roads, found_loops, wish.export)
    wish.put_out(text, {"loops": data, "warnings": [one.shortfall for one in short]})
    if wish.out is not None and not wish.as_json:
        total = sum(loop.length_m for loop in found_loops) / 1000.0
        click.echo(f"{counted(len(found_loops), 'loop')}, {total:.1f} km in all, written to {wish.out}")
    if then and not wish.as_json:
        click.echo(then)
    for one in short:
        click.echo(f"warning: {one.shortfall}; for more {one.way_out}", err=True)


def _note(wish: LoopsWish, count: int, length_m: tuple[float, float]) -> str:
    """Return the comment that says how the loops were made."""
    note = f"loopgate loops {wish.network}: count {count}, length {length_m[0]:g}:{length_m[1]:g}"
    note += f", seed {wish.seed}"
    note += "" if wish.max_shared is None else f", max-shared {wish.max_shared:g}"
    note += "" if wish.rho_m is None else f", rho {wish.rho_m:g}"
    note += ", u-turns" if wish.u_turns else ""
    note += "" if wish.vclass == "passenger" else f", vclass {wish.vclass}"
    note += "" if not wish.via else f", via {' and '.join(wish.via)}"
    return note + ("" if wish.avoid is None else f", avoid {wish.avoid}")


def _timetable(
    wish: LoopsWish, roads: RoadNetwork, made: Sequence[Loop], kind: VehicleType, note: str
) -> tuple[str, str]:
    """Return the route file with a timetable and the command that runs it; write the bus stops beside it."""
    from loopgate.network.routes_text import write_text
    from loopgate.network.timetable import Timetable, timetable_texts, without_stops
    from loopgate.results.headings import clock

    names = tuple(filter(None, map(str.strip, (wish.stops or "").split(","))))
    asked = Timetable(names, wish.every_s or 0.0, wish.first_s or 0.0, wish.margin)
    routes, stops = timetable_texts(roads, made, kind, asked, note=note)
    if bare := without_stops(roads, made, asked):
        click.echo(f"warning: {listed(bare)}: no stop on the way; name one in --stops, or --via", err=True)
    if wish.out is not None:
        beside = wish.out.with_name(f"{wish.out.name.removesuffix('.rou.xml').removesuffix('.xml')}.add.xml")
        command = f"loopgate run {shlex.quote(wish.network)} --routes {shlex.quote(str(wish.out))}"
        if names:
            write_text(stops, beside)
            command += f" --stops {shlex.quote(str(beside))} --move-stops"
        command += f" --begin {clock(wish.first_s)}" if wish.first_s else ""
        return routes, f"next: {command} -o out/day"
    return routes, ""


def _vehicles(made: Sequence[Loop], kind: VehicleType) -> list[VehicleDemand]:
    """Return a vehicle for each loop if the file must name the class."""
    from loopgate.network import VehicleDemand

    if kind.vclass == "passenger":
        return []
    return [VehicleDemand(f"{loop.id}.0", loop, kind) for loop in made]


def _check_timetable(wish: LoopsWish) -> None:
    """Raise a usage error for options of a timetable that lack others."""
    for option, value in (("--stops", wish.stops), ("--first", wish.first_s)):
        if value is not None and wish.every_s is None:
            msg = f"{option} belongs to --every"
            raise click.UsageError(msg)
    if wish.stops is not None and wish.out is None:
        msg = "--stops writes two files; name the first with --out"
        raise click.UsageError(msg)
    if wish.every_s is not None and not wish.every_s >= 1.0:
        msg = "--every is at least a second"
        raise click.UsageError(msg)


def _check_together(wish: LoopsWish) -> None:
    """Raise a usage error for an option that does not fit the others."""
    covering: dict[str, object] = {
        "--max-length": wish.max_length_m,
        "--shift": wish.shift_min,
        "--driven": wish.driven,
        "--either-way": wish.either_way or None,
        "--both-sides": wish.both_sides,
        "--by-district": wish.by_district,
        "--start": wish.start,
        "--weights": wish.weights,
        "--vehicles": wish.vehicles,
        "--revisit": wish.revisit_s,
        "--plot": wish.plot,
    }
    strange, other = covering, "--cover"
    if wish.cover is not None:
        strange = {"--length": wish.length_m, "--max-shared": wish.max_shared}
        strange |= {"--rho": wish.rho_m, "--via": wish.via or None}
        strange |= {"--stops": wish.stops, "--every": wish.every_s, "--first": wish.first_s}
        other = "random loops, not to --cover"
    for option in (name for name, value in strange.items() if value is not None):
        msg = f"{option} belongs to {other}"
        msg += "; give 'loopgate run' the number on random loops" if option == "--vehicles" else ""
        raise click.UsageError(msg)
    _check_timetable(wish)
    if wish.both_sides is not None and not wish.either_way:
        msg = "--both-sides belongs to --either-way; without --either-way both directions are covered"
        raise click.UsageError(msg)
    if wish.shift_min is not None and wish.max_length_m is not None:
        msg = "--shift and --max-length both set the longest loop; leave one out"
        raise click.UsageError(msg)
    if wish.vehicles is not None and wish.count is not None and wish.vehicles < wish.count:
        msg = (
            f"--vehicles {wish.vehicles} are too few: each of the {wish.count} loops needs one; "
            f"take --count {wish.vehicles}"
        )
        raise RouteError(msg)
    for one in ("--vehicles", "--max-length"):
        if wish.revisit_s is not None and covering[one] is not None:
            msg = f"--revisit and {one} both set the number of vehicles; leave one out"
            raise click.UsageError(msg)
