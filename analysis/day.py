"""A simulated day: is anything lost, does anything grow.

    python analysis/day.py                 # 24 simulated hours on sumo:DRT, 300 vehicles
    python analysis/day.py --hours 2 --positions

Prints for each simulated hour the laps, the vehicles that completed none in it, the longest wait for a grant
that ended in it and the largest resident memory; then the drift of the memory [MB/h], laps and vehicles lost,
collisions, and what the audit found. Exit code 1 if anything was lost or the audit found something.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from frame_table import frame_table
from rich.console import Console

from loopgate.cli.terminal import show_progress
from loopgate.results.columns import (
    DISTANCE,
    EVENT,
    LAPS,
    LOOP_LENGTH,
    TIME,
    VEHICLE,
    X,
)
from loopgate.runs.run import read_run
from loopgate.simulation.loop_run import RunCourse
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.sweep.task import peak_memory_mb, reset_peak_memory

HOUR_S = 3600.0
PER_HOUR = 6
"""Memory is noted so often in an hour."""

HEADINGS = {
    "hour": "hour",
    "laps": "laps",
    "without": "vehicles without a lap",
    "wait_s": "longest wait [s]",
    "memory_mb": "memory [MB]",
}


class Memory:
    """Notes the largest resident memory again and again, of ten simulated minutes if not said [MB]."""

    def __init__(self, every_s: float = HOUR_S / PER_HOUR) -> None:
        self._every_s = every_s
        self.peaks_mb: list[float] = []
        reset_peak_memory()

    def look(self, now_s: float) -> None:
        """Note the peak when that time is over; called every ten simulated seconds."""
        if now_s >= self._every_s * (len(self.peaks_mb) + 1):
            self.peaks_mb.append(peak_memory_mb())
            reset_peak_memory()


def hours_table(events: pd.DataFrame, vehicles: int, memory_mb: list[float]) -> pd.DataFrame:
    """Return one row per simulated hour.

    A wait is counted in the hour in which it ended; it runs from the first refusal to the grant. Memory is
    given for each ten minutes; hours that are not over are left out.
    """
    rows = []
    waits = _waits(events)
    for hour in range(len(memory_mb) // PER_HOUR):
        begin, end = hour * HOUR_S, (hour + 1) * HOUR_S
        laps = events[(events[EVENT] == "lap") & events[TIME].between(begin, end, inclusive="right")]
        ended = waits[waits["granted_s"].between(begin, end, inclusive="right")]["wait_s"]
        rows.append(
            {
                "hour": hour + 1,
                "laps": len(laps),
                "without": vehicles - laps[VEHICLE].nunique(),
                "wait_s": float(ended.max()) if len(ended) else 0.0,
                "memory_mb": max(memory_mb[hour * PER_HOUR : (hour + 1) * PER_HOUR]),
            }
        )
    return pd.DataFrame(rows, columns=list(HEADINGS))


def _waits(events: pd.DataFrame) -> pd.DataFrame:
    asked = events[events[EVENT].isin(["refuse", "grant"])]
    vehicle = asked[VEHICLE].astype("str")
    is_grant = (asked[EVENT] == "grant").astype(int)
    granted = is_grant.groupby(vehicle).cumsum() - is_grant  # by then, this one not counted
    spells = asked.groupby([vehicle, granted])[TIME].agg(["min", "max"])
    return pd.DataFrame({"granted_s": spells["max"], "wait_s": spells["max"] - spells["min"]})


def drift_mb_per_h(memory_mb: list[float]) -> float:
    """Return the slope of a straight line through all but the first hour, which fills caches [MB/h]."""
    later = memory_mb[PER_HOUR:]
    if len(later) < 2:  # noqa: PLR2004  a line needs two points
        return float("nan")
    return float(np.polyfit(np.arange(len(later)) / PER_HOUR, later, 1)[0])


def laps_lost(vehicles: pd.DataFrame) -> int:
    """Return how many whole laps the vehicles drove, by their odometers, that were not counted."""
    driven = np.floor(vehicles[DISTANCE] / vehicles[LOOP_LENGTH] + 1e-6)
    return int((driven - vehicles[LAPS]).abs().sum())


def main() -> int:
    """Run the day and print what became of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--network", default="sumo:DRT")
    parser.add_argument("--vehicles", type=int, default=300)
    parser.add_argument("--loops", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--positions", action="store_true", help="audit crossings and bodies too")
    parser.add_argument("--out", type=Path, default=Path("out/day"))
    given = parser.parse_args()
    scenario = Scenario(
        network=given.network,
        loops=given.loops,
        loop_length_m=(400.0, 3000.0),
        vehicles=given.vehicles,
        duration_s=given.hours * HOUR_S,
        seed=given.seed,
        positions=given.positions,
    )
    memory = Memory()
    with show_progress(f"{given.hours:g} h of {given.network}", total=round(scenario.duration_s)) as report:

        def tick(now_s: float, _course: RunCourse) -> None:
            memory.look(now_s)
            report(round(now_s))

        summary = simulate(scenario, given.out, tick=tick, overwrite=True)
    return tell(given.out, summary, memory.peaks_mb)


def tell(folder: Path, summary: dict[str, Any], memory_mb: list[float]) -> int:
    """Print the tables; return the exit code."""
    finished = read_run(folder)
    vehicles = finished.vehicles
    console = Console()
    hours = hours_table(finished.events, len(vehicles), memory_mb)
    console.print(frame_table(hours, HEADINGS, title=f"{summary['network']}, {len(vehicles)} vehicles"))
    lost = int(vehicles[X].isna().sum())
    uncounted = laps_lost(vehicles)
    audit = summary["audit"]
    facts = {
        "simulated": f"{summary['duration_s'] / HOUR_S:.2f} h in {summary['wall_s']['total']:.0f} s",
        "outcome": summary["outcome"],
        "vehicles lost": lost,
        "laps": f"{summary['laps']}, {uncounted} lost",
        "vehicles without a lap": summary["vehicles_without_a_lap"],
        "collisions, teleports": f"{summary['collisions']}, {summary['teleports']}",
        "longest wait": f"{summary['longest_wait_s']:.0f} s",
        "audit": audit if audit == "clean" else f"{len(audit)} findings, the first: {audit[0]}",
        "audited": ", ".join(summary["audited"]),
        "memory drift": f"{drift_mb_per_h(memory_mb):+.2f} MB/h, the first hour left out",
    }
    for name, value in facts.items():
        console.print(f"{name:24}{value}", highlight=False, markup=False)
    fine = audit == "clean" and summary["outcome"] == "done" and not lost and not uncounted
    return 0 if fine and not summary["collisions"] and not summary["teleports"] else 1


if __name__ == "__main__":
    sys.exit(main())
