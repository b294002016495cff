"""Patrol cars among ordinary trips in south-east Berlin: collisions and waits, SUMO beside the gate.

    python analysis/ordinary.py --seeds 5 --hours 2

Trips are drawn by SUMO's randomTrips.py, one every 2.5 s and one every 1.7 s; lights are obeyed. Runs that
are done are kept in ``out/ordinary``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import pandas as pd
import sumo

from loopgate import RoadNetwork, Sweep, read_results, run_sweep
from loopgate.cli.progress import show_progress

ROOT = Path(__file__).resolve().parent.parent
NETWORK = "sumo:DRT"
PERIODS_S = (2.5, 1.7)
GATES = ("open", "certified")
SHOWN = ("collisions", "deadlocks", "distance_km", "longest_wait_s", "longest_traffic_s")
PERIOD = "trip every [s]"


def write_trips(period_s: float, seed: int, hours: float, file: Path) -> None:
    """Let SUMO draw trips that can be driven."""
    script = Path(sumo.SUMO_HOME) / "tools" / "randomTrips.py"
    net = str(RoadNetwork.open(NETWORK).file)
    words = ["-n", net, "-e", f"{3600 * hours:g}", "-p", f"{period_s:g}", "--seed", str(seed), "--validate"]
    trips = file.with_name(f"{file.name}.trips.xml")
    command = [sys.executable, str(script), *words, "-o", str(trips), "-r", str(file)]
    subprocess.run(command, check=True, capture_output=True, env={"SUMO_HOME": sumo.SUMO_HOME})


def main() -> int:
    """Run what is missing, and print the table; return 1 if a gate's zero is none."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--vehicles", type=int, default=150)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "ordinary")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    include, periods = [], []
    for period_s in PERIODS_S:
        for seed in range(1, given.seeds + 1):
            trips = given.out / f"every{period_s:g}s_{seed}_{given.hours:g}h.rou.xml"
            if not trips.exists():
                write_trips(period_s, seed, given.hours, trips)
            include += [{"gate": gate, "seed": seed, "traffic": str(trips.resolve())} for gate in GATES]
            periods += [period_s] * len(GATES)
    base = {
        "network": NETWORK,
        "loops": 40,
        "vehicles": given.vehicles,
        "lights": "obey",
        "duration_s": 3600.0 * given.hours,
        "on_deadlock": "continue",
    }
    sweep = Sweep("ordinary", base, {}, include=include, folder=ROOT)
    with show_progress("ordinary traffic", total=len(include)) as report:
        run_sweep(sweep, given.out, workers=given.jobs, report=lambda p: report(p.present + p.done))
    every_s = {point.key: period_s for point, period_s in zip(sweep.points(), periods, strict=True)}
    runs = read_results(given.out).runs
    runs = runs[runs["key"].isin(list(every_s))].copy()
    runs[PERIOD] = [every_s[key] for key in runs["key"]]
    runs = runs.sort_values("seed")
    print(runs.groupby([PERIOD, "gate"])[list(SHOWN)].agg(list).to_string())
    gated = runs[runs["gate"] != "open"]
    return int(bool(gated[["trespasses", "overruns"]].to_numpy().sum()))


if __name__ == "__main__":
    pd.set_option("display.width", 250)
    sys.exit(main())
