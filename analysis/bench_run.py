"""What a gate costs: a gated run against plain SUMO stepping of the same vehicles. Part of ``make bench``.

Each figure is the median of several runs, alternating, one process. Stepping alone is timed: reading the
network and building the states is the same for both and comes before.
"""

from __future__ import annotations

import dataclasses
import statistics
import subprocess
import tempfile
from pathlib import Path
from time import perf_counter

import pandas as pd
import sumo
from rich.console import Console

from loopgate.abstraction.sharing import SharingBound
from loopgate.cli.frame_table import frame_table
from loopgate.cli.progress import show_progress
from loopgate.network import RoadNetwork, generate_loops, write_loops
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import run
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo_input import write_sumo_input
from loopgate.simulation.sumo_start import plain_options, start_traffic

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "bench"
SCENARIO = Scenario(
    network=str(OUT / "grid20.net.xml"),
    routes=str(OUT / "grid20.rou.xml"),
    abstraction="segments",
    negotiation="random",
    lights="off",
)
VEHICLES = (10, 50, 100)
GATES = ("algorithm2", "certified")
REPEATS = 3
MAX_SHARED = 0.4

HEADINGS = {
    "vehicles": "vehicles",
    "gate": "gate",
    "plain_s": "plain SUMO [s]",
    "gated_s": "gated [s]",
    "ratio": "ratio",
    "decisions": "decisions",
    "per_s": "decisions/s",
    "laps": "laps",
}


def prepare() -> None:
    """Make a grid of twenty by twenty one-lane roads, and on it a hundred loops of bounded sharing."""
    OUT.mkdir(parents=True, exist_ok=True)
    grid = ("--grid", "--grid.number=20", "--grid.length=100", "--default.lanenumber=1", "--no-turnarounds")
    tool = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
    subprocess.run([tool, *grid, f"--output-file={SCENARIO.network}"], check=True, capture_output=True)
    network = RoadNetwork.open(SCENARIO.network)
    bound = SharingBound(network, MAX_SHARED, rho_m=SCENARIO.rho_m)
    loops = generate_loops(network, max(VEHICLES), length_m=(400.0, 1200.0), seed=1, admits=bound.admits)
    write_loops(loops, SCENARIO.routes)


def plain_stepping_s(scenario: Scenario) -> float:
    """Return the wall time [s] of stepping SUMO through the scenario with nobody looking on."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        assembly = assemble(scenario)
        options = [
            *("--net-file", str(assembly.network.file)),
            *write_sumo_input(assembly.starts, folder),
            *plain_options(scenario, folder / "sumo.log"),
        ]
        traffic = start_traffic(options, backend="libsumo", log=folder / "sumo.log")
        try:
            traffic.step()
            began = perf_counter()
            for _ in range(round(scenario.duration_s / scenario.step_s)):
                traffic.step()
            return perf_counter() - began
        finally:
            traffic.close()


def measure(vehicles: int, gate: str) -> dict[str, object]:
    """Return the row of one number of vehicles and gate."""
    scenario = dataclasses.replace(SCENARIO, vehicles=vehicles, gate=gate)
    plain, gated = [], []
    summary = {}
    for _ in range(REPEATS):
        plain.append(plain_stepping_s(scenario))
        summary = run(scenario)
        gated.append(summary["wall_s"]["sumo"] + summary["wall_s"]["gate"])
    plain_s, gated_s = statistics.median(plain), statistics.median(gated)
    return {
        "vehicles": vehicles,
        "gate": gate,
        "plain_s": f"{plain_s:.2f}",
        "gated_s": f"{gated_s:.2f}",
        "ratio": f"{gated_s / plain_s:.2f}",
        "decisions": summary["decisions"],
        "per_s": round(summary["decisions"] / summary["wall_s"]["gate"]),
        "laps": summary["laps"],
    }


def main() -> None:
    """Measure and print."""
    prepare()
    points = [(vehicles, gate) for vehicles in VEHICLES for gate in GATES]
    rows = []
    with show_progress("gated against plain SUMO", total=len(points)) as report:
        for point in points:
            rows.append(measure(*point))
            report(len(rows))
    title = f"100 loops on a grid of 20 by 20, segments, one simulated hour, median of {REPEATS} runs"
    Console(width=max(Console().width, 110)).print(frame_table(pd.DataFrame(rows), HEADINGS, title=title))


if __name__ == "__main__":
    main()
