"""One vehicle that stands for a while: how far everybody else drives, against the same run without it.

    python analysis/standing.py --seeds 5 --write

drives loops on four networks with 0.3, 0.6 and 0.9 of the vehicles that can start. One vehicle breaks down
after ten minutes, for ten, thirty or sixty minutes. The yardstick is the vehicle-km of all others in the
measured time, as a share of theirs in the same run in which nothing happens. ``wait`` is the gate without
containment, ``open`` are SUMO's own rules, ``rerouted`` those with its rerouting device, each against the
same rule in which nothing happens.
"""

from __future__ import annotations

import argparse
import itertools
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd
from frame_table import frame_table
from rich.console import Console
from standing_rerouted import drive

from loopgate import Scenario
from loopgate.cli.terminal import show_progress
from loopgate.errors import TooManyVehiclesError
from loopgate.runs.run import read_run
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate

ROOT = Path(__file__).resolve().parents[1]
OUT = Path(__file__).parent / "tables" / "standing.json"
BREAKS_S = 600.0
LOOPS = 30
RULES = {
    "contained": {"standing": "contain"},
    "wait": {"standing": "wait"},
    "open": {"gate": "open", "on_deadlock": "continue"},
    "rerouted": {"gate": "open"},
}


def networks(more: list[str]) -> dict[str, dict[str, Any]]:
    """Return the networks of the study with the loops on them, and those that are named besides."""
    grid = str(ROOT / "networks/grid5-priority.net.xml")
    found: dict[str, dict[str, Any]] = {
        "grid": {"network": grid, "routes": str(ROOT / "routes/grid5.rou.xml")},
        "DRT": {"network": "sumo:DRT", "loops": LOOPS},
    }
    return found | {Path(file).name.partition(".")[0]: {"network": file, "loops": LOOPS} for file in more}


def most(what: dict[str, Any]) -> int:
    """Return how many vehicles can start there."""
    try:
        assemble(Scenario(vehicles=100_000, **what))
    except TooManyVehiclesError as error:
        return int(error.fitting)
    return 100_000


def driven(
    scenario: Scenario, folder: Path, without: str, rule: str, until_s: float = BREAKS_S
) -> dict[str, Any]:
    """Return what all vehicles but one did, which stands until then."""
    if rule == "rerouted":
        return drive(scenario, folder, without, (BREAKS_S, until_s))
    if until_s > BREAKS_S:
        file = folder / "incidents.toml"
        stands = f'vehicle = "{without}"\nfrom = {BREAKS_S:g}\nto = {until_s:g}\n'
        file.write_text(f"[[breakdowns]]\n{stands}")
        scenario = replace(scenario, incidents=str(file))
    summary = simulate(scenario, folder / "run", overwrite=True)
    vehicles = read_run(folder / "run").vehicles
    others = vehicles[vehicles["vehicle"] != without]
    starving = {vehicle for sink in summary["starving"] for vehicle in sink["vehicles"]}
    return {
        "km": float(others["distance_m"].sum()) / 1000.0,
        "laps": int(others["laps"].sum()),
        "starving": len(starving),
        "longest_wait_s": summary["longest_wait_s"],
        "collisions": summary["collisions"],
        "trespasses": summary.get("trespasses"),
        "outcome": summary["outcome"],
        "clean": summary.get("clean"),
        "led_round": summary.get("standing", {}).get("led_round", 0),
        "no_way_round": len(summary.get("standing", {}).get("no_way_round", ())),
    }


def points(args: argparse.Namespace) -> Iterator[tuple[str, dict[str, Any], float, int, int]]:
    """Yield network, share, number of vehicles and seed of each run."""
    for name, what in networks(args.nets).items():
        if args.only and name not in args.only:
            continue
        can_start = most(what)
        for share, seed in itertools.product(args.shares, range(1, args.seeds + 1)):
            yield name, what, share, max(2, round(share * can_start)), seed


def main() -> None:
    """Run, and print or write the table."""
    said = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    said.add_argument("--seeds", type=int, default=1)
    said.add_argument("--nets", nargs="*", default=[], help="more network files")
    said.add_argument("--only", nargs="*", default=[], help="of all these networks only those of these names")
    said.add_argument("--shares", nargs="*", type=float, default=[0.3, 0.6, 0.9])
    said.add_argument("--minutes", nargs="*", type=int, default=[10, 30, 60])
    said.add_argument("--rules", nargs="*", default=list(RULES), choices=list(RULES))
    said.add_argument("--hours", type=float, default=1.0)
    said.add_argument("--write", action="store_true")
    args = said.parse_args()
    rows = []
    every = list(points(args))
    with TemporaryDirectory() as scratch, show_progress("runs", total=len(every)) as report:
        folder = Path(scratch)
        for number, (name, what, share, count, seed) in enumerate(every):
            for rule in args.rules:
                common = dict(what, vehicles=count, seed=seed, duration_s=3600.0 * args.hours, **RULES[rule])
                first = assemble(Scenario(**common)).starts[0].vehicle
                free = driven(Scenario(**common), folder, first, rule)
                for minutes in args.minutes:
                    stands = driven(Scenario(**common), folder, first, rule, BREAKS_S + 60.0 * minutes)
                    key = {"network": name, "share": share, "vehicles": count, "seed": seed, "rule": rule}
                    rows.append(
                        key
                        | {"minutes": minutes, "free_km": free["km"], "kept": stands["km"] / free["km"]}
                        | {"free_outcome": free["outcome"], **stands}
                    )
                    print(json.dumps(rows[-1]), flush=True)
            report(number + 1)
    table = pd.DataFrame(rows)
    each = table.groupby(["network", "share", "minutes", "rule"], sort=False)
    told = each.agg(
        vehicles=("vehicles", "first"),
        kept=("kept", "mean"),
        least=("kept", "min"),
        starving=("starving", "mean"),
        collisions=("collisions", "sum"),
        trespasses=("trespasses", "sum"),
    ).reset_index()
    columns = {name: str(name) for name in told.columns}
    Console(width=120).print(frame_table(told.round(3), columns, title="Kilometres of all others"))
    if args.write:
        OUT.write_text(table.to_json(orient="records", indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
