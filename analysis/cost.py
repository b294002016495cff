"""What the gate costs on top of SUMO's own steps, plain and compiled: the one table. ``make cost``.

    python analysis/cost.py                              # every row, a quarter of an hour
    python analysis/cost.py --rows grid400 drt --pairs 5
    python analysis/cost.py --trips NET ROUTES           # a row more: trips of yours, lights obeyed

*On top* is the processor time outside SUMO's steps over that in them, of the thread that drives. Each run is
a process of its own. A pair is a run with the plain ledger and one with the compiled ledger, one after the
other; the table has the median over the pairs, with the least and the greatest.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pandas as pd
import sumo
from by_thread_time import median_and_spread, time_by_thread
from compiled_wheel import compile_copy
from frame_table import frame_table
from heart import draw_trips
from rich.console import Console

from loopgate.cli.terminal import show_progress
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.versions import ledger_kind

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "cost"
BIG, OTHERS, TRIPS = OUT / "grid20.net.xml", OUT / "others.rou.xml", OUT / "trips.rou.xml"

GRID = Scenario(network=str(ROOT / "networks" / "grid5-priority.net.xml"), vehicles=100, duration_s=3600.0)
ROWS = {
    "grid100": ("grid 5 x 5, 100 vehicles", GRID),
    "grid400": ("grid 5 x 5, 400 vehicles", replace(GRID, vehicles=400, duration_s=1200.0)),
    "big": (
        "grid 20 x 20, 1,000 vehicles",
        Scenario(network=str(BIG), loops=40, vehicles=1000, duration_s=300.0, lights="off"),
    ),
    "drt": (
        "sumo:DRT, 300 vehicles, lights obeyed",
        Scenario(network="sumo:DRT", loops=60, vehicles=300, duration_s=900.0, lights="obey"),
    ),
    "ordinary": (
        "grid 5 x 5, 60 vehicles among ordinary trips",
        replace(GRID, vehicles=60, duration_s=1800.0, traffic=str(OTHERS)),
    ),
    "trips": (
        "grid 20 x 20, trips under the gate",
        Scenario(network=str(BIG), routes=str(TRIPS), duration_s=600.0, lights="off"),
    ),
}
OTHERS_EVERY_S, TRIPS_EVERY_S = 2.5, 1.0
KINDS = ("plain", "compiled")


def prepare() -> None:
    """Make the large grid, and draw the trips."""
    OUT.mkdir(parents=True, exist_ok=True)
    words = ("--grid", "--grid.number=20", "--grid.length=200", "--default.lanenumber=1", "--no-turnarounds")
    tool = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
    subprocess.run([tool, *words, f"--output-file={BIG}"], check=True, capture_output=True)
    draw_trips(GRID.network, OTHERS_EVERY_S, 1800.0, 1, OTHERS)
    draw_trips(str(BIG), TRIPS_EVERY_S, 600.0, 1, TRIPS)


def measure(scenario: Scenario) -> dict[str, Any]:
    """Run a scenario in this process; return the ledger that drove it, and the times of SUMO and gate [s]."""
    time_by_thread()
    summary = simulate(scenario)
    wall = summary["wall_s"]
    return {"kind": ledger_kind(), "sumo": wall["sumo"], "gate": wall["gate"], "km": summary["distance_km"]}


def run_apart(scenario: Scenario, kind: str, sources: dict[str, Path]) -> dict[str, Any]:
    """Measure in a process of its own, with the sources of one kind."""
    env = {**os.environ, "PYTHONPATH": str(sources[kind])}
    done = subprocess.run(
        [sys.executable, __file__, "--one"],
        input=json.dumps(asdict(scenario)),
        check=True,
        capture_output=True,
        text=True,
        env=env,
    )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    if found["kind"] != kind:
        sys.exit(f"the ledger should be {kind}, and is {found['kind']}")
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rows", nargs="*", choices=ROWS, default=list(ROWS))
    parser.add_argument("--trips", nargs=2, action="append", default=[], metavar=("NET", "ROUTES"))
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(measure(Scenario.from_dict(json.load(sys.stdin), source="analysis/cost.py"))))
        return
    prepare()
    rows = [ROWS[name] for name in given.rows]
    for network, routes in given.trips:
        trips = Scenario(network=network, routes=routes, duration_s=3600.0, lights="obey")
        rows.append((f"{Path(network).name.partition('.')[0]}, all trips gated", trips))
    table = []
    with (
        tempfile.TemporaryDirectory() as folder,
        show_progress("runs", total=len(rows) * given.pairs * len(KINDS)) as report,
    ):
        compile_copy(Path(folder))
        sources, done = {"plain": ROOT / "src", "compiled": Path(folder)}, 0
        for name, scenario in rows:
            found: dict[str, list[dict[str, Any]]] = {kind: [] for kind in KINDS}
            for _ in range(given.pairs):
                for kind in KINDS:
                    found[kind].append(run_apart(scenario, kind, sources))
                    done += 1
                    report(done)
            if len({one["km"] for both in found.values() for one in both}) > 1:
                sys.exit(f"{name}: plain and compiled do not drive the same distance")
            shares = {kind: [one["gate"] / one["sumo"] for one in found[kind]] for kind in KINDS}
            steps_s = statistics.median(one["sumo"] for both in found.values() for one in both)
            table.append(
                {
                    "what": name,
                    **{kind: median_and_spread(shares[kind]) for kind in KINDS},
                    "sumo_s": f"{steps_s:.2f}",
                }
            )
    title = f"on top of SUMO's own steps, by thread time; median of {given.pairs} pairs, least and greatest"
    headings = {"what": "", **{kind: kind for kind in KINDS}, "sumo_s": "SUMO [s]"}
    Console(width=120).print(frame_table(pd.DataFrame(table), headings, title=title))


if __name__ == "__main__":
    main()
