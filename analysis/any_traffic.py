"""All vehicles of a demand under the gate, or none: delays as tripinfo defines them, who arrived, and when.

``python analysis/any_traffic.py NET ROUTES --begin 25200 --hours 1 --seeds 3`` runs a demand from files, with
the lights off, until all have arrived, and SUMO beside it: with the lights off, as they are, made to follow
the traffic, and switched by max-pressure. ``--drawn grid drt`` draws trips in the five-by-five grid and in a
district of Berlin instead, for an hour at 0.5 to 3 times what the gate lets through, and then none; a run
ends when it locks up. ``--made`` draws trips, some of them by truck or bus, in networks with several lanes
and lights that netgenerate makes. ``--demand NET ROUTES BEGIN``, any number of times, takes demands from
files. With ``--most-hours 1`` runs end after the hour, and those under way count with what they have lost so
far, as in ``make lights``. Trips that cannot be under the gate (one in a thousand in Berlin, which would have
to change lanes where there is no room) are left out, for SUMO too.
``--shares 100 80 50 20`` puts only so many in a hundred under the gate, lights obeyed. Runs that are done are
kept in ``out/any_traffic``.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Collection, Iterator
from contextlib import nullcontext
from pathlib import Path
from random import Random
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import sumo
import sumolib
from frame_table import frame_table
from made_networks import netgenerate
from rich.console import Console
from signals import CONTROLLERS, controlled
from throughput_study import with_half

from loopgate import Scenario
from loopgate.abstraction.queue_layout import why_not
from loopgate.cli.terminal import show_progress
from loopgate.errors import RouteError
from loopgate.network import RoadNetwork
from loopgate.network.xml_file import read_xml
from loopgate.simulation.assembly import read_vehicles
from loopgate.simulation.run import simulate
from loopgate.simulation.sumo.start import TRIPS

ROOT = Path(__file__).resolve().parent.parent
DRAWN = {"grid": (str(ROOT / "networks" / "grid5-priority.net.xml"), 2.0), "drt": ("sumo:DRT", 1.0)}
"""Networks, and how many trips arrive in a second under the gate where too many are asked for, about."""
_LANES = "-L 2 -j traffic_light --no-turnarounds true"
_GRID = f"--grid --grid.x-number=5 --grid.y-number=3 --grid.length=200 {_LANES}"
_SPIDER = f"--spider --spider.arm-number=6 --spider.circle-number=2 --spider.space-radius=180 {_LANES}"
_RANDOM = f"--rand --rand.iterations=40 --rand.min-distance=100 --rand.max-distance=250 --seed=7 {_LANES}"
MADE = {
    "avenues": (f"{_GRID} --turn-lanes 1 --turn-lanes.length 60", 1.2),
    "web": (_SPIDER, 0.6),
    "old town": (f"{_RANDOM} --rand.random-lanenumber true", 0.6),
}
"""Options of netgenerate, and how many trips arrive in a second where SUMO's lights are about full."""
LONG = (
    '<vType id="truck" vClass="truck" length="10"/>',
    '<vType id="bus" vClass="bus" length="12"/>',
)
LONG_EVERY = 20
"""Every so many trips one of these in turn."""
EVERYONE = 100
TIMES = (0.5, 1.0, 1.5, 2.0, 3.0)
ALONE = {"gate": "open", "on_deadlock": "continue"}
RULES: dict[str, dict[str, Any]] = {
    "gate": {"gate": "certified", "lights": "off", "positions": True},
    "gate, lights obeyed": {"gate": "certified", "lights": "obey", "positions": True},
    "SUMO, lights off": {**ALONE, "lights": "off"},
    "SUMO, its lights": {**ALONE, "lights": "keep"},
    "SUMO, actuated": {**ALONE, "lights": "keep"},
    "SUMO, delay based": {**ALONE, "lights": "keep"},
    **{f"SUMO, {name}": {**ALONE, "lights": "keep"} for name in CONTROLLERS},
}
BESIDE = {"grid": ("gate", "SUMO, lights off"), "drt": ("gate", "SUMO, lights off", "SUMO, its lights")}
"""The rules that drawn trips drive by: the grid has no lights."""
SWITCHING = {"SUMO, actuated": "actuated", "SUMO, delay based": "delay_based"}
"""The rules that give the lights of a network another type, as SUMO calls it."""

FLOW, HOUR_S = "flow", 3600.0
SHOWN = {
    "mean_delay_s": "mean delay [s]",
    "mean_time_loss_s": "time loss [s]",
    "mean_depart_delay_s": "depart delay [s]",
    "worst_delay_s": "worst [s]",
    "unfinished": "unfinished",
    "duration_s": "drained after [s]",
    FLOW: "arrived in the first hour",
    "collisions": "collisions",
    "deadlocks": "locked",
    "audit": "audit findings",
}


def config(
    net: Path, routes: Path, begin_s: float, end_s: float, file: Path, more: Path | None = None
) -> Path:
    """Write a SUMO configuration of a network and routes."""
    added = f'<additional-files value="{more.resolve()}"/>' if more else ""
    file.write_text(
        f'<configuration><input><net-file value="{net.resolve()}"/>'
        f'<route-files value="{routes.resolve()}"/>{added}</input>'
        f'<time><begin value="{begin_s:g}"/><end value="{end_s:g}"/></time></configuration>\n',
        encoding="utf-8",
    )
    return file


def other_lights(net: Path, kind: str, file: Path) -> Path:
    """Write the lights of a network anew with the same phases, but of another type."""
    made = ET.Element("additional")
    for light in sumolib.xml.parse(str(net), "tlLogic"):
        words = {"id": light.id, "type": kind, "programID": kind, "offset": "0"}
        logic = ET.SubElement(made, "tlLogic", words)
        for phase in light.phase:
            length = {"minDur": "5", "maxDur": "50"} if "y" not in phase.state else {}
            ET.SubElement(logic, "phase", {"duration": phase.duration, "state": phase.state, **length})
    ET.ElementTree(made).write(file)
    return file


def some_of(routes: Path, share: int, seed: int, file: Path) -> Path:
    """Write the names of so many in a hundred of the vehicles, drawn by the seed."""
    top = read_xml(routes, root="routes", what="route file", error=RouteError)
    names = [str(one.get("id")) for one in top if one.tag in ("trip", "vehicle")]
    file.write_text("\n".join(Random(seed).sample(names, len(names) * share // 100)) + "\n", encoding="utf-8")
    return file


def only_between(routes: Path, begin_s: float, end_s: float, file: Path) -> Path:
    """Write those that depart between two times."""
    top = read_xml(routes, root="routes", what="route file", error=RouteError)
    for one in [one for one in top if not begin_s <= float(one.get("depart", begin_s)) < end_s]:
        top.remove(one)
    ET.ElementTree(top).write(file, encoding="utf-8", xml_declaration=True)
    return file


def drawn_trips(net: Path, per_s: float, seed: int, file: Path) -> Path:
    """Let SUMO draw trips in a network for an hour, most from edge to edge of it, unless it has done so."""
    return _drawn(net, per_s, seed, file, long=False)


def _drawn(net: Path, per_s: float, seed: int, file: Path, *, long: bool) -> Path:
    """Draw trips, with `long` vehicles among them or without."""
    if file.exists():
        return file
    drawn = file.with_name(f"drawn-{file.name}")
    script = Path(sumo.SUMO_HOME) / "tools" / "randomTrips.py"
    words = [
        "-n",
        str(net.resolve()),
        "-e",
        "3600",
        "-p",
        f"{1.0 / per_s:g}",
        "--seed",
        str(seed),
        "-o",
        drawn.name,
    ]
    words += ["--min-distance", "300", "--fringe-factor", "5", "--validate"]
    command = [sys.executable, str(script), *words]
    home = {"SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run(command, check=True, capture_output=True, env=home, cwd=file.parent)  # leaves files there
    if long:
        lengthen(drawn)
    leave_out(unfit(net, drawn), drawn)
    return drawn.rename(file)


def lengthen(routes: Path) -> None:
    """Let one trip in twenty be driven by a truck or a bus."""
    top = read_xml(routes, root="routes", what="route file", error=RouteError)
    for number, one in enumerate(one for one in top if one.tag in ("trip", "vehicle")):
        if number % LONG_EVERY == 0:
            one.set("type", ("truck", "bus")[number // LONG_EVERY % 2])
    top[:0] = [ET.fromstring(kind) for kind in LONG]  # noqa: S314  written above
    ET.ElementTree(top).write(routes, encoding="utf-8", xml_declaration=True)


def unfit(net: Path, routes: Path) -> set[str]:
    """Return whose ways cannot be under the gate: a run would take them for ordinary traffic."""
    network = RoadNetwork.open(str(net))
    vehicles, _, _ = read_vehicles(Scenario(network=str(net), routes=str(routes)), network)
    reasons = {way: why_not(network, *way) for way in dict.fromkeys((v.loop, v.type) for v in vehicles)}
    return {v.id for v in vehicles if reasons[v.loop, v.type]}


def leave_out(names: Collection[str], routes: Path) -> None:
    """Write a route file without these vehicles."""
    top = read_xml(routes, root="routes", what="route file", error=RouteError)
    for one in [one for one in top if one.get("id") in names]:
        top.remove(one)
    ET.ElementTree(top).write(routes, encoding="utf-8", xml_declaration=True)


Demand = tuple[Path, Path, float]


def _demands(
    given: argparse.Namespace, seed: int, folder: Path
) -> Iterator[tuple[str, tuple[Path, Path, float]]]:
    """Yield demands by name: network, route file, and when it begins [s]."""
    for where in given.drawn:
        name, most = DRAWN[where]
        net = RoadNetwork.open(name).file
        for k in given.times:
            file = folder / f"{where}-{k:g}-{seed}.rou.xml"
            yield f"{where}, {k:g} times", (net, drawn_trips(net, k * most, seed, file), 0.0)
    for name in given.made:
        options, most = MADE[name]
        net = folder / f"{name.replace(' ', '-')}.net.xml"
        if not net.exists():
            netgenerate(options, net)
        for k in given.times:
            file = folder / f"{net.name.partition('.')[0]}-{k:g}-{seed}.rou.xml"
            yield f"{name}, {k:g} times", (net, _drawn(net, k * most, seed, file, long=True), 0.0)
    for net, routes, begin in given.demand:
        name, begin_s = Path(net).name.partition(".")[0], float(begin)
        file = folder / f"{name}.rou.xml"
        some = only_between(Path(routes), begin_s, begin_s + HOUR_S * given.hours, file)
        yield name, (Path(net), some, begin_s)
    if given.net:
        file = folder / f"{given.routes.name.partition('.')[0]}.rou.xml"
        some = only_between(given.routes, given.begin, given.begin + 3600.0 * given.hours, file)
        yield given.net.name.partition(".")[0], (given.net, some, given.begin)


def planned(given: argparse.Namespace, folder: Path) -> Iterator[tuple[str, str, int, Scenario]]:
    """Yield demand, rule, seed and scenario of each run."""
    for seed in range(1, given.seeds + 1):
        demands = dict(_demands(given, seed, folder))
        for name, (net, routes, begin_s) in demands.items():
            where, _, times = name.partition(", ")
            drawn = bool(times) and where in BESIDE
            beside = BESIDE[where] if drawn else RULES
            most_s = given.most_hours * 3600.0
            each: dict[str, Any] = {"seed": seed, "duration_s": most_s}
            if drawn:
                each["on_deadlock"] = "stop"
            end_s = begin_s + most_s
            called = name.replace(",", "").replace(" ", "_")  # SUMO takes a comma for the end of a name
            file = config(net, routes, begin_s, end_s, folder / f"{called}-{seed}.sumocfg")
            for rule in given.rules:
                if rule not in beside:
                    continue
                used = file
                if kind := SWITCHING.get(rule):
                    more = other_lights(net, kind, folder / f"{called}-{kind}.add.xml")
                    used = config(
                        net, routes, begin_s, end_s, folder / f"{called}-{kind}-{seed}.sumocfg", more
                    )
                yield (
                    name,
                    rule,
                    seed,
                    Scenario(network=str(used), **(RULES[rule] | each)),
                )
            for share in given.shares:
                rule = {**RULES["gate, lights obeyed"], "on_deadlock": "continue"}
                if share < EVERYONE:
                    rule["who"] = str(some_of(routes, share, seed, folder / f"{called}-{share}-{seed}.txt"))
                yield (
                    name,
                    f"{share} in 100 under the gate",
                    seed,
                    Scenario(network=str(file), seed=seed, duration_s=most_s, **rule),
                )


def result(scenario: Scenario, rule: str, key: str, folder: Path) -> dict[str, Any]:
    """Run a scenario, or return what it gave before."""
    kept = folder / f"{key}.json"
    if not kept.exists():
        name = rule.removeprefix("SUMO, ")
        with controlled(name) if name in CONTROLLERS else nullcontext():
            summary = simulate(scenario, folder / key, overwrite=True)
        arrivals = [float(trip.arrival) for trip in sumolib.xml.parse(str(folder / key / TRIPS), "tripinfo")]
        begin_s = min(float(trip.depart) for trip in sumolib.xml.parse(str(folder / key / TRIPS), "tripinfo"))
        summary[FLOW] = sum(0 <= at_s <= begin_s + HOUR_S for at_s in arrivals)
        kept.write_text(json.dumps(summary), encoding="utf-8")
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
    return found


def print_delays(table: pd.DataFrame) -> None:
    """Print the mean delay by demand and rule side by side, with half its 95 % interval over seeds."""
    figures = table.groupby(["demand", "rule"], sort=False)["mean_delay_s"].apply(lambda s: with_half(s, 1))
    wide = figures.unstack("rule")[list(dict.fromkeys(table["rule"]))]  # noqa: PD010  one figure for each pair
    wide = wide.loc[list(dict.fromkeys(table["demand"]))].fillna("-").reset_index()
    columns = {name: str(name) for name in wide.columns}
    Console(width=230).print(frame_table(wide, columns, title="Mean delay in s, with half its 95 % interval"))


def main() -> int:
    """Run what is missing, and print the table; return 1 if a zero of the gate is none."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("net", type=Path, nargs="?")
    parser.add_argument("routes", type=Path, nargs="?")
    parser.add_argument("--drawn", nargs="*", default=[], choices=list(DRAWN))
    parser.add_argument("--made", nargs="*", default=[], choices=list(MADE))
    parser.add_argument("--demand", nargs=3, action="append", default=[], metavar=("NET", "ROUTES", "BEGIN"))
    parser.add_argument("--times", nargs="*", type=float, default=list(TIMES), help="of what is let through")
    parser.add_argument("--begin", type=float, default=0.0)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--most-hours", type=float, default=6.0)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--rules", nargs="*", default=list(RULES), choices=list(RULES))
    parser.add_argument("--shares", nargs="*", type=int, default=[], help="percentages under the gate")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "any_traffic")
    given = parser.parse_args()
    if not (given.drawn or given.made or given.demand) and given.routes is None:
        parser.error("give a network and its routes, --demand, --drawn or --made")
    given.out.mkdir(parents=True, exist_ok=True)
    rows = []
    drawn = (len(given.drawn) + len(given.made)) * len(given.times)
    most = given.seeds * (drawn + len(given.demand) + bool(given.net))
    most *= len(given.rules) + len(given.shares)
    with show_progress("runs", total=most) as report:
        for number, (name, rule, seed, scenario) in enumerate(planned(given, given.out), 1):
            key = f"{name}-{rule}-{seed}".replace(" ", "_").replace(",", "")
            found = result(scenario, rule, key, given.out)
            found |= {"deadlocks": len(found["deadlocks"])}
            found["audit"] = 0 if isinstance(found["audit"], str) else len(found["audit"])
            rows.append({"demand": name, "rule": rule, "seed": seed, **{n: found[n] for n in SHOWN}})
            report(number)
    table = pd.DataFrame(rows)
    means = table.groupby(["demand", "rule"], sort=False)[list(SHOWN)].mean().reset_index()
    columns = {"demand": "demand", "rule": "rule", **SHOWN}
    Console(width=230).print(frame_table(means, columns, title="Means over seeds"))
    print_delays(table)
    table.to_csv(given.out / "runs.csv", index=False)
    gate = table[table["rule"].isin(("gate", "gate, lights obeyed"))]
    zeros = ["collisions", "deadlocks", "audit"]
    if given.most_hours > given.hours:
        zeros.append("unfinished")
    return int(bool(gate[zeros].to_numpy().sum()))


if __name__ == "__main__":
    sys.exit(main())
