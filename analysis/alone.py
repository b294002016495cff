"""How far the vehicles of the studies of throughput drive in the hour if each is all by itself on the roads.

Each is under a gate that always says yes, so it does not slow down to give way; lights are obeyed or off.
No rule for junctions can do better on these loops with these drivers. At the lowest number of
vehicles, where it is within reach. Run the studies first: shares are of their figures.

    python analysis/alone.py --seeds 5 --write

prints the table and renews it in ``docs/studies/throughput.md``.
"""

from __future__ import annotations

import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from throughput import GRID
from throughput_city import CITIES
from throughput_study import RULE, WARMUP_S, Study, markdown, parser, with_half, write_section

from loopgate.cli.terminal import show_progress
from loopgate.control.start import VehicleStart
from loopgate.network import write_loops
from loopgate.results import columns as c
from loopgate.simulation.assembly import assemble
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.input import write_sumo_input
from loopgate.simulation.sumo.start import plain_options, start_traffic


class Case(NamedTuple):
    """A study at its lowest number of vehicles: rules of SUMO and of ours that keep to the same lights."""

    study: Study
    lights: str
    sumo: str
    ours: str


BERLIN, BRAUNSCHWEIG = CITIES
CASES = (
    Case(GRID, "none", "SUMO, priority", "certified, pressure"),
    Case(BERLIN, "on", "SUMO, lights on", "certified, lights obeyed"),
    Case(BERLIN, "off", "SUMO, lights off", "certified, lights off"),
    Case(BRAUNSCHWEIG, "off", "SUMO, lights off", "certified, lights off"),
)


def alone_km(scenario: Scenario) -> float:
    """Return how far the vehicles drive in all [km/h], each in a simulation of its own, after the warm-up."""
    assembly = assemble(scenario)
    km = sum(one_km(scenario, assembly.network.file, start) for start in assembly.starts)
    return km * 3600 / scenario.duration_s


def one_km(scenario: Scenario, network: Path, start: VehicleStart) -> float:
    """Return how far one drives alone in the scenario's duration [km]."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        options = ["--net-file", str(network), *write_sumo_input([start], folder)]
        log = folder / "sumo.log"
        traffic = start_traffic([*options, *plain_options(scenario, log)], backend="libsumo", log=log)
        try:
            traffic.step()
            traffic.put_under_gate(start.vehicle)
            while traffic.now_s <= WARMUP_S:
                traffic.step()
            began_m = traffic.odometer(start.vehicle)
            while traffic.now_s <= WARMUP_S + scenario.duration_s:
                traffic.step()
            return (traffic.odometer(start.vehicle) - began_m) / 1000
        finally:
            traffic.close()


def _scenario(case: Case, seed: int, duration_s: float, folder: Path) -> Scenario:
    routes = folder / f"{case.study.name}{seed}.rou.xml"
    if not routes.exists():
        write_loops(case.study.loops(seed), routes)
    rule = next(rule for rule in case.study.rules if rule.name == case.sumo)
    how: dict[str, Any] = {**rule.scenario, "routes": str(routes), "vehicles": case.study.vehicles[0]}
    return Scenario(abstraction="queues", seed=seed, duration_s=duration_s, **how)


def _shares(case: Case, alone: pd.Series[float], file: Path) -> list[str]:
    """Return the share of SUMO's rule and of ours of what the vehicles drive alone, empty if not yet run."""
    if not file.exists():
        return ["", ""]
    runs = pd.read_csv(file)
    runs = runs[runs[c.VEHICLES] == case.study.vehicles[0]]
    done = (runs[runs[RULE] == rule].set_index(c.SEED)[c.KM_PER_H] for rule in (case.sumo, case.ours))
    return [with_half((km / alone).dropna() * 100, 0) + " %" for km in done]


def main() -> None:
    """Simulate, print and write."""
    given = parser(__doc__).parse_args()
    seeds = range(1, given.seeds + 1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenarios = [_scenario(case, seed, given.duration, folder) for case in CASES for seed in seeds]
        found = []
        with (
            show_progress("each vehicle alone", total=len(scenarios)) as report,
            ProcessPoolExecutor(given.jobs) as pool,
        ):
            for km in pool.map(alone_km, scenarios):
                found.append(km)
                report(len(found))
    rows = []
    for case in CASES:
        alone = pd.Series([found.pop(0) for _ in seeds], index=list(seeds))
        sumo, ours = _shares(case, alone, given.out / f"{case.study.name}.csv")
        rows.append(
            {
                "network": case.study.title,
                "lights": case.lights,
                "vehicles": case.study.vehicles[0],
                "each alone [km]": with_half(alone, 0),
                "SUMO": sumo,
                "certified": ours,
            }
        )
    text = markdown(pd.DataFrame(rows))
    print(text)
    if given.write:
        write_section(text, "alone")


if __name__ == "__main__":
    main()
