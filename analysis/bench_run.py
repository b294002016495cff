"""What a gate costs: a gated run against plain SUMO stepping of the same vehicles. Part of ``make bench``.

Each figure is the median of several runs, alternating, one process, by the processor time of its thread; *on
top* and *ratio* have the least and the greatest too. Stepping alone is timed: reading the network and
building the states is the same for both and comes before. `cost.py` compares plain and compiled ledgers.

Two yardsticks, since vehicles under SUMO's own rules drive less, or stand in gridlock, which is cheap to
step: *on top* is the time outside SUMO's steps over that in them, in the gated run; *ratio* is the time of
the gated run over that of SUMO stepping the same vehicles by its own rules with nobody looking on.
*Prepared* is the share of a whole run that went by before its first step.
"""

from __future__ import annotations

import argparse
import math
import statistics
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import thread_time

import pandas as pd
import sumo
from by_thread_time import median_and_spread, time_by_thread
from frame_table import frame_table
from rich.console import Console

from loopgate.abstraction.sharing import SharingBound
from loopgate.cli.terminal import show_progress
from loopgate.network import RoadNetwork, generate_loops, write_loops
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.input import write_sumo_input
from loopgate.simulation.sumo.start import plain_options, start_traffic

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "bench"
GRID = OUT / "grid20.net.xml"
LONG_GRID, LIGHTS_GRID = OUT / "grid20-long.net.xml", OUT / "grid20-lights.net.xml"
QUARTER_S = 900.0
TRIPS, TRIP_EVERY_S = OUT / "trips.rou.xml", 3.0
"""Of ordinary traffic: some 75 vehicles at a time."""
GATED_TRIPS, GATED_TRIP_EVERY_S = OUT / "gated-trips.rou.xml", 1.0
"""Of trips under the gate, which join and leave all the time."""
SCENARIO = Scenario(
    network=str(GRID),
    routes=str(OUT / "grid20.rou.xml"),
    abstraction="segments",
    negotiation="random",
    lights="off",
)
VEHICLES = (10, 50, 100)
GATES = ("algorithm2", "certified")
OTHER_GATES = ("collision", "one-step", "banker")
"""With the most vehicles only."""
QUEUES = {
    "grid 200 m": Scenario(network=str(LONG_GRID), loops=40, duration_s=QUARTER_S, lights="off"),
    # Everybody has a place of its own then, so the exact stage decides instead of the chain rule, in Python.
    "grid 200 m, a loop each": Scenario(
        network=str(LONG_GRID), loops=100, duration_s=QUARTER_S, lights="off"
    ),
    "sumo:DRT": Scenario(network="sumo:DRT", loops=60, duration_s=QUARTER_S, lights="off"),
}
ON_QUEUES = replace(QUEUES["grid 200 m"], vehicles=100)
ELSEWISE = {
    **{f"gate {gate}": replace(ON_QUEUES, gate=gate) for gate in ("collision", "one-step", "algorithm2")},
    "gate banker": replace(ON_QUEUES, gate="banker"),
    **{f"negotiation {name}": replace(ON_QUEUES, negotiation=name) for name in ("oldest", "random")},
    "lights obeyed": replace(ON_QUEUES, network=str(LIGHTS_GRID), lights="obey"),
    "sumo:DRT, lights obeyed": replace(QUEUES["sumo:DRT"], vehicles=100, lights="obey"),
    "ordinary traffic": replace(ON_QUEUES, traffic=str(TRIPS)),
    "trips": Scenario(network=str(LONG_GRID), routes=str(GATED_TRIPS), duration_s=QUARTER_S, lights="off"),
    "trips, lights obeyed": Scenario(
        network=str(LIGHTS_GRID), routes=str(GATED_TRIPS), duration_s=QUARTER_S, lights="obey"
    ),
    "sumo:DRT, spaced": replace(QUEUES["sumo:DRT"], vehicles=100, spacing="hold"),
}
"""Other gates, negotiations and surroundings."""
QUEUED = (
    ("grid 200 m", 100),
    ("grid 200 m", 1000),
    ("sumo:DRT", 100),
    ("sumo:DRT", 400),
    ("grid 200 m, a loop each", 100),
)
REPEATS = 3
MAX_SHARED = 0.4

HEADINGS = {
    "network": "network",
    "vehicles": "vehicles",
    "gate": "gate",
    "plain_s": "plain [s]",
    "sumo_s": "SUMO [s]",
    "gate_s": "rest [s]",
    "on_top": "on top",
    "prepared": "prepared",
    "ratio": "ratio",
    "decisions": "decisions",
    "per_s": "decisions/s",
    "laps": "laps",
}

ALONE = {key: heading for key, heading in HEADINGS.items() if key not in ("gate", "plain_s", "ratio")}


def prepare() -> None:
    """Make grids of twenty by twenty one-lane roads, and a hundred loops of bounded sharing."""
    OUT.mkdir(parents=True, exist_ok=True)
    _generate(GRID, 100)
    _generate(LONG_GRID, 200)
    _generate(LIGHTS_GRID, 200, "--default-junction-type=traffic_light")
    tool = Path(sumo.SUMO_HOME) / "tools" / "randomTrips.py"
    for file, every_s in ((TRIPS, TRIP_EVERY_S), (GATED_TRIPS, GATED_TRIP_EVERY_S)):
        trips = (f"--net-file={LONG_GRID}", f"--route-file={file}", f"--output-trip-file={OUT / 'trips.xml'}")
        often = (f"--period={every_s}", f"--end={QUARTER_S}", "--validate", "--seed=1")
        subprocess.run([sys.executable, tool, *trips, *often], check=True, capture_output=True, cwd=OUT)
    network = RoadNetwork.open(GRID)
    bound = SharingBound(network, MAX_SHARED, rho_m=SCENARIO.rho_m)
    loops = generate_loops(network, max(VEHICLES), length_m=(400.0, 1200.0), seed=1, admits=bound.admits)
    write_loops(loops, SCENARIO.routes)


def _generate(file: Path, length_m: int, *words: str) -> None:
    grid = ("--grid", "--grid.number=20", "--default.lanenumber=1", "--no-turnarounds")
    tool = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
    options = (*grid, f"--grid.length={length_m}", f"--output-file={file}", *words)
    subprocess.run([tool, *options], check=True, capture_output=True)


def plain_stepping_s(scenario: Scenario) -> float:
    """Return the processor time [s] of stepping SUMO through the scenario with nobody looking on."""
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
            began = thread_time()
            for _ in range(round(scenario.duration_s / scenario.step_s)):
                traffic.step()
            return thread_time() - began
        finally:
            traffic.close()


def measure(name: str, scenario: Scenario, *, beside: bool = True) -> dict[str, object]:
    """Return the row of one scenario, with SUMO by itself `beside` it or not."""
    plain, steps, rest, prepared = [], [], [], []
    summary = {}
    for _ in range(REPEATS):
        plain.append(plain_stepping_s(scenario) if beside else math.nan)
        summary = simulate(scenario)
        steps.append(summary["wall_s"]["sumo"])
        rest.append(summary["wall_s"]["gate"])
        prepared.append(summary["wall_s"]["prepared"] / summary["wall_s"]["total"])
    ratios = [(step + gate) / alone for step, gate, alone in zip(steps, rest, plain, strict=True)]
    plain_s, sumo_s, gate_s = statistics.median(plain), statistics.median(steps), statistics.median(rest)
    return {
        "network": name,
        "vehicles": scenario.vehicles or summary["trips"],
        "gate": scenario.gate,
        "plain_s": f"{plain_s:.2f}",
        "sumo_s": f"{sumo_s:.2f}",
        "gate_s": f"{gate_s:.2f}",
        "on_top": median_and_spread([gate / step for gate, step in zip(rest, steps, strict=True)]),
        "prepared": f"{statistics.median(prepared):.0%}",
        "ratio": median_and_spread(ratios, ".2f") if beside else "-",
        "decisions": summary["decisions"],
        "per_s": round(summary["decisions"] / gate_s),
        "laps": summary["laps"],
    }


def main() -> None:
    """Measure and print; with names of rows of other gates and surroundings, only those."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("only", nargs="*", metavar="ROW", help="only these rows")
    only = parser.parse_args().only
    if unknown := [name for name in only if name not in ELSEWISE]:
        parser.error(f"{unknown[0]} is none of {', '.join(ELSEWISE)}")
    prepare()
    time_by_thread()
    console = Console(width=max(Console().width, 160))
    if only:
        rows = [measure(name, ELSEWISE[name], beside=False) for name in only]
        console.print(frame_table(pd.DataFrame(rows), ALONE, title=f"queues, median of {REPEATS} runs"))
        return
    segments = [
        ("grid 100 m", replace(SCENARIO, vehicles=vehicles, gate=gate))
        for vehicles in VEHICLES
        for gate in (*GATES, *(OTHER_GATES if vehicles == max(VEHICLES) else ()))
    ]
    queues = [(name, replace(QUEUES[name], vehicles=vehicles)) for name, vehicles in QUEUED]
    points = [*segments, *queues, *ELSEWISE.items()]
    rows = []
    with show_progress("gated against plain SUMO", total=len(points)) as report:
        for point in points:
            rows.append(measure(*point, beside=point[0] not in ELSEWISE))
            report(len(rows))
    table = pd.DataFrame(rows)
    title = f"segments, 100 loops, one simulated hour, median of {REPEATS} runs"
    console.print(frame_table(table[: len(segments)], HEADINGS, title=title))
    headings = {column: heading for column, heading in HEADINGS.items() if column != "gate"}
    first, last = table[len(segments) : -len(ELSEWISE)], table[-len(ELSEWISE) :]
    tables = (
        ("certified by pressure", first, headings),
        ("other gates and surroundings", last, ALONE),
    )
    for what, some, its in tables:
        title = f"queues, {what}, a quarter of a simulated hour, median of {REPEATS} runs"
        console.print(frame_table(some, its, title=title))


if __name__ == "__main__":
    main()
