"""Vehicles that decide among themselves on the road, beside the central gate: kilometres and messages.

    python analysis/vehicles_roads.py                     # all: two hours
    python analysis/vehicles_roads.py --part hour --first-seed 3 --seeds 2 --decide central vehicles
    python analysis/vehicles_roads.py --part costs growth --duration 300

``hour``: the five-by-five grid with 140 and 300 vehicles and a district of Berlin with 300, positions
audited. ``segments``: Algorithm 2 of Zhou et al. 2020 on segments, an hour. ``costs``: what range, loss and
delay take. ``growth``: a grid of 20 x 20 junctions with 100 to 2,000 vehicles. Seed by seed, so that what is
there after a while is of whole seeds. Rows go to a CSV file.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import sumo

from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

NETWORKS = Path(__file__).parents[1] / "networks"
GRID = NETWORKS / "grid5-priority.net.xml"
OUT = Path("out/vehicles")
DISTRICT = Scenario(network="sumo:DRT", loops=60, vehicles=300)
COLUMNS = (
    *(
        "part",
        "network",
        "vehicles",
        "seed",
        "decide",
        "duration_s",
        "km",
        "of_central",
        "per_move",
        "moves",
        "ask",
        "probe",
    ),
    *("longest_m", "lost", "given_back", "late", "otherwise", "unsafe", "longest_wait_s", "collisions"),
    *("deadlocks", "clean", "audit", "wall_s"),
)
COSTS = (
    *("central", "vehicles"),
    *("vehicles:loss=0.1", "vehicles:loss=0.2", "vehicles:loss=0.3", "vehicles:loss=0.4"),
    *("vehicles:delay=0", "vehicles:delay=0.2", "vehicles:delay=0.3", "vehicles:delay=0.5"),
    *("vehicles:delay=1", "vehicles:range=23", "vehicles:range=30", "vehicles:range=40"),
    "vehicles:range=60",
)


PARTS = ("hour", "segments", "costs", "growth")
HOUR = ("central", "vehicles", "vehicles:loss=0.1")
SEGMENTS = tuple(
    Scenario(
        network=str(NETWORKS / f"{name}.net.xml"),
        routes=str(NETWORKS.parent / "routes" / f"{name}.rou.xml"),
        abstraction="segments",
        gate="algorithm2",
        positions=True,
    )
    for name in ("order2", "ring3")
)
FLEETS = {"grid140": 140, "grid300": 300, "drt300": 0}


def cases(
    parts: list[str],
    seeds: range,
    duration_s: float,
    decides: Sequence[str] = (),
    fleets: Sequence[str] = tuple(FLEETS),
) -> Iterator[tuple[str, Scenario]]:
    """Yield what is run, ``central`` first of each."""
    hours = [_grid(FLEETS[name]) if FLEETS[name] else DISTRICT for name in fleets]
    whole = [replace(start, positions=True, duration_s=duration_s or 3600.0) for start in hours]
    made: dict[str, list[tuple[Scenario, tuple[str, ...]]]] = {
        "hour": [(start, tuple(decides) or HOUR) for start in whole],
        "segments": [
            (replace(start, duration_s=duration_s or 3600.0), (*HOUR, "vehicles:delay=0.3"))
            for start in SEGMENTS
        ],
        "costs": [(_grid(300, duration_s=duration_s or 600.0), tuple(decides) or COSTS)],
        "growth": list(_growing(duration_s or 600.0)) if "growth" in parts else [],
    }
    for seed in seeds:
        for part in parts:
            for start, some in made[part]:
                for decide in some:
                    yield part, replace(start, seed=seed, decide=decide)


def _growing(duration_s: float) -> Iterator[tuple[Scenario, tuple[str, ...]]]:
    network = str(large_grid())
    for vehicles in (100, 300, 1000, 2000):
        start = Scenario(network=network, loops=400, vehicles=vehicles, duration_s=duration_s)
        yield start, ("central", "vehicles")


def _grid(vehicles: int, **more: Any) -> Scenario:  # noqa: ANN401  as a scenario's
    return Scenario(network=str(GRID), loops=180, vehicles=vehicles, **more)


def large_grid() -> Path:
    """Make a grid of 20 x 20 junctions, one lane each way, if it is not there."""
    file = OUT / "grid20.net.xml"
    if not file.exists():
        OUT.mkdir(parents=True, exist_ok=True)
        netgenerate = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
        grid = (
            "--grid",
            "--grid.number=20",
            "--grid.length=200",
            "--default.lanenumber=1",
            "--no-turnarounds",
        )
        subprocess.run([str(netgenerate), *grid, "-o", str(file)], check=True, capture_output=True)
    return file


def row(part: str, scenario: Scenario, central_km: float) -> dict[str, Any]:
    """Run a scenario; return its figures."""
    folder = (
        f"run-{part}-{Path(scenario.network).name.partition('.')[0].replace(':', '-')}-{scenario.vehicles}"
    )
    summary = simulate(scenario, OUT / folder, overwrite=True)
    found = summary.get("by_messages") or {}
    kinds = found.get("by_kind", {})
    return {
        "part": part,
        "network": Path(scenario.network).name.partition(".")[0],
        "vehicles": scenario.vehicles,
        "seed": scenario.seed,
        "decide": scenario.decide,
        "duration_s": scenario.duration_s,
        "km": round(summary["distance_km"], 1),
        "of_central": round(summary["distance_km"] / central_km, 4) if central_km else 1.0,
        "per_move": found.get("per_move", ""),
        "moves": found.get("moves", ""),
        "ask": kinds.get("ask", 0),
        "probe": kinds.get("probe", 0),
        "longest_m": found.get("longest_m", ""),
        "lost": found.get("lost", 0) + found.get("too_far", 0),
        "given_back": found.get("given_back", 0),
        "late": summary["refusals"].get("answer", 0),
        "otherwise": sum(found.get("central_otherwise", {}).values()),
        "unsafe": found.get("unsafe", 0),
        "longest_wait_s": summary["longest_wait_s"],
        "collisions": summary["collisions"],
        "deadlocks": len(summary["deadlocks"]),
        "clean": summary["clean"],
        "audit": summary["audit"] if isinstance(summary["audit"], str) else len(summary["audit"]),
        "wall_s": summary["wall_s"]["total"],
    }


def main() -> None:
    """Print and write the rows; exit code 1 if a run was not clean or locked up."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--part", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=5, help="how many")
    parser.add_argument("--fleets", nargs="+", choices=FLEETS, default=list(FLEETS), help="of the hours")
    parser.add_argument("--decide", nargs="+", default=[], help="of hours and costs; central first")
    parser.add_argument("--duration", type=float, default=0.0, help="instead of each part's own [s]")
    options = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    wrong, central_km = 0, 0.0
    name = f"{'-'.join(options.part)}-{options.first_seed}-{'-'.join(options.fleets)}.csv"
    with (OUT / name).open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        print(" ".join(COLUMNS))
        seeds = range(options.first_seed, options.first_seed + options.seeds)
        for part, scenario in cases(options.part, seeds, options.duration, options.decide, options.fleets):
            one = row(part, scenario, 0.0 if scenario.decide == "central" else central_km)
            if scenario.decide == "central":
                central_km = one["km"]
            wrong += not one["clean"] or one["deadlocks"] > 0 or one["unsafe"] > 0
            table.writerow(one)
            file.flush()
            print(" ".join(str(one[c]) for c in COLUMNS), flush=True)
    sys.exit(int(wrong > 0))


if __name__ == "__main__":
    main()
