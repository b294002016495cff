"""Compile what tests need, in two processes at once; else each process that tests would compile all of it."""

import subprocess
import sys
from pathlib import Path

from numba import config

from loopgate.kernel_cache import mark

ROOT = Path(__file__).parents[2]
DRIVE = """
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
for lights in ("off", "obey"):
    simulate(Scenario(network="networks/grid5-actuated.net.xml", loops=2, duration_s=1.0, lights=lights))
"""
OTHERS = """
import tempfile
from pathlib import Path
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
with tempfile.TemporaryDirectory() as folder:
    trips = Path(folder, "trips.rou.xml")
    trips.write_text('<routes><trip id="a" depart="0" from="A0A1" to="C0D0"/></routes>')
    network = "networks/grid5-actuated.net.xml"
    simulate(Scenario(network=network, loops=2, duration_s=3.0, lights="off", traffic=str(trips)))
"""
STUDIES = """
from loopgate.abstraction.covering import cover_streets
from loopgate.gates import make_gate
from loopgate.network import RoadNetwork
from loopgate.network.cover.design import CoverTask
from loopgate.research.state_space import explore
from loopgate.research.theory.instances import instance
system = instance("fig10")
for gate in ("algorithm2", "certified", "certified:promise=somebody"):
    explore(system, make_gate(gate, system), counterexample=True)
cover_streets(RoadNetwork.open("sumo:square"), CoverTask(), 2)
"""

if __name__ == "__main__" and mark(config.CACHE_DIR, "tests"):  # type: ignore[attr-defined]
    started = [subprocess.Popen([sys.executable, "-c", code], cwd=ROOT) for code in (DRIVE, OTHERS + STUDIES)]
    sys.exit(max(abs(process.wait()) for process in started))
