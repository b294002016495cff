"""A road leads over another, in a network without heights."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import sumo

from loopgate.audit import read_layout
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

NODES = """<nodes><node id="W" x="-100" y="0"/><node id="M" x="12" y="0"/><node id="E" x="100" y="0"/>
<node id="S" x="0" y="-88"/><node id="K" x="0" y="12"/><node id="N" x="0" y="112"/></nodes>"""
EDGES = """<edges><edge id="w" from="W" to="M"/><edge id="e" from="M" to="E"/>
<edge id="s" from="S" to="K"/><edge id="n" from="K" to="N"/></edges>"""
VEHICLES = """<routes>
{}
</routes>"""
PAIR = """<vehicle id="{0}e" depart="{0}"><route edges="w e"/></vehicle>
<vehicle id="{0}n" depart="{0}"><route edges="s n"/></vehicle>"""


def test_vehicles_on_a_bridge_and_below_do_not_wait_for_each_other(tmp_path: Path) -> None:
    """They come at the same time, and are one above the other; the audit draws them by itself."""
    vehicles = VEHICLES.format("\n".join(PAIR.format(at) for at in range(0, 40, 4)))
    for name, text in (("n.nod", NODES), ("n.edg", EDGES), ("r.rou", vehicles)):
        (tmp_path / f"{name}.xml").write_text(text)
    tool = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    subprocess.run(
        [str(tool), "-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "net.net.xml"],
        check=True,
        cwd=tmp_path,
        env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
        capture_output=True,
    )
    network, routes = str(tmp_path / "net.net.xml"), str(tmp_path / "r.rou.xml")
    scenario = Scenario(network=network, routes=routes, duration_s=90.0, positions=True)
    summary = simulate(scenario, tmp_path / "out")
    (bridge,) = read_layout(tmp_path / "out" / "layout.json").bridges
    assert {frozenset(bridge.one), frozenset(bridge.other)} == {
        frozenset({"w_0", "e_0", ":M_0_0"}),
        frozenset({"s_0", "n_0", ":K_0_0"}),
    }
    assert (summary["arrived"], summary["refusals"], summary["audit"]) == (20, {}, "clean")
