"""Attach the gate to installed SUMO of several versions, through traci; needs a network for pip.

    python analysis/sumo_versions.py [--versions 1.20.0 1.24.0 1.27.1] [--folder FOLDER]

Each version of SUMO goes into an environment of its own under the folder (780 MB each), where it is kept. The
gate runs here, with the traci of this environment. For each version and step there are 60 vehicles on the
loops of the small grid, without and with traffic lights, and a line: how many still drive on their loops
after ten minutes, kilometres, laps, collisions, overruns, trespasses. Ends with exit code 1 if a vehicle is
lost or something is unclean.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import venv
from pathlib import Path

import traci

import loopgate

ROOT = Path(__file__).resolve().parent.parent
NETWORKS = {"priority": "grid5-priority", "lights": "grid5-actuated"}
VEHICLES, UNTIL_S = 60, 600.0


def program(version: str, folder: Path) -> Path:
    """Return the program ``sumo`` of a version; install it if it is not there."""
    home = folder / version
    found = [*home.glob("lib/python3*/site-packages/sumo/bin/sumo"), *home.glob("Lib/**/sumo/bin/sumo.exe")]
    if not found:
        venv.create(home, with_pip=True)
        pip = next(file for file in (home / "bin" / "pip", home / "Scripts" / "pip.exe") if file.exists())
        subprocess.run([str(pip), "install", "--quiet", f"eclipse-sumo=={version}"], check=True)
        return program(version, folder)
    return found[0]


def drive(sumo: Path, network: str, step_s: float) -> tuple[str, bool]:
    """Drive vehicles on loops under an attached gate; return a line of figures, and whether all is well."""
    roads = ["-n", str(ROOT / f"networks/{network}.net.xml"), "-r", str(ROOT / "routes/grid5.rou.xml")]
    quiet = ["--no-step-log", "--no-warnings", "--time-to-teleport", "-1", "--collision.check-junctions"]
    traci.start([str(sumo), *roads, *quiet, "--step-length", f"{step_s:g}"], numRetries=60)
    try:
        loops = traci.route.getIDList()
        names = [f"bus{number}" for number in range(VEHICLES)]
        for number, name in enumerate(names):
            traci.vehicle.add(name, loops[number % len(loops)])
        collisions = 0
        with loopgate.attach(traci, gate="certified", lights="obey") as gate:
            gate.add(*names)
            while traci.simulation.getTime() < UNTIL_S:
                traci.simulationStep()
                gate.after_step()
                collisions += traci.simulation.getCollidingVehiclesNumber()
            there = traci.vehicle.getIDList()
            km = sum(traci.vehicle.getDistance(name) for name in there) / 1000.0
        laps = int((gate.events["event"] == "lap").sum())
        overruns, trespasses = gate.summary["overruns"], gate.summary["trespasses"]
        well = (len(there), collisions, overruns, trespasses) == (VEHICLES, 0, 0, 0)
        return f"{len(there):8} {km:7.1f} {laps:5} {collisions:10} {overruns:8} {trespasses:10}", well
    finally:
        traci.close()


def main() -> int:
    """Install, drive, and print a line for each."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    words.add_argument("--versions", nargs="+", default=["1.20.0", "1.24.0", "1.27.1", "1.28.0"])
    words.add_argument("--folder", type=Path, default=ROOT / "out" / "sumo-versions")
    asked = words.parse_args()
    print("SUMO     roads     step  drive on     km  laps collisions overruns trespasses", flush=True)
    wells = []
    for version in asked.versions:
        sumo = program(version, asked.folder)
        for kind, network in NETWORKS.items():
            for step_s in (1.0, 0.5):
                line, well = drive(sumo, network, step_s)
                wells.append(well)
                print(f"{version:8} {kind:9} {step_s:4} {line}", flush=True)
    return 0 if all(wells) else 1


if __name__ == "__main__":
    sys.exit(main())
