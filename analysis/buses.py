"""What cars lose by buses among them: the mean delay of cars, by the share and the length of buses.

``python analysis/buses.py`` draws trips on a grid of avenues and in a town of one-lane roads, makes a share
of the vehicles buses, and drives half an hour under the gate and under SUMO's rules, with positions.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pandas as pd
import sumo
from made_networks import netgenerate
from rich.console import Console

from loopgate import Run, Scenario, run
from loopgate.analysis.statistics import mean_interval

ROOT = Path(__file__).resolve().parents[1]
NETWORKS = {
    "avenues": (
        "--grid --grid.number=4 --grid.length=180 --grid.attach-length=150 -L 2 --no-turnarounds",
        0.6,
    ),
    "town": ("--rand --rand.iterations=60 --rand.grid --seed=47 --tls.guess", 1.2),
}
"""Options of netgenerate, and the time between two departures [s]."""

SHARES = ((0.0, 12.0), (0.05, 12.0), (0.05, 18.0), (0.2, 12.0), (0.2, 18.0))
"""Share of buses, and their length [m]."""

RULES = {"gate": "certified", "SUMO": "open"}
"""The gate of a run."""

BUS = "bus"


def draw_trips(net: Path, every_s: float, seed: int, file: Path) -> Path:
    """Let SUMO draw trips for twenty minutes, with their routes, most from edge to edge of the network."""
    if not file.exists():
        script = Path(sumo.SUMO_HOME) / "tools" / "randomTrips.py"
        words = ["-n", net.name, "-e", "1200", "-p", f"{every_s:g}", "--seed", f"{seed}", "-r", file.name]
        words += ["-o", f"{file.stem}.trips.xml", "--min-distance", "400", "--fringe-factor", "5"]
        command = [sys.executable, str(script), *words]
        home = {"SUMO_HOME": sumo.SUMO_HOME}
        subprocess.run(command, check=True, capture_output=True, env=home, cwd=file.parent)
    return file


def mix(trips: Path, share: float, length_m: float, file: Path) -> Path:
    """Write the trips with a share of buses; a bus at a small share is one at a large share too."""
    tree, rng = ET.parse(trips), random.Random(99)  # noqa: S314  SUMO wrote it
    root = tree.getroot()
    for vehicle in root.iter("vehicle"):
        if rng.random() < share:
            vehicle.set("type", BUS)
    root.insert(0, ET.Element("vType", id=BUS, vClass="bus", length=f"{length_m:g}"))
    tree.write(file)
    return file


def row(made: Run, routes: Path) -> dict[str, Any]:
    """Return the figures of one run: mean delays of cars and of buses [s], and what must not be."""
    root = ET.parse(routes).getroot()  # noqa: S314  written above
    buses = {one.get("id", "") for one in root.iter("vehicle") if one.get("type") == BUS}
    trips = made.vehicles
    delay_s = trips["time_loss_s"] + trips["depart_delay_s"]
    is_bus = trips["vehicle"].isin(buses)
    summary = made.summary
    return {
        "cars": delay_s[~is_bus].mean(),
        "buses": delay_s[is_bus].mean() if is_bus.any() else np.nan,
        "arrived": summary["arrived"],
        "longest": summary["longest_wait_s"],
        "collisions": summary["collisions"],
        "clean": summary["audit"] == "clean",
    }


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("networks", nargs="*", help=f"of {', '.join(NETWORKS)}; with none all")
    parser.add_argument("--seeds", type=int, default=5, help="demands")
    parser.add_argument("--rules", nargs="+", default=list(RULES), choices=list(RULES))
    parser.add_argument("--duration", type=float, default=1800.0, help="seconds of each run")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "buses", help="folder of the runs")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    console = Console(highlight=False, soft_wrap=True)
    for name in options.networks or NETWORKS:
        net, every_s = options.out / f"{name}.net.xml", NETWORKS[name][1]
        if not net.exists():
            netgenerate(NETWORKS[name][0], net)
        for share, length_m in SHARES:
            for rule in options.rules:
                rows = []
                for seed in range(1, options.seeds + 1):
                    trips = draw_trips(net, every_s, seed, options.out / f"{name}-{seed}.rou.xml")
                    file = options.out / f"{name}-{seed}-{share:g}-{length_m:g}.mixed.rou.xml"
                    routes = mix(trips, share, length_m, file)
                    scenario = Scenario(
                        network=str(net),
                        routes=str(routes),
                        duration_s=options.duration,
                        positions=rule == "gate",
                        seed=seed,
                        gate=RULES[rule],
                    )
                    rows.append(row(run(scenario, options.out / file.stem / rule, overwrite=True), routes))
                _print(console, f"{name}, {share:.0%} of {length_m:g} m, {rule}", pd.DataFrame(rows))


def _print(console: Console, what: str, rows: pd.DataFrame) -> None:
    spread = rows["cars"].mean() - mean_interval(rows["cars"]).low if len(rows) > 1 else np.nan
    each = " ".join(f"{delay:.1f}" for delay in rows["cars"])
    console.print(
        f"{what}: cars {rows['cars'].mean():.1f} ± {spread:.1f} s ({each}), "
        f"buses {rows['buses'].mean():.1f} s, "
        f"arrived {rows['arrived'].sum()}, longest wait {rows['longest'].max():.0f} s, "
        f"collisions {rows['collisions'].sum()}, {rows['clean'].sum()} of {len(rows)} clean"
    )


if __name__ == "__main__":
    main()
