"""Patrol cars among ordinary trips in south-east Berlin: collisions and waits, SUMO beside the gate.

    python analysis/ordinary.py --seeds 5 --hours 2

Trips are drawn by SUMO's randomTrips.py, one every 2.5 s and one every 1.7 s; lights are obeyed. Runs that
are done are kept in ``out/ordinary``.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import sumo

from loopgate import RoadNetwork, Scenario, run
from loopgate.cli.terminal import show_progress
from loopgate.simulation.run_folder import SUMMARY

ROOT = Path(__file__).resolve().parent.parent
NETWORK = "sumo:DRT"
PERIODS_S = (2.5, 1.7)
GATES = ("certified", "open")
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
    parser.add_argument("--periods", type=float, nargs="+", default=list(PERIODS_S), help="of trips [s]")
    parser.add_argument("--gates", nargs="+", default=list(GATES))
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "ordinary")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    points = [(p, s, g) for g in given.gates for p in given.periods for s in range(1, given.seeds + 1)]
    rows = []
    with show_progress("ordinary traffic", total=len(points)) as report:
        for number, (period_s, seed, gate) in enumerate(points, 1):
            trips = given.out / f"every{period_s:g}s_{seed}_{given.hours:g}h.rou.xml"
            if not trips.exists():
                write_trips(period_s, seed, given.hours, trips)
            scenario = Scenario(
                network=NETWORK,
                loops=40,
                vehicles=given.vehicles,
                lights="keep" if gate == "open" else "obey",
                gate=gate,
                seed=seed,
                traffic=str(trips.resolve()),
                duration_s=3600.0 * given.hours,
                positions=gate != "open",
                on_deadlock="continue",
            )
            rows.append({PERIOD: period_s, **row(scenario, given.out / f"{gate}-{trips.name[:-8]}")})
            report(number)
    table = pd.DataFrame(rows)
    print(table.groupby([PERIOD, "gate"], sort=False).agg(list).T.to_string())
    gated = table[table["gate"] != "open"]
    ours = gated["collisions"] - gated["by others"] + gated["locks of the gate"]
    return int(bool((gated["broken"] + ours).sum()))


def row(scenario: Scenario, folder: Path) -> dict[str, Any]:
    """Run a scenario, or take what it gave before; return its figures."""
    kept = folder / SUMMARY
    if not kept.exists():
        run(scenario, folder, overwrite=True)
    found = json.loads(kept.read_text(encoding="utf-8"))
    return {
        "gate": scenario.gate,
        "seed": scenario.seed,
        "collisions": found["collisions"],
        "by others": found.get("collisions_by_others", 0),
        "locks": " ".join(told(lock) for lock in found["deadlocks"]),
        "locks of the gate": sum(is_gates(lock) for lock in found["deadlocks"]),
        "broken": found["trespasses"] + found["overruns"],
        "km": round(found["distance_km"]),
        "longest wait [s]": found["longest_wait_s"],
    }


def told(lock: dict[str, Any]) -> str:
    """Return when a lock was seen, whose it is, and who came last into it."""
    last = lock.get("last")
    came = f", last {last['vehicle']} at {last['at_s']:.0f}" if last else ""
    return f"{lock['closed_at_s']:.0f}:{lock.get('by', '')}{came}"


def is_gates(lock: dict[str, Any]) -> bool:
    """Return whether gated vehicles locked up alone, or one of them was let in last."""
    by = lock.get("by")
    return by == "gated" or (by == "both" and lock.get("last", {}).get("gated", False))


if __name__ == "__main__":
    pd.set_option("display.width", 250)
    sys.exit(main())
