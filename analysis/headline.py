"""The headline: 400 vehicles on sixty loops in south-east Berlin, SUMO's own rules beside ours, for one hour.

``python analysis/headline.py`` prints a table and draws ``out/demo/berlin.png``; ``make demo`` does it too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from frame_table import frame_table
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from side_by_side import side_by_side

from loopgate.network import RoadNetwork
from loopgate.results.columns import LAPS, STANDING, X, Y
from loopgate.simulation.scenario import Scenario

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "demo"
BERLIN = Scenario(
    network="sumo:DRT",
    routes=str(ROOT / "routes" / "berlin60.rou.xml"),
    vehicles=400,
    seed=2,  # of the first five SUMO's own rules lock up with all but 3
    on_deadlock="continue",  # the hour goes on around the gridlock
)
GATES = {"open": "SUMO's own rules", "certified": "loopgate"}
STANDING_S = 300.0
"""Who has not moved for this long counts as standing still."""

HEADINGS = {
    "rule": "under",
    "km": "km",
    "laps": "laps",
    "lapless": "lapless",
    "still": "stuck",
    "deadlock": "deadlock [s]",
    "collisions": "collisions",
    "wait": "wait [s]",
    "stood": "stood [s]",
}


def drive(step_s: float = 1.0) -> list[tuple[dict[str, Any], pd.DataFrame]]:
    """Run the hour under each gate in steps of `step_s` [s]; return the rows, each with its vehicles."""
    out = OUT / ("berlin" if step_s == 1.0 else f"berlin-{step_s:g}s")
    runs = {out / gate: dataclasses.replace(BERLIN, gate=gate, step_s=step_s) for gate in GATES}
    summaries = side_by_side(f"Berlin, one hour twice, steps of {step_s:g} s", runs)
    tables = [pd.read_parquet(folder / "vehicles.parquet") for folder in runs]
    return [
        (_row(gate, summary, vehicles), vehicles)
        for gate, summary, vehicles in zip(GATES, summaries, tables, strict=True)
    ]


def _row(gate: str, summary: Mapping[str, Any], vehicles: pd.DataFrame) -> dict[str, Any]:
    deadlocks = summary["deadlocks"]
    return {
        "rule": GATES[gate],
        "km": round(summary["distance_km"]),
        "laps": summary["laps"],
        "lapless": int((vehicles[LAPS] == 0).sum()),
        "still": int((vehicles[STANDING] >= STANDING_S).sum()),
        "deadlock": f"{deadlocks[0]['closed_at_s']:.0f}" if deadlocks else "never",
        "collisions": summary["collisions"],
        "wait": f"{summary['longest_wait_s']:.0f}" if summary["decisions"] else "-",
        "stood": f"{summary['longest_stood_s']:.0f}",
    }


def draw(rows: list[dict[str, Any]], vehicles: list[pd.DataFrame], file: Path) -> None:
    """Draw where the vehicles are at the end of the hour, one map per rule."""
    mpl.use("Agg")
    network = RoadNetwork.open(BERLIN.network)
    roads = [np.asarray(lane.shape) for edge in network.edges.values() for lane in edge.lanes[:1]]
    figure, axes = plt.subplots(1, len(rows), figsize=(12.0, 6.4), layout="constrained")
    for axis, row, table in zip(axes, rows, vehicles, strict=True):
        axis.add_collection(LineCollection(roads, colors="#c9ced6", linewidths=0.8, zorder=1))
        _dots(axis, table)
        axis.set_title(
            f"{row['rule']}: {row['km']} vehicle-km, {row['still']} of 400 stand still", fontsize=12
        )
        axis.set_aspect("equal")
        axis.set_axis_off()
    seen = pd.concat(vehicles)
    margin = 150.0
    for axis in axes:
        axis.set_xlim(seen[X].min() - margin, seen[X].max() + margin)
        axis.set_ylim(seen[Y].min() - margin, seen[Y].max() + margin)
    axes[0].legend(loc="lower left", frameon=False, fontsize=10)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=110)
    plt.close(figure)


def _dots(axis: Axes, table: pd.DataFrame) -> None:
    still = table[STANDING] >= STANDING_S
    going, stuck = table[~still], table[still]
    axis.scatter(going[X], going[Y], s=9, c="#0072b2", label="on its way", zorder=2, linewidths=0)
    axis.scatter(
        stuck[X],
        stuck[Y],
        s=26,
        c="#d55e00",
        marker="X",
        label="has stood for five minutes",
        zorder=3,
        linewidths=0,
    )


def headline() -> tuple[pd.DataFrame, Path]:
    """Run both hours; return the table and the picture's file."""
    results = drive()
    file = OUT / "berlin.png"
    draw([row for row, _ in results], [table for _, table in results], file)
    return pd.DataFrame([row for row, _ in results]), file


TITLE = "South-east Berlin, 400 vehicles on 60 loops, one hour"

if __name__ == "__main__":
    from rich.console import Console

    frame, picture = headline()
    Console(highlight=False, width=110).print(frame_table(frame, HEADINGS, title=TITLE))
    print(picture)
