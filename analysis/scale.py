"""A city at scale: thousands of vehicles at a time under the gate, and what that takes.

    python analysis/scale.py                  # all rows three times, half an hour
    python analysis/scale.py --rows trips drt

On a grid of 40 x 40 junctions with one lane each way: trips between edges drawn by SUMO's ``randomTrips.py``,
as many departing in each second, and vehicles on loops; and loops in a district of Berlin. Each row is a
process of its own, and is run several times. Times are the processor time of the thread that drives, medians;
*on top* is the time outside SUMO's steps over that in them, while vehicles drive, with the least and the
greatest. What is prepared before the first step, and judged and written after the last, is told apart. Exit
code 1 if a vehicle collided or the audit found something.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from operator import itemgetter
from pathlib import Path
from typing import Any

import pandas as pd
import sumo
from by_thread_time import median_and_spread, time_by_thread
from day import Memory
from frame_table import frame_table
from rich.console import Console

from loopgate.cli.terminal import show_progress
from loopgate.results.columns import ON_ROAD
from loopgate.runs.run import read_run
from loopgate.simulation.loop_run import RunCourse
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "scale"
GRID, TRIPS = OUT / "grid40.net.xml", OUT / "trips.rou.xml"
TRIPS_S, WAYS, PER_S = 1200, 2000, 15
"""For how long trips depart [s], on how many ways, and how many in each second."""

ROWS = {
    "trips": Scenario(network=str(GRID), routes=str(TRIPS), duration_s=TRIPS_S, lights="off"),
    "loops": Scenario(network=str(GRID), loops=50, vehicles=1000, duration_s=900.0, lights="off"),
    "many": Scenario(network=str(GRID), loops=200, vehicles=5000, duration_s=300.0, lights="off"),
    "drt": Scenario(network="sumo:DRT", loops=60, vehicles=300, duration_s=900.0, lights="off"),
}
NAMES = {
    "trips": "grid 40 x 40, trips",
    "loops": "grid 40 x 40, loops",
    "many": "grid 40 x 40, loops",
    "drt": "sumo:DRT, loops",
}
MEMORY_EVERY_S = 100.0
HEADINGS = {
    "name": "what",
    "mean": "at a time",
    "most": "at most",
    "done": "arrived or laps",
    "sumo_s": "SUMO [s]",
    "gate_s": "gate [s]",
    "on_top": "on top",
    "faster": "x real time",
    "prepared_s": "before [s]",
    "after_s": "after [s]",
    "in_all": "x in all",
    "memory": "memory [MB], at half time and at the end",
    "collisions": "collisions",
    "audit": "audit",
}


def prepare() -> None:
    """Make the grid and draw the trips."""
    OUT.mkdir(parents=True, exist_ok=True)
    home = Path(sumo.SUMO_HOME)
    grid = ("--grid", "--grid.number=40", "--grid.length=200", "--default.lanenumber=1", "--no-turnarounds")
    _call(str(home / "bin" / "netgenerate"), *grid, f"--output-file={GRID}")
    drawn = ("-e", str(TRIPS_S), "-p", f"{1.0 / PER_S:g}", "--flows", str(WAYS), "--poisson", "--seed", "1")
    tool = str(home / "tools" / "randomTrips.py")
    _call(sys.executable, tool, "-n", str(GRID), "-o", str(TRIPS), *drawn)


def _call(*command: str) -> None:
    home = {"SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run(command, check=True, capture_output=True, env=home, cwd=OUT)  # the tools leave files there


def measure(row: str) -> dict[str, Any]:
    """Run a scenario and return its row; `on_top` is a share."""
    time_by_thread()
    memory = Memory(MEMORY_EVERY_S)

    def tick(now_s: float, _course: RunCourse) -> None:
        memory.look(now_s)

    summary = simulate(ROWS[row], OUT / row, tick=tick, overwrite=True)
    at_a_time = read_run(OUT / row).flow[ON_ROAD]
    wall, duration_s = summary["wall_s"], summary["duration_s"]
    driven_s, peaks_mb = wall["sumo"] + wall["gate"], memory.peaks_mb
    return {
        "name": NAMES[row],
        "mean": round(at_a_time[len(at_a_time) // 2 :].mean()),
        "most": int(at_a_time.max()),
        "done": summary.get("arrived", summary["laps"]),
        "sumo_s": f"{wall['sumo']:.1f}",
        "gate_s": f"{wall['gate']:.1f}",
        "on_top": wall["gate"] / wall["sumo"],
        "faster": f"{duration_s / driven_s:.1f}",
        "prepared_s": f"{wall['prepared']:.0f}",
        "after_s": f"{wall['total'] - wall['prepared'] - driven_s:.0f}",
        "in_all": f"{duration_s / wall['total']:.1f}",
        "memory": f"{peaks_mb[len(peaks_mb) // 2]:.0f}, {peaks_mb[-1]:.0f}",
        "collisions": summary["collisions"],
        "audit": summary["audit"] if summary["audit"] == "clean" else f"{len(summary['audit'])} findings",
    }


def main() -> int:
    """Measure and print; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=list(ROWS))
    parser.add_argument("--times", type=int, default=3, help="how often each row is run")
    given = parser.parse_args()
    prepare()
    runs: list[dict[str, Any]] = []
    with (
        show_progress("a city at scale", total=len(given.rows) * given.times) as report,
        ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool,
    ):
        for run in pool.map(measure, [row for row in given.rows for _ in range(given.times)]):
            runs.append(run)
            report(len(runs))
    rows = []
    for first in range(0, len(runs), given.times):
        same = sorted(runs[first : first + given.times], key=itemgetter("on_top"))
        spread = median_and_spread([run["on_top"] for run in same])
        rows.append({**same[len(same) // 2], "on_top": spread})
    told = {str(n): [str(row[name]) for name in HEADINGS] for n, row in enumerate(rows)}
    table = pd.DataFrame({"": list(HEADINGS.values()), **told})
    title = "at a time: mean of the second half; x real time while vehicles drive, and in all"
    Console().print(frame_table(table, {"": "", **dict.fromkeys(told, "")}, title=title))
    return int(any(row["collisions"] or row["audit"] != "clean" for row in rows))


if __name__ == "__main__":
    sys.exit(main())
