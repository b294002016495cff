"""A bus line from a GTFS feed to a page with headways and lateness at its stops.

    python analysis/gtfs.py                                   # a small feed of its own, on sumo:DRT
    python analysis/gtfs.py FEED.zip TOWN.net.xml 20240603    # a feed, a network that knows its place, a day

SUMO's gtfs2pt.py lays the feed on the network (it needs ``pip install rtree``); the buses then run under the
gate, with stops moved where a bus would stand in others' way, and under SUMO's own rules. Runs and pages are
in ``out/gtfs``.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from random import Random
from xml.etree import ElementTree as ET

import pandas as pd
import sumo
import sumolib

from loopgate import RoadNetwork, Scenario, run
from loopgate.analysis import compute_stops
from loopgate.results.columns import (
    CAME,
    DUE,
    HEADWAY,
    LATENESS,
    LOOP,
    ON_TIME_60,
    STOP,
    VEHICLE,
    VISITS,
    WENT_ON,
    WORST_LATENESS,
)

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "gtfs"
NETWORK, DAY = "sumo:DRT", "20240603"
LINES, BUSES, HEADWAY_S, BEGIN_S, END_S = 3, 6, 600, 7 * 3600, 9 * 3600
SPEED_MPS, DWELL_S, APART_M = 6.0, 15, 350.0
"""By what timetable the buses of the small feed drive."""

STREET_M, LEAST_M, MOST_M = 60.0, 2500.0, 5000.0
"""The least length of a street with a stop, and the least and largest of a line [m]."""

TABLES = {
    "agency.txt": "agency_id,agency_name,agency_url,agency_timezone\na,A,http://localhost,Europe/Berlin\n",
    "calendar.txt": "service_id,monday,tuesday,wednesday,thursday,friday,saturday,sunday,"
    "start_date,end_date\ns,1,1,1,1,1,1,1,20240101,20261231\n",
    "calendar_dates.txt": "service_id,date,exception_type\n",
}


def write_feed(net_file: Path, feed: Path) -> None:
    """Write a feed of a few lines between streets of a network, with a bus every ten minutes."""
    net, rng = sumolib.net.readNet(str(net_file)), Random(3)
    streets = [e for e in net.getEdges() if e.allows("bus") and e.allows("passenger")]
    stops: dict[str, tuple[str, float, float]] = {}
    times: list[tuple[object, ...]] = []
    while len({row[0] for row in times}) < LINES * BUSES:
        line = len({row[0] for row in times}) // BUSES
        way, _ = net.getOptimalPath(*rng.sample(streets, 2), vClass="bus", fastest=True)
        if not way or not LEAST_M < sum(e.getLength() for e in way) < MOST_M:
            continue
        driven_m, last_m, calls = 0.0, -APART_M, list[tuple[str, float]]()
        for edge in way:
            if edge.getLength() > STREET_M and driven_m - last_m >= APART_M:
                x, y = sumolib.geomhelper.positionAtShapeOffset(edge.getShape(), edge.getLength() / 2)
                lon, lat = net.convertXY2LonLat(x, y)
                stops[edge.getID()] = (edge.getName() or edge.getID(), lat, lon)
                calls.append((edge.getID(), driven_m))
                last_m = driven_m
            driven_m += edge.getLength()
        for bus in range(BUSES):
            for number, (stop, at_m) in enumerate(calls):
                at_s = int(BEGIN_S + bus * HEADWAY_S + at_m / SPEED_MPS + 2 * DWELL_S * number)
                leaves = clock(at_s + DWELL_S)
                times.append((f"line{line}bus{bus}", clock(at_s), leaves, stop, number, f"{line}"))
    with zipfile.ZipFile(feed, "w") as found:
        for name, text in TABLES.items():
            found.writestr(name, text)
        trips = sorted({(row[-1], "s", row[0], "") for row in times})
        routes = [(f"{line}", "a", f"{line}", "", 3) for line in range(LINES)]
        table(found, "routes", "route_id agency_id route_short_name route_long_name route_type", routes)
        table(found, "trips", "route_id service_id trip_id trip_headsign", trips)
        table(found, "stops", "stop_id stop_name stop_lat stop_lon", [(k, *v) for k, v in stops.items()])
        table(
            found,
            "stop_times",
            "trip_id arrival_time departure_time stop_id stop_sequence",
            [row[:-1] for row in times],
        )


def table(found: zipfile.ZipFile, name: str, columns: str, rows: Sequence[Sequence[object]]) -> None:
    """Write a table of the feed."""
    text = io.StringIO()
    csv.writer(text).writerows([columns.split(), *rows])
    found.writestr(f"{name}.txt", text.getvalue())


def clock(at_s: int) -> str:
    """Return a time of day."""
    return f"{at_s // 3600:02d}:{at_s // 60 % 60:02d}:{at_s % 60:02d}"


def lay_on(feed: Path, net_file: Path, day: str) -> Path:
    """Let SUMO lay a feed on a network; return the configuration of the buses."""
    home = Path(sumo.__path__[0])
    command = [sys.executable, str(home / "tools/import/gtfs/gtfs2pt.py"), "-n", str(net_file)]
    command += ["--gtfs", str(feed), "--date", day, "--modes", "bus"]
    command += ["--begin", f"{BEGIN_S}", "--end", f"{END_S}", "--vtype-output", "types.add.xml"]
    command += ["--route-output", "buses.rou.xml", "--additional-output", "stops.add.xml"]
    env = {**os.environ, "SUMO_HOME": str(home), "PROJ_LIB": str(home / "data/proj")}
    subprocess.run(command, check=True, cwd=OUT, env=env, stdout=subprocess.DEVNULL)
    config = OUT / "buses.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{net_file}"/><route-files value="buses.rou.xml"/>'
        f'<additional-files value="types.add.xml,stops.add.xml"/><begin value="{BEGIN_S}"/>'
        f'<end value="{END_S}"/></configuration>\n',
        encoding="utf-8",
    )
    return config


def stops_of_sumo(file: Path) -> pd.DataFrame:
    """Return the stops in SUMO's own output, as the visits of a gated run."""
    found = [one.attrib for one in ET.parse(file).getroot()]  # noqa: S314  SUMO has written it
    made = pd.DataFrame(found)[["id", "busStop", "started", "ended", "delay"]]
    started, ended, delay = (made[key].astype(float) for key in ("started", "ended", "delay"))
    made = made.assign(loop="", started=started, ended=ended, delay=ended - delay)
    return made.set_axis([VEHICLE, STOP, CAME, WENT_ON, DUE, LOOP], axis="columns")


def main() -> None:
    """Lay a feed on a network, run its buses, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("feed", nargs="?", type=Path)
    parser.add_argument("network", nargs="?", default=NETWORK)
    parser.add_argument("day", nargs="?", default=DAY)
    asked = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    net_file = RoadNetwork.open(asked.network).file.resolve()
    feed = asked.feed.resolve() if asked.feed else OUT / "feed.zip"
    if asked.feed is None:
        write_feed(net_file, feed)
    config = str(lay_on(feed, net_file, asked.day))
    gated = Scenario(network=config, move_stops=True)
    beside = replace(gated, gate="open", move_stops=False, sumo=f"--stop-output {OUT / 'stops.xml'}")
    for scenario in (gated, beside):
        done = run(scenario, OUT / scenario.gate, overwrite=True)
        told = {
            key: done.summary.get(key) for key in ("vehicles", "arrived", "collisions", "audit", "outcome")
        }
        sys.stdout.write(f"{scenario.gate}: {json.dumps(told)}\n")
        sys.stdout.writelines(f"  {line}\n" for line in done.summary["warnings"])
        visits = done.visits if scenario.gated else stops_of_sumo(OUT / "stops.xml")
        made = compute_stops(visits=visits)[[STOP, VISITS, HEADWAY, LATENESS, WORST_LATENESS, ON_TIME_60]]
        sys.stdout.write(made.round(2).to_string(index=False) + "\n")
    report = [
        sys.executable,
        "-m",
        "loopgate",
        "report",
        str(OUT / "certified"),
        "-o",
        str(OUT / "page.html"),
    ]
    subprocess.run(report, check=True, cwd=OUT)


if __name__ == "__main__":
    main()
