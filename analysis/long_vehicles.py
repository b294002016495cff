"""Buses of 12 m and trailers of 16.5 m among cars, with positions: whether bodies ever overlap.

``make long-vehicles`` drives the five-by-five grid and south-east Berlin, a tenth of the
vehicles trailers and a fifth buses, for a quarter of an hour and three seeds, and prints a row per run.
"""

from __future__ import annotations

import argparse
import random
from pathlib import Path
from xml.etree import ElementTree as ET

from rich.console import Console

from loopgate import Scenario, run
from loopgate.abstraction.queue_layout import why_not
from loopgate.network import Loop, RoadNetwork, generate_loops
from loopgate.network.vehicle_type import vehicle_type

ROOT = Path(__file__).resolve().parents[1]
FLEETS = ((str(ROOT / "networks" / "grid5-priority.net.xml"), 120), ("sumo:DRT", 120), ("sumo:DRT", 200))
SHARES = {"passenger": 7, "bus": 2, "trailer": 1}
KINDS = {vclass: vehicle_type(ET.Element("vType", id=vclass, vClass=vclass), "") for vclass in SHARES}


def loops_for_all(name: str, count: int, seed: int) -> tuple[Loop, ...]:
    """Return random loops that even the longest of the vehicles can drive."""
    network = RoadNetwork.open(name)

    def admits(loop: Loop) -> bool:
        return not any(why_not(network, loop, kind) for kind in KINDS.values())

    return generate_loops(network, count, length_m=(600, 3000), seed=seed, admits=admits, vclass="trailer")


def write_mixed_fleet(loops: tuple[Loop, ...], vehicles: int, seed: int, file: Path) -> Path:
    """Write a route file in which the vehicles go round the loops in turn, of kinds drawn by `SHARES`."""
    rng = random.Random(seed)
    root = ET.Element("routes")
    for vclass in SHARES:
        ET.SubElement(root, "vType", id=vclass, vClass=vclass)
    for loop in loops:
        ET.SubElement(root, "route", id=loop.id, edges=" ".join(loop.edges))
    for number in range(vehicles):
        (vclass,) = rng.choices(list(SHARES), list(SHARES.values()))
        route = loops[number % len(loops)].id
        ET.SubElement(root, "vehicle", id=f"v{number}", type=vclass, route=route, depart="0")
    file.parent.mkdir(parents=True, exist_ok=True)
    ET.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
    return file


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3, help="fleets and loops")
    parser.add_argument("--duration", type=float, default=900.0, help="seconds of each run")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "long", help="folder of the runs")
    options = parser.parse_args()
    console = Console(highlight=False, soft_wrap=True)
    for name, vehicles in FLEETS:
        for seed in range(1, options.seeds + 1):
            folder = options.out / f"{Path(name).name.replace(':', '-')}-{vehicles}-{seed}"
            file = options.out / f"{folder.name}.rou.xml"
            write_mixed_fleet(loops_for_all(name, 30, seed), vehicles, seed, file)
            scenario = Scenario(
                network=name, routes=str(file), duration_s=options.duration, positions=True, seed=seed
            )
            summary = run(scenario, folder, overwrite=True).summary
            kept = ("collisions", "overruns", "trespasses", "strays", "audit")
            console.print(
                f"{folder.name}: {summary['distance_km']:.0f} km, "
                f"longest wait {summary['longest_wait_s']:.0f} s, "
                + ", ".join(f"{key} {summary[key]}" for key in kept)
            )


if __name__ == "__main__":
    main()
