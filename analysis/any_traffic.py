"""All vehicles of a demand under the gate, or none: delays as tripinfo defines them, who arrived, and when.

``python analysis/any_traffic.py NET ROUTES --begin 25200 --hours 1 --seeds 3`` runs a demand from files, with
the lights off, until all have arrived, and SUMO beside it, with the lights off and kept. ``--grid`` draws
trips in the five-by-five grid instead, for an hour at 0.5 to 3 times what the gate lets through, and then
none. Runs that are done are kept in ``out/any_traffic`` and not repeated.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import sumo
from rich.console import Console

from loopgate import Scenario
from loopgate.cli.frame_table import frame_table
from loopgate.cli.progress import show_progress
from loopgate.errors import RouteError
from loopgate.network.xml_file import read_xml
from loopgate.simulation.run import simulate

ROOT = Path(__file__).resolve().parent.parent
GRID = ROOT / "networks" / "grid5-priority.net.xml"
CAPACITY_PER_S = 1.7
"""Trips that arrive in a second under the gate where three times as many are asked for, about."""
TIMES = (0.5, 1.0, 1.5, 2.0, 3.0)
RULES: dict[str, dict[str, Any]] = {
    "gate": {"gate": "certified", "lights": "off", "positions": True},
    "SUMO, lights off": {"gate": "open", "lights": "off", "on_deadlock": "continue"},
    "SUMO, lights kept": {"gate": "open", "lights": "keep", "on_deadlock": "continue"},
}
SHOWN = {
    "mean_delay_s": "mean delay [s]",
    "mean_time_loss_s": "time loss [s]",
    "mean_depart_delay_s": "depart delay [s]",
    "worst_delay_s": "worst [s]",
    "unfinished": "unfinished",
    "duration_s": "drained after [s]",
    "collisions": "collisions",
    "deadlocks": "locked",
    "audit": "audit findings",
}


def config(net: Path, routes: Path, begin_s: float, end_s: float, file: Path) -> Path:
    """Write a SUMO configuration of a network and routes."""
    file.write_text(
        f'<configuration><input><net-file value="{net.resolve()}"/>'
        f'<route-files value="{routes.resolve()}"/></input>'
        f'<time><begin value="{begin_s:g}"/><end value="{end_s:g}"/></time></configuration>\n',
        encoding="utf-8",
    )
    return file


def only_between(routes: Path, begin_s: float, end_s: float, file: Path) -> Path:
    """Write those that depart between two times."""
    top = read_xml(routes, root="routes", what="route file", error=RouteError)
    for one in [one for one in top if not begin_s <= float(one.get("depart", begin_s)) < end_s]:
        top.remove(one)
    ET.ElementTree(top).write(file, encoding="utf-8", xml_declaration=True)
    return file


def drawn_trips(times: float, seed: int, file: Path) -> Path:
    """Let SUMO draw trips in the grid for an hour, most from edge to edge of it."""
    script = Path(sumo.SUMO_HOME) / "tools" / "randomTrips.py"
    period = 1.0 / (times * CAPACITY_PER_S)
    words = ["-n", str(GRID), "-e", "3600", "-p", f"{period:g}", "--seed", str(seed), "-o", str(file)]
    words += ["--min-distance", "300", "--fringe-factor", "5"]
    command = [sys.executable, str(script), *words]
    subprocess.run(command, check=True, capture_output=True, env={"SUMO_HOME": sumo.SUMO_HOME})
    return file


def planned(given: argparse.Namespace, folder: Path) -> Iterator[tuple[str, str, int, Scenario]]:
    """Yield demand, rule, seed and scenario of each run."""
    for seed in range(1, given.seeds + 1):
        if given.grid:
            demands = {
                f"grid, {k:g} times": (GRID, drawn_trips(k, seed, folder / f"{k:g}-{seed}.rou.xml"))
                for k in TIMES
            }
            begin_s, hour_s = 0.0, 3600.0
        else:
            begin_s, hour_s = given.begin, 3600.0 * given.hours
            file = folder / f"{given.routes.name.partition('.')[0]}.rou.xml"
            some = only_between(given.routes, begin_s, begin_s + hour_s, file)
            demands = {given.net.name.partition(".")[0]: (given.net, some)}
        for name, (net, routes) in demands.items():
            end_s = begin_s + given.most_hours * 3600.0
            file = config(net, routes, begin_s, end_s, folder / f"{name.replace(' ', '_')}-{seed}.sumocfg")
            for rule in given.rules:
                scenario = Scenario.from_dict({"network": str(file), "seed": seed, **RULES[rule]})
                yield name, rule, seed, scenario


def result(scenario: Scenario, key: str, folder: Path) -> dict[str, Any]:
    """Run a scenario, or return what it gave before."""
    kept = folder / f"{key}.json"
    if not kept.exists():
        summary = simulate(scenario, folder / key, overwrite=True)
        kept.write_text(json.dumps(summary), encoding="utf-8")
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
    return found


def main() -> int:
    """Run what is missing, and print the table; return 1 if a zero of the gate is none."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("net", type=Path, nargs="?")
    parser.add_argument("routes", type=Path, nargs="?")
    parser.add_argument("--grid", action="store_true")
    parser.add_argument("--begin", type=float, default=0.0)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--most-hours", type=float, default=6.0)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--rules", nargs="*", default=list(RULES), choices=list(RULES))
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "any_traffic")
    given = parser.parse_args()
    if not given.grid and given.routes is None:
        parser.error("give a network and its routes, or --grid")
    given.out.mkdir(parents=True, exist_ok=True)
    rows = []
    runs = list(planned(given, given.out))
    with show_progress("runs", total=len(runs)) as report:
        for number, (name, rule, seed, scenario) in enumerate(runs, 1):
            key = f"{name}-{rule}-{seed}".replace(" ", "_").replace(",", "")
            found = result(scenario, key, given.out)
            found |= {"deadlocks": len(found["deadlocks"])}
            found["audit"] = 0 if isinstance(found["audit"], str) else len(found["audit"])
            rows.append({"demand": name, "rule": rule, "seed": seed, **{n: found[n] for n in SHOWN}})
            report(number)
    table = pd.DataFrame(rows)
    means = table.groupby(["demand", "rule"], sort=False)[list(SHOWN)].mean().reset_index()
    columns = {"demand": "demand", "rule": "rule", **SHOWN}
    Console(width=170).print(frame_table(means, columns, title="Means over seeds"))
    table.to_csv(given.out / "runs.csv", index=False)
    gate = table[table["rule"] == "gate"]
    return int(bool(gate[["unfinished", "collisions", "deadlocks", "audit"]].to_numpy().sum()))


if __name__ == "__main__":
    sys.exit(main())
