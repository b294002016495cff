"""Drives vehicles of every car-following model of SUMO under the gate, on slow to fast roads.

``python analysis/car_following.py`` drives 32 vehicles on a grid for two and a half minutes: 17 models, eight
decelerations, six speed limits, four step lengths, with positions. Each run is clean, or it is refused by a
line that names the attribute. Half an hour of two processors takes a quarter of the 3,264 runs, so they go in
an order whose every part covers all levels evenly; a later call goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from functools import cache
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from random import Random
from typing import Any

import pandas as pd
from frame_table import frame_table
from made_networks import netgenerate
from rich.console import Console
from rich.progress import track

from loopgate import Scenario
from loopgate.errors import LoopgateError
from loopgate.network import RoadNetwork, generate_loops
from loopgate.simulation.run import simulate

ROOT = Path(__file__).resolve().parent.parent
MODELS = (
    *("Krauss", "KraussOrig1", "KraussPS", "KraussX", "Daniel1", "IDM", "IDMM", "EIDM", "ACC", "Wiedemann"),
    *("BKerner", "W99", "CACC", "CC", "PWagner2009", "Rail", "SmartSK"),
)
DECELS = (0.8, 1.0, 1.5, 2.0, 3.0, 4.5, 6.0, 9.0)
LIMITS_MPS = (5.0, 8.3, 13.9, 20.0, 30.0, 40.0)
STEPS_S = (0.1, 0.2, 0.5, 1.0)
CITY_MPS = 14.0
"""Faster roads are longer [m/s]."""
BAD = ("collisions", "overruns", "trespasses", "findings")
TITLE = "every car-following model under the gate"
HEADINGS = {
    "model": "model",
    "runs": "runs",
    "taken": "taken",
    "refused": "refused",
    "unnamed": "unnamed",
    "distance_km": "km",
    "faults": "faults",
}

Cell = tuple[str, float, float, float]


def cells() -> list[Cell]:
    """Return model, deceleration [m/s2], speed limit [m/s] and step [s] of each run, in a random order."""
    return Random(7).sample(list(product(MODELS, DECELS, LIMITS_MPS, STEPS_S)), 17 * 8 * 6 * 4)


@cache
def roads(folder: Path, limit_mps: float) -> tuple[Path, tuple[Any, ...]]:
    """Return a grid with this speed limit, and eight loops on it."""
    side_m = 200 if limit_mps < CITY_MPS else 400
    options = f"--grid --grid.number=4 --grid.length={side_m} --default.speed={limit_mps} --no-turnarounds"
    net = netgenerate(options, folder / f"{os.getpid()}-{limit_mps:g}.net.xml")
    return net, tuple(generate_loops(RoadNetwork.open(str(net)), 8, length_m=(4.0 * side_m, 10.0 * side_m)))


def drive(task: tuple[Path, Cell]) -> dict[str, Any]:
    """Drive one cell; return its row."""
    folder, (model, decel, limit_mps, step_s) = task
    net, loops = roads(folder, limit_mps)
    hard = max(decel, 9.0)
    kind = f'<vType id="t" carFollowModel="{model}" decel="{decel}" emergencyDecel="{hard}" maxSpeed="60"/>'
    lines = [kind]
    for loop in loops:
        lines.append(f'<route id="{loop.id}" edges="{" ".join(loop.edges)}"/>')
        lines += [f'<vehicle id="{loop.id}.{k}" type="t" route="{loop.id}" depart="0"/>' for k in range(4)]
    routes = folder / f"{os.getpid()}.rou.xml"
    routes.write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    scenario = Scenario(
        network=str(net), routes=str(routes), duration_s=150.0, step_s=step_s, seed=3, positions=True
    )
    row: dict[str, Any] = {
        "model": model,
        "decel": decel,
        "limit_mps": limit_mps,
        "step_s": step_s,
        "refused": "",
    }
    try:
        summary = simulate(scenario, folder / f"{os.getpid()}", overwrite=True)
    except LoopgateError as error:
        return row | {"refused": str(error)}
    findings = 0 if summary["audit"] == "clean" else len(summary["audit"])
    counts = {name: summary[name] for name in ("collisions", "overruns", "trespasses", "distance_km")}
    return row | {"refused": "", "findings": findings} | counts


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row a model; `unnamed` are refused without the attribute."""
    taken = rows["refused"] == ""
    unnamed = ~taken & ~rows["refused"].str.contains("carFollowModel|decel|tau")
    faults = rows[list(BAD)].sum(axis=1).astype(int)
    rows = rows.assign(taken=taken, refused=~taken, unnamed=unnamed, faults=faults)
    kinds = rows.groupby("model", sort=False)
    total = kinds[["taken", "refused", "unnamed", "distance_km", "faults"]].sum()
    return total.assign(runs=kinds.size(), distance_km=total["distance_km"].round().astype(int)).reset_index()


def main() -> int:
    """Drive the runs that are missing and print a row for each model."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--cells", type=int, default=800, help="runs, those of earlier calls included (default: 800)"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "car-following")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    file = args.out / "rows.jsonl"
    done = (
        [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()] if file.exists() else []
    )
    known = {(row["model"], row["decel"], row["limit_mps"], row["step_s"]) for row in done}
    todo = [(args.out, cell) for cell in cells()[: args.cells] if cell not in known]
    console = Console()
    with get_context("spawn").Pool(args.jobs) as pool, file.open("a", encoding="utf-8") as rows:
        driven = pool.imap_unordered(drive, todo)
        for row in track(driven, "driving", total=len(todo), console=Console(stderr=True)):
            rows.write(json.dumps(row) + "\n")
            rows.flush()
            done.append(row)
    found = table(pd.DataFrame(done).sort_values("model", key=lambda names: names.map(MODELS.index)))
    console.print(frame_table(found, HEADINGS, title=TITLE))
    return int(found[["unnamed", "faults"]].to_numpy().sum() > 0)


if __name__ == "__main__":
    sys.exit(main())
