"""Ten scenarios made by SUMO's own generators, each with loops under SUMO's rules and under the gate.

    python analysis/scenarios.py

Each is a configuration with ordinary vehicles of its own and whatever its kind brings: detectors, parking
areas, closed roads, calibrators, persons, lines of buses. Nothing may be dropped: SUMO loads as many vehicles
and writes the same outputs in both runs. What differs is what the program itself says. Runs are kept in
``out/scenarios``.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import sumo

from loopgate import RoadNetwork, Scenario, run
from loopgate.network import generate_loops, write_loops

ROOT = Path(__file__).resolve().parent.parent
TOOLS = Path(sumo.SUMO_HOME) / "tools"
GATES = ("open", "certified")
GRID = ("--grid", "--grid.number", "5", "--grid.length", "150", "--default.lanenumber", "2")
NET, TRIPS, STATISTICS, LOOPS = "net.net.xml", "trips.rou.xml", "statistics.xml", "loops.rou.xml"


def netgenerate(folder: Path, *options: str) -> None:
    """Make the network."""
    program = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
    _call([str(program), *options, "--seed", "7", "-o", NET], folder)


def tool(folder: Path, name: str, *options: str) -> None:
    """Run one of SUMO's tools."""
    _call([sys.executable, str(TOOLS / name), *options], folder)


def _call(command: Sequence[str], folder: Path) -> None:
    home = {"SUMO_HOME": sumo.SUMO_HOME, "PATH": str(Path(sumo.SUMO_HOME) / "bin")}
    done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True, env=home)
    if done.returncode and done.stderr:  # one of them ends with 1 when all is well
        sys.exit(f"{' '.join(command)}: {done.stderr.strip()}")


def trips(folder: Path, *options: str, every_s: float = 5.0, file: str = TRIPS) -> None:
    """Draw ordinary vehicles."""
    words = ["-n", NET, "-e", "600", "-p", f"{every_s:g}", "--seed", "7", "-r", file, *options]
    tool(folder, "randomTrips.py", *words, "-o", f"{file}.trips.xml", "--validate")


def roads(folder: Path) -> RoadNetwork:
    """Return the network made."""
    return RoadNetwork.open(folder / NET)


def write(folder: Path, name: str, text: str) -> None:
    """Write an additional file."""
    (folder / name).write_text(f"<additional>{text}</additional>", encoding="utf-8")


def long_lanes(folder: Path) -> list[str]:
    """Return the right lanes of roads long enough for whatever is put there."""
    return [edge.lanes[0].id for edge in roads(folder).edges.values() if edge.length_m > 100.0]  # noqa: PLR2004


def plain(folder: Path) -> list[str]:
    """Make crossings by priority."""
    netgenerate(folder, *GRID)
    trips(folder)
    return []


def detectors(folder: Path) -> list[str]:
    """Make actuated lights with detectors of three kinds on all their lanes."""
    netgenerate(folder, *GRID, "-j", "traffic_light", "--tls.default-type", "actuated")
    trips(folder)
    files = []
    for kind in ("E1", "E2", "E3"):
        files.append(f"{kind}.add.xml")
        words = ("-n", NET, "-o", files[-1], "-r", f"{kind}.out.xml", "-f", "60")
        tool(folder, f"output/generateTLS{kind}Detectors.py", *words)
    return files


def flows(folder: Path) -> list[str]:
    """Make a spider's web with flows, and measures of each road."""
    netgenerate(folder, "--spider", "--spider.arm-number", "7", "--spider.circle-number", "4")
    trips(folder, "--flows", "20")
    write(folder, "measures.add.xml", '<edgeData id="e" freq="300" file="edges.out.xml"/>')
    return ["measures.add.xml"]


def random_net(folder: Path) -> list[str]:
    """Make a network where who comes from the right goes first, with trips from its fringe."""
    words = ("--rand.iterations", "60", "--bidi-probability", "1", "--rand.min-distance", "150")
    netgenerate(folder, "--rand", *words, "-j", "right_before_left")
    trips(folder, "--fringe-factor", "5")
    return []


def parking(folder: Path) -> list[str]:
    """Make parking areas, and rerouters to others where one is full; every trip parks on its way."""
    netgenerate(folder, *GRID)
    tool(folder, "generateParkingAreas.py", "-n", NET, "-o", "parking.add.xml", "--seed", "7")
    words = ("-a", "parking.add.xml", "-n", NET, "-o", "rerouters.add.xml")
    tool(folder, "generateParkingAreaRerouters.py", *words)
    trips(folder)
    areas = {
        area.get("lane", "").rpartition("_")[0]: area.get("id", "")
        for area in ET.parse(folder / "parking.add.xml").getroot().iter("parkingArea")  # noqa: S314
    }
    top = ET.parse(folder / TRIPS).getroot()  # noqa: S314
    for vehicle in top.iter("vehicle"):
        way = vehicle[0].get("edges", "").split()
        there = next((areas[edge] for edge in way[1:] if edge in areas), None)
        if there is not None:
            ET.SubElement(vehicle, "stop", parkingArea=there, duration="60")
    ET.ElementTree(top).write(folder / TRIPS)
    return ["parking.add.xml", "rerouters.add.xml"]


CLOSED = ("B1C1", "D3D2", "C3D3")


def closed(folder: Path) -> list[str]:
    """Close two roads for five minutes, and a lane of a third; loops avoid all three."""
    netgenerate(folder, *GRID)
    trips(folder)
    tool(
        folder,
        "generateRerouters.py",
        "-n",
        NET,
        "-x",
        "B1C1,D3D2",
        "-b",
        "100",
        "-e",
        "400",
        "-o",
        "r.add.xml",
    )
    lane = '<interval begin="100" end="400"><closingLaneReroute id="C3D3_1" disallow="all"/></interval>'
    write(folder, "lane.add.xml", f'<rerouter id="lane" edges="B3C3">{lane}</rerouter>')
    return ["r.add.xml", "lane.add.xml"]


def calibrators(folder: Path) -> list[str]:
    """Make calibrators that put vehicles in, and signs that change the limit."""
    netgenerate(folder, *GRID)
    trips(folder)
    lanes = long_lanes(folder)
    flow = '<flow begin="0" end="600" vehsPerHour="200" speed="10" route="{0}" type="c"/>'
    text = '<vType id="c"/>'
    for number, edge in enumerate(("A2B2", "E2D2")):
        text += f'<route id="r{number}" edges="{edge} {edge[2:]}C2"/>'
        named = f'id="k{number}" edge="{edge}" pos="0" vTypes="c" period="60"'
        text += f'<calibrator {named} output="{folder / f"k{number}.out.xml"}">'
        text += flow.format(f"r{number}") + "</calibrator>"
    slower = '<step time="100" speed="8"/>'
    text += f'<variableSpeedSign id="s" lanes="{" ".join(lanes[:6])}">{slower}</variableSpeedSign>'
    write(folder, "calibrators.add.xml", text)
    return ["calibrators.add.xml"]


def walkers(folder: Path) -> list[str]:
    """Make sidewalks and crossings with persons on foot."""
    netgenerate(folder, *GRID, "--sidewalks.guess", "--crossings.guess", "-j", "traffic_light")
    trips(folder)
    words = (
        "-n",
        NET,
        "-e",
        "600",
        "-p",
        "4",
        "--seed",
        "8",
        "--pedestrians",
        "--prefix",
        "walks",
        "-o",
        "persons.rou.xml",
    )
    tool(folder, "randomTrips.py", *words)
    return ["persons.rou.xml"]


def lines(folder: Path) -> list[str]:
    """Make two lines of buses with stops, made of a list of lines."""
    netgenerate(folder, *GRID)
    trips(folder)
    ways = {"1": "A1B1 B1C1 C1D1 D1E1", "2": "C4C3 C3C2 C2C1 C1C0"}
    stops, found = "", ""
    for line, way in ways.items():
        names = [f"{line}.{edge}" for edge in way.split()]
        stops += "".join(
            f'<busStop id="{name}" lane="{name[2:]}_0" startPos="60" endPos="90"/>' for name in names
        )
        served = "".join(f'<busStop id="{name}" name="{name}"/>' for name in names)
        route = f'<route edges="{way}"/>'
        named = f'id="{line}" name="{line}" line="{line}" type="bus" period="180"'
        found += f"<ptLine {named}>{route}{served}</ptLine>\n"
    write(folder, "stops.add.xml", stops)
    (folder / "lines.xml").write_text(f"<ptLines>\n{found}</ptLines>\n", encoding="utf-8")
    words = ("-n", NET, "-l", "lines.xml", "-s", "stops.add.xml", "-o", "buses.rou.xml", "-e", "600")
    tool(folder, "ptlines2flows.py", *words, "--use-osm-routes", "-p", "180")
    return ["stops.add.xml", "buses.rou.xml"]


def sublane(folder: Path) -> list[str]:
    """Let mixed vehicles share lanes side by side, in half seconds and with another seed."""
    netgenerate(folder, *GRID)
    (folder / "kinds.add.xml").write_text(
        '<additional><vTypeDistribution id="mix"><vType id="car" probability="0.7"/>'
        '<vType id="cycle" vClass="motorcycle" probability="0.2"/>'
        '<vType id="lorry" vClass="truck" probability="0.1"/></vTypeDistribution></additional>',
        encoding="utf-8",
    )
    trips(folder, "--trip-attributes", 'type="mix"', "--additional-file", "kinds.add.xml")
    return []  # the trips bring their types


KINDS: dict[str, Callable[[Path], list[str]]] = {
    one.__name__: one
    for one in (
        *(plain, detectors, flows, random_net, parking),
        *(closed, calibrators, walkers, lines, sublane),
    )
}
OPTIONS = {"sublane": {"lateral-resolution": "0.8", "step-length": "0.5", "seed": "11"}}


def make(kind: str, folder: Path) -> Path:
    """Make a scenario in an empty folder; return its configuration."""
    folder.mkdir(parents=True)
    beside = KINDS[kind](folder)
    routes = [TRIPS, *(name for name in beside if name.endswith(".rou.xml"))]
    more = [name for name in beside if not name.endswith(".rou.xml")]
    said = {
        "net-file": NET,
        "route-files": ",".join(routes),
        **({"additional-files": ",".join(more)} if more else {}),
        "end": "600",
        "ignore-route-errors": "true",  # roads are closed on which vehicles were to depart
        "statistic-output": STATISTICS,
        "tripinfo-output": "trips.out.xml",
        "summary-output": "summary.out.xml",
        **OPTIONS.get(kind, {}),
    }
    if kind == "closed":
        open_roads = roads(folder).without(CLOSED)
        write_loops(generate_loops(open_roads, 10, length_m=(400.0, 3000.0)), folder / LOOPS)
    config = folder / "all.sumocfg"
    text = "".join(f'<{name} value="{value}"/>' for name, value in said.items())
    config.write_text(f"<configuration>{text}</configuration>", encoding="utf-8")
    return config


def copy(config: Path, folder: Path) -> Path:
    """Copy a scenario to a folder that its outputs go to; return its configuration."""
    shutil.copytree(config.parent, folder)
    for file in folder.glob("*.add.xml"):
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace(str(config.parent), str(folder)), encoding="utf-8")
    return folder / config.name


def outputs(folder: Path) -> dict[str, bool]:
    """Return which of the outputs that the files of a scenario name have been written."""
    named = {STATISTICS, "trips.out.xml", "summary.out.xml"}
    for file in folder.glob("*.add.xml"):
        for element in ET.parse(file).getroot().iter():  # noqa: S314
            named |= {Path(element.attrib[key]).name for key in ("file", "output") if element.get(key)}
    return {name: (folder / name).is_file() and (folder / name).stat().st_size > 0 for name in sorted(named)}


def compare(kind: str, folder: Path, *, vehicles: int = 30, loops: int = 10) -> dict[str, Any]:
    """Make a scenario and run it by both rules, each in a folder of its own; return a row of the table."""
    row: dict[str, Any] = {"scenario": kind}
    said: dict[str, set[str]] = {}
    made: dict[str, dict[str, bool]] = {}
    made_once = make(kind, folder / "made")
    for gate in GATES:
        config = copy(made_once, folder / gate)
        where = {"network": str(config), "traffic": str(config), "gate": gate}
        given = {**where, "loops": loops, "vehicles": vehicles, "on_deadlock": "continue"}
        given["lights"] = "obey" if gate == "certified" else "keep"
        if (config.parent / LOOPS).exists():
            given = {**given, "routes": str(config.parent / LOOPS), "loops": 0}
        summary = run(Scenario.from_dict(given), folder / f"{gate}_run").summary
        found = ET.parse(config.with_name(STATISTICS)).getroot().find("vehicles")  # noqa: S314
        row[f"loaded, {gate}"] = int(found.get("loaded", "0")) if found is not None else 0
        made[gate] = outputs(config.parent)
        said[gate] = {line.replace(str(config.parent), "") for line in summary["warnings"]}
        for name in ("collisions", "distance_km"):
            row[f"{name}, {gate}"] = summary[name]
        row[f"locks, {gate}"] = len(summary["deadlocks"])
    row["outputs"] = f"{sum(made['certified'].values())} of {len(made['certified'])}"
    row["dropped"] = int(made["open"] != made["certified"] or not all(made["certified"].values()))
    row["dropped"] |= int(row["loaded, open"] != row["loaded, certified"])
    row["by others"] = summary["collisions_by_others"]
    row["differences"] = sorted(said["certified"] ^ said["open"])
    return row


def main() -> int:
    """Run what is asked for, print the table; return 1 if anything was dropped."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=sorted(KINDS), default=list(KINDS))
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "scenarios")
    given = parser.parse_args()
    rows = []
    for kind in given.only:
        folder = given.out / kind
        if folder.exists():
            sys.exit(f"{folder} is there already: remove it to make it anew")
        rows.append(compare(kind, folder))
        print(pd.DataFrame(rows[-1:]).drop(columns="differences").to_string(index=False), flush=True)
        for line in rows[-1]["differences"]:
            print(f"    {line}")
    return int(any(row["dropped"] for row in rows))


if __name__ == "__main__":
    pd.set_option("display.width", 250)
    sys.exit(main())
