"""How often streets are seen: SUMO's rules beside the gate, loops by design and by chance, spacing or none.

    python analysis/watched.py --seeds 5 --write
    python analysis/watched.py --only 'DRT-*-40' --seeds 5
    python analysis/watched.py my.net.xml --seeds 1

One hour after half an hour. Loops are made once per seed, and each rule drives the same vehicles on them,
evenly started. Beside what was measured stands what the same vehicles would reach at the same speeds if those
of each loop came evenly. All tables are run with one seed before the next; runs that are done are kept, so
the study may be ended at any time; see ``--help``.
"""

from __future__ import annotations

import argparse
import math
import random
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import lru_cache
from pathlib import Path
from typing import Any

import pandas as pd
from sweep_runs import rows_with, sweep_runs
from throughput_study import ROOT, markdown, with_half, write_section

from loopgate.abstraction.covering import cover_streets
from loopgate.abstraction.queue_layout import why_not
from loopgate.errors import LoopgateError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, generate_loops, read_loops
from loopgate.network.cover.design import CoverTask
from loopgate.network.cover.watch import even_starts_m, laps_s, vehicles_needed
from loopgate.network.routes_text import routes_text, write_text
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.results import columns as c
from loopgate.sweep import Sweep

PAGE = ROOT / "docs" / "studies" / "covering.md"
TABLES = ROOT / "analysis" / "tables" / "watched.md"
"""A table for each cell; the page shows one row of each."""

LEAST_SEEDS = 3
"""Tables of fewer seeds are not on the page."""

RULE = "rule"
WARMUP_S, DURATION_S = 1800.0, 3600.0
REVISIT_S = 600.0
MARGIN = 1.5
MEAN, WORST = "idleness [s]", "worst [s]"
GRID = str(ROOT / "networks" / "grid5-priority.net.xml")
BS3D = "sumo:bs3d"
COUNTS = {"sumo:DRT": 18, BS3D: 5, GRID: 12}
"""How many loops cover a network by design; 300 vehicles find room on them."""

MANY = 300
TRIP_EVERY_S = 5.0


@dataclass(frozen=True, slots=True)
class Cell:
    """One table: the same loops and vehicles under several rules.

    Attributes
    ----------
    network, loops, vehicles
        ``loops`` is ``covering``, ``random``, ``one`` (a single long cycle), ``partition`` (a loop for each
        vehicle), or ``revisit`` and ``margin`` (as many vehicles as the promise takes).
    traffic
        Whether other vehicles drive there; lights are then obeyed.
    """

    network: str
    loops: str
    vehicles: int
    traffic: bool = False

    @property
    def name(self) -> str:
        """Of its folder; SUMO takes a comma in the name of a file for two files."""
        network = Path(self.network).name.removeprefix("sumo:").partition(".")[0]
        return f"{network}-{self.loops}-{self.vehicles}{'-traffic' if self.traffic else ''}"

    def rules(self) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """Return the rules by name."""
        lights = "obey" if self.traffic else "off"
        if self.network == GRID:
            for rule in ("priority", "right-before-left", "all-way-stop", "actuated"):
                yield (
                    f"SUMO, {rule.replace('-', ' ')}",
                    {
                        "network": GRID.replace("priority", rule),
                        "gate": "open",
                    },
                )
        elif self.network == BS3D:  # its lights wait for a player of a game
            yield (
                "SUMO, lights off",
                {"gate": "open", "lights": "off"},
            )
        else:
            yield "SUMO, lights on", {"gate": "open", "lights": "keep"}
        for spacing in ("none", "hold", "advice"):
            yield f"loopgate, {spacing}", {"spacing": spacing, "lights": lights}


def cells(networks: list[str]) -> list[Cell]:
    """Return all tables, in the order of the page."""
    counts = 20, 40, 80, MANY
    small = [(network, vehicles) for network in (GRID, BS3D) for vehicles in (20, 40, 80)]
    return [
        *(Cell("sumo:DRT", "covering", vehicles) for vehicles in counts),
        *(Cell("sumo:DRT", loops, 0) for loops in ("revisit", "margin")),
        *(Cell("sumo:DRT", "random", vehicles) for vehicles in counts),
        *(Cell("sumo:DRT", "covering", vehicles, traffic=True) for vehicles in counts),
        *(Cell(network, "covering", vehicles) for network, vehicles in small),
        *(Cell("sumo:DRT", loops, 40) for loops in ("one", "partition")),
        *(Cell(name, "covering", vehicles) for name in networks for vehicles in (40, 80)),
    ]


@lru_cache(maxsize=2)
def make_loops(network: str, kind: str, count: int, seed: int) -> tuple[Loop, ...]:
    """Return so many random, covering or (short in time) revisit loops; kept, since cells share them."""
    roads = RoadNetwork.open(network)
    if kind == "random":
        admits = lambda loop: not why_not(roads, loop)  # noqa: E731  a word for what follows
        return tuple(generate_loops(roads, count, seed=seed, admits=admits))
    task = replace(CoverTask(), by_time=kind == "revisit")
    return tuple(cover_streets(roads, task, count, seed=seed).loops)


def write_loops(cell: Cell, roads: RoadNetwork, seed: int, file: Path) -> None:
    """Write the loops of a seed, with the vehicles that a promise takes."""
    count = {"one": 1, "partition": cell.vehicles, "revisit": 5, "margin": 5}.get(
        cell.loops, COUNTS.get(cell.network, 18)
    )
    kind = {"one": "covering", "partition": "covering", "margin": "revisit"}.get(cell.loops, cell.loops)
    loops = make_loops(cell.network, kind, count, seed)
    vehicles: list[VehicleDemand] = []
    if not cell.vehicles:
        laps = [lap * (MARGIN if cell.loops == "margin" else 1.0) for lap in laps_s(roads, loops)]
        vehicles = [
            VehicleDemand(f"{loop.id}.{k}", loop, DEFAULT_TYPE, at)
            for loop, number in zip(loops, vehicles_needed(laps, REVISIT_S), strict=True)
            for k, at in enumerate(even_starts_m(roads, loop, number))
        ]
    write_text(routes_text(loops, note=f"{cell.name}, seed {seed}", vehicles=vehicles), file)


def write_trips(routes: Path, roads: RoadNetwork, seed: int, file: Path) -> None:
    """Write trips of other vehicles between streets on the loops, which all can be reached."""
    draw = random.Random(seed)
    edges = sorted({edge for loop in read_loops(roads, routes).loops for edge in loop.edges})
    trips = [
        f'    <trip id="other{k}" depart="{k * TRIP_EVERY_S:g}" from="{begin}" to="{end}"/>'
        for k in range(int((WARMUP_S + DURATION_S) / TRIP_EVERY_S))
        for begin, end in [draw.sample(edges, 2)]
    ]
    write_text("\n".join(["<routes>", *trips, "</routes>", ""]), file)


def simulate(cell: Cell, given: argparse.Namespace, seeds: int) -> pd.DataFrame:
    """Run what is missing of a table with so many seeds; return its rows with a column for the rule."""
    folder = given.out / cell.name
    folder.mkdir(parents=True, exist_ok=True)
    roads = RoadNetwork.open(cell.network)
    include, names = [], []
    for seed in range(1, seeds + 1):
        routes, trips = folder / f"loops{seed}.rou.xml", folder / f"trips{seed}.rou.xml"
        if given.done and not (routes.exists() and (trips.exists() or not cell.traffic)):
            break
        if not routes.exists():
            write_loops(cell, roads, seed, routes)
        if cell.traffic and not trips.exists():
            write_trips(routes, roads, seed, trips)
        common = {"network": cell.network, "routes": str(routes), "seed": seed, "starts": "even"}
        common |= {"traffic": str(trips)} if cell.traffic else {}
        common |= {"vehicles": cell.vehicles} if cell.vehicles else {"revisit_s": REVISIT_S}
        for name, rule in cell.rules():
            if not any(word in name for word in given.rules):
                continue
            include.append({**common, **rule})
            names.append(name)
    if not include:
        return pd.DataFrame()
    base = {"on_deadlock": "continue", "duration_s": DURATION_S, "warmup_s": WARMUP_S}
    sweep = Sweep(cell.name, base, {}, include=include, folder=ROOT)
    rules = {point.key: name for point, name in zip(sweep.points(), names, strict=True)}
    runs = rows_with(folder, rules) if given.done else sweep_runs(sweep, folder, workers=given.jobs)
    runs[RULE] = [rules[key] for key in runs[c.KEY]]
    return runs


def table(cell: Cell, runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row per rule: means with half their 95 % intervals over the seeds."""
    rows = []
    for rule, _ in cell.rules():
        group = runs[runs[RULE] == rule]
        done = group[group[c.STATUS] == c.STATUS_OK]
        if done.empty:
            if len(group):
                rows.append({RULE: rule, MEAN: f"refused: {group[c.ERROR].iloc[0]}"})
            continue
        gated = done[done[c.AUDIT] != c.NOT_GATED]
        row = {
            RULE: rule,
            MEAN: with_half(done[c.IDLENESS], 1),
            "over even": _over(done[c.IDLENESS] / done[c.IF_EVEN]),
            WORST: with_half(done[c.WORST_IDLENESS], 0),
            "worst over even": _over(done[c.WORST_IDLENESS] / done[c.WORST_IF_EVEN]),
            "coefficient of variation": f"{done[c.HEADWAY_CV].mean():.2f}",
            "bunched": f"{done[c.BUNCHED].mean():.1%}",
            "never seen": f"{done[c.NEVER_SEEN].mean():.0f}",
            "km": with_half(done[c.KM_PER_H], 0),
            "longest wait [s]": f"{done[c.LONGEST_WAIT].max():.0f}" if len(gated) else "",
            "locked": f"{int((done[c.DEADLOCKS] > 0).sum())} of {len(done)}",
            "collisions": f"{int(done[c.COLLISIONS].sum())}",
            "clean": f"{int(gated[c.KEPT].sum())} of {len(gated)}" if len(gated) else "",
        }
        if not cell.vehicles:
            row |= {
                "vehicles": with_half(done[c.VEHICLES], 1),
                "within 600 s": f"{done[c.WITHIN_OF_SEEN].mean():.1%}",
                "streets over": f"{done[c.STREETS_OVER].mean():.0f}",
            }
        rows.append(row)
    return pd.DataFrame(rows).fillna("")


def _over(ratios: pd.Series[float]) -> str:
    """Return by how much more it is, where vehicles came to every street at all."""
    return f"{ratios.mean() - 1:+.0%}" if ratios.notna().all() else ""


def title(cell: Cell, runs: pd.DataFrame) -> str:
    """Return what the table is about."""
    network = cell.network if cell.network.startswith("sumo:") else Path(cell.network).name.partition(".")[0]
    loops = f"{runs[c.LOOPS].median():.0f}"
    kinds = {
        "covering": f"{loops} covering loops",
        "random": f"{loops} random loops",
        "one": "one loop that covers all",
        "partition": "a covering loop for each",
        "revisit": f"{loops} covering loops, the fleet for a visit every 600 s at the speed limits",
        "margin": f"{loops} covering loops, the fleet for a visit every 600 s if laps take 1.5 times as long",
    }
    vehicles = f"{cell.vehicles} vehicles on " if cell.vehicles else "vehicles on "
    among = ", among other traffic, lights obeyed" if cell.traffic else ""
    return f"**{network}, {vehicles}{kinds[cell.loops]}{among}**"


def renewed(page: str, tables: Iterable[str]) -> str:
    """Return the tables of a page with these in place of those that have their titles, or after them."""
    section = page.partition("<!-- watched: begin -->\n")[2].partition("\n<!-- watched: end -->")[0]
    parts = {part.partition("**, ")[0]: part for part in re.split(r"\n\n(?=\*\*)", section) if part}
    parts |= {part.partition("**, ")[0]: part for part in tables}
    return "\n\n".join(parts.values())


ON_PAGE = "40 vehicles on (?!one|a )|80 vehicles on 18 covering|300 vehicles|the fleet for"
"""The rows of the overview; the tables of the others are in the file of tables."""


def overview(tables: str) -> str:
    """Return a table with one row for each table: idleness under SUMO's best rule and under the gate."""
    rows = []
    for part in re.split(r"\n\n(?=\*\*)", tables):
        named, _, text = part.partition("\n\n")
        what, seeds = named.rsplit("**, ", 1)
        if int(seeds.removesuffix(" seeds")) < LEAST_SEEDS:
            continue  # their intervals say nothing
        if not re.search(ON_PAGE, what):
            continue
        head, _, *lines = (
            [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()
        )
        found = {line[0]: dict(zip(head, line, strict=True)) for line in lines}
        own = min(
            (name for name in found if name.startswith("SUMO")), key=lambda name: _first(found[name][MEAN])
        )
        row = {"network, vehicles, loops": what.removeprefix("**")}
        columns = {"SUMO": own} | {rule: f"loopgate, {rule}" for rule in ("hold", "advice")}
        for short, title in ((MEAN, "mean"), (WORST, "worst")):
            for column, rule in columns.items():
                row[f"{title}: {column}"] = found.get(rule, {}).get(short, "")
        row["SUMO: locked, collisions"] = f"{found[own]['locked']}, {found[own]['collisions']}"
        rows.append(row)
    return markdown(pd.DataFrame(rows))


def _first(cell: str) -> float:
    return math.inf if cell.startswith("refused") else float(cell.split(maxsplit=1)[0])


def main() -> None:
    """Run what is missing, print the tables, and renew the page if asked to."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("networks", nargs="*", help="further networks")
    words.add_argument("--seeds", type=int, default=1)
    words.add_argument("--only", nargs="+", default=["*"], help="only tables of these names, as 'DRT-*-40'")
    words.add_argument("--rules", nargs="+", default=[""], help="only rules in whose name one of these is")
    words.add_argument("--done", action="store_true", help="run nothing; show what has been run")
    words.add_argument("--jobs", type=int, default=1, help="processes")
    words.add_argument("--out", type=Path, default=ROOT / "out" / "watched", help="results folder")
    words.add_argument(
        "--write",
        action="store_true",
        help=f"renew analysis/tables/{TABLES.name} and docs/studies/{PAGE.name}",
    )
    given = words.parse_args()
    chosen = [
        cell
        for cell in cells(given.networks)
        if any(fnmatch(cell.name, pattern) for pattern in given.only)
        and (not given.done or (given.out / cell.name).exists())
    ]
    tables: dict[str, str] = {}
    for seeds in range(given.seeds if given.done else 1, given.seeds + 1):
        for cell in chosen:
            try:
                runs = simulate(cell, given, seeds)
            except LoopgateError as error:
                print(f"{cell.name}: {error}", flush=True)
                continue
            if not runs.empty:
                said = f"{title(cell, runs)}, {runs[c.SEED].nunique()} seeds"
                tables[cell.name] = f"{said}\n\n{markdown(table(cell, runs))}"
                print(f"\n{tables[cell.name]}", flush=True)
    if given.write:
        every = renewed(TABLES.read_text(encoding="utf-8"), tables.values())
        write_section(every, "watched", TABLES)
        write_section(overview(every), "watched", PAGE)


if __name__ == "__main__":
    main()
