"""Three circular bus lines by timetable among patrol cars and ordinary trips in south-east Berlin.

    python analysis/circulator.py --seeds 5 --hours 2

Each line has five stops of 20 s and a bus every five minutes; 200 patrol cars drive on 40 loops, beside 300
ordinary trips an hour. Runs are kept in ``out/circulator``; each is audited by its positions.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import NamedTuple
from xml.etree import ElementTree as ET

import pandas as pd
from ordinary import is_gates, told

from loopgate import Loop, RoadNetwork, Scenario, run
from loopgate.errors import LoopgateError
from loopgate.network import generate_loops
from loopgate.network.cover.watch import laps_s
from loopgate.network.vehicle_type import DEFAULT_TYPE, type_of_class
from loopgate.simulation.attaching.plan import Plan

ROOT = Path(__file__).resolve().parent.parent
NETWORK = "sumo:DRT"
LINES, STOPS, LOOPS, PATROL = 3, 5, 40, 200
HEADWAY_S, DWELL_S, TRIP_EVERY_S = 300, 20, 12
SLACK = 1.3
"""How much longer a round by timetable takes than at the speeds allowed."""

BUS_M = 12.0

FIGURES = ("collisions", "collisions_by_others", "trespasses", "overruns", "distance_km")


class Line(NamedTuple):
    """A bus line: its loop, the stops on it as lane and last metre, and how many buses it takes."""

    loop: Loop
    stops: tuple[tuple[str, float], ...]
    fractions: tuple[float, ...]
    buses: int


def make_lines(roads: RoadNetwork, patrol: tuple[Loop, ...], seed: int) -> list[Line]:
    """Draw loops for buses, with stops in places long enough, evenly round."""
    bus = type_of_class("bus", "circulator")
    drawn = generate_loops(roads, 4 * LINES, length_m=(2000.0, 4500.0), seed=seed, vclass="bus")
    found: list[Loop] = []
    for loop in drawn:
        named = replace(loop, id=f"line{len(found)}")
        found.append(named)
        users = [(other, DEFAULT_TYPE) for other in patrol] + [(other, bus) for other in found]
        try:
            plan = Plan(roads, tuple(users))
            lines = [_line(roads, plan, other) for other in found]
        except (ValueError, LoopgateError):
            found.pop()
            continue
        if len(found) == LINES:
            return lines
    sys.exit(f"seed {seed}: no {LINES} loops with {STOPS} places for buses each")


def _line(roads: RoadNetwork, plan: Plan, loop: Loop) -> Line:
    track = next(track for track in plan.tracks if track.loop == loop.id)
    roomy = [k for k, leg in enumerate(track.legs) if leg.end_m - leg.begin_m > BUS_M + 6.0]
    if len(roomy) < STOPS:
        msg = f"{loop.id}: {len(roomy)} places for buses"
        raise ValueError(msg)
    chosen = [roomy[k * len(roomy) // STOPS] for k in range(STOPS)]
    lines = [track.legs[k].line for k in chosen]
    lap_s = SLACK * laps_s(roads, [loop])[0] + STOPS * DWELL_S
    return Line(
        loop,
        tuple((f"{line.edge}_{line.lane}", line.position_m - 1.0) for line in lines),
        tuple(track.legs[k].end_m % loop.length_m / loop.length_m for k in chosen),
        math.ceil(lap_s / HEADWAY_S),
    )


def write_files(seed: int, hours: float, folder: Path) -> dict[str, str]:
    """Write routes, stops and trips; return them as a scenario has them."""
    roads = RoadNetwork.open(NETWORK)
    patrol = generate_loops(roads, LOOPS, length_m=(400.0, 3000.0), seed=seed)
    lines = make_lines(roads, patrol, seed)
    routes, places, trips = ET.Element("routes"), ET.Element("additional"), ET.Element("routes")
    ET.SubElement(routes, "vType", id="bus", vClass="bus", length=f"{BUS_M:g}", accel="1.2")
    for loop in patrol:
        ET.SubElement(routes, "route", id=loop.id, edges=" ".join(loop.edges))
    for line in lines:
        cycle_s = line.buses * HEADWAY_S
        route = ET.SubElement(
            routes, "route", id=line.loop.id, edges=" ".join(line.loop.edges), cycleTime=str(cycle_s)
        )
        for number, (part, (lane, end_m)) in enumerate(sorted(zip(line.fractions, line.stops, strict=True))):
            place = f"{line.loop.id}.{number}"
            ET.SubElement(
                places,
                "busStop",
                id=place,
                lane=lane,
                startPos=f"{end_m - BUS_M - 2:.2f}",
                endPos=f"{end_m:.2f}",
            )
            until = str(round((0.05 + part) * cycle_s))
            ET.SubElement(route, "stop", busStop=place, duration=str(DWELL_S), until=until)
    for number in range(PATROL):
        ET.SubElement(routes, "vehicle", id=f"patrol{number}", route=patrol[number % LOOPS].id, depart="0")
    for line in lines:
        words = {"route": line.loop.id, "period": str(HEADWAY_S), "number": str(line.buses)}
        ET.SubElement(routes, "flow", {"id": f"bus{line.loop.id[4:]}", "type": "bus", "begin": "0", **words})
    draw, edges = Random(seed), sorted({edge for loop in patrol for edge in loop.edges})
    for number in range(int(3600 * hours / TRIP_EVERY_S)):
        begin, end = draw.sample(edges, 2)
        words = {"depart": str(number * TRIP_EVERY_S), "from": begin, "to": end}
        ET.SubElement(trips, "trip", {"id": f"trip{number}", **words})
    files = {}
    for key, name, top in (("routes", "rou", routes), ("stops", "add", places), ("traffic", "trips", trips)):
        files[key] = str(folder / f"{name}{seed}.xml")
        ET.indent(top)
        ET.ElementTree(top).write(files[key])
    return files


def punctual(stop_output: Path) -> dict[str, float]:
    """Return how late buses left their stops [s], and how regular they were."""
    stops = [
        dict(stop.attrib)
        for stop in ET.parse(stop_output).getroot()  # noqa: S314  SUMO wrote it
        if stop.get("busStop", "")
    ]
    table = pd.DataFrame(stops)
    late = table["delay"].astype(float)
    began = table["started"].astype(float)
    headways = began.groupby(table["busStop"]).apply(lambda times: times.sort_values().diff().dropna())
    return {
        "stops": len(table),
        "late_s": round(float(late.mean()), 1),
        "late_worst_s": round(float(late.max()), 1),
        "within_60_s": round(float((late <= 60.0).mean()), 4),  # noqa: PLR2004  a minute
        "headway_s": round(float(headways.mean()), 1),
        "headway_cv": round(float(headways.std() / headways.mean()), 3),
    }


def main() -> int:
    """Run what is missing, and print a table; return 1 if a gated run was not clean."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--gates", nargs="+", default=["certified", "open"])
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "circulator")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows, clean = [], True
    for seed in range(1, given.seeds + 1):
        for gate in given.gates:
            folder = given.out / f"{gate}{seed}_{given.hours:g}h"
            result = folder / "circulator.json"
            if not result.exists():
                output = given.out / f"stops_{gate}{seed}.xml"
                scenario = Scenario.from_dict(
                    {
                        "network": NETWORK,
                        "gate": gate,
                        "lights": "obey" if gate != "open" else "keep",
                        "seed": seed,
                        "duration_s": 3600.0 * given.hours,
                        "positions": True,
                        "on_deadlock": "continue",
                        "sumo": f"--stop-output {output.resolve()}",
                        **write_files(seed, given.hours, given.out),
                    }
                )
                summary = run(scenario, folder, overwrite=True).summary
                found = {
                    "gate": gate,
                    "seed": seed,
                    **punctual(output),
                    "missed": summary["stops"]["missed"],
                    "locks": " ".join(told(lock) for lock in summary["deadlocks"]),
                    "gates_locks": sum(is_gates(lock) for lock in summary["deadlocks"]),
                    **{name: summary.get(name) for name in FIGURES},
                    "longest_wait_s": summary.get("longest_wait_s"),
                    "audit": str(summary.get("audit")),
                }
                result.write_text(json.dumps(found), encoding="utf-8")
            rows.append(json.loads(result.read_text(encoding="utf-8")))
            print(pd.DataFrame(rows[-1:]).to_string(index=False, header=len(rows) == 1), flush=True)
            broken = [rows[-1][name] for name in ("trespasses", "overruns", "missed", "gates_locks")]
            ours = rows[-1]["collisions"] - (rows[-1]["collisions_by_others"] or 0)
            clean &= gate == "open" or not any((*broken, ours))
    return 0 if clean else 1


if __name__ == "__main__":
    pd.set_option("display.width", 250)
    sys.exit(main())
